#include <sarfocus/autofocus/sharpness.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>

#include <sarfocus/autofocus/pga.hpp>
#include <sarfocus/autofocus/phase_estimate.hpp>
#include <sarfocus/core/checks.hpp>
#include <sarfocus/core/error.hpp>
#include <sarfocus/focus/azimuth.hpp>
#include <sarfocus/quality/image_measures.hpp>

#include "gate_layout.hpp"
#include "image_evidence.hpp"
#include "pulse_set.hpp"
#include "score.hpp"
#include "sharpness_ascent.hpp"
#include "sharpness_estimate.hpp"
#include "stopwatch.hpp"
#include "strip_result.hpp"
#include "strong_points.hpp"

namespace sarfocus::autofocus {
namespace {

using detail::Measure;
using Phase = std::vector<double>;

constexpr double unknown = std::numeric_limits<double>::quiet_NaN();

// Half the difference between two independent estimates of half the information each scatters as their joint estimate does.
Phase deviation(const Phase& first, const Phase& second) {
    Phase difference(first.size());
    for (std::size_t k = 0; k < first.size(); ++k) difference[k] = first[k] - second[k];
    remove_gauge(difference);
    const auto n = static_cast<std::ptrdiff_t>(first.size());
    const std::ptrdiff_t reach = std::max<std::ptrdiff_t>(n / 64, 4);
    Phase out(first.size());
    for (std::ptrdiff_t k = 0; k < n; ++k) {
        const std::ptrdiff_t begin = std::max<std::ptrdiff_t>(k - reach, 0);
        const std::ptrdiff_t end = std::min(k + reach + 1, n);
        double sum = 0.0;
        for (std::ptrdiff_t i = begin; i < end; ++i)
            sum += difference[static_cast<std::size_t>(i)] * difference[static_cast<std::size_t>(i)];
        out[static_cast<std::size_t>(k)] = 0.5 * std::sqrt(sum / static_cast<double>(end - begin));
    }
    return out;
}

// Gates of the image with a phase taken out, formed as they are asked for.
detail::ColumnWriter gates_without(const detail::PulseSet& pulses, const Phase& phase) {
    return [&pulses, factors = pulses.factors(phase)](std::ptrdiff_t column, cfloat* line) { pulses.form_line(column, factors, line); };
}

std::vector<std::ptrdiff_t> columns_of(const detail::Halves& halves, std::ptrdiff_t n_gate, int half) {
    std::vector<std::ptrdiff_t> out;
    for (std::ptrdiff_t c = 0; c < n_gate; ++c)
        if (halves.of(0, c) == half) out.push_back(c);
    return out;
}

// Of some gates of the image with a phase taken out.
detail::HalfSums sums_without(const detail::PulseSet& pulses, const Phase& phase, const std::vector<std::ptrdiff_t>& columns,
                              const Execution& execution) {
    const detail::ColumnWriter gates = gates_without(pulses, phase);
    std::vector<detail::HalfSums> sums(columns.size());
    parallel_for(execution, "sums", static_cast<std::int64_t>(columns.size()), [&](std::int64_t c) {
        Array<cfloat, 1> line({pulses.n_azimuth()});
        gates(columns[static_cast<std::size_t>(c)], line.data());
        for (const cfloat& sample : line) sums[static_cast<std::size_t>(c)].add(std::norm(cdouble(sample)));
    });
    detail::HalfSums out;
    for (const detail::HalfSums& of_gate : sums) out += of_gate;
    return out;
}

class Driver {
public:
    Driver(const ImageView& image, const geometry::StripmapGeometry* geometry, Measure measure, const SharpnessOptions& options,
           Result& result)
        : image_(image), geometry_(geometry), measure_(measure), options_(options), result_(result), watch_(result.timings) {}

    void run(const MutableImageView& corrected) {
        estimate();
        result_.score.entropy_before = quality::entropy(image_, options_.execution);
        if (options_.do_no_harm && !result_.score.improved) {
            result_.score.entropy_after = result_.score.entropy_before;
            return hand_back(image_, corrected);
        }
        apply(corrected);
    }

