#include <sarfocus/autofocus/strip.hpp>

#include <algorithm>
#include <cmath>
#include <string>

#include <sarfocus/core/constants.hpp>
#include <sarfocus/core/error.hpp>

#include "strip_lines.hpp"
#include "tone_sums.hpp"

namespace sarfocus::autofocus {
namespace {

using detail::at;

struct Overlap {
    std::ptrdiff_t begin = 0;
    std::ptrdiff_t end = 0;
    [[nodiscard]] std::ptrdiff_t size() const { return std::max<std::ptrdiff_t>(end - begin, 0); }
};

Overlap overlap_of(const Apertures& a, std::ptrdiff_t i, std::ptrdiff_t j) {
    return {std::max(a.start[at(i)], a.start[at(j)]), std::min(a.start[at(i)] + a.count[at(i)], a.start[at(j)] + a.count[at(j)])};
}

bool long_enough(const Apertures& a, std::ptrdiff_t i, std::ptrdiff_t j, double share) {
    const double shorter = static_cast<double>(std::min(a.count[at(i)], a.count[at(j)]));
    return static_cast<double>(overlap_of(a, i, j).size()) >= std::max(share * shorter, 8.0);
}

// H of [Xie2023, eq. 11] over the overlap, weighted by how strong either point is expected there.
std::vector<cdouble> conjugate_product(const Apertures& a, std::ptrdiff_t i, std::ptrdiff_t j) {
    const Overlap o = overlap_of(a, i, j);
    std::vector<cdouble> out(at(o.size()));
    if (out.empty()) return out;
    const std::ptrdiff_t ki = o.begin - a.start[at(i)];
    const std::ptrdiff_t kj = o.begin - a.start[at(j)];
    detail::conjugate_products(&a.lines(i, ki), &a.weight(i, ki), &a.lines(j, kj), &a.weight(j, kj), o.size(), out.data());
    return out;
}

// Cramer-Rao bound of a tone's frequency at this coherence, noise correlated over `look` samples.
double slope_deviation(double coherence, double n, double look) {
    const double ratio = std::max(coherence, 1e-12) / std::max(1.0 - coherence, 1e-9);
    return std::min(std::sqrt(6.0 * look / (ratio * n * n * n)), pi);
}

Seam seam_of(const Apertures& a, std::ptrdiff_t i, std::ptrdiff_t j, double slope, double coherence) {
    Seam out;
    out.first = i;
    out.second = j;
    out.overlap = overlap_of(a, i, j).size();
    out.slope = slope;
    out.coherence = coherence;
    const double look = std::max(a.samples_per_look(i), a.samples_per_look(j));
    out.slope_std = slope_deviation(coherence, static_cast<double>(out.overlap), look);
    return out;
}

// Up to `count` of the partners, the nearest among them, evenly spread.
std::vector<std::ptrdiff_t> spread(const std::vector<std::ptrdiff_t>& partners, int count) {
    if (static_cast<int>(partners.size()) <= count) return partners;
    std::vector<std::ptrdiff_t> out;
    for (int c = 0; c < count; ++c)
        out.push_back(partners[static_cast<std::size_t>(c) * partners.size() / static_cast<std::size_t>(count)]);
    return out;
}

// Sum of H(k + 1) conj H(k): its argument is the slope of H's phase.
cdouble phase_step(const std::vector<cdouble>& product) {
    cdouble sum{};
    for (std::size_t k = 1; k < product.size(); ++k) sum += detail::times_conjugate(product[k], product[k - 1]);
    return sum;
}

struct Displacement {
    double first = 0.0;  // pixels
    double second = 0.0;
    double residual = 0.0;  // r of [Xie2023, eq. 14], rad a sample
};

// The smallest |r| over displacements first + i step, second + j step, |i|, |j| up to `half`; of equals the smallest displacement.
Displacement traverse(const cdouble& step_sum, double f1, double f2, Displacement centre, int half, double step) {
    Displacement best = centre;
    double best_cost = 1e300;
    for (int i = -half; i < half; ++i)
        for (int j = -half; j < half; ++j) {
            const double u1 = centre.first + step * i;
            const double u2 = centre.second + step * j;
            const double r = std::arg(step_sum * std::polar(1.0, -two_pi * (f1 * u1 - f2 * u2)));
            const double cost = std::abs(r) + 1e-9 * f1 * (u1 * u1 + u2 * u2);
            if (cost < best_cost) {
                best_cost = cost;
                best = {u1, u2, r};
            }
        }
    return best;
}

double coherence_after(const std::vector<cdouble>& product, double slope) {
    detail::Ramp ramp(-slope, 0.0);
    cdouble sum{};
    double power = 0.0;
    for (const cdouble& h : product) {
        sum += h * ramp.next();
        power += std::norm(h);
    }
    return power > 0.0 ? std::norm(sum) / (static_cast<double>(product.size()) * power) : 0.0;
}

void require_pair(const Apertures& a, std::ptrdiff_t i, std::ptrdiff_t j) {
    for (const std::ptrdiff_t n : {i, j})
        if (n < 0 || n >= a.size())
            throw ValueError("first, second", "points from 0 to " + std::to_string(a.size() - 1), std::to_string(n));
    if (overlap_of(a, i, j).size() < 2)
        throw ValueError("first, second", "two apertures that overlap", std::to_string(i) + ", " + std::to_string(j));
}

}  // namespace

void SlopeMatchOptions::validate() const {
    if (pairs_per_point < 1) throw ValueError("pairs_per_point", "at least 1", std::to_string(pairs_per_point));
    if (!(minimum_overlap > 0.0 && minimum_overlap < 1.0))
        throw ValueError("minimum_overlap", "a share between 0 and 1", number_text(minimum_overlap));
    (void)resolve_threads(execution.threads);
}

void SearchMatchOptions::validate() const {
    if (width < 2 || width % 2 != 0) throw ValueError("width", "an even number of pixels", std::to_string(width));
    if (largest_width < width) throw ValueError("largest_width", "at least the width", std::to_string(largest_width));
    if (!(minimum_overlap > 0.0 && minimum_overlap < 1.0))
        throw ValueError("minimum_overlap", "a share between 0 and 1", number_text(minimum_overlap));
    (void)resolve_threads(execution.threads);
}

std::vector<Seam> match_slope(const Apertures& apertures, const SlopeMatchOptions& options) {
    options.validate();
    std::vector<std::vector<Seam>> of_point(at(apertures.size()));
    parallel_for(options.execution, "match", apertures.size(), [&](std::int64_t i) {
        std::vector<std::ptrdiff_t> partners;
        for (std::ptrdiff_t j = i + 1; j < apertures.size(); ++j)
            if (long_enough(apertures, i, j, options.minimum_overlap)) partners.push_back(j);
        for (const std::ptrdiff_t j : spread(partners, options.pairs_per_point)) {
            const double limit = detail::slope_of(apertures, i, apertures.window) + detail::slope_of(apertures, j, apertures.window);
            const detail::Tone tone = detail::strongest_tone(conjugate_product(apertures, i, j), std::min(limit, pi));
            of_point[at(i)].push_back(seam_of(apertures, i, j, tone.slope, tone.coherence));
        }
    });
    std::vector<Seam> out;
    for (const auto& seams : of_point) out.insert(out.end(), seams.begin(), seams.end());
    return out;
}

Array<double, 2> search_matrix(const Apertures& apertures, std::ptrdiff_t first, std::ptrdiff_t second, int width) {
    require_pair(apertures, first, second);
    if (width < 2 || width % 2 != 0) throw ValueError("width", "an even number of pixels", std::to_string(width));
    const cdouble step = phase_step(conjugate_product(apertures, first, second));
    Array<double, 2> out({width, width});
    const int half = width / 2;
    for (int i = 0; i < width; ++i)
        for (int j = 0; j < width; ++j) {
            const double turn = apertures.fm_rate[at(first)] * (i - half) - apertures.fm_rate[at(second)] * (j - half);
            out(i, j) = std::abs(std::arg(step * std::polar(1.0, -two_pi * turn)));
        }
    return out;
}

std::vector<Seam> match_search(const Apertures& apertures, const SearchMatchOptions& options) {
    options.validate();
    std::vector<Seam> out;
    for (std::ptrdiff_t i = 0; i + 1 < apertures.size(); ++i)
        if (long_enough(apertures, i, i + 1, options.minimum_overlap)) out.push_back(seam_of(apertures, i, i + 1, 0.0, 0.0));
    parallel_for(options.execution, "match", static_cast<std::int64_t>(out.size()), [&](std::int64_t s) {
        Seam& seam = out[at(s)];
        const double f1 = apertures.fm_rate[at(seam.first)];
        const double f2 = apertures.fm_rate[at(seam.second)];
        const std::vector<cdouble> product = conjugate_product(apertures, seam.first, seam.second);
        const cdouble step = phase_step(product);
        const double satisfied = 2.0 * two_pi * std::max(f1, f2);  // [Xie2023, eq. 15], rad a sample
        int width = options.width;
        Displacement found = traverse(step, f1, f2, {}, width / 2, 1.0);
        while (std::abs(found.residual) > satisfied && 2 * width <= options.largest_width) {
            width *= 2;
            found = traverse(step, f1, f2, {}, width / 2, 1.0);
        }
        if (std::abs(found.residual) > satisfied) return;  // coherence 0: not to be used
        if (options.interpolation) found = traverse(step, f1, f2, found, 8, 0.125);
        const double displaced = two_pi * (f1 * found.first - f2 * found.second);
        const double slope = displaced + (options.correction ? found.residual : 0.0);
        seam = seam_of(apertures, seam.first, seam.second, slope, coherence_after(product, displaced + found.residual));
    });
    return out;
}

}  // namespace sarfocus::autofocus
