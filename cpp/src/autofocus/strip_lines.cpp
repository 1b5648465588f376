#include "strip_lines.hpp"

#include <algorithm>
#include <limits>
#include <map>
#include <mutex>
#include <utility>

#include <sarfocus/core/array.hpp>
#include <sarfocus/core/constants.hpp>

#include "tone_sums.hpp"

namespace sarfocus::autofocus {

double Apertures::shift(std::ptrdiff_t n, double slope) const {
    return slope / (two_pi * fm_rate[detail::at(n)]);
}

double Apertures::samples_per_look(std::ptrdiff_t n) const {
    // A piece of 2 W pixels, tapered over the outer quarter of either half: 1.75 W of them count. They are tones of the dechirped signal
    // over a band of 1.75 W K / prf^2 cycles a sample.
    return std::max(1.0 / (1.75 * window * fm_rate[detail::at(n)]), 1.0);
}

namespace detail {
namespace {

constexpr std::ptrdiff_t longest_tone = 512;
constexpr double settled = 1e-6;  // rad over the signal: what a Newton step that follows would add is its square

std::vector<cdouble> averaged(const std::vector<cdouble>& signal, std::ptrdiff_t factor) {
    std::vector<cdouble> out((signal.size() + at(factor) - 1) / at(factor));
    for (std::size_t k = 0; k < signal.size(); ++k) out[k / at(factor)] += signal[k];
    return out;
}

// One Newton step up |sum z exp(-j slope x)|^2, at most half a cell of the periodogram.
double newton_step(const std::vector<cdouble>& z, double slope, double middle) {
    const auto [s0, s1, s2] = tone_moments(z.data(), static_cast<std::ptrdiff_t>(z.size()), slope, middle);
    const double gradient = 2.0 * std::imag(s1 * std::conj(s0));
    const double curvature = 2.0 * (std::norm(s1) - std::real(s2 * std::conj(s0)));
    const double limit = pi / static_cast<double>(z.size());
    return curvature < 0.0 ? std::clamp(-gradient / curvature, -limit, limit) : 0.0;
}

// The strongest cell of the periodogram, rad a sample.
double periodogram_peak(const std::vector<cdouble>& z, double limit) {
    const std::ptrdiff_t length = plan_length(2 * static_cast<std::ptrdiff_t>(z.size()));
    Array<cdouble, 1> spectrum({length});
    std::copy(z.begin(), z.end(), spectrum.data());
    kept_plan(length, fft::Direction::forward).execute(spectrum.data());
    const double step = two_pi / static_cast<double>(length);
    const auto reach = std::min(static_cast<std::ptrdiff_t>(limit / step), length / 2 - 1);
    std::ptrdiff_t peak = 0;
    double power = -1.0;
    for (std::ptrdiff_t f = -reach; f <= reach; ++f) {
        const double here = std::norm(spectrum(f < 0 ? f + length : f));
        if (here > power) {
            power = here;
            peak = f;
        }
    }
    return step * static_cast<double>(peak);
}

}  // namespace

std::ptrdiff_t plan_length(std::ptrdiff_t n) {
    std::ptrdiff_t out = 64;
    while (out < n) out *= 2;
    return out;
}

const fft::Plan<double>& kept_plan(std::ptrdiff_t length, fft::Direction direction) {
    static std::mutex lock;
    static std::map<std::pair<std::ptrdiff_t, fft::Direction>, fft::Plan<double>> plans;
    const std::lock_guard<std::mutex> guard(lock);
    return plans.try_emplace({length, direction}, length, direction).first->second;
}

Tone strongest_tone(const std::vector<cdouble>& signal, double limit) {
    Tone out;
    const auto n = static_cast<std::ptrdiff_t>(signal.size());
    const double power = signal_power(signal.data(), n);
    if (n == 0 || !(power > 0.0)) return out;
    const std::ptrdiff_t factor =
        std::clamp<std::ptrdiff_t>(std::min(n / longest_tone, static_cast<std::ptrdiff_t>(0.25 * pi / limit)), 1, n);
    const std::vector<cdouble> fewer = factor > 1 ? averaged(signal, factor) : std::vector<cdouble>{};
    const std::vector<cdouble>& z = factor > 1 ? fewer : signal;

    const double cell = two_pi / static_cast<double>(n);
    double slope = limit > 2.0 * cell ? periodogram_peak(z, limit * static_cast<double>(factor)) : 0.0;
    const double middle = 0.5 * static_cast<double>(z.size() - 1);
    for (int i = 0; i < 4; ++i) {
        const double step = newton_step(z, slope, middle);
        slope += step;
        if (std::abs(step) < settled / static_cast<double>(z.size())) break;
    }

    out.slope = std::clamp(slope / static_cast<double>(factor), -limit - cell, limit + cell);
    out.sum = tone_sum(signal.data(), n, out.slope, 0.5 * static_cast<double>(n - 1));
    out.coherence = std::norm(out.sum) / (static_cast<double>(n) * power);
    return out;
}

std::vector<cdouble> rotation_of(const std::vector<double>& phase) {
    std::vector<cdouble> out(phase.size());
    for (std::size_t k = 0; k < phase.size(); ++k) out[k] = std::polar(1.0, -phase[k]);
    return out;
}

std::vector<cdouble> whitened_line(const Apertures& apertures, std::ptrdiff_t n, const std::vector<cdouble>& rotation, double slope) {
    const std::ptrdiff_t start = apertures.start[at(n)];
    std::vector<cdouble> out(at(apertures.count[at(n)]));
    if (out.empty()) return out;
    whiten(&apertures.lines(n, 0), &apertures.weight(n, 0), rotation.empty() ? nullptr : rotation.data() + start, apertures.count[at(n)],
           slope, static_cast<double>(start - apertures.points[at(n)].azimuth), out.data());
    return out;
}

double slope_of(const Apertures& apertures, std::ptrdiff_t n, double pixels) {
    return std::min(two_pi * apertures.fm_rate[at(n)] * pixels, pi);
}

std::vector<double> imaged_before(const Apertures& apertures, const Execution& execution) {
    std::vector<double> out(at(apertures.size()));
    parallel_for(execution, "find peaks", apertures.size(), [&](std::int64_t n) {
        out[at(n)] =
            apertures.shift(n, strongest_tone(whitened_line(apertures, n, {}, 0.0), slope_of(apertures, n, apertures.window)).slope);
    });
    return out;
}

void unwrap(std::vector<double>& phase, std::ptrdiff_t begin, std::ptrdiff_t end) {
    for (std::ptrdiff_t k = begin + 1; k < end; ++k) {
        const double difference = phase[at(k)] - phase[at(k - 1)];
        phase[at(k)] = phase[at(k - 1)] + difference - two_pi * std::nearbyint(difference / two_pi);
    }
}

std::vector<SegmentSpan> segment_spans(const Apertures& apertures, const std::vector<int>& segment, int segments) {
    std::vector<SegmentSpan> out(static_cast<std::size_t>(segments));
    std::vector<bool> seen(out.size(), false);
    for (std::ptrdiff_t n = 0; n < apertures.size(); ++n) {
        if (segment[at(n)] < 0) continue;
        const auto s = static_cast<std::size_t>(segment[at(n)]);
        const std::ptrdiff_t begin = apertures.start[at(n)];
        const std::ptrdiff_t end = begin + apertures.count[at(n)];
        out[s].covered_begin = seen[s] ? std::min(out[s].covered_begin, begin) : begin;
        out[s].covered_end = seen[s] ? std::max(out[s].covered_end, end) : end;
        seen[s] = true;
    }
    // Segments are in order of azimuth; neighbours that overlap by less than a seam needs meet in the middle of what both cover.
    for (std::size_t s = 0; s < out.size(); ++s) {
        out[s].begin = s == 0 ? 0 : out[s - 1].end;
        out[s].end = s + 1 == out.size() ? apertures.n_azimuth : (out[s].covered_end + out[s + 1].covered_begin) / 2;
        out[s].end = std::clamp(out[s].end, out[s].begin, apertures.n_azimuth);
        out[s].covered_begin = std::clamp(out[s].covered_begin, out[s].begin, out[s].end);
        out[s].covered_end = std::clamp(out[s].covered_end, out[s].covered_begin, out[s].end);
    }
    return out;
}

std::vector<double> coverage_of(const Apertures& apertures) {
    std::vector<double> out(at(apertures.n_azimuth), 0.0);
    for (std::ptrdiff_t n = 0; n < apertures.size(); ++n)
        for (std::ptrdiff_t k = 0; k < apertures.count[at(n)]; ++k) out[at(apertures.start[at(n)] + k)] += 1.0;
    return out;
}

}  // namespace detail
}  // namespace sarfocus::autofocus
