#pragma once

#include <cstddef>

#include <sarfocus/core/array_view.hpp>

namespace sarfocus::autofocus::detail {

// Sums over the pulses k of one line, with x = k - middle and z = line[k] conj(rotation[k]) exp(-j slope x).

struct LineMoments {
    cdouble zeroth;  ///< sum of z
    cdouble first;   ///< sum of x z
    cdouble second;  ///< sum of x^2 z
};

[[nodiscard]] LineMoments line_moments(const cfloat* line, const cdouble* rotation, std::ptrdiff_t n, double slope, double middle);
[[nodiscard]] cdouble line_sum(const cfloat* line, const cdouble* rotation, std::ptrdiff_t n, double slope, double middle);

/// sum[k] += gain line[k] exp(-j slope (k - middle)) and own[k] += share |line[k]|^2.
void add_line(const cfloat* line, std::ptrdiff_t n, cdouble gain, double slope, double middle, double share, cdouble* sum, double* own);

}  // namespace sarfocus::autofocus::detail
