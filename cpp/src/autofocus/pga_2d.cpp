#include <sarfocus/autofocus/pga_2d.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <string>
#include <utility>

#include <sarfocus/core/array.hpp>
#include <sarfocus/core/checks.hpp>
#include <sarfocus/core/error.hpp>
#include <sarfocus/fft/plan.hpp>
#include <sarfocus/quality/image_measures.hpp>

#include "bandwidth_ratio.hpp"
#include "gate_layout.hpp"
#include "image_evidence.hpp"
#include "pga_estimate.hpp"
#include "score.hpp"
#include "spectrum_source.hpp"
#include "stopwatch.hpp"
#include "strip_result.hpp"

namespace sarfocus::autofocus {
namespace {

using Phase = std::vector<double>;

constexpr double tolerated_migration = 0.5;  // gates in a band, below which a point stays where it is
constexpr std::ptrdiff_t least_gates = 16;
constexpr std::ptrdiff_t widest_division = 32;

// The middle of the range band: 1 / division of it, with as many gates fewer.
Array<cfloat, 2> range_band(const ImageView& image, std::ptrdiff_t division, const Execution& execution) {
    const std::ptrdiff_t m = image.extent(1);
    const std::ptrdiff_t kept = std::max(m / division, std::ptrdiff_t{1});
    const fft::Plan<float> forward(m, fft::Direction::forward);
    const fft::Plan<float> inverse(kept, fft::Direction::inverse);
    Array<cfloat, 2> out({image.extent(0), kept});
    const float scale = 1.0f / static_cast<float>(m);
    parallel_for(execution, "range band", image.extent(0), [&](std::int64_t i) {
        Array<cfloat, 1> line({m});
        Array<cfloat, 1> band({kept});
        for (std::ptrdiff_t j = 0; j < m; ++j) line(j) = image(i, j);
        forward.execute(line.data());
        for (std::ptrdiff_t f = 0; f < kept; ++f) band(f) = line(f < (kept + 1) / 2 ? f : m - kept + f) * scale;
        inverse.execute(band.data());
        std::copy_n(band.data(), kept, out.data() + i * kept);
    });
    return out;
}

struct Estimate {
    Phase phase;
    Result last;  // of the last pass
    std::vector<Round> rounds;
    bool settled = false;
    int passes = 0;
};

class Driver {
public:
    Driver(const ImageView& image, const Pga2dOptions& options, Result& result)
        : image_(image), options_(options), execution_(options.points.execution), result_(result), watch_(result.timings) {
        estimate_options_ = options.points;
        estimate_options_.do_no_harm = false;
    }

    void run(const MutableImageView& corrected) {
        MigrationDetails& details = result_.migration;
        details.model = options_.model == MigrationModel::polar_format ? "polar_format" : "range_doppler";
        details.estimated = std::isnan(options_.bandwidth_ratio);
        details.bandwidth_ratio = details.estimated ? first_ratio() : options_.bandwidth_ratio;
        Estimate all = estimate(image_, details.bandwidth_ratio, options_.passes);
        if (details.estimated && details.bandwidth_ratio != 0.0) refine_ratio(all);
        adopt(all);
        if (result_.points.empty()) return hand_back(corrected, Status::no_strong_points, "no strong point was found");
        // Where the image is corrected in its own memory, it must last until the verdict.
        Array<cfloat, 2> kept = image_.data() == corrected.data() ? Array<cfloat, 2>(image_.extents()) : Array<cfloat, 2>();
        const MutableImageView after = kept.empty() ? corrected : kept.view();
        correct(all.phase, after);
        result_.status = all.settled ? Status::converged : Status::max_iterations;
        if (options_.points.do_no_harm) {
            judge_on_halves(after);
            if (!result_.score.improved) return hand_back(corrected, Status::not_improved, result_.score.reason);
        } else {
            result_.score.entropy_before = quality::entropy(image_, execution_);
            result_.score.entropy_after = quality::entropy(after, execution_);
            result_.score.reason = "applied without judging, as asked";
        }
        result_.score.reason += said_of_migration();
        result_.phase_error = result_.estimate;
        if (!kept.empty()) detail::copy_image(after, corrected, execution_);
        watch_.lap("copy");
    }

private:
    void correct(const Phase& phase, const MutableImageView& out) {
        correct_two_dimensional(image_, phase, result_.migration.bandwidth_ratio, options_.model, out, execution_);
        watch_.lap("correct");
    }

