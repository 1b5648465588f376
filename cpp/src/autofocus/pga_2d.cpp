#include <sarfocus/autofocus/pga_2d.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <string>
#include <utility>
#include <vector>

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
        // Where the image is corrected in its own memory, it must last until the verdict.
        Array<cfloat, 2> kept = image_.data() == corrected.data() ? Array<cfloat, 2>(image_.extents()) : Array<cfloat, 2>();
        scratch_ = kept.empty() ? corrected : kept.view();
        Estimate all = estimate({}, options_.passes);
        if (details.estimated && details.bandwidth_ratio != 0.0) refine_ratio(all);
        adopt(all);
        if (result_.points.empty()) return hand_back(corrected, Status::no_strong_points, "no strong point was found");
        result_.status = all.settled ? Status::converged : Status::max_iterations;
        correct({}, all.phase);
        if (options_.points.do_no_harm) {
            if (judge_on_halves()) correct({}, all.phase);
            if (!result_.score.improved) return hand_back(corrected, Status::not_improved, result_.score.reason);
        } else {
            result_.score.entropy_before = quality::entropy(image_, execution_);
            result_.score.entropy_after = quality::entropy(scratch_, execution_);
            result_.score.reason = "applied without judging, as asked";
        }
        result_.score.reason += said_of_migration();
        result_.phase_error = result_.estimate;
        if (!kept.empty()) detail::copy_image(scratch_, corrected, execution_);
        watch_.lap("copy");
    }

private:
    // The pixels that an estimate is made from, or that are judged: all, or those of one half of the scene.
    struct Pixels {
        const detail::Halves* halves = nullptr;
        int half = 0;
    };

    // Those of a half, to the scratch image, the others zero. False where all of them are zero.
    bool copy_half(const Pixels& pixels) {
        std::vector<char> any(static_cast<std::size_t>(image_.extent(1)), 0);
        parallel_for(execution_, "half", image_.extent(1), [&](std::int64_t j) {
            for (std::ptrdiff_t i = 0; i < image_.extent(0); ++i) {
                scratch_(i, j) = pixels.halves->of(i, j) == pixels.half ? image_(i, j) : cfloat{};
                if (scratch_(i, j) != cfloat{}) any[static_cast<std::size_t>(j)] = 1;
            }
        });
        return std::any_of(any.begin(), any.end(), [](char c) { return c != 0; });
    }

    // These pixels with the phase taken out, in the scratch image.
    void correct(const Pixels& pixels, const Phase& phase) {
        if (pixels.halves != nullptr) copy_half(pixels);
        correct_two_dimensional(pixels.halves != nullptr ? ImageView(scratch_) : image_, phase, result_.migration.bandwidth_ratio,
                                options_.model, scratch_, execution_);
        watch_.lap("correct");
    }

    [[nodiscard]] std::ptrdiff_t most_division() const {
        return std::clamp<std::ptrdiff_t>(image_.extent(1) / least_gates, 1, widest_division);
    }

    [[nodiscard]] Result estimate_in_band(const ImageView& image, std::ptrdiff_t division) {
        Array<cfloat, 2> band = division > 1 ? range_band(image, division, execution_) : Array<cfloat, 2>();
        const ImageView source = division > 1 ? std::as_const(band).view() : image;
        Result out = detail::pga_estimate(source, estimate_options_, std::move(band));
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

    [[nodiscard]] Estimate estimate(const Pixels& pixels, int passes, const Phase& start = {}) {
        const double ratio = result_.migration.bandwidth_ratio;
        Estimate out;
        out.phase = start.empty() ? Phase(static_cast<std::size_t>(image_.extent(0)), 0.0) : start;
        const bool everywhere = pixels.halves == nullptr;
        if (!everywhere && start.empty() && !copy_half(pixels)) return out;
        for (int pass = 0; pass < passes && !out.settled; ++pass) {
            const bool corrected = pass > 0 || !start.empty();
            if (corrected) correct(pixels, out.phase);
            out.last = estimate_once(corrected || !everywhere ? ImageView(scratch_) : image_, ratio);
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
        Estimate more = estimate({}, 1, again.ratio != 0.0 ? all.phase : Phase{});
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

    // The corrected image is in the scratch image. True where something else is there afterwards.
    bool judge_on_halves() {
        const detail::GateLayout layout(image_.extent(0), image_.extent(1));
        const detail::CellSize cell = detail::cell_size(image_, layout);
        const detail::Halves parts = halves(layout, cell);
        detail::EvidenceOptions how;
        how.first_bin = detail::SpectrumSource(image_, execution_).bin(0);
        how.neighbours = static_cast<std::ptrdiff_t>(std::ceil(result_.migration.gates));
        how.execution = execution_;
        const detail::Evidence evidence = detail::image_evidence(image_, scratch_, layout, cell, how);
        detail::TrialSums trial;
        trial.entropy_before = quality::entropy(image_, execution_);
        trial.entropy_after = quality::entropy(scratch_, execution_);
        const bool decided = detail::judged_without_halves(trial, parts, evidence, result_.score);
        if (!decided) {
            for (const int half : {0, 1}) trial.before[static_cast<std::size_t>(half)] = detail::sums_of(image_, parts, half);
            trial.held_out = {held_out({&parts, 1}, 0), held_out({&parts, 0}, 1)};
            detail::judge_held_out(trial, cell, result_.score);
        }
        watch_.lap("judge");
        return !decided;
    }

    // Of one half of the scene, corrected by the phase that the pixels of the other give alone.
    [[nodiscard]] detail::HalfSums held_out(const Pixels& from, int judged) {
        const Phase phase = estimate(from, options_.passes).phase;
        correct({}, phase);
        return detail::sums_of(scratch_, *from.halves, judged);
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
    MutableImageView scratch_;  // the corrected image's memory as a rule
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
    const std::uint64_t images = image.data() == corrected.data() ? 2 : 1;
    require_memory(images * static_cast<std::uint64_t>(image.size()) * sizeof(cfloat), "pga_2d");
    Result result;
    result.method = "pga_2d";
    result.threads = resolve_threads(options.points.execution.threads);
    Driver(image, options, result).run(corrected);
    return result;
}

}  // namespace sarfocus::autofocus
