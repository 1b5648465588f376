#pragma once

#include <array>
#include <cmath>
#include <cstddef>

#include <sarfocus/core/array_view.hpp>

namespace sarfocus::focus {

/// Interpolation of a line sampled at twice the rate that its band needs: twelve taps of a sinc under a Kaiser window (beta 9.25), from a
/// table of 256 fractions, linear between them. Largest error of a component within the band: -84 dB.
class SincKernel {
public:
    static constexpr std::ptrdiff_t taps = 12;
    static constexpr std::ptrdiff_t before = taps / 2 - 1;  ///< samples used before the one at or left of the place
    static constexpr std::ptrdiff_t after = taps / 2;       ///< and behind it

    SincKernel();

    /// out[j] = the line at place first + step * ranges[j], j < n, in samples of `line`; `before` samples of it in front of every place
    /// and `after` behind must exist.
    void interpolate(const cfloat* line, double first, double step, const double* ranges, std::ptrdiff_t n, cfloat* out) const;

private:
    static constexpr std::ptrdiff_t fractions = 256;
    using Weights = std::array<float, 2 * static_cast<std::size_t>(taps)>;  // each twice: for real and imaginary part

    std::array<Weights, static_cast<std::size_t>(fractions) + 1> table_{};
};

}  // namespace sarfocus::focus
