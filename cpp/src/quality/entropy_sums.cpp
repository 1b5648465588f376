#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>

#include <sarfocus/core/multiversion.hpp>
#include <sarfocus/quality/image_measures.hpp>

namespace sarfocus::quality {
namespace {

constexpr std::ptrdiff_t lanes = 8;

// ln x of a normal number > 0, 1e-12: exponent and the series of artanh((m - 1) / (m + 1)) for m in [sqrt(1/2), sqrt(2)). Finite for 0. No
// branches and no calls: loops over it vectorise.
inline double logarithm(double x) {
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

}  // namespace

double EntropySums::entropy() const {
    if (!(power > 0.0 && std::isfinite(power))) return std::numeric_limits<double>::quiet_NaN();
    return std::max(0.0, std::log(power) - weighted / power);
}

SARFOCUS_MULTIVERSION EntropySums entropy_sums(const cfloat* samples, std::ptrdiff_t n) {
    std::array<double, lanes> power{};
    std::array<double, lanes> weighted{};
    const auto* x = reinterpret_cast<const float*>(samples);
    const std::ptrdiff_t whole = n / lanes * lanes;
    for (std::ptrdiff_t i = 0; i < whole; i += lanes)
        for (std::ptrdiff_t l = 0; l < lanes; ++l) {
            const auto re = static_cast<double>(x[2 * (i + l)]);
            const auto im = static_cast<double>(x[2 * (i + l) + 1]);
            const double intensity = re * re + im * im;
            power[static_cast<std::size_t>(l)] += intensity;
            weighted[static_cast<std::size_t>(l)] += intensity * logarithm(intensity);
        }
    EntropySums out;
    for (std::size_t l = 0; l < lanes; ++l) out += {power[l], weighted[l]};
    for (std::ptrdiff_t i = whole; i < n; ++i) {
        const auto re = static_cast<double>(x[2 * i]);
        const auto im = static_cast<double>(x[2 * i + 1]);
        const double intensity = re * re + im * im;
        out += {intensity, intensity * logarithm(intensity)};
    }
    return out;
}

}  // namespace sarfocus::quality