    [[nodiscard]] std::ptrdiff_t most_division() const {
        return std::clamp<std::ptrdiff_t>(image_.extent(1) / least_gates, 1, widest_division);
    }

    [[nodiscard]] Result estimate_in_band(const ImageView& image, std::ptrdiff_t division) {
        const Array<cfloat, 2> band = division > 1 ? range_band(image, division, execution_) : Array<cfloat, 2>();
        const ImageView source = division > 1 ? band.view() : image;
        Result out = detail::pga_estimate(source, estimate_options_);
        for (Round& round : out.rounds)
            if (division > 1) round.stage += " 1/" + std::to_string(division) + " of the range band";
        watch_.lap("estimate");
        return out;
    }

    // In the widest band in which what it finds moves no point by more than half a gate of that band.
    [[nodiscard]] Result estimate_once(const ImageView& image, double ratio) {
        std::ptrdiff_t division = 1;
        Result out = estimate_in_band(image, division);
        while (division < most_division()) {
            const double gates = range_migration(out.estimate, ratio, options_.model) / static_cast<double>(division);
            if (gates <= tolerated_migration) break;
            const auto wanted = static_cast<std::ptrdiff_t>(std::exp2(std::ceil(std::log2(gates / tolerated_migration))));
            division = std::min(division * std::max<std::ptrdiff_t>(wanted, 2), most_division());
            out = estimate_in_band(image, division);
        }
        return out;
    }

    [[nodiscard]] Estimate estimate(const ImageView& image, double ratio, int passes, const Phase& start = {}) {
        Estimate out;
        out.phase = start.empty() ? Phase(static_cast<std::size_t>(image.extent(0)), 0.0) : start;
        Array<cfloat, 2> current;
        for (int pass = 0; pass < passes && !out.settled; ++pass) {
            const bool corrected = pass > 0 || !start.empty();
            if (corrected) {
                current = Array<cfloat, 2>(image.extents());
                correct_two_dimensional(image, out.phase, ratio, options_.model, current.view(), execution_);
                watch_.lap("correct");
            }
            out.last = estimate_once(corrected ? ImageView(current.view()) : image, ratio);
            if (out.last.points.empty()) return out;
            double square = 0.0;
            for (std::size_t k = 0; k < out.phase.size(); ++k) {
                out.phase[k] += out.last.estimate[k];
                square += out.last.estimate[k] * out.last.estimate[k];
            }
            ++out.passes;
            out.rounds.insert(out.rounds.end(), out.last.rounds.begin(), out.last.rounds.end());
            out.settled = std::sqrt(square / static_cast<double>(out.phase.size())) < options_.points.tolerance ||
                          (ratio == 0.0 && out.last.status == Status::converged);
        }
        return out;
    }

    // From the phases found in bands of several widths: which of them suits the error is not known yet.
    [[nodiscard]] double first_ratio() {
        constexpr double largest = 0.5;
        detail::BandwidthRatio found;
        for (std::ptrdiff_t division = 1; division <= most_division(); division *= 4) {
            const Result trial = estimate_in_band(image_, division);
            if (trial.points.empty()) continue;
            const auto here = detail::find_bandwidth_ratio(image_, trial.estimate, options_.model, largest, execution_);
            watch_.lap("bandwidth ratio");
            if (here.gain > found.gain) found = here;
        }
        result_.migration.gain = found.gain;
        result_.migration.noise = found.noise;
        return found.ratio;
    }

    void refine_ratio(Estimate& all) {
        constexpr double largest = 0.5;
        const auto again = detail::find_bandwidth_ratio(image_, all.phase, options_.model, largest, execution_);
        watch_.lap("bandwidth ratio");
        result_.migration.gain = again.gain;
        result_.migration.noise = again.noise;
        result_.migration.bandwidth_ratio = again.ratio;
        Estimate more = estimate(image_, again.ratio, 1, again.ratio != 0.0 ? all.phase : Phase{});
        more.passes += all.passes;
        more.rounds.insert(more.rounds.begin(), all.rounds.begin(), all.rounds.end());
        all = std::move(more);
    }

    void adopt(const Estimate& all) {
        result_.estimate = all.phase;
        result_.phase_std = all.last.phase_std;
        result_.points = all.last.points;
        result_.rounds = all.rounds;
        result_.migration.passes = all.passes;
        result_.migration.gates = range_migration(all.phase, result_.migration.bandwidth_ratio, options_.model);
    }