    // With the verdict of the gates.
    void estimate() {
        const detail::PulseSet pulses =
            geometry_ != nullptr ? detail::PulseSet(image_, *geometry_, options_.execution) : detail::PulseSet(image_, options_.execution);
        watch_.lap("pulses");
        detail::Ascent all = detail::ascend(pulses, measure_, options_);
        for (Round& round : all.rounds) round.points = static_cast<int>(pulses.n_gate());
        result_.rounds = all.rounds;
        result_.estimate = pulses.over_azimuth(all.phase, 0.0);
        result_.phase_std.assign(result_.estimate.size(), unknown);
        watch_.lap("estimate");
        weigh(pulses, all.phase);
        result_.status = all.settled ? Status::converged : Status::max_iterations;
        if (!options_.do_no_harm)
            result_.score.reason = "applied without judging, as asked";
        else if (!result_.score.improved)
            result_.status = Status::not_improved;
    }

private:
    // Points for the report; the verdict and the deviation where the halves are asked. One image of the gates at a time.
    void weigh(const detail::PulseSet& pulses, const Phase& phase) {
        const detail::GateLayout layout(pulses.n_azimuth(), pulses.gates());
        const Phase none(phase.size(), 0.0);
        Array<cfloat, 2> memory({pulses.n_gate(), pulses.line_length()});
        const ImageView image = pulses.as_image(memory);
        pulses.form(none, memory, options_.execution);
        const detail::CellSize cell = detail::cell_size(image, layout);
        const detail::Halves halves(layout, cell);
        detail::EvidenceOptions how;
        how.first_bin = pulses.first_bin();
        if (geometry_ != nullptr)
            how.window = std::max<std::ptrdiff_t>(std::lround(0.5 * geometry_->aperture_samples(geometry_->slant_range.size() / 2)), 1);
        how.execution = options_.execution;
        detail::TrialSums trial;
        detail::Evidence reversed;
        if (options_.do_no_harm) {
            trial.entropy_before = quality::entropy(image, options_.execution);
            trial.before = {detail::sums_of(image, halves, 0), detail::sums_of(image, halves, 1)};
            reversed = detail::image_evidence(gates_without(pulses, phase), image, layout, cell, how);
        }
        pulses.form(phase, memory, options_.execution);
        const detail::Evidence evidence = detail::image_evidence(gates_without(pulses, none), image, layout, cell, how);
        const double aperture = static_cast<double>(pulses.n_pulse());
        for (std::size_t n = 0; n < evidence.points.size(); ++n) {
            const detail::Pixel& p = evidence.points[n];
            result_.points.push_back({p.azimuth, static_cast<double>(layout.range_gate(std::lround(p.column))), 0.0, evidence.weight[n],
                                      evidence.coherence[n] * aperture});
        }
        watch_.lap("weigh points");
        if (!options_.do_no_harm) return;
        trial.entropy_after = quality::entropy(image, options_.execution);
        memory = {};
        const std::array<Phase, 2> own = {estimate_half(pulses, halves, 0), estimate_half(pulses, halves, 1)};
        for (const int half : {0, 1}) {
            const auto judged = static_cast<std::size_t>(half);
            trial.held_out[judged] = sums_without(pulses, own[1 - judged], columns_of(halves, pulses.n_gate(), half), options_.execution);
        }
        if (!detail::judged_without_halves(trial, halves, evidence, result_.score)) detail::judge_held_out(trial, cell, result_.score);
        if (result_.score.improved) refuse_losses(reversed, aperture / cell.azimuth, pulses.n_gate());
        if (!detail::one_sided(halves, evidence)) result_.phase_std = pulses.over_azimuth(deviation(own[0], own[1]), unknown);
        watch_.lap("judge");
    }

    // A few very bright points may gain what many others lose: ships of one speed, or whatever contrast likes best. reversed: the strongest
    // points of the input, and by how much they were stronger before. cells: of a gate.
    void refuse_losses(const detail::Evidence& reversed, double cells, std::ptrdiff_t gates) {
        constexpr double chance = 5.0;  // of 150 images of speckle one has a crest brighter than ln(cells) by this much
        const double minimum_contrast = std::log(cells * static_cast<double>(gates)) + chance;
        int points = 0;
        int much = 0;    // lose 3 dB: a tenth at most, as for strips (harm_done), or one
        int little = 0;  // lose 1 dB: less than half, of four or more
        for (std::size_t n = 0; n < reversed.points.size(); ++n) {
            if (reversed.coherence[n] * cells < minimum_contrast) continue;
            ++points;
            if (reversed.gain_db[n] > 3.0) ++much;
            if (reversed.gain_db[n] > 1.0) ++little;
        }
        // Of a defocused image the strongest points may be crests of one another: a single one of five proves nothing.
        const bool few_lose_much = 10 * much <= points || (much == 1 && points >= 5);
        if (few_lose_much && (points < 4 || 2 * little < points)) return;
        result_.score.improved = false;
        result_.score.reason = "of the " + std::to_string(points) + " strongest points of the input " + std::to_string(much) +
                               " would lose more than 3 dB, " + std::to_string(little) + " more than 1 dB";
    }

    [[nodiscard]] Phase estimate_half(const detail::PulseSet& pulses, const detail::Halves& halves, int half) const {
        const std::vector<std::ptrdiff_t> columns = columns_of(halves, pulses.n_gate(), half);
        const auto n = static_cast<std::size_t>(pulses.n_pulse());
        if (columns.empty()) return Phase(n, 0.0);
        const detail::PulseSet part = pulses.subset(columns);
        const bool dark = part.energy() == 0.0;
        return dark ? Phase(n, 0.0) : detail::ascend(part, measure_, options_).phase;
    }

