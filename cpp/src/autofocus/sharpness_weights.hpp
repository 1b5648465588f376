#pragma once

#include <cstddef>

#include <sarfocus/core/array_view.hpp>

namespace sarfocus::autofocus::detail {

// With J = scale |x|^2 of every sample. Each returns the sum of J w and, where `multiply`, puts w x in place of x.

/// w = ln J, 2e-7 of the larger of one and the logarithm; 0 of a sample that is zero.
[[nodiscard]] double weigh_by_logarithm(cfloat* line, std::ptrdiff_t n, float scale, bool multiply);
/// w = J.
[[nodiscard]] double weigh_by_intensity(cfloat* line, std::ptrdiff_t n, float scale, bool multiply);

/// sum[k] += a[k] conj(b[k]).
void add_products(const cfloat* a, const cfloat* b, std::ptrdiff_t n, cdouble* sum);

}  // namespace sarfocus::autofocus::detail
