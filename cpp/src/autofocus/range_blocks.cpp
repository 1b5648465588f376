#include "range_blocks.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include <sarfocus/core/constants.hpp>
#include <sarfocus/core/error.hpp>

#include "strip_lines.hpp"
#include "strip_result.hpp"

namespace sarfocus::autofocus::detail {
namespace {

constexpr int fewest_common = 16;  // samples that a segment shares with the neighbour, or it keeps its own gauge

constexpr std::ptrdiff_t fewest_points = 4;  // of a segment that is taken at its word where other blocks know better
constexpr double fewest_apertures = 2.0;     // that reach a sample, likewise

bool reached(const RangeBlock& block, std::ptrdiff_t k) {
    return std::isfinite(block.phase.phase_std[at(k)]);
}

double information(const RangeBlock& block) {
    double out = 0.0;
    for (const double sigma : block.phase.phase_std)
        if (std::isfinite(sigma)) out += 1.0 / std::max(sigma * sigma, 1e-12);
    return out;
}

// Samples where the points of a block check one another: two apertures, of a segment of several points.
std::vector<bool> confirmed(const RangeBlock& block) {
    std::vector<bool> out(block.phase.phase.size(), false);
    const std::vector<SegmentSpan> spans = segment_spans(block.apertures, block.phase.segment, block.stitching.segments);
    for (std::size_t s = 0; s < spans.size(); ++s) {
        const auto points = std::count(block.phase.segment.begin(), block.phase.segment.end(), static_cast<int>(s));
        if (points < fewest_points) continue;
        for (std::ptrdiff_t k = spans[s].begin; k < spans[s].end; ++k)
            out[at(k)] = reached(block, k) && block.phase.coverage[at(k)] >= fewest_apertures;
    }
    return out;
}

// Where two other blocks are confirmed, one that is not counts as not reaching: a slip of its phase would go unseen.
void forget_thin(std::vector<RangeBlock>& blocks) {
    std::vector<std::vector<bool>> sure;
    for (const RangeBlock& block : blocks) sure.push_back(confirmed(block));
    for (std::size_t k = 0; k < sure.front().size(); ++k) {
        const auto count = std::count_if(sure.begin(), sure.end(), [k](const std::vector<bool>& s) { return s[k]; });
        for (std::size_t b = 0; b < blocks.size() && count >= 2; ++b)
            if (!sure[b][k]) blocks[b].phase.phase_std[k] = std::numeric_limits<double>::quiet_NaN();
    }
}

// Constant and line taken off the phase of the samples of a segment; its points have that line more.
struct Line {
    double constant = 0.0;
    double slope = 0.0;
};

void take_off(RangeBlock& block, int segment, const SegmentSpan& span, const Line& line) {
    for (std::ptrdiff_t k = span.begin; k < span.end; ++k) block.phase.phase[at(k)] -= line.constant + line.slope * static_cast<double>(k);
    for (std::ptrdiff_t n = 0; n < block.apertures.size(); ++n) {
        const std::int64_t azimuth = block.apertures.points[at(n)].azimuth;
        const int own = block.phase.segment[at(n)];
        if (own != segment && !(own < 0 && azimuth >= span.begin && azimuth < span.end)) continue;
        block.phase.slope[at(n)] += line.slope;
        block.shift[at(n)] += block.apertures.shift(n, line.slope);
    }
}

// Weighted least squares over the samples of the span that both blocks reach.
Line difference(const RangeBlock& block, const RangeBlock& neighbour, const SegmentSpan& span) {
    double s0 = 0.0;
    double s1 = 0.0;
    double s2 = 0.0;
    double y0 = 0.0;
    double y1 = 0.0;
    int common = 0;
    const auto middle = 0.5 * static_cast<double>(span.begin + span.end);
    for (std::ptrdiff_t k = span.begin; k < span.end; ++k) {
        if (!reached(block, k) || !reached(neighbour, k)) continue;
        const double own = block.phase.phase_std[at(k)];
        const double other = neighbour.phase.phase_std[at(k)];
        const double weight = 1.0 / std::max(own * own + other * other, 1e-12);
        const double x = static_cast<double>(k) - middle;
        const double y = block.phase.phase[at(k)] - neighbour.phase.phase[at(k)];
        s0 += weight;
        s1 += weight * x;
        s2 += weight * x * x;
        y0 += weight * y;
        y1 += weight * x * y;
        ++common;
    }
    if (common < fewest_common) return {};
    const double slope = (s0 * y1 - s1 * y0) / (s0 * s2 - s1 * s1);
    return {(y0 - slope * s1) / s0 - slope * middle, slope};
}

void lay_beside(const RangeBlock& neighbour, RangeBlock& block) {
    const std::vector<SegmentSpan> spans = segment_spans(block.apertures, block.phase.segment, block.stitching.segments);
    for (std::size_t s = 0; s < spans.size(); ++s) take_off(block, static_cast<int>(s), spans[s], difference(block, neighbour, spans[s]));
}

// The block that reaches the most of samples [begin, end), the nearest of them.
std::size_t stand_in(const std::vector<RangeBlock>& blocks, std::size_t b, std::ptrdiff_t begin, std::ptrdiff_t end) {
    std::size_t best = b;
    std::ptrdiff_t most = 0;
    const auto distance = [b](std::size_t m) { return m > b ? m - b : b - m; };
    for (std::size_t m = 0; m < blocks.size(); ++m) {
        std::ptrdiff_t count = 0;
        for (std::ptrdiff_t k = begin; k < end; ++k) count += reached(blocks[m], k) ? 1 : 0;
        if (count < most || count == 0 || (count == most && distance(m) >= distance(best))) continue;
        most = count;
        best = m;
    }
    return best;
}

// The phase of block b where no aperture of its own reaches: that of another, and what they differ by at the edges.
void bridge(const std::vector<RangeBlock>& blocks, std::size_t b, std::ptrdiff_t begin, std::ptrdiff_t end, std::vector<double>& phase) {
    const std::size_t other = stand_in(blocks, b, begin, end);
    if (other == b) return;
    const std::vector<double>& shape = blocks[other].phase.phase;
    const std::vector<double>& own = blocks[b].phase.phase;
    const auto n = static_cast<std::ptrdiff_t>(own.size());
    const auto gap = [&](std::ptrdiff_t k) { return own[at(k)] - shape[at(k)]; };
    const double before = begin > 0 ? gap(begin - 1) : gap(end);
    const double behind = end < n ? gap(end) : before;
    for (std::ptrdiff_t k = begin; k < end; ++k) {
        const double share = static_cast<double>(k - begin + 1) / static_cast<double>(end - begin + 1);
        phase[at(k)] = shape[at(k)] + (1.0 - share) * before + share * behind;
    }
}

void bridge_gaps(std::vector<RangeBlock>& blocks) {
    std::vector<std::vector<double>> whole;
    for (std::size_t b = 0; b < blocks.size(); ++b) {
        whole.push_back(blocks[b].phase.phase);
        const auto n = static_cast<std::ptrdiff_t>(whole.back().size());
        for (std::ptrdiff_t begin = 0; begin < n; ++begin) {
            std::ptrdiff_t end = begin;
            while (end < n && !reached(blocks[b], end)) ++end;
            if (end > begin && end - begin < n) bridge(blocks, b, begin, end, whole.back());
            begin = end;
        }
    }
    for (std::size_t b = 0; b < blocks.size(); ++b) blocks[b].phase.phase = std::move(whole[b]);
}

// A point and the azimuth pixels by which it lies off where the gauge wants it.
struct Offset {
    std::ptrdiff_t point = 0;
    double pixels = 0.0;
    double weight = 1.0;
};

std::vector<Offset> offsets(const RangeBlock& block, const SpgaLinearOptions& options) {
    const Apertures& a = block.apertures;
    std::vector<Offset> out;
    if (options.gauge == Gauge::tie_points) {
        std::vector<double> after;
        for (std::ptrdiff_t n = 0; n < a.size(); ++n) after.push_back(a.shift(n, block.phase.slope[at(n)]));
        for (const TiePoint& tie : options.tie_points) {
            const std::ptrdiff_t n = matching_point(a, after, tie);
            if (n >= 0) out.push_back({n, static_cast<double>(a.points[at(n)].azimuth) + after[at(n)] - tie.azimuth, 1.0});
        }
        return out;
    }
    for (std::ptrdiff_t n = 0; n < a.size(); ++n) {
        if (block.phase.segment[at(n)] < 0) continue;
        out.push_back({n, block.shift[at(n)], options.gauge == Gauge::first_point ? 1.0 : gauge_weight(a, block.phase, n)});
    }
    return out;
}

// The line that all phases lack, by least squares over the offsets in pixels.
double common_slope(const std::vector<RangeBlock>& blocks, const SpgaLinearOptions& options) {
    double numerator = 0.0;
    double denominator = 0.0;
    std::int64_t first = -1;
    std::size_t matched = 0;
    for (const RangeBlock& block : blocks)
        for (const Offset& offset : offsets(block, options)) {
            const double pixel = two_pi * block.apertures.fm_rate[at(offset.point)];
            const std::int64_t azimuth = block.apertures.points[at(offset.point)].azimuth;
            if (options.gauge == Gauge::first_point) {
                if (first >= 0 && azimuth >= first) continue;
                first = azimuth;
                numerator = 0.0;
                denominator = 0.0;
            }
            numerator += offset.weight * offset.pixels / pixel;
            denominator += offset.weight / (pixel * pixel);
            ++matched;
        }
    if (options.gauge == Gauge::tie_points && matched < options.tie_points.size())
        throw ValueError(
            "tie_points", "a strong point within the window and one range gate of each",
            std::to_string(options.tie_points.size() - matched) + " of " + std::to_string(options.tie_points.size()) + " without");
    return denominator > 0.0 ? numerator / denominator : 0.0;
}

}  // namespace

void keep_reliable(std::vector<RangeBlock>& blocks) {
    std::erase_if(blocks, [](const RangeBlock& b) { return b.empty(); });
    const auto agrees = [](const RangeBlock& b) { return b.evidence.agrees; };
    if (std::any_of(blocks.begin(), blocks.end(), agrees)) std::erase_if(blocks, [&](const RangeBlock& b) { return !agrees(b); });
}

void lay_together(std::vector<RangeBlock>& blocks, const SpgaLinearOptions& options) {
    if (blocks.empty()) return;
    forget_thin(blocks);
    std::size_t best = 0;
    for (std::size_t b = 1; b < blocks.size(); ++b)
        if (information(blocks[b]) > information(blocks[best])) best = b;
    for (std::size_t b = best; b > 0; --b) lay_beside(blocks[b], blocks[b - 1]);
    for (std::size_t b = best + 1; b < blocks.size(); ++b) lay_beside(blocks[b - 1], blocks[b]);
    bridge_gaps(blocks);
    const double slope = common_slope(blocks, options);
    for (RangeBlock& block : blocks) {
        const std::vector<SegmentSpan> spans = segment_spans(block.apertures, block.phase.segment, block.stitching.segments);
        const double middle = 0.5 * static_cast<double>(block.apertures.n_azimuth - 1);
        for (std::size_t s = 0; s < spans.size(); ++s) take_off(block, static_cast<int>(s), spans[s], {slope * middle, -slope});
    }
}

}  // namespace sarfocus::autofocus::detail
