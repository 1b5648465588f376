#include "range_profile_table.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <sarfocus/core/constants.hpp>

namespace sarfocus::focus::detail {
namespace {

constexpr std::ptrdiff_t guard_samples = 32;

// Coefficients of x^0 … x^3 in the cubic Legendre approximation of exp(j w x) on |x| <= 1/2.
std::array<cdouble, 4> cubic_of_frequency(double w) {
    const double half = 0.5 * w;
    std::array<cdouble, 4> legendre{};
    const std::array<cdouble, 4> power_of_j{cdouble{1, 0}, cdouble{0, 1}, cdouble{-1, 0}, cdouble{0, -1}};
    for (unsigned d = 0; d < 4; ++d) {
        const double bessel = std::sph_bessel(d, std::abs(half));
        legendre[d] = (2.0 * d + 1.0) * power_of_j[d] * ((d % 2 == 1 && half < 0.0) ? -bessel : bessel);
    }
    // P_0 = 1, P_1 = u, P_2 = (3 u^2 - 1) / 2, P_3 = (5 u^3 - 3 u) / 2 with u = 2 x.
    return {legendre[0] - 0.5 * legendre[2], 2.0 * (legendre[1] - 1.5 * legendre[3]), 6.0 * legendre[2], 20.0 * legendre[3]};
}

}  // namespace

RangeProfileTable::RangeProfileTable(std::ptrdiff_t n_range)
    : n_range_(n_range),
      n_padded_(fft::good_size(n_range + guard_samples)),
      forward_(n_padded_, fft::Direction::forward),
      inverse_(upsample * n_padded_, fft::Direction::inverse),
      adjoint_forward_(upsample * n_padded_, fft::Direction::forward),
      adjoint_inverse_(n_padded_, fft::Direction::inverse),
      weights_(static_cast<std::size_t>((degree + 1) * n_padded_)) {
    for (std::ptrdiff_t k = 0; k < n_padded_; ++k) {
        const std::ptrdiff_t signed_k = 2 * k < n_padded_ ? k : k - n_padded_;
        const double w = two_pi * static_cast<double>(signed_k) / static_cast<double>(upsample * n_padded_);  // rad a bin
        const auto cubic = cubic_of_frequency(w);
        // The Nyquist component of an even length is shared out between both signs.
        const double share = 2 * k == n_padded_ ? 0.5 : 1.0;
        for (std::size_t d = 0; d <= degree; ++d)
            weights_[d * static_cast<std::size_t>(n_padded_) + static_cast<std::size_t>(k)] =
                cfloat(cubic[d] * share / static_cast<double>(n_padded_));
    }
}

RangeProfileTable::Workspace::Workspace(const RangeProfileTable& table)
    : spectrum_({table.n_padded_}), line_({upsample * table.n_padded_}) {}

void RangeProfileTable::build(const ArrayView<const cfloat, 1>& profile, float* table, Workspace& workspace) const {
    cfloat* spectrum = workspace.spectrum_.data();
    cfloat* line = workspace.line_.data();
    for (std::ptrdiff_t i = 0; i < n_range_; ++i) spectrum[i] = profile(i);
    std::fill(spectrum + n_range_, spectrum + n_padded_, cfloat{});
    forward_.execute(spectrum);

    const std::ptrdiff_t positive = (n_padded_ + 1) / 2;  // components 0 … positive - 1, the rest are negative frequencies
    const std::ptrdiff_t n_long = upsample * n_padded_;
    const std::ptrdiff_t n_inner = n_bin() - 2;
    std::fill_n(table, floats_per_bin, 0.0f);
    std::fill_n(table + static_cast<std::ptrdiff_t>(n_bin() - 1) * floats_per_bin, floats_per_bin, 0.0f);
    for (int d = 0; d <= degree; ++d) {
        const cfloat* weight = weights_.data() + d * n_padded_;
        std::fill(line, line + n_long, cfloat{});
        for (std::ptrdiff_t k = 0; k < positive; ++k) line[k] = spectrum[k] * weight[k];
        for (std::ptrdiff_t k = positive; k < n_padded_; ++k) line[n_long - n_padded_ + k] = spectrum[k] * weight[k];
        if (n_padded_ % 2 == 0) line[positive] = spectrum[positive] * std::conj(weight[positive]);
        inverse_.execute(line);
        float* out = table + floats_per_bin + 2 * d;
        for (std::ptrdiff_t b = 0; b < n_inner; ++b) {
            out[b * floats_per_bin] = line[b].real();
            out[b * floats_per_bin + 1] = line[b].imag();
        }
    }
}

void RangeProfileTable::build_adjoint(const float* table, const ArrayView<cfloat, 1>& profile, Workspace& workspace) const {
    cfloat* spectrum = workspace.spectrum_.data();
    cfloat* line = workspace.line_.data();
    const std::ptrdiff_t positive = (n_padded_ + 1) / 2;
    const std::ptrdiff_t n_long = upsample * n_padded_;
    const std::ptrdiff_t n_inner = n_bin() - 2;
    std::fill(spectrum, spectrum + n_padded_, cfloat{});
    for (int d = 0; d <= degree; ++d) {
        const cfloat* weight = weights_.data() + d * n_padded_;
        const float* in = table + floats_per_bin + 2 * d;
        for (std::ptrdiff_t b = 0; b < n_inner; ++b) line[b] = {in[b * floats_per_bin], in[b * floats_per_bin + 1]};
        std::fill(line + n_inner, line + n_long, cfloat{});
        adjoint_forward_.execute(line);
        for (std::ptrdiff_t k = 0; k < positive; ++k) spectrum[k] += line[k] * std::conj(weight[k]);
        for (std::ptrdiff_t k = positive; k < n_padded_; ++k) spectrum[k] += line[n_long - n_padded_ + k] * std::conj(weight[k]);
        if (n_padded_ % 2 == 0) spectrum[positive] += line[positive] * weight[positive];
    }
    adjoint_inverse_.execute(spectrum);
    for (std::ptrdiff_t i = 0; i < n_range_; ++i) profile(i) = spectrum[i];
}

}  // namespace sarfocus::focus::detail
