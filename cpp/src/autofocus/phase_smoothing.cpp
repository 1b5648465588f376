#include "phase_smoothing.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include <sarfocus/core/array.hpp>
#include <sarfocus/core/constants.hpp>
#include <sarfocus/fft/plan.hpp>

#include "strip_lines.hpp"

namespace sarfocus::autofocus::detail {
namespace {

// exp(-j pi k / 2n) [n].
std::vector<cdouble> quarter_turns(std::ptrdiff_t n) {
    std::vector<cdouble> out;
    for (std::ptrdiff_t k = 0; k < n; ++k) out.push_back(std::polar(1.0, -pi * static_cast<double>(k) / static_cast<double>(2 * n)));
    return out;
}

// Place in the line of the sample that a transform of half the length takes as its i-th: the even ones, then the odd ones backwards.
std::ptrdiff_t place(std::ptrdiff_t i, std::ptrdiff_t n) {
    return 2 * i < n ? 2 * i : 2 * (n - 1 - i) + 1;
}

// Orthonormal DCT-II [n].
std::vector<double> cosines(const std::vector<double>& values) {
    const auto n = static_cast<std::ptrdiff_t>(values.size());
    Array<cdouble, 1> line({n});
    for (std::ptrdiff_t i = 0; i < n; ++i) line(i) = values[at(place(i, n))];
    fft::Plan<double>(n, fft::Direction::forward).execute(line.data());
    const std::vector<cdouble> turn = quarter_turns(n);
    std::vector<double> out;
    for (std::ptrdiff_t k = 0; k < n; ++k)
        out.push_back(times(line(k), turn[at(k)]).real() * std::sqrt((k > 0 ? 2.0 : 1.0) / static_cast<double>(n)));
    return out;
}

// Its inverse.
std::vector<double> from_cosines(const std::vector<double>& coefficients) {
    const auto n = static_cast<std::ptrdiff_t>(coefficients.size());
    const std::vector<cdouble> turn = quarter_turns(n);
    Array<cdouble, 1> line({n});
    for (std::ptrdiff_t k = 0; k < n; ++k)
        line(k) = coefficients[at(k)] * std::sqrt((k > 0 ? 2.0 : 1.0) / static_cast<double>(n)) * std::conj(turn[at(k)]);
    fft::Plan<double>(n, fft::Direction::inverse).execute(line.data());
    std::vector<double> out(coefficients.size());
    for (std::ptrdiff_t i = 0; i < n; ++i) out[at(place(i, n))] = line(i).real();
    return out;
}

}  // namespace

SmoothedPhase smoothed(const std::vector<double>& phase, const std::vector<double>& std) {
    const auto n = static_cast<double>(phase.size());
    double variance = 0.0;
    for (const double s : std) variance += s * s / n;
    SmoothedPhase out{phase, 1.0};
    if (!(std::isfinite(variance) && variance > 0.0)) return out;
    std::vector<double> a = cosines(phase);
    // Error of keeping the first c, less that of keeping none.
    double error = 0.0;
    double least = 0.0;
    std::size_t kept = 0;
    double beyond = 0.0;
    for (std::size_t c = 0; c < a.size(); ++c) {
        error += 2.0 * variance - a[c] * a[c];
        beyond += a[c] * a[c] - variance;
        if (error < least) {
            least = error;
            kept = c + 1;
        }
    }
    for (std::size_t c = 0; c < kept; ++c) beyond -= a[c] * a[c] - variance;
    const double own = static_cast<double>(kept) * variance;
    out.variance_share = std::clamp((own + std::max(beyond, 0.0)) / (n * variance), 1.0 / n, 1.0);
    std::fill(a.begin() + static_cast<std::ptrdiff_t>(kept), a.end(), 0.0);
    if (kept < a.size()) out.phase = from_cosines(a);
    return out;
}

}  // namespace sarfocus::autofocus::detail
