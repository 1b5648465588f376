#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>

#include <sarfocus/core/intensities.hpp>
#include <sarfocus/core/logarithm.hpp>
#include <sarfocus/core/multiversion.hpp>
#include <sarfocus/quality/image_measures.hpp>

namespace sarfocus::quality {
namespace {

constexpr std::ptrdiff_t lanes = 8;          // double precision
constexpr std::ptrdiff_t narrow_lanes = 16;  // single

// Of the narrow lanes, half a vector of 512 bits: wider ones than the processor has would be taken apart value by value.
using Floats = sarfocus::detail::EightFloats;
using Integers = std::int32_t __attribute__((vector_size(2 * narrow_lanes)));
using Bits = std::uint32_t __attribute__((vector_size(2 * narrow_lanes)));

// Exponent and mantissa of x >= 0 in [sqrt(1/2), sqrt(2)); finite for 0.
inline __attribute__((always_inline)) void split(const Floats& x, Floats& exponent, Floats& mantissa) {
    constexpr std::uint32_t half = 0x3f3504f3U;  // bits of sqrt(1/2)
    const Bits shifted = reinterpret_cast<Bits>(x) - half;
    exponent = __builtin_convertvector(reinterpret_cast<Integers>(shifted) >> 23, Floats);
    mantissa = reinterpret_cast<Floats>((shifted & 0x007fffffU) + half);
}

// ln m of such a mantissa, 3e-8: the series to the second order and a polynomial for the rest, fitted by least squares at Chebyshev's
// points.
inline __attribute__((always_inline)) void logarithm_of_mantissa(const Floats& m, Floats& out) {
    const Floats x = m - 1.0F;
    const Floats high = ((-7.459099282e-02F * x + 1.273671092e-01F) * x - 1.321968368e-01F) * x + 1.420963546e-01F;
    const Floats low = ((high * x - 1.661746767e-01F) * x + 2.000063153e-01F) * x - 2.500099843e-01F;
    const Floats p = low * x + 3.333334216e-01F;
    out = x + x * x * (x * p - 0.5F);
}

// Any samples, in double precision.
SARFOCUS_MULTIVERSION EntropySums wide_sums(const cfloat* samples, std::ptrdiff_t n) {
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
            weighted[static_cast<std::size_t>(l)] += intensity * plain_logarithm(intensity);
        }
    EntropySums out;
    for (std::size_t l = 0; l < lanes; ++l) out += {power[l], weighted[l]};
    for (std::ptrdiff_t i = whole; i < n; ++i) {
        const auto re = static_cast<double>(x[2 * i]);
        const auto im = static_cast<double>(x[2 * i + 1]);
        const double intensity = re * re + im * im;
        out += {intensity, intensity * plain_logarithm(intensity)};
    }
    return out;
}

// In single precision over runs of sixteen samples a lane, which are added up in double. Exponents apart from mantissas: large ones would
// take digits from the small.
SARFOCUS_MULTIVERSION EntropySums narrow_sums(const cfloat* samples, std::ptrdiff_t n) {
    constexpr std::ptrdiff_t run = 16 * narrow_lanes;
    const auto* x = reinterpret_cast<const float*>(samples);
    std::array<double, narrow_lanes> power{};
    std::array<double, narrow_lanes> doublings{};
    std::array<double, narrow_lanes> rest{};
    const std::ptrdiff_t whole = n / narrow_lanes * narrow_lanes;
    for (std::ptrdiff_t begin = 0; begin < whole; begin += run) {
        Floats p[2] = {};
        Floats d[2] = {};
        Floats r[2] = {};
        for (std::ptrdiff_t i = begin; i < std::min(begin + run, whole); i += narrow_lanes)
            for (std::ptrdiff_t v = 0; v < 2; ++v) {
                Floats intensity;
                sarfocus::detail::eight_intensities(x + 2 * i + v * narrow_lanes, intensity);
                Floats exponent;
                Floats mantissa;
                split(intensity, exponent, mantissa);
                p[v] += intensity;
                d[v] += intensity * exponent;
                Floats logarithm;
                logarithm_of_mantissa(mantissa, logarithm);
                r[v] += intensity * logarithm;
            }
        for (std::ptrdiff_t l = 0; l < narrow_lanes; ++l) {
            const auto k = static_cast<std::size_t>(l / 8 * 8 + sarfocus::detail::sample_of_lane[l % 8]);
            power[k] += static_cast<double>(p[l / 8][l % 8]);
            doublings[k] += static_cast<double>(d[l / 8][l % 8]);
            rest[k] += static_cast<double>(r[l / 8][l % 8]);
        }
    }
    EntropySums out;
    for (std::size_t l = 0; l < power.size(); ++l) out += {power[l], doublings[l] * std::numbers::ln2 + rest[l]};
    if (whole < n) out += wide_sums(samples + whole, n - whole);
    return out;
}

}  // namespace

double EntropySums::entropy() const {
    if (!(power > 0.0 && std::isfinite(power))) return std::numeric_limits<double>::quiet_NaN();
    return std::max(0.0, std::log(power) - weighted / power);
}

EntropySums entropy_sums(const cfloat* samples, std::ptrdiff_t n) {
    // Between these neither the intensities that count nor their sums leave what single precision holds.
    constexpr double least = 1e-24;
    constexpr double most = 1e34;
    const EntropySums out = narrow_sums(samples, n);
    return out.power > least && out.power < most ? out : wide_sums(samples, n);
}

}  // namespace sarfocus::quality