    void apply(const MutableImageView& corrected) {
        Array<cfloat, 2> kept;  // of an image that is corrected in its own memory
        if (options_.do_no_harm && image_.data() == corrected.data()) {
            require_memory(static_cast<std::uint64_t>(image_.size()) * sizeof(cfloat),
                           "the input, to hand it back where it gets no better");
            kept = Array<cfloat, 2>(image_.extents());
            detail::copy_image(image_, kept.view(), options_.execution);
        }
        if (geometry_ != nullptr)
            focus::azimuth_correct(image_, *geometry_, {result_.estimate.data(), {1, image_.extent(0)}}, std::vector<double>{0.0},
                                   corrected, {{}, {}, options_.execution});
        else
            correct_azimuth_spectrum(image_, result_.estimate, corrected, options_.execution);
        result_.score.entropy_after = quality::entropy(corrected, options_.execution);
        watch_.lap("correct");
        if (options_.do_no_harm && !(result_.score.entropy_after < result_.score.entropy_before)) {
            result_.score.improved = false;
            result_.score.reason += "; but the entropy of the whole image does not fall";
            return hand_back(kept.empty() ? image_ : ImageView(kept.view()), corrected);
        }
        result_.phase_error = result_.estimate;
    }

    void hand_back(const ImageView& input, const MutableImageView& corrected) {
        result_.status = Status::not_improved;
        result_.phase_error.assign(result_.estimate.size(), 0.0);
        detail::copy_image(input, corrected, options_.execution);
    }

    ImageView image_;
    const geometry::StripmapGeometry* geometry_;
    Measure measure_;
    const SharpnessOptions& options_;
    Result& result_;
    detail::Stopwatch watch_;
};

void require_image(const ImageView& image, const geometry::StripmapGeometry* geometry, const SharpnessOptions& options) {
    options.validate();
    require_not_empty(image, "image");
    require_finite(image, "image", options.execution.threads);
    if (image.extent(0) < 16) throw ShapeError("image", "at least 16 azimuth lines", shape_text(image.extents()));
    if (geometry != nullptr) {
        geometry->validate();
        if (static_cast<std::ptrdiff_t>(geometry->slant_range.size()) != image.extent(1))
            throw ShapeError("image", "(n_azimuth, " + std::to_string(geometry->slant_range.size()) + "), a column for every slant_range",
                             shape_text(image.extents()));
    }
    (void)quality::entropy(image, options.execution);  // throws for an image of zeros
}

Result result_of(Measure measure, const Execution& execution) {
    Result out;
    out.method = measure == Measure::entropy ? "minimum_entropy" : "maximum_contrast";
    out.threads = resolve_threads(execution.threads);
    return out;
}

Result focus_by(const ImageView& image, const geometry::StripmapGeometry* geometry, const MutableImageView& corrected, Measure measure,
                const SharpnessOptions& options) {
    require_image(image, geometry, options);
    require_same_shape(corrected, "out", image, "image");
    Result result = result_of(measure, options.execution);
    Driver(image, geometry, measure, options, result).run(corrected);
    return result;
}

}  // namespace

void SharpnessOptions::validate() const {
    if (smooth_rounds < 0) throw ValueError("smooth_rounds", "at least 0", std::to_string(smooth_rounds));
    if (free_rounds < 0) throw ValueError("free_rounds", "at least 0", std::to_string(free_rounds));
    if (polynomial < 1 || polynomial > 12) throw ValueError("polynomial", "an order from 1 (none) to 12", std::to_string(polynomial));
    require_positive(search, "search");
    if (search > 1000.0) throw ValueError("search", "at most 1000 rad", number_text(search));
    require_positive(tolerance, "tolerance");
    (void)resolve_threads(execution.threads);
}

namespace detail {

Result minimum_entropy_estimate(const ImageView& image, const SharpnessOptions& options) {
    require_image(image, nullptr, options);
    Result result = result_of(Measure::entropy, options.execution);
    Driver(image, nullptr, Measure::entropy, options, result).estimate();
    return result;
}

}  // namespace detail

Result minimum_entropy(const ImageView& image, MutableImageView corrected, const SharpnessOptions& options) {
    return focus_by(image, nullptr, corrected, Measure::entropy, options);
}

Result minimum_entropy(const ImageView& image, const geometry::StripmapGeometry& geometry, MutableImageView corrected,
                       const SharpnessOptions& options) {
    return focus_by(image, &geometry, corrected, Measure::entropy, options);
}

Result maximum_contrast(const ImageView& image, MutableImageView corrected, const SharpnessOptions& options) {
    return focus_by(image, nullptr, corrected, Measure::contrast, options);
}

Result maximum_contrast(const ImageView& image, const geometry::StripmapGeometry& geometry, MutableImageView corrected,
                        const SharpnessOptions& options) {
    return focus_by(image, &geometry, corrected, Measure::contrast, options);
}

}  // namespace sarfocus::autofocus
