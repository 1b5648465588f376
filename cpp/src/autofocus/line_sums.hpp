#pragma once

#include <cstddef>

#include <sarfocus/core/array_view.hpp>
#include <sarfocus/core/multiversion.hpp>

namespace sarfocus::autofocus::detail {

// Sums over the pulses k of one line, with x = k - middle and z = line[k] conj(rotation[k]) exp(-j slope x).

struct LineMoments {
    cdouble zeroth;  ///< sum of z
    cdouble first;   ///< sum of x z
    cdouble second;  ///< sum of x^2 z
};

/// Of the samples of one line.
struct LinePower {
    double sum = 0.0;            ///< of |line[k]|^2
    std::ptrdiff_t samples = 0;  ///< other than zero
};
[[nodiscard]] LinePower line_power(const cfloat* line, std::ptrdiff_t n);

struct LineIntensity {
    double sum = 0.0;     ///< of |line[k]|^2
    double square = 0.0;  ///< of |line[k]|^4
};
[[nodiscard]] LineIntensity line_intensity(const cfloat* line, std::ptrdiff_t n);

[[nodiscard]] LineMoments line_moments(const cfloat* line, const cdouble* rotation, std::ptrdiff_t n, double slope, double middle);
/// The zeroth alone, with vectors of so many bytes; of other widths than the processor's it is the same, slower.
[[nodiscard]] cdouble line_sum(const cfloat* line, const cdouble* rotation, std::ptrdiff_t n, double slope, double middle,
                               std::ptrdiff_t register_bytes = sarfocus::detail::register_bytes);

/// sum[k] += gain line[k] exp(-j slope (k - middle)) and own[k] += share |line[k]|^2.
void add_line(const cfloat* line, std::ptrdiff_t n, cdouble gain, double slope, double middle, double share, cdouble* sum, double* own);

/// scatter[k] += Im(gain line[k] conj(rotation[k]))^2.
void add_scatter(const cfloat* line, const cdouble* rotation, std::ptrdiff_t n, cdouble gain, double* scatter);

/// Index of the first of the greatest |line[k]|^2.
[[nodiscard]] std::ptrdiff_t strongest_sample(const cfloat* line, std::ptrdiff_t n);

/// out[k] = line[k] exp(j slope (first + k)).
void turn_line(const cfloat* line, std::ptrdiff_t n, double slope, double first, cfloat* out);

}  // namespace sarfocus::autofocus::detail
