#include "focus/sinc_kernel.hpp"

#include <algorithm>

#include <sarfocus/core/constants.hpp>
#include <sarfocus/core/multiversion.hpp>

namespace sarfocus::focus {
namespace {

constexpr double beta = 9.25;  // the least error at twelve taps over the inner half of the band
constexpr std::size_t lanes = 8;

double weight(double x) {
    const double half = 0.5 * static_cast<double>(SincKernel::taps);
    const double window =
        std::cyl_bessel_i(0.0, beta * std::sqrt(std::max(0.0, 1.0 - x * x / (half * half)))) / std::cyl_bessel_i(0.0, beta);
    return x == 0.0 ? 1.0 : window * std::sin(pi * x) / (pi * x);
}

// Sum over taps of (low + part * (high - low)) * samples; 2 * taps floats each.
inline cfloat weighted_sum(const float* samples, const float* low, const float* high, float part) {
    float sum[lanes] = {};
    for (std::size_t t = 0; t < 2 * static_cast<std::size_t>(SincKernel::taps); t += lanes)
        for (std::size_t l = 0; l < lanes; ++l) sum[l] += samples[t + l] * (low[t + l] + part * (high[t + l] - low[t + l]));
    return {(sum[0] + sum[4]) + (sum[2] + sum[6]), (sum[1] + sum[5]) + (sum[3] + sum[7])};
}

SARFOCUS_MULTIVERSION void interpolate_line(const float* line, const float* table, std::ptrdiff_t fractions, double first, double step,
                                            const double* ranges, std::ptrdiff_t n, cfloat* out) {
    constexpr std::ptrdiff_t floats = 2 * SincKernel::taps;
    for (std::ptrdiff_t j = 0; j < n; ++j) {
        const double place = first + step * ranges[j];
        const double whole = std::floor(place);
        const double entry = (place - whole) * static_cast<double>(fractions);
        const auto index = static_cast<std::ptrdiff_t>(entry);
        const float* low = table + index * floats;
        out[j] = weighted_sum(line + 2 * (static_cast<std::ptrdiff_t>(whole) - SincKernel::before), low, low + floats,
                              static_cast<float>(entry - static_cast<double>(index)));
    }
}

}  // namespace

SincKernel::SincKernel() {
    for (std::size_t f = 0; f <= static_cast<std::size_t>(fractions); ++f)
        for (std::ptrdiff_t t = 0; t < taps; ++t) {
            const double x = static_cast<double>(f) / static_cast<double>(fractions) - static_cast<double>(t - before);
            const auto at = 2 * static_cast<std::size_t>(t);
            table_[f][at] = table_[f][at + 1] = static_cast<float>(weight(x));
        }
}

void SincKernel::interpolate(const cfloat* line, double first, double step, const double* ranges, std::ptrdiff_t n, cfloat* out) const {
    interpolate_line(reinterpret_cast<const float*>(line), table_.front().data(), fractions, first, step, ranges, n, out);
}

}  // namespace sarfocus::focus
