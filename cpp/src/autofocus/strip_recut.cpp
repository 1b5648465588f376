#include "strip_recut.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <vector>

#include <sarfocus/core/array.hpp>
#include <sarfocus/focus/azimuth.hpp>

#include "strip_lines.hpp"
#include "strip_result.hpp"

namespace sarfocus::autofocus::detail {
namespace {

// Beyond the apertures of a segment the phase goes on as a line, with the mean slope of its last samples.
void go_on_as_lines(std::vector<double>& phase, const std::vector<SegmentSpan>& spans) {
    for (const SegmentSpan& span : spans) {
        const std::ptrdiff_t length = span.covered_end - span.covered_begin;
        if (length < 2) continue;
        const std::ptrdiff_t reach = std::clamp<std::ptrdiff_t>(length / 32, 1, length - 1);
        const double first = phase[at(span.covered_begin)];
        const double last = phase[at(span.covered_end - 1)];
        const double before = (phase[at(span.covered_begin + reach)] - first) / static_cast<double>(reach);
        const double behind = (last - phase[at(span.covered_end - 1 - reach)]) / static_cast<double>(reach);
        for (std::ptrdiff_t k = span.begin; k < span.covered_begin; ++k)
            phase[at(k)] = first + before * static_cast<double>(k - span.covered_begin);
        for (std::ptrdiff_t k = span.covered_end; k < span.end; ++k)
            phase[at(k)] = last + behind * static_cast<double>(k - span.covered_end + 1);
    }
}

// The coherent phase of all points, the points not moved on average, and where they then lie.
StripPhase first_phase(const Apertures& apertures, const Stitching& stitching, const Execution& execution) {
    std::vector<bool> use(at(apertures.size()));
    for (std::size_t n = 0; n < use.size(); ++n) use[n] = stitching.segment[n] >= 0;
    const CoherentPhase coherent = coherent_phase(apertures, stitching, use, {1.0}, 1, execution);
    StripPhase out;
    out.phase = coherent.phase;
    out.slope = coherent.slope;
    out.segment = stitching.segment;
    out.information.assign(at(apertures.size()), 1.0);
    go_on_as_lines(out.phase, segment_spans(apertures, stitching.segment, stitching.segments));
    SpgaLinearOptions gauge;
    gauge.execution = execution;
    (void)apply_gauge(apertures, gauge, out);
    return out;
}

}  // namespace

Apertures recut_apertures(const ImageView& image, const geometry::StripmapGeometry& geometry, const Apertures& apertures,
                          const Stitching& stitching, const StripExtractOptions& options) {
    const StripPhase phase = first_phase(apertures, stitching, options.execution);
    std::set<std::int64_t> held;
    for (const StripPoint& p : apertures.points) held.insert(p.range);
    const std::vector<std::int64_t> gates(held.begin(), held.end());
    geometry::StripmapGeometry part = geometry;
    part.slant_range.clear();
    Array<cfloat, 2> focused({image.extent(0), static_cast<std::ptrdiff_t>(gates.size())});
    for (std::size_t g = 0; g < gates.size(); ++g) {
        part.slant_range.push_back(geometry.slant_range[static_cast<std::size_t>(gates[g])]);
        for (std::ptrdiff_t i = 0; i < image.extent(0); ++i)
            focused(i, static_cast<std::ptrdiff_t>(g)) = image(i, static_cast<std::ptrdiff_t>(gates[g]));
    }
    focus::AzimuthCorrectOptions correct;
    correct.execution = options.execution;
    const ArrayView<const double, 2> row(phase.phase.data(), {1, image.extent(0)});
    focus::azimuth_correct(focused.view(), part, row, {0.0}, focused.view(), correct);

    std::vector<StripPoint> points = apertures.points;
    for (std::ptrdiff_t n = 0; n < apertures.size(); ++n) {
        StripPoint& p = points[at(n)];
        p.azimuth = std::clamp<std::int64_t>(p.azimuth + std::lround(apertures.shift(n, phase.slope[at(n)])), 0, image.extent(0) - 1);
        p.range = std::lower_bound(gates.begin(), gates.end(), p.range) - gates.begin();
    }
    Apertures out = extract_apertures(focused.view(), part, points, options);
    std::vector<cfloat> error;
    for (const double value : phase.phase) error.emplace_back(std::polar(1.0, value));
    for (std::ptrdiff_t n = 0; n < out.size(); ++n) {
        for (std::ptrdiff_t k = 0; k < out.count[at(n)]; ++k) out.lines(n, k) *= error[at(out.start[at(n)] + k)];
        out.points[at(n)].range = gates[static_cast<std::size_t>(out.points[at(n)].range)];
    }
    return out;
}

}  // namespace sarfocus::autofocus::detail
