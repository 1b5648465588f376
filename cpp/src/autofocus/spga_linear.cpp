#include <sarfocus/autofocus/spga.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include <sarfocus/core/checks.hpp>
#include <sarfocus/core/error.hpp>

#include "range_blocks.hpp"
#include "stopwatch.hpp"
#include "strip_chain.hpp"
#include "strip_lines.hpp"
#include "strip_recut.hpp"
#include "strip_result.hpp"
#include "strip_score.hpp"
#include "strip_window.hpp"

namespace sarfocus::autofocus {
namespace {

using detail::at;
using detail::RangeBlock;
using geometry::StripmapGeometry;

std::vector<Seam> match(const Apertures& apertures, const SpgaLinearOptions& options) {
    if (options.matching == Matching::search) {
        SearchMatchOptions search = options.search;
        search.execution = options.execution;
        return match_search(apertures, search);
    }
    SlopeMatchOptions slope = options.slope;
    slope.execution = options.execution;
    return match_slope(apertures, slope);
}

StripPhase estimate(const Apertures& apertures, const Stitching& stitching, const SpgaLinearOptions& options) {
    if (!options.refine) return integrate_gradient(apertures, stitching, options.execution);
    StripRefineOptions refinement = options.refinement;
    refinement.execution = options.execution;
    return refine_strip_phase(apertures, stitching, refinement);
}

StripmapGeometry part_of(const StripmapGeometry& geometry, std::ptrdiff_t first, std::ptrdiff_t count) {
    StripmapGeometry out = geometry;
    out.slant_range.assign(geometry.slant_range.begin() + first, geometry.slant_range.begin() + first + count);
    return out;
}

RangeBlock run_block(const ImageView& image, const StripmapGeometry& geometry, const SpgaLinearOptions& options,
                     const detail::StripChooser& choose, detail::Stopwatch& clock) {
    RangeBlock out;
    StripSelectOptions select = options.select;
    select.execution = options.execution;
    if (select.window == 0) select.window = options.extract.window;
    const std::vector<StripPoint> points = choose(image, geometry, select);
    clock.lap("select");
    if (points.empty()) return out;
    StripExtractOptions extract = options.extract;
    extract.execution = options.execution;
    if (extract.window == 0) extract.window = containing_window(image, geometry, points);
    out.apertures = extract_apertures(image, geometry, points, extract);
    clock.lap("extract");
    std::vector<Seam> seams = match(out.apertures, options);
    clock.lap("match");
    out.stitching = stitch(out.apertures, seams);
    clock.lap("stitch");
    if (options.refine) {
        out.apertures = detail::recut_apertures(image, geometry, out.apertures, out.stitching, extract);
        clock.lap("cut again");
        seams = match(out.apertures, options);
        clock.lap("match");
        out.stitching = stitch(out.apertures, seams);
        clock.lap("stitch");
    }
    out.phase = estimate(out.apertures, out.stitching, options);
    SpgaLinearOptions gauge = options;
    if (options.range_blocks > 1) gauge.gauge = Gauge::zero_mean_shift;  // until the blocks have one in common
    out.shift = detail::apply_gauge(out.apertures, gauge, out.phase);
    clock.lap("estimate");
    if (options.do_no_harm) {
        // The traversal joins neighbours alone, which leaving points out would part.
        SpgaLinearOptions all_pairs = options;
        all_pairs.matching = Matching::slope;
        if (options.matching == Matching::search) seams = match(out.apertures, all_pairs);
        out.evidence = detail::weigh_points(out.apertures, seams, out.phase, options.execution);
    }
    if (!options.do_no_harm) out.evidence.held_out_gain.assign(at(out.apertures.size()), std::numeric_limits<double>::quiet_NaN());
    clock.lap("score");
    return out;
}

// The range gates of each block, as even as they go.
std::vector<std::ptrdiff_t> block_edges(std::ptrdiff_t n_range, int blocks) {
    std::vector<std::ptrdiff_t> out;
    for (int b = 0; b <= blocks; ++b) out.push_back(b * n_range / blocks);
    return out;
}

double mean_gate(const RangeBlock& block) {
    double sum = 0.0;
    double weights = 0.0;
    for (std::ptrdiff_t n = 0; n < block.apertures.size(); ++n) {
        const double weight = std::max(detail::gauge_weight(block.apertures, block.phase, n), 1e-6);
        sum += weight * static_cast<double>(block.apertures.points[at(n)].range);
        weights += weight;
    }
    return weights > 0.0 ? sum / weights : 0.0;
}

std::vector<RangeBlock> run_blocks(const ImageView& image, const StripmapGeometry& geometry, const SpgaLinearOptions& options,
                                   const detail::StripChooser& choose, detail::Stopwatch& clock) {
    std::vector<RangeBlock> out;
    const std::vector<std::ptrdiff_t> edges = block_edges(image.extent(1), options.range_blocks);
    for (std::size_t b = 0; b + 1 < edges.size(); ++b) {
        const std::ptrdiff_t count = edges[b + 1] - edges[b];
        RangeBlock block;
        try {
            block = run_block(image.slice(1, edges[b], count), part_of(geometry, edges[b], count), options, choose, clock);
        } catch (const NumericalError&) {
            require_finite(image, "image", options.execution.threads);  // with its place in the whole image
            throw;
        }
        for (StripPoint& p : block.apertures.points) p.range += edges[b];
        block.centre = mean_gate(block);
        out.push_back(std::move(block));
    }
    detail::keep_reliable(out);
    if (options.range_blocks > 1) detail::lay_together(out, options);
    return out;
}

// The phase of every block, [n_block, n_azimuth], and their mean and its deviation.
Array<double, 2> block_phases(const std::vector<RangeBlock>& blocks, std::ptrdiff_t n, Result& result) {
    Array<double, 2> out({static_cast<std::ptrdiff_t>(blocks.size()), n});
    result.estimate.assign(at(n), 0.0);
    result.phase_std.assign(at(n), std::numeric_limits<double>::quiet_NaN());
    for (std::size_t b = 0; b < blocks.size(); ++b) {
        const std::vector<double>& phase = blocks[b].phase.phase;
        std::copy(phase.begin(), phase.end(), out.data() + static_cast<std::ptrdiff_t>(b) * n);
    }
    for (std::ptrdiff_t k = 0; k < n; ++k) {
        double variance = 0.0;
        double reached = 0.0;
        for (std::size_t b = 0; b < blocks.size(); ++b) {
            result.estimate[at(k)] += out(static_cast<std::ptrdiff_t>(b), k) / static_cast<double>(blocks.size());
            const double sigma = blocks[b].phase.phase_std[at(k)];
            if (!std::isfinite(sigma)) continue;
            variance += sigma * sigma;
            reached += 1.0;
        }
        if (reached > 0.0) result.phase_std[at(k)] = std::sqrt(variance) / reached;
    }
    return out;
}

void score_points(const std::vector<RangeBlock>& blocks, Score& score) {
    double gain = 0.0;
    double variance = 0.0;
    double own = 0.0;
    double judged = 0.0;
    score.improved = true;
    for (const RangeBlock& block : blocks) {
        gain += block.evidence.mean_gain;
        variance += block.evidence.noise * block.evidence.noise;
        own += block.evidence.own_gain_db;
        judged += 1.0;
        if (!block.evidence.agrees || score.reason.empty()) score.reason = block.evidence.reason;
        if (!block.evidence.agrees) {
            score.improved = false;
            break;
        }
    }
    score.held_out_gain = gain / judged;
    score.held_out_noise = std::sqrt(variance) / judged;
    score.point_gain_db = own / judged;
}

}  // namespace

void SpgaLinearOptions::validate() const {
    select.validate();
    extract.validate();
    slope.validate();
    search.validate();
    refinement.validate();
    if (refinement.bridge && !refine) throw ValueError("bridge", "refine, whose smoothness it rests on", "bridge without refine");
    if (range_blocks < 1) throw ValueError("range_blocks", "at least 1", std::to_string(range_blocks));
    if (gauge == Gauge::tie_points && tie_points.empty()) throw ValueError("tie_points", "at least one for gauge tie_points", "none");
    for (const TiePoint& tie : tie_points) require_finite_value(tie.azimuth, "tie_points");
    (void)resolve_threads(execution.threads);
}

Result spga_linear(const ImageView& image, const StripmapGeometry& geometry, MutableImageView corrected, const SpgaLinearOptions& options) {
    return detail::spga_linear_with(image, geometry, corrected, options, select_strip_points);
}

Result detail::spga_linear_with(const ImageView& image, const StripmapGeometry& geometry, MutableImageView corrected,
                                const SpgaLinearOptions& options, const StripChooser& choose) {
    options.validate();
    detail::require_strip_input(image, geometry, corrected);
    if (options.range_blocks > image.extent(1))
        throw ValueError("range_blocks", "at most the " + std::to_string(image.extent(1)) + " range gates",
                         std::to_string(options.range_blocks));
    Result result;
    result.method = "spga_linear";
    result.threads = resolve_threads(options.execution.threads);
    detail::Stopwatch clock(result.timings);
    const std::ptrdiff_t n = image.extent(0);
    const std::vector<RangeBlock> blocks = run_blocks(image, geometry, options, choose, clock);
    result.phase_error.assign(at(n), 0.0);
    result.strip.coverage.assign(at(n), 0.0);
    if (blocks.empty()) {
        result.estimate.assign(at(n), 0.0);
        result.phase_std.assign(at(n), std::numeric_limits<double>::quiet_NaN());
        result.score.reason = "no pixel stands out of the clutter";
        detail::copy_image(image, corrected, options.execution);
        return result;
    }
    const Array<double, 2> phase = block_phases(blocks, n, result);
    std::vector<double> centres;
    for (const RangeBlock& block : blocks) {
        centres.push_back(block.centre);
        detail::append_details(block.apertures, block.stitching, block.phase, block.shift, block.evidence, result);
    }
    if (options.range_blocks > 1) {
        result.strip.block_phase.assign(phase.begin(), phase.end());
        result.strip.block_centre = centres;
        for (const RangeBlock& block : blocks)
            result.strip.block_std.insert(result.strip.block_std.end(), block.phase.phase_std.begin(), block.phase.phase_std.end());
    }
    if (options.do_no_harm) score_points(blocks, result.score);
    if (options.do_no_harm && !result.score.improved) {
        result.status = Status::not_improved;
        detail::copy_image(image, corrected, options.execution);
        return result;
    }
    detail::apply_and_judge(image, geometry, phase.view(), centres, corrected, options.do_no_harm, options.execution, result);
    clock.lap("correct");
    return result;
}

}  // namespace sarfocus::autofocus
