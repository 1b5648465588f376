#pragma once

#include <bit>
#include <cstdint>
#include <numbers>

namespace sarfocus {

/// ln x of a normal number > 0, 1e-12: exponent and the series of artanh((m - 1) / (m + 1)) for m in [sqrt(1/2), sqrt(2)). Finite for 0.
/// No branches and no calls: loops over it vectorise.
inline double plain_logarithm(double x) {
    constexpr std::uint64_t half = 0x3fe6a09e667f3bcdULL;  // bits of sqrt(1/2)
    const std::uint64_t shifted = std::bit_cast<std::uint64_t>(x) - half;
    // The exponent as a double without a conversion: its bits below those of 2^52, less 2^52 and the bias.
    const std::uint64_t exponent_bits = ((shifted + (1023ULL << 52)) >> 52) | 0x4330000000000000ULL;
    const double exponent = std::bit_cast<double>(exponent_bits) - (4503599627370496.0 + 1023.0);
    const double m = std::bit_cast<double>((shifted & 0x000fffffffffffffULL) + half);
    const double s = (m - 1.0) / (m + 1.0);
    const double u = s * s;
    const double series =
        ((((((u / 15.0 + 1.0 / 13.0) * u + 1.0 / 11.0) * u + 1.0 / 9.0) * u + 1.0 / 7.0) * u + 1.0 / 5.0) * u + 1.0 / 3.0) * u + 1.0;
    return exponent * std::numbers::ln2 + 2.0 * s * series;
}

}  // namespace sarfocus
