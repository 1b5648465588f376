#include "strip_score.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numeric>

#include "strip_lines.hpp"

namespace sarfocus::autofocus::detail {
namespace {

constexpr int most_groups = 4;  // each leaves a quarter of the points out: the others still overlap
// Without an error the gain over its standard error was at most -0.15 on 276 simulated strips, so that 1.5 would do there; pairs of equal
// points that share an aperture, which the estimate cannot tell apart, reach 3 with a phase that takes single points 5 dB down.
constexpr double sigmas = 3.0;

std::string sentence(const char* format, double a, double b) {
    char text[240];
    std::snprintf(text, sizeof text, format, a, b);
    return text;
}

// Peak of point n with a phase taken out: the power of its tone, added up over pieces of slow time whose phases do not join.
struct Peak {
    double log_power = -std::numeric_limits<double>::infinity();
    double over_noise = 1.0;  // times what independent noise of the same energy gives on average
};

Peak peak_of(const Apertures& a, std::ptrdiff_t n, const std::vector<cdouble>& rotation, const std::vector<SegmentSpan>& pieces) {
    const std::vector<cdouble> line = whitened_line(a, n, rotation, 0.0);
    const std::ptrdiff_t start = a.start[at(n)];
    double sum = 0.0;
    double energy = 0.0;
    for (const SegmentSpan& piece : pieces) {
        const std::ptrdiff_t begin = std::max(piece.covered_begin, start);
        const std::ptrdiff_t end = std::min(piece.covered_end, start + a.count[at(n)]);
        if (end - begin < 8) continue;
        std::vector<cdouble> part(line.begin() + (begin - start), line.begin() + (end - start));
        for (std::size_t k = 0; k < part.size(); ++k) {
            part[k] *= std::sqrt(static_cast<double>(a.weight(n, begin - start + static_cast<std::ptrdiff_t>(k))));
            energy += std::norm(part[k]);
        }
        sum += std::norm(strongest_tone(part, slope_of(a, n, a.window)).sum);
    }
    Peak out;
    if (sum > 0.0) out.log_power = std::log(sum);
    if (energy > 0.0) out.over_noise = std::max(sum / (energy * a.samples_per_look(n)), 1.0);
    return out;
}

std::vector<SegmentSpan> whole(const Apertures& a) {
    return {{0, a.n_azimuth, 0, a.n_azimuth}};
}

// Share of point n's weight that the pieces reach.
double share_reached(const Apertures& a, std::ptrdiff_t n, const std::vector<SegmentSpan>& pieces) {
    double reached = 0.0;
    double weight = 0.0;
    for (std::ptrdiff_t k = 0; k < a.count[at(n)]; ++k) {
        const auto w = static_cast<double>(a.weight(n, k));
        const std::ptrdiff_t sample = a.start[at(n)] + k;
        weight += w;
        for (const SegmentSpan& piece : pieces)
            if (sample >= piece.covered_begin && sample < piece.covered_end) reached += w;
    }
    return weight > 0.0 ? reached / weight : 0.0;
}

void judge_held_out(StripEvidence& out, double floor) {
    double sum = 0.0;
    double square = 0.0;
    for (const double gain : out.held_out_gain) {
        if (!std::isfinite(gain)) continue;
        sum += gain;
        square += gain * gain;
    }
    const double n = out.judged;
    out.mean_gain = sum / n;
    const double scatter = n > 1.0 ? std::max(square / n - out.mean_gain * out.mean_gain, 0.0) / (n - 1.0) : 0.0;
    // The scatter over points, but not less than what the noise of the peaks alone gives.
    out.noise = std::sqrt(std::max(scatter, floor / n));
    out.agrees = out.mean_gain > sigmas * out.noise;
    out.reason =
        out.agrees ? sentence("the peaks of points rise by %.2f dB with the phase that other points gave, +- %.2f dB by chance",
                              4.342944819 * out.mean_gain, 4.342944819 * out.noise)
                   : sentence("the phase that other points gave changes a point's peak by %.2f dB, no more than chance would (+- %.2f dB)",
                              4.342944819 * out.mean_gain, 4.342944819 * out.noise);
}

// Nat, of the points' peaks with the phase of all.
double mean_own_gain(const Apertures& a, const StripPhase& phase, const Execution& execution) {
    const std::vector<cdouble> rotation = rotation_of(phase.phase);
    std::vector<double> gain(at(a.size()));
    parallel_for(execution, "judge", a.size(), [&](std::int64_t n) {
        gain[at(n)] = peak_of(a, n, rotation, whole(a)).log_power - peak_of(a, n, {}, whole(a)).log_power;
    });
    return std::accumulate(gain.begin(), gain.end(), 0.0) / static_cast<double>(a.size());
}

void judge_alone(const Apertures& a, const StripPhase& phase, double gain, StripEvidence& out) {
    // Envelope of the decompressed signal: a tenth of the way from an ideal point to speckle.
    constexpr double steady = 0.05;
    double worst = 0.0;
    for (const StripPoint& p : a.points) worst = std::max(worst, p.contrast);
    double explained = 0.0;
    // Fitting its own noise raises a peak by the variance of the phase.
    for (std::ptrdiff_t n = 0; n < a.size(); ++n)
        explained += 0.5 * phase.noise[at(n)] / std::max(phase.signal[at(n)], 1e-300) / static_cast<double>(a.size());
    out.mean_gain = gain;
    out.noise = explained;
    if (!(worst <= steady))
        out.reason = sentence("no other point confirms the phase, and the envelope of a point's signal is unsteady (Q %.2f, %.2f allowed)",
                              worst, steady);
    else if (!(gain > sigmas * std::min(explained, 1.0) + 0.02))
        out.reason = sentence("no other point confirms the phase, and the points' peaks gain %.2f dB, of which %.2f dB may be fitted noise",
                              4.342944819 * gain, 4.342944819 * explained);
    else {
        out.agrees = true;
        out.reason = sentence("the points are steady (Q at most %.3f) and their peaks rise by %.2f dB; no other point confirms it", worst,
                              4.342944819 * gain);
    }
}

}  // namespace

StripEvidence weigh_points(const Apertures& apertures, const std::vector<Seam>& seams, const StripPhase& phase,
                           const Execution& execution) {
    StripEvidence out;
    const std::ptrdiff_t n = apertures.size();
    out.held_out_gain.assign(at(n), std::numeric_limits<double>::quiet_NaN());
    double floor = 0.0;
    const std::ptrdiff_t groups = std::min<std::ptrdiff_t>(most_groups, n);
    for (std::ptrdiff_t group = 0; group < groups && n > 1; ++group) {
        std::vector<bool> use(at(n));
        for (std::ptrdiff_t i = 0; i < n; ++i) use[at(i)] = i % groups != group;
        const Stitching stitching = stitch_some(apertures, seams, use);
        const CoherentPhase others = coherent_phase(apertures, stitching, use, {0.5}, 1, execution);
        const std::vector<cdouble> rotation = rotation_of(others.phase);
        const std::vector<SegmentSpan> pieces = segment_spans(apertures, stitching.segment, stitching.segments);
        std::vector<double> over_noise(at(n), 0.0);  // 0: not judged
        parallel_for(execution, "judge", (n - group + groups - 1) / groups, [&](std::int64_t m) {
            const std::ptrdiff_t i = group + m * groups;
            if (share_reached(apertures, i, pieces) < 0.5) return;
            const Peak before = peak_of(apertures, i, {}, pieces);
            const Peak after = peak_of(apertures, i, rotation, pieces);
            out.held_out_gain[at(i)] = after.log_power - before.log_power;
            over_noise[at(i)] = std::max(before.over_noise, after.over_noise);
        });
        for (const double over : over_noise) {
            if (!(over > 0.0)) continue;
            floor += 1.0 / over;
            ++out.judged;
        }
    }
    const double own = mean_own_gain(apertures, phase, execution);
    out.own_gain_db = 4.342944819 * own;
    if (out.judged >= 2)
        judge_held_out(out, floor / out.judged);
    else
        judge_alone(apertures, phase, own, out);
    return out;
}

}  // namespace sarfocus::autofocus::detail
