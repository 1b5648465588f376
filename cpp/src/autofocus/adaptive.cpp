#include <sarfocus/autofocus/adaptive.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <string>
#include <utility>

#include <sarfocus/autofocus/pga_2d.hpp>
#include <sarfocus/core/checks.hpp>
#include <sarfocus/core/error.hpp>
#include <sarfocus/detect/local_maxima.hpp>
#include <sarfocus/quality/image_measures.hpp>

#include "adaptive_choice.hpp"
#include "adaptive_steps.hpp"
#include "gate_layout.hpp"
#include "held_out.hpp"
#include "point_engine.hpp"
#include "sharpness_estimate.hpp"
#include "spectrum_source.hpp"
#include "stopwatch.hpp"
#include "strip_lines.hpp"
#include "strip_result.hpp"

namespace sarfocus::autofocus {
namespace {

using detail::at;

constexpr int spotlight_sub_aperture = 512;    // [Luo2025, section 2.2.4]
constexpr double negligible_migration = 0.01;  // gates: a point loses a thousandth of a decibel
constexpr int adaptive_coarse_points = 100;    // as pga
constexpr std::size_t fallback_points = 100;   // of the classic rounds tried last: a fraction of what these cost on a large image

std::ptrdiff_t sub_aperture_length(const ImageView& image, int asked) {
    return asked > 0 ? asked : std::min<std::ptrdiff_t>(spotlight_sub_aperture, std::max<std::ptrdiff_t>(image.extent(0) / 2 * 2, 2));
}

void require_input(const ImageView& image, const MutableImageView& corrected) {
    require_not_empty(image, "image");
    require_same_shape(corrected, "out", image, "image");
    if (image.extent(0) < 16) throw ShapeError("image", "at least 16 azimuth lines", shape_text(image.extents()));
}

PointOptions engine_options(Estimator estimator, bool do_no_harm, const Execution& execution) {
    PointOptions out;
    out.estimator = estimator;
    out.fine_points = 1000;  // of which most are speckle
    out.do_no_harm = do_no_harm;
    out.execution = execution;
    return out;
}

// The strongest sample of every chosen gate of every sub-aperture, in the image as the engine has focused it so far.
detail::PartColumns chosen_columns(const detail::SpectrumSource& source, const std::vector<SubAperture>& parts,
                                   const std::vector<std::vector<std::ptrdiff_t>>& gates, std::size_t most) {
    detail::PartColumns out{parts, std::vector<std::vector<std::ptrdiff_t>>(parts.size()), most};
    for (std::ptrdiff_t c = 0; c < source.shape()[1]; ++c)
        for (std::size_t s = 0; s < parts.size(); ++s)
            if (std::binary_search(gates[s].begin(), gates[s].end(), source.range_gate(c))) out.columns[s].push_back(c);
    return out;
}

// Coarse rounds are a start, and every fine round goes on where the one before it ended.
detail::PointPlan quick_plan() {
    detail::PointPlan out;
    out.coarse_iterations = 8;
    out.fine_iterations = 8;
    out.fine_rounds_of_halves = 2;
    return out;
}

// A piece of azimuth is no longer than half a sub-aperture.
detail::PictureRequest picture_of(const std::vector<SubAperture>& parts) {
    detail::PictureRequest out;
    if (parts.size() > 1) out.piece = std::min<std::ptrdiff_t>(out.piece, parts[1].first);
    return out;
}

// The correction, and the entropies before and after.
void correct(const ImageView& image, const MutableImageView& corrected, double bandwidth_ratio, const Execution& execution,
             Result& result) {
    if (bandwidth_ratio != 0.0) {
        result.migration.model = "range_doppler";
        result.migration.bandwidth_ratio = bandwidth_ratio;
        result.migration.gates = range_migration(result.estimate, bandwidth_ratio, MigrationModel::range_doppler);
    }
    if (result.migration.gates < negligible_migration) {
        quality::EntropySums before;
        quality::EntropySums after;
        detail::correct_spectrum(image, result.estimate, corrected, &before, &after, execution);
        result.score.entropy_before = before.entropy();
        result.score.entropy_after = after.entropy();
        return;
    }
    result.score.entropy_before = quality::entropy(image, execution);
    correct_two_dimensional(image, result.estimate, bandwidth_ratio, MigrationModel::range_doppler, corrected, execution);
    result.score.entropy_after = quality::entropy(corrected, execution);
}

// Of the classic method, whose points grow with the length: a history is as long as the image, and those of a square one fit in half of it.
std::size_t most_points(const ImageView& image) {
    constexpr std::ptrdiff_t enough = 512;
    return static_cast<std::size_t>(std::max(enough, image.extent(1) / 2));
}

// What comes of an image: the estimate applied, or the image as it is.
void apply(const ImageView& image, const MutableImageView& corrected, double bandwidth_ratio, const Execution& execution, Result& result) {
    result.phase_error.assign(result.estimate.size(), 0.0);
    if (result.input_returned()) {
        detail::copy_image(image, corrected, execution);
        return;
    }
    correct(image, corrected, bandwidth_ratio, execution, result);
    result.phase_error = result.estimate;
}

// Whether a result leaves less entropy than another.
bool sharper(const Result& a, const Result& b) {
    return !a.input_returned() && (b.input_returned() || a.score.entropy_after < b.score.entropy_after);
}

// Applies the best of several estimates, the first of equals, unless the entropy of the whole image says otherwise.
Result apply_best(const ImageView& image, const MutableImageView& corrected, bool judge, double bandwidth_ratio, const Execution& execution,
                  std::vector<Result> results) {
    Array<cfloat, 2> kept;  // of an image that is corrected in its own memory
    if (image.data() == corrected.data() && (judge || results.size() > 1)) {
        require_memory(static_cast<std::uint64_t>(image.size()) * sizeof(cfloat), "the input, to hand it back where it gets no better");
        kept = Array<cfloat, 2>(image.extents());
        detail::copy_image(image, kept.view(), execution);
    }
    const ImageView input = kept.empty() ? image : ImageView(std::as_const(kept).view());
    std::size_t best = 0;
    for (std::size_t n = 0; n < results.size(); ++n) {
        apply(input, corrected, bandwidth_ratio, execution, results[n]);
        if (n > 0 && sharper(results[n], results[best])) best = n;
    }
    Result out = std::move(results[best]);
    if (best + 1 < results.size()) apply(input, corrected, bandwidth_ratio, execution, out);
    if (!judge || out.input_returned()) return out;
    std::string objection;
    if (!(out.score.entropy_after < out.score.entropy_before)) objection = "the entropy of the whole image does not fall";
    if (objection.empty() && out.score.held_out_noise == 0.0) {  // no other part of the scene has confirmed the phase
        const detail::Subject subject{input, nullptr};
        const detail::CellSize cell = detail::cell_size(input, detail::GateLayout(input.extent(0), input.extent(1)));
        objection =
            detail::objection_of_points(subject, corrected, detail::place_rule(subject, cell), detail::band_centre(subject), execution);
    }
    if (!objection.empty()) {
        out.score.improved = false;
        out.score.reason += "; but " + objection;
        out.status = Status::not_improved;
        apply(input, corrected, bandwidth_ratio, execution, out);
    }
    return out;
}

// Where strong points do not settle the phase: all of the scene has a say.
Result from_entropy(const ImageView& image, const AdaptiveOptions& options) {
    SharpnessOptions sharpness;
    sharpness.do_no_harm = options.do_no_harm;
    sharpness.execution = options.execution;
    Result out = detail::minimum_entropy_estimate(image, sharpness);
    out.score.reason = "by least entropy, since the points left the phase open: " + out.score.reason;
    return out;
}

void over_spectrum(const detail::SpectrumSource& source, Result& result) {
    result.estimate = source.over_spectrum(result.estimate, 0.0);
    result.phase_std = source.over_spectrum(result.phase_std, std::numeric_limits<double>::quiet_NaN());
}

Result from_chosen_gates(const ImageView& image, const detail::Scan& scan, const detail::Selection& selection,
                         const std::vector<SubAperture>& parts, const AdaptiveOptions& options) {
    detail::SpectrumSource source(image, detail::gates_to_transform(scan, selection), options.execution);
    const PointOptions engine = engine_options(options.estimator, options.do_no_harm, options.execution);
    detail::PointPlan plan = quick_plan();
    plan.compare_starts = true;
    plan.passes = 3;
    plan.coarse = chosen_columns(source, parts, selection.gates, adaptive_coarse_points);
    plan.picture = picture_of(parts);
    Result out = detail::estimate_from_points(source, engine, plan);
    over_spectrum(source, out);
    return out;
}

// The classic method: windowed rounds, with the points of fixed numbers of gates.
Result from_windows(const ImageView& image, const detail::Scan& scan, const std::vector<SubAperture>& parts, std::size_t most,
                    const ConventionalOptions& options) {
    const detail::Selection selection = detail::select_fixed(scan, options.k);
    detail::SpectrumSource source(image, detail::gates_to_transform(scan, selection), options.execution);
    PointOptions engine = engine_options(Estimator::gradient, options.do_no_harm, options.execution);
    engine.coarse_windows.clear();
    for (int i = 0; i < options.iterations; ++i) engine.coarse_windows.push_back(std::max(0.5 * std::pow(options.narrowing, i), 1e-3));
    detail::PointPlan plan;
    plan.coarse_only = true;
    plan.coarse_iterations = 3;  // the gradient itself needs none; these say how well it is known
    plan.coarse = chosen_columns(source, parts, selection.gates, most);
    plan.picture = picture_of(parts);
    Result out = detail::estimate_from_points(source, engine, plan);
    over_spectrum(source, out);
    return out;
}

// From the mean-filtered gates about the strongest cell, with the sign of the filter taken out.
Result from_denoised(const ImageView& image, const GateSpan& span, const std::vector<SubAperture>& parts, const AdaptiveOptions& options) {
    const ImageView block = image.slice(1, span.first, span.count);
    std::vector<std::ptrdiff_t> gates(at(span.count));
    std::iota(gates.begin(), gates.end(), std::ptrdiff_t{0});
    detail::SpectrumSource source(block, gates, options.execution);
    Array<cfloat, 2> filtered({block.extent(0), block.extent(1)});
    mean_filter(block, filtered.view(), options.execution);
    source.replace(std::as_const(filtered).view(), detail::sign_of_mean_filter(span.count, image.extent(0)), options.execution);
    const PointOptions engine = engine_options(options.estimator, options.do_no_harm, options.execution);
    detail::PointPlan plan = quick_plan();
    plan.coarse = chosen_columns(source, parts, std::vector<std::vector<std::ptrdiff_t>>(parts.size(), gates), adaptive_coarse_points);
    plan.picture = picture_of(parts);
    Result out = detail::estimate_from_points(source, engine, plan);
    for (StrongPoint& p : out.points) p.range += static_cast<double>(span.first);
    over_spectrum(source, out);
    return out;
}

void require_common(int k, int sub_aperture, const Execution& execution) {
    if (k < 1) throw ValueError("k", "at least 1", std::to_string(k));
    if (sub_aperture < 0 || sub_aperture % 2 != 0)
        throw ValueError("sub_aperture", "0 (automatic) or an even number of azimuth lines", std::to_string(sub_aperture));
    (void)resolve_threads(execution.threads);
}

}  // namespace

void AdaptiveOptions::validate() const {
    require_common(k, sub_aperture, execution);
    require_positive(eta, "eta");
    constexpr double largest = 0.9;
    if (!(std::abs(bandwidth_ratio) <= largest)) throw ValueError("bandwidth_ratio", "-0.9 to 0.9", number_text(bandwidth_ratio));
    gate.validate();
}

void ConventionalOptions::validate() const {
    require_common(k, sub_aperture, execution);
    if (iterations < 1) throw ValueError("iterations", "at least 1", std::to_string(iterations));
    if (!(narrowing > 0.0 && narrowing <= 1.0)) throw ValueError("narrowing", "a factor above 0, at most 1", number_text(narrowing));
}

Result adaptive_pga(const ImageView& image, MutableImageView corrected, const AdaptiveOptions& options) {
    options.validate();
    require_input(image, corrected);
    std::vector<Timing> timings;
    detail::Stopwatch clock(timings);
    const std::ptrdiff_t length = sub_aperture_length(image, options.sub_aperture);
    const detail::Scan scan =
        detail::scan_image(image, length / 2, detail::tested_extents(options.gate), options.gate.cells, options.execution);
    detail::require_not_zero(scan);
    const CfarGate gate = detail::gate_of(image, scan, detail::azimuth_cell(image), options.gate);
    const std::vector<SubAperture> parts = sub_apertures(image.extent(0), length);
    const detail::Selection selection =
        gate.strong_points ? detail::select_gates(scan, gate, options.k, options.eta) : detail::no_selection(parts.size());
    clock.lap("scan");
    Result result;
    if (gate.strong_points) {
        result = from_chosen_gates(image, scan, selection, parts, options);
    } else if (options.weak_scene == WeakScene::denoise) {
        const GateSpan span = gates_to_denoise(image.extent(1), gate.cells.front().range);
        result = from_denoised(image, span, parts, options);
        result.adaptive.first_denoised = span.first;
        result.adaptive.denoised = span.count;
    } else {
        result = detail::nothing_done(image, "no cell stands out of the clutter", options.execution);
    }
    if (result.status == Status::not_improved) {
        ConventionalOptions classic;
        classic.k = options.k;
        classic.execution = options.execution;
        Result windows = from_windows(image, scan, parts, fallback_points, classic);
        if (!windows.input_returned()) {
            windows.adaptive = result.adaptive;
            result = std::move(windows);
        }
    }
    std::vector<Result> results;
    const bool open = gate.strong_points && result.status != Status::converged;
    results.push_back(std::move(result));
    if (open) results.push_back(from_entropy(image, options));
    result = apply_best(image, corrected, options.do_no_harm, options.bandwidth_ratio, options.execution, std::move(results));
    result.method = "adaptive_pga";
    detail::describe(selection, gate, parts, options.eta, result);
    result.timings.insert(result.timings.begin(), timings.begin(), timings.end());
    return result;
}

Result conventional_pga(const ImageView& image, MutableImageView corrected, const ConventionalOptions& options) {
    options.validate();
    require_input(image, corrected);
    std::vector<Timing> timings;
    detail::Stopwatch clock(timings);
    const std::ptrdiff_t length = sub_aperture_length(image, options.sub_aperture);
    const CfarGateOptions gate;
    const detail::Scan scan = detail::scan_image(image, length / 2, gate.extents, gate.cells, options.execution);
    detail::require_not_zero(scan);
    const std::vector<SubAperture> parts = sub_apertures(image.extent(0), length);
    clock.lap("scan");
    Result result = from_windows(image, scan, parts, most_points(image), options);
    result.method = "conventional_pga";
    detail::describe(detail::select_fixed(scan, options.k), {}, parts, 0.0, result);
    result.timings.insert(result.timings.begin(), timings.begin(), timings.end());
    std::vector<Result> results;
    results.push_back(std::move(result));
    return apply_best(image, corrected, options.do_no_harm, 0.0, options.execution, std::move(results));
}

}  // namespace sarfocus::autofocus
