#pragma once

#include <cstddef>

#include <sarfocus/core/array_view.hpp>

#include "line_sums.hpp"

namespace sarfocus::autofocus::detail {

// Sums over the samples k of one signal in double precision, and what makes such signals of the lines of apertures.

/// With x = k - middle, of signal[k] exp(-j slope x).
[[nodiscard]] LineMoments tone_moments(const cdouble* signal, std::ptrdiff_t n, double slope, double middle);
[[nodiscard]] cdouble tone_sum(const cdouble* signal, std::ptrdiff_t n, double slope, double middle);

/// Sum of |signal[k]|^2.
[[nodiscard]] double signal_power(const cdouble* signal, std::ptrdiff_t n);

/// signal[k] *= exp(-j slope (first + k)).
void turn_signal(cdouble* signal, std::ptrdiff_t n, double slope, double first);

/// out[k] = sqrt(weight[k]) line[k] rotation[k] exp(-j slope (first + k)); without a rotation where that is null.
void whiten(const cfloat* line, const float* weight, const cdouble* rotation, std::ptrdiff_t n, double slope, double first, cdouble* out);

/// out[k] = sqrt(a_weight[k] b_weight[k]) a[k] conj(b[k]).
void conjugate_products(const cfloat* a, const float* a_weight, const cfloat* b, const float* b_weight, std::ptrdiff_t n, cdouble* out);

/// Sum of sqrt(a_weight[k] b_weight[k]) a[k] conj(b[k]).
[[nodiscard]] cdouble weighted_product(const cdouble* a, const float* a_weight, const cdouble* b, const float* b_weight, std::ptrdiff_t n);

/// sum[k] += gain sqrt(weight[k]) signal[k].
void add_weighted(const cdouble* signal, const float* weight, std::ptrdiff_t n, cdouble gain, cdouble* sum);

}  // namespace sarfocus::autofocus::detail
