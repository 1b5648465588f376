#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include <sarfocus/core/array.hpp>
#include <sarfocus/core/constants.hpp>
#include <sarfocus/fft/plan.hpp>

#include "strip_lines.hpp"
#include "tone_sums.hpp"

namespace sarfocus::autofocus::detail {
namespace {

using Lines = std::vector<std::vector<cdouble>>;

constexpr int sweeps = 30;
constexpr double noise_floor = 0.02;  // of a line's signal: no line is believed to be cleaner, because measured points are not ideal

// sum over the overlap of y_first conj y_second, as a list for either point.
struct Link {
    std::ptrdiff_t other = 0;
    cdouble product;
};
using Links = std::vector<std::vector<Link>>;

cdouble product_of(const Apertures& a, const Lines& lines, std::ptrdiff_t i, std::ptrdiff_t j) {
    const std::ptrdiff_t begin = std::max(a.start[at(i)], a.start[at(j)]);
    const std::ptrdiff_t end = std::min(a.start[at(i)] + a.count[at(i)], a.start[at(j)] + a.count[at(j)]);
    if (end <= begin) return {};
    const std::ptrdiff_t ki = begin - a.start[at(i)];
    const std::ptrdiff_t kj = begin - a.start[at(j)];
    return weighted_product(lines[at(i)].data() + ki, &a.weight(i, ki), lines[at(j)].data() + kj, &a.weight(j, kj), end - begin);
}

Links links_of(const Apertures& a, const Stitching& stitching, const Lines& lines, const std::vector<bool>& use,
               const Execution& execution) {
    std::vector<cdouble> products(stitching.seams.size());
    const auto used = [&](const Seam& seam) { return seam.weight > 0.0 && use[at(seam.first)] && use[at(seam.second)]; };
    parallel_for(
        execution, "align", static_cast<std::int64_t>(products.size()),
        [&](std::int64_t s) {
            const Seam& seam = stitching.seams[at(s)];
            if (used(seam)) products[at(s)] = product_of(a, lines, seam.first, seam.second);
        },
        8);
    Links out(at(a.size()));
    for (std::size_t s = 0; s < products.size(); ++s) {
        const Seam& seam = stitching.seams[s];
        if (!used(seam)) continue;
        out[at(seam.first)].push_back({seam.second, products[s]});
        out[at(seam.second)].push_back({seam.first, std::conj(products[s])});
    }
    return out;
}

cdouble pull(const std::vector<Link>& links, const std::vector<cdouble>& constant) {
    cdouble sum{};
    for (const Link& link : links) sum += link.product * constant[at(link.other)];
    return sum;
}

// Unit phasors v_n with y_i conj y_j like v_i conj v_j: grown from the best connected point of every segment to whatever is pulled
// hardest, then swept until they agree.
std::vector<cdouble> constants_of(const Links& links, const std::vector<int>& segment, const std::vector<bool>& use) {
    const std::size_t n = links.size();
    std::vector<cdouble> out(n);
    std::vector<double> strength(n, 0.0);
    for (std::size_t i = 0; i < n; ++i)
        for (const Link& link : links[i]) strength[i] += std::abs(link.product);
    std::map<int, std::size_t> seed;
    for (std::size_t i = 0; i < n; ++i)
        if (use[i] && (seed.count(segment[i]) == 0 || strength[i] > strength[seed[segment[i]]])) seed[segment[i]] = i;
    for (const auto& [s, i] : seed) out[i] = 1.0;
    std::vector<cdouble> pulls(n);
    for (std::size_t i = 0; i < n; ++i) pulls[i] = pull(links[i], out);
    for (;;) {
        std::size_t next = n;
        for (std::size_t i = 0; i < n; ++i)
            if (use[i] && out[i] == cdouble{} && std::abs(pulls[i]) > 0.0 && (next == n || std::abs(pulls[i]) > std::abs(pulls[next])))
                next = i;
        if (next == n) break;
        out[next] = pulls[next] / std::abs(pulls[next]);
        for (const Link& link : links[next]) pulls[at(link.other)] += std::conj(link.product) * out[next];
    }
    for (int sweep = 0; sweep < sweeps; ++sweep)
        for (std::size_t i = 0; i < n; ++i) {
            if (!use[i]) continue;
            const cdouble p = pull(links[i], out);
            if (std::abs(p) > 0.0) out[i] = p / std::abs(p);
        }
    return out;
}

// Keeps the tones of a line within +-limit cycles a sample, rounded off over the outer quarter.
void low_pass(std::vector<cdouble>& line, double limit) {
    const auto n = static_cast<std::ptrdiff_t>(line.size());
    const std::ptrdiff_t length = plan_length(n + n / 8);
    Array<cdouble, 1> spectrum({length});
    std::copy(line.begin(), line.end(), spectrum.data());
    kept_plan(length, fft::Direction::forward).execute(spectrum.data());
    for (std::ptrdiff_t f = 0; f < length; ++f) {
        const double cycles = static_cast<double>(std::min(f, length - f)) / static_cast<double>(length);
        const double x = std::clamp(4.0 * (cycles / limit - 0.75), 0.0, 1.0);
        spectrum(f) *= (0.5 + 0.5 * std::cos(pi * x)) / static_cast<double>(length);
    }
    kept_plan(length, fft::Direction::inverse).execute(spectrum.data());
    std::copy_n(spectrum.data(), n, line.begin());
}

// Amplitude and noise of a whitened line that is a constant times the root of the weights.
struct Fit {
    cdouble amplitude;
    double noise = 0.0;
};

Fit fit(const Apertures& a, std::ptrdiff_t n, const std::vector<cdouble>& line) {
    cdouble sum{};
    double weights = 0.0;
    for (std::size_t k = 0; k < line.size(); ++k) {
        const auto w = static_cast<double>(a.weight(n, static_cast<std::ptrdiff_t>(k)));
        sum += std::sqrt(w) * line[k];
        weights += w;
    }
    Fit out;
    out.amplitude = weights > 0.0 ? sum / weights : cdouble{};
    for (std::size_t k = 0; k < line.size(); ++k)
        out.noise += std::norm(line[k] - out.amplitude * std::sqrt(static_cast<double>(a.weight(n, static_cast<std::ptrdiff_t>(k)))));
    out.noise /= static_cast<double>(line.size());
    return out;
}

// Adds weight * conj(gain) * line to the sum over points, each in place. In the order of the points, so that bits do not depend on threads.
void add_line(const Apertures& a, std::ptrdiff_t n, const std::vector<cdouble>& line, const cdouble& gain, std::vector<cdouble>& sum) {
    if (line.empty()) return;
    add_weighted(line.data(), &a.weight(n, 0), static_cast<std::ptrdiff_t>(line.size()), std::conj(gain), sum.data() + a.start[at(n)]);
}

void add_argument(const std::vector<cdouble>& sum, CoherentPhase& out) {
    std::vector<double> change(sum.size(), 0.0);
    std::ptrdiff_t begin = 0;
    const auto n = static_cast<std::ptrdiff_t>(sum.size());
    while (begin < n) {
        while (begin < n && sum[at(begin)] == cdouble{}) ++begin;
        std::ptrdiff_t end = begin;
        while (end < n && sum[at(end)] != cdouble{}) {
            change[at(end)] = std::arg(sum[at(end)]);
            ++end;
        }
        unwrap(change, begin, end);
        begin = end;
    }
    for (std::size_t k = 0; k < sum.size(); ++k) {
        out.phase[k] += change[k];
        out.reached[k] = sum[k] != cdouble{};
    }
}

// One round of maximum likelihood within a window of +-pixels [methods 3].
void improve(const Apertures& a, const std::vector<bool>& use, double pixels, bool first, CoherentPhase& out, const Execution& execution) {
    const std::vector<cdouble> rotation = rotation_of(out.phase);
    Lines lines(at(a.size()));
    std::vector<cdouble> gain(at(a.size()));
    parallel_for(execution, "refine", a.size(), [&](std::int64_t n) {
        if (!use[at(n)]) return;
        lines[at(n)] = whitened_line(a, n, rotation, out.slope[at(n)]);
        const double cell = two_pi / static_cast<double>(a.count[at(n)]);
        const double limit = first ? slope_of(a, n, pixels) : 2.0 * cell;
        const double step = strongest_tone(lines[at(n)], limit).slope;
        out.slope[at(n)] += step;
        turn_signal(lines[at(n)].data(), a.count[at(n)], step, static_cast<double>(a.start[at(n)] - a.points[at(n)].azimuth));
        low_pass(lines[at(n)], pixels * a.fm_rate[at(n)]);
        const Fit f = fit(a, n, lines[at(n)]);
        gain[at(n)] = f.amplitude / std::max({f.noise, noise_floor * std::norm(f.amplitude), 1e-300});
    });
    std::vector<cdouble> sum(out.phase.size());
    for (std::ptrdiff_t n = 0; n < a.size(); ++n)
        if (use[at(n)]) add_line(a, n, lines[at(n)], gain[at(n)], sum);
    add_argument(sum, out);
}

}  // namespace

CoherentPhase coherent_phase(const Apertures& apertures, const Stitching& stitching, const std::vector<bool>& use,
                             const std::vector<double>& windows, int rounds, const Execution& execution) {
    CoherentPhase out;
    out.phase.assign(at(apertures.n_azimuth), 0.0);
    out.reached.assign(at(apertures.n_azimuth), false);
    out.slope = stitching.slope;
    Lines lines(at(apertures.size()));
    parallel_for(execution, "align", apertures.size(), [&](std::int64_t n) {
        if (!use[at(n)]) return;
        // About sample 0 of the strip, as the slopes of the seams are.
        std::vector<cdouble> line = whitened_line(apertures, n, {}, 0.0);
        const double power = signal_power(line.data(), apertures.count[at(n)]);
        const double scale = power > 0.0 ? std::sqrt(static_cast<double>(line.size()) / power) : 0.0;
        turn_signal(line.data(), apertures.count[at(n)], out.slope[at(n)], static_cast<double>(apertures.start[at(n)]));
        for (cdouble& z : line) z *= scale;
        lines[at(n)] = std::move(line);
    });
    const std::vector<cdouble> constant = constants_of(links_of(apertures, stitching, lines, use, execution), stitching.segment, use);
    std::vector<cdouble> sum(out.phase.size());
    for (std::ptrdiff_t n = 0; n < apertures.size(); ++n)
        if (use[at(n)]) add_line(apertures, n, lines[at(n)], constant[at(n)], sum);
    add_argument(sum, out);
    for (const double share : windows)
        for (int round = 0; round < rounds; ++round) improve(apertures, use, share * apertures.window, round == 0, out, execution);
    return out;
}

}  // namespace sarfocus::autofocus::detail
