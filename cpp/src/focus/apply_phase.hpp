#pragma once

#include <cstddef>

#include <sarfocus/core/array_view.hpp>

namespace sarfocus::focus {

/// samples[k] *= scale * exp(2j pi rate shape[k]), k < n. Error of the phase: 1.5e-7 rad plus that of the double-precision product.
void apply_phase(cfloat* samples, const double* shape, std::ptrdiff_t n, double rate, float scale);

/// factor[k] = scale * exp(2j pi rate shape[k]), k < n. Error as above.
void phase_factors(const double* shape, std::ptrdiff_t n, double rate, float scale, cfloat* factor);

/// line[n - k] = line[k], 0 < k < n / 2.
void mirror(cfloat* line, std::ptrdiff_t n);

/// samples[k] *= factor[k], or its conjugate, k < n.
void multiply(cfloat* samples, const cfloat* factor, std::ptrdiff_t n);
void multiply_conjugate(cfloat* samples, const cfloat* factor, std::ptrdiff_t n);

}  // namespace sarfocus::focus
