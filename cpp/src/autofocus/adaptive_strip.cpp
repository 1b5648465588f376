#include <algorithm>
#include <cmath>
#include <utility>

#include <sarfocus/autofocus/adaptive.hpp>
#include <sarfocus/core/checks.hpp>
#include <sarfocus/core/error.hpp>
#include <sarfocus/fft/plan.hpp>

#include "adaptive_choice.hpp"
#include "adaptive_steps.hpp"
#include "stopwatch.hpp"
#include "strip_chain.hpp"
#include "strip_lines.hpp"
#include "strip_result.hpp"
#include "strip_window.hpp"

namespace sarfocus::autofocus {
namespace {

using detail::at;
using geometry::StripmapGeometry;

std::ptrdiff_t sub_aperture_length(const StripmapGeometry& geometry, std::ptrdiff_t n_azimuth, int asked) {
    if (asked > 0) return asked;
    const double aperture = geometry.aperture_samples(geometry.slant_range.size() / 2);
    return std::max<std::ptrdiff_t>(2 * std::lround(0.5 * std::min(aperture, static_cast<double>(n_azimuth))), 2);
}

// The strongest sample of every chosen gate of every sub-aperture.
std::vector<StripPoint> strongest_samples(const ImageView& image, const std::vector<SubAperture>& parts,
                                          const detail::Selection& selection) {
    std::vector<StripPoint> out;
    for (std::size_t s = 0; s < parts.size(); ++s)
        for (const std::ptrdiff_t gate : selection.gates[s]) {
            StripPoint best;
            double energy = 0.0;
            for (std::ptrdiff_t i = parts[s].first; i < parts[s].first + parts[s].count; ++i) {
                const double intensity = std::norm(cdouble(image(i, gate)));
                energy += intensity;
                if (!(intensity > best.energy)) continue;
                best.energy = intensity;
                best.azimuth = i;
            }
            if (!(best.energy > 0.0)) continue;
            best.range = gate;
            best.statistic = best.energy * static_cast<double>(parts[s].count) / energy;
            out.push_back(best);
        }
    return out;
}

// The mean-filtered block with the sign of the filter taken out of its azimuth spectrum.
Array<cfloat, 2> denoised(const ImageView& block, const Execution& execution) {
    Array<cfloat, 2> out({block.extent(0), block.extent(1)});
    mean_filter(block, out.view(), execution);
    const std::ptrdiff_t n = block.extent(0);
    const Array<float, 2> sign = detail::sign_of_mean_filter(block.extent(1), n);
    const fft::Plan<float> forward(n, fft::Direction::forward);
    const fft::Plan<float> inverse(n, fft::Direction::inverse);
    parallel_for(execution, "denoise", block.extent(1), [&](std::int64_t j) {
        Array<cfloat, 1> line({n});
        for (std::ptrdiff_t i = 0; i < n; ++i) line(i) = out(i, j);
        forward.execute(line.data());
        for (std::ptrdiff_t k = 0; k < n; ++k) line(k) *= sign(j, k) / static_cast<float>(n);
        inverse.execute(line.data());
        for (std::ptrdiff_t i = 0; i < n; ++i) out(i, j) = line(i);
    });
    return out;
}

StripmapGeometry part_of(const StripmapGeometry& geometry, const GateSpan& span) {
    StripmapGeometry out = geometry;
    out.slant_range.assign(geometry.slant_range.begin() + span.first, geometry.slant_range.begin() + span.first + span.count);
    return out;
}

Result from_denoised(const ImageView& image, const StripmapGeometry& geometry, const MutableImageView& corrected, const GateSpan& span,
                     const std::vector<SubAperture>& parts, std::ptrdiff_t length, const AdaptiveOptions& options,
                     const SpgaLinearOptions& chain) {
    const Array<cfloat, 2> block = denoised(image.slice(1, span.first, span.count), options.execution);
    const auto choose = [&](const ImageView& from, const StripmapGeometry& part, const StripSelectOptions& select) {
        const detail::Scan scan = detail::scan_image(from, length / 2, {}, 0, options.execution);
        return detail::best_spread(from, part, strongest_samples(from, parts, detail::select_fixed(scan, options.k)), select);
    };
    Array<cfloat, 2> scratch(block.extents());
    Result out = detail::spga_linear_with(block.view(), part_of(geometry, span), scratch.view(), chain, choose);
    for (StrongPoint& p : out.points) p.range += static_cast<double>(span.first);
    const bool applied = !out.input_returned();
    std::fill(out.phase_error.begin(), out.phase_error.end(), 0.0);
    if (!applied) {
        detail::copy_image(image, corrected, options.execution);
        return out;
    }
    const ArrayView<const double, 2> phase(out.estimate.data(), {1, image.extent(0)});
    detail::apply_and_judge(image, geometry, phase, {0.0}, corrected, options.do_no_harm, options.execution, out);
    return out;
}

}  // namespace

Result adaptive_pga(const ImageView& image, const StripmapGeometry& geometry, MutableImageView corrected, const AdaptiveOptions& options) {
    options.validate();
    if (options.bandwidth_ratio != 0.0) throw ValueError("bandwidth_ratio", "0 for a strip", number_text(options.bandwidth_ratio));
    detail::require_strip_input(image, geometry, corrected);
    std::vector<Timing> timings;
    detail::Stopwatch clock(timings);
    const std::ptrdiff_t length = sub_aperture_length(geometry, image.extent(0), options.sub_aperture);
    const detail::Scan scan =
        detail::scan_image(image, length / 2, detail::tested_extents(options.gate), options.gate.cells, options.execution);
    detail::require_not_zero(scan);
    const CfarGate gate = detail::gate_of(image, scan, detail::azimuth_cell(image), options.gate);
    const std::vector<SubAperture> parts = sub_apertures(image.extent(0), length);
    const detail::Selection selection =
        gate.strong_points ? detail::select_gates(scan, gate, options.k, options.eta) : detail::no_selection(parts.size());
    clock.lap("scan");
    SpgaLinearOptions chain;
    chain.refine = options.estimator == Estimator::maximum_likelihood;
    chain.do_no_harm = options.do_no_harm;
    chain.execution = options.execution;
    Result result;
    if (gate.strong_points) {
        const auto choose = [&](const ImageView& from, const StripmapGeometry& part, const StripSelectOptions& select) {
            return detail::best_spread(from, part, strongest_samples(from, parts, selection), select);
        };
        result = detail::spga_linear_with(image, geometry, corrected, chain, choose);
    } else if (options.weak_scene == WeakScene::denoise) {
        const GateSpan span = gates_to_denoise(image.extent(1), gate.cells.front().range);
        result = from_denoised(image, geometry, corrected, span, parts, length, options, chain);
        result.adaptive.first_denoised = span.first;
        result.adaptive.denoised = span.count;
    } else {
        result = detail::nothing_done(image, "no cell stands out of the clutter", options.execution);
        result.strip.coverage.assign(at(image.extent(0)), 0.0);
        detail::copy_image(image, corrected, options.execution);
    }
    result.method = "adaptive_pga";
    detail::describe(selection, gate, parts, options.eta, result);
    result.timings.insert(result.timings.begin(), timings.begin(), timings.end());
    return result;
}

Result conventional_pga(const ImageView& image, const StripmapGeometry& geometry, MutableImageView corrected,
                        const ConventionalOptions& options) {
    options.validate();
    detail::require_strip_input(image, geometry, corrected);
    const std::ptrdiff_t length = sub_aperture_length(geometry, image.extent(0), options.sub_aperture);
    const std::vector<SubAperture> parts = sub_apertures(image.extent(0), length);
    detail::Selection selection;
    const auto choose = [&](const ImageView& from, const StripmapGeometry& part, const StripSelectOptions& select) {
        const CfarGateOptions gate;
        selection = detail::select_fixed(detail::scan_image(from, length / 2, gate.extents, gate.cells, options.execution), options.k);
        StripSelectOptions any = select;
        any.maximum_contrast = 1.0;
        return detail::best_spread(from, part, strongest_samples(from, parts, selection), any);
    };
    SpgaOptions passes;
    passes.iterations = options.iterations;
    passes.narrowing = options.narrowing;
    passes.do_no_harm = options.do_no_harm;
    passes.execution = options.execution;
    Result result = detail::spga_with(image, geometry, corrected, passes, choose);
    result.method = "conventional_pga";
    detail::describe(selection, {}, parts, 0.0, result);
    return result;
}

}  // namespace sarfocus::autofocus
