#include <sarfocus/autofocus/strip.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

#include <sarfocus/core/constants.hpp>
#include <sarfocus/core/error.hpp>

#include "strip_lines.hpp"

namespace sarfocus::autofocus {
namespace {

using detail::at;

struct Steps {
    std::vector<cdouble> sum;       // of d(k) conj d(k - 1), [n_azimuth]
    std::vector<double> magnitude;  // of |d(k) conj d(k - 1)|
    std::vector<double> looks;      // independent samples in it
};

Steps phase_steps(const Apertures& apertures, const Stitching& stitching, std::vector<double>& line_power) {
    const std::size_t n = at(apertures.n_azimuth);
    Steps out{std::vector<cdouble>(n), std::vector<double>(n, 0.0), std::vector<double>(n, 0.0)};
    for (std::ptrdiff_t i = 0; i < apertures.size(); ++i) {
        if (stitching.segment[at(i)] < 0) continue;
        const std::vector<cdouble> line = detail::whitened_line(apertures, i, {}, stitching.slope[at(i)]);
        double power = 0.0;
        for (const cdouble& z : line) power += std::norm(z);
        power /= static_cast<double>(line.size());
        line_power[at(i)] = power;
        if (!(power > 0.0)) continue;
        for (std::size_t k = 1; k < line.size(); ++k) {
            const cdouble step = line[k] * std::conj(line[k - 1]) / power;
            const std::size_t sample = at(apertures.start[at(i)]) + k;
            out.sum[sample] += step;
            out.magnitude[sample] += std::abs(step);
            out.looks[sample] += 1.0 / apertures.samples_per_look(i);
        }
    }
    return out;
}

// The samples at either end of the apertures whose mean step the line beyond takes.
std::ptrdiff_t end_samples(const detail::SegmentSpan& span) {
    return std::clamp<std::ptrdiff_t>((span.covered_end - span.covered_begin) / 32, 1, 32);
}

double mean_step(const Steps& steps, std::ptrdiff_t begin, std::ptrdiff_t end) {
    cdouble sum{};
    for (std::ptrdiff_t k = std::max<std::ptrdiff_t>(begin, 0); k < std::min(end, static_cast<std::ptrdiff_t>(steps.sum.size())); ++k)
        sum += steps.sum[at(k)];
    return sum != cdouble{} ? std::arg(sum) : 0.0;
}

// Variance of one step from how well its contributions agree, averaged over a look: smooth noise takes steps that are alike.
std::vector<double> step_variance(const Steps& steps, double look) {
    const auto n = static_cast<std::ptrdiff_t>(steps.sum.size());
    const auto half = std::max<std::ptrdiff_t>(std::lround(2.0 * look), 8);
    std::vector<double> out(at(n), 0.0);
    cdouble sum{};
    double magnitude = 0.0;
    double looks = 0.0;
    const auto add = [&](std::ptrdiff_t k, double sign) {
        if (k < 0 || k >= n || steps.magnitude[at(k)] == 0.0) return;
        sum += sign * std::abs(steps.sum[at(k)]);
        magnitude += sign * steps.magnitude[at(k)];
        looks += sign * steps.looks[at(k)];
    };
    for (std::ptrdiff_t k = -half; k < n; ++k) {
        add(k + half, 1.0);
        if (k < 0) continue;
        const double agreement = magnitude > 0.0 ? std::clamp(std::abs(sum) / magnitude, 1e-3, 1.0) : 1e-3;
        const double mean_looks = std::max(looks / static_cast<double>(2 * half + 1), 1e-3);
        out[at(k)] = std::max(-2.0 * std::log(agreement), 1e-12) / mean_looks;
        add(k - half, -1.0);
    }
    return out;
}

// Standard deviation of a random walk with these step variances once constant and line are taken off: with u_k(i) = [i <= k] less its line,
// var(k) = sum over i of v_i u_k(i)^2.
void random_walk_deviation(const std::vector<double>& variance, const detail::SegmentSpan& span, std::vector<double>& out) {
    const std::ptrdiff_t n = span.covered_end - span.covered_begin;
    if (n < 3) return;
    const double middle = 0.5 * static_cast<double>(n - 1);
    const double sxx = static_cast<double>(n) * (static_cast<double>(n) * static_cast<double>(n) - 1.0) / 12.0;
    // Line of the step at i: 1 for samples i … n - 1.
    std::vector<double> constant(at(n));
    std::vector<double> slope(at(n));
    for (std::ptrdiff_t i = 0; i < n; ++i) {
        const auto after = static_cast<double>(n - i);
        constant[at(i)] = after / static_cast<double>(n);
        slope[at(i)] = after * (0.5 * static_cast<double>(n - 1 + i) - middle) / sxx;
    }
    double s0 = 0.0;
    double s1 = 0.0;
    double s2 = 0.0;
    for (std::ptrdiff_t i = 1; i < n; ++i) {
        const double v = variance[at(span.covered_begin + i)];
        s0 += v * constant[at(i)] * constant[at(i)];
        s1 += v * constant[at(i)] * slope[at(i)];
        s2 += v * slope[at(i)] * slope[at(i)];
    }
    double c0 = 0.0;
    double c1 = 0.0;
    for (std::ptrdiff_t k = 0; k < n; ++k) {
        if (k > 0) {
            const double v = variance[at(span.covered_begin + k)];
            c0 += v * (1.0 - 2.0 * constant[at(k)]);
            c1 -= 2.0 * v * slope[at(k)];
        }
        const double x = static_cast<double>(k) - middle;
        out[at(span.covered_begin + k)] = std::sqrt(std::max(c0 + c1 * x + s0 + 2.0 * s1 * x + s2 * x * x, 0.0));
    }
}

}  // namespace

StripPhase integrate_gradient(const Apertures& apertures, const Stitching& stitching, const Execution& execution) {
    (void)resolve_threads(execution.threads);
    if (static_cast<std::ptrdiff_t>(stitching.slope.size()) != apertures.size())
        throw ShapeError("stitching", std::to_string(apertures.size()) + " points", std::to_string(stitching.slope.size()));
    StripPhase out;
    const std::size_t n = at(apertures.n_azimuth);
    std::vector<double> power(at(apertures.size()), 0.0);
    const Steps steps = phase_steps(apertures, stitching, power);
    out.phase.assign(n, 0.0);
    out.phase_std.assign(n, std::numeric_limits<double>::quiet_NaN());
    out.coverage = detail::coverage_of(apertures);
    out.slope = stitching.slope;
    out.segment = stitching.segment;
    double look = 1.0;
    for (std::ptrdiff_t i = 0; i < apertures.size(); ++i) look = std::max(look, apertures.samples_per_look(i));
    const std::vector<double> variance = step_variance(steps, look);
    for (const detail::SegmentSpan& span : detail::segment_spans(apertures, stitching.segment, stitching.segments)) {
        const double before = mean_step(steps, span.covered_begin + 1, span.covered_begin + 1 + end_samples(span));
        const double behind = mean_step(steps, span.covered_end - end_samples(span), span.covered_end);
        for (std::ptrdiff_t k = span.begin; k < span.covered_begin; ++k)
            out.phase[at(k)] = before * static_cast<double>(k - span.covered_begin);
        double phase = 0.0;
        for (std::ptrdiff_t k = span.covered_begin + 1; k < span.end; ++k) {
            phase += k >= span.covered_end ? behind : steps.magnitude[at(k)] > 0.0 ? std::arg(steps.sum[at(k)]) : 0.0;
            out.phase[at(k)] = phase;
        }
        random_walk_deviation(variance, span, out.phase_std);
    }
    // How well every point's line follows that phase.
    const auto count = at(apertures.size());
    out.signal.assign(count, 0.0);
    out.noise.assign(count, 0.0);
    out.information.assign(count, 0.0);
    double total = 0.0;
    const std::vector<cdouble> rotation = detail::rotation_of(out.phase);
    for (std::ptrdiff_t i = 0; i < apertures.size(); ++i) {
        const detail::Tone tone = detail::strongest_tone(detail::whitened_line(apertures, i, rotation, stitching.slope[at(i)]),
                                                         detail::slope_of(apertures, i, 4.0));
        out.slope[at(i)] += tone.slope;
        out.signal[at(i)] = power[at(i)] * tone.coherence;
        out.noise[at(i)] = power[at(i)] * (1.0 - tone.coherence);
        out.information[at(i)] = power[at(i)] > 0.0 ? static_cast<double>(apertures.count[at(i)]) : 0.0;
        total += out.information[at(i)];
    }
    for (double& share : out.information) share /= std::max(total, 1e-300);
    out.smoothness.assign(static_cast<std::size_t>(stitching.segments), std::numeric_limits<double>::quiet_NaN());
    return out;
}

}  // namespace sarfocus::autofocus