    // Stripes as wide as the error spreads a point several times over, at least four cells, at least eight of them.
    [[nodiscard]] detail::Halves halves(const detail::GateLayout& layout, const detail::CellSize& cell) const {
        const double least = 4.0 * std::max(cell.range, result_.migration.gates);
        const double stripe = std::clamp(least, 1.0, std::max(static_cast<double>(image_.extent(1)) / 8.0, 1.0));
        return {layout, {cell.azimuth, stripe / 4.0}};
    }

    void judge_on_halves(const ImageView& after) {
        const detail::GateLayout layout(image_.extent(0), image_.extent(1));
        const detail::CellSize cell = detail::cell_size(image_, layout);
        const detail::Halves parts = halves(layout, cell);
        detail::EvidenceOptions how;
        how.first_bin = detail::SpectrumSource(image_, execution_).bin(0);
        how.neighbours = static_cast<std::ptrdiff_t>(std::ceil(result_.migration.gates));
        how.execution = execution_;
        const detail::Evidence evidence = detail::image_evidence(image_, after, layout, cell, how);
        detail::TrialSums trial;
        trial.entropy_before = quality::entropy(image_, execution_);
        trial.entropy_after = quality::entropy(after, execution_);
        if (!detail::judged_without_halves(trial, parts, evidence, result_.score)) {
            for (const int half : {0, 1}) trial.before[static_cast<std::size_t>(half)] = detail::sums_of(image_, parts, half);
            trial.held_out = {held_out(parts, 1, 0), held_out(parts, 0, 1)};
            detail::judge_held_out(trial, cell, result_.score);
        }
        watch_.lap("judge");
    }

    // Of one half of the scene, corrected by the phase that the pixels of the other give alone.
    [[nodiscard]] detail::HalfSums held_out(const detail::Halves& parts, int from, int judged) {
        Array<cfloat, 2> own(image_.extents());
        bool empty = true;
        for (std::ptrdiff_t i = 0; i < image_.extent(0); ++i)
            for (std::ptrdiff_t j = 0; j < image_.extent(1); ++j)
                if (parts.of(i, j) == from) {
                    own(i, j) = image_(i, j);
                    empty = empty && own(i, j) == cfloat{};
                }
        const Phase phase =
            empty ? Phase(result_.estimate.size(), 0.0) : estimate(own.view(), result_.migration.bandwidth_ratio, options_.passes).phase;
        correct(phase, own.view());
        return detail::sums_of(own.view(), parts, judged);
    }

    [[nodiscard]] std::string said_of_migration() const {
        const MigrationDetails& d = result_.migration;
        char text[160];
        if (d.estimated && d.bandwidth_ratio == 0.0)
            std::snprintf(text, sizeof text, "; no migration through range seen (gain %.4f, noise %.4f nat)", d.gain, d.noise);
        else
            std::snprintf(text, sizeof text, "; migration of %.2f range gates, bandwidth ratio %.4f%s", d.gates, d.bandwidth_ratio,
                          d.estimated ? " (estimated)" : "");
        return text;
    }

    void hand_back(const MutableImageView& corrected, Status status, const std::string& reason) {
        result_.status = status;
        result_.score.reason = reason + said_of_migration();
        result_.phase_error.assign(result_.estimate.size(), 0.0);
        detail::copy_image(image_, corrected, execution_);
    }

    ImageView image_;
    const Pga2dOptions& options_;
    const Execution& execution_;
    Result& result_;
    detail::Stopwatch watch_;
    PointOptions estimate_options_;
};

}  // namespace

void Pga2dOptions::validate() const {
    constexpr double largest = 0.9;
    if (!std::isnan(bandwidth_ratio) && !(std::abs(bandwidth_ratio) <= largest))
        throw ValueError("bandwidth_ratio", "-0.9 to 0.9", number_text(bandwidth_ratio));
    if (passes < 1) throw ValueError("passes", "at least 1", std::to_string(passes));
    points.validate();
}

Result pga_2d(const ImageView& image, MutableImageView corrected, const Pga2dOptions& options) {
    options.validate();
    require_not_empty(image, "image");
    require_same_shape(corrected, "out", image, "image");
    require_finite(image, "image", options.points.execution.threads);
    if (image.extent(0) < 16) throw ShapeError("image", "at least 16 azimuth lines", shape_text(image.extents()));
    require_memory(3 * static_cast<std::uint64_t>(image.size()) * sizeof(cfloat), "three images of the scene");
    Result result;
    result.method = "pga_2d";
    result.threads = resolve_threads(options.points.execution.threads);
    Driver(image, options, result).run(corrected);
    return result;
}

}  // namespace sarfocus::autofocus
