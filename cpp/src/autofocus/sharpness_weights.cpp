#include "sharpness_weights.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <limits>
#include <numbers>

#include <sarfocus/core/multiversion.hpp>

namespace sarfocus::autofocus::detail {
namespace {

constexpr std::ptrdiff_t lanes = 16;

// ln x of a normal number > 0: exponent and the series of artanh((m - 1) / (m + 1)) for m in [sqrt(1/2), sqrt(2)). No branches and no
// calls: loops over it vectorise.
inline float logarithm(float x) {
    constexpr std::uint32_t half = 0x3f3504f3U;  // bits of sqrt(1/2)
    const std::uint32_t shifted = std::bit_cast<std::uint32_t>(x) - half;
    const auto exponent = static_cast<float>(static_cast<std::int32_t>(shifted) >> 23);
    const float m = std::bit_cast<float>((shifted & 0x007fffffU) + half);
    const float s = (m - 1.0f) / (m + 1.0f);
    const float u = s * s;
    const float series = (((u / 9.0f + 1.0f / 7.0f) * u + 1.0f / 5.0f) * u + 1.0f / 3.0f) * u + 1.0f;
    return exponent * std::numbers::ln2_v<float> + 2.0f * s * series;
}

struct Logarithm {
    static inline float of(float intensity) { return logarithm(std::max(intensity, std::numeric_limits<float>::min())); }
};

struct Intensity {
    static inline float of(float intensity) { return intensity; }
};

// Samples of a line, weighed `lanes` at a time: inlined into the versions below.
template <class Weight>
inline __attribute__((always_inline)) double weigh(float* x, std::ptrdiff_t n, float scale, bool multiply) {
    std::array<double, lanes> sums{};
    const std::ptrdiff_t whole = n / lanes * lanes;
    for (std::ptrdiff_t i = 0; i < whole; i += lanes)
        for (std::ptrdiff_t l = 0; l < lanes; ++l) {
            float& re = x[2 * (i + l)];
            float& im = x[2 * (i + l) + 1];
            const float intensity = (re * re + im * im) * scale;
            const float w = Weight::of(intensity);
            sums[static_cast<std::size_t>(l)] += static_cast<double>(intensity * w);
            const float factor = multiply ? w : 1.0f;
            re *= factor;
            im *= factor;
        }
    double sum = 0.0;
    for (const double s : sums) sum += s;
    for (std::ptrdiff_t i = whole; i < n; ++i) {
        float& re = x[2 * i];
        float& im = x[2 * i + 1];
        const float intensity = (re * re + im * im) * scale;
        const float w = Weight::of(intensity);
        sum += static_cast<double>(intensity * w);
        const float factor = multiply ? w : 1.0f;
        re *= factor;
        im *= factor;
    }
    return sum;
}

}  // namespace

SARFOCUS_MULTIVERSION double weigh_by_logarithm(cfloat* line, std::ptrdiff_t n, float scale, bool multiply) {
    return weigh<Logarithm>(reinterpret_cast<float*>(line), n, scale, multiply);
}

SARFOCUS_MULTIVERSION double weigh_by_intensity(cfloat* line, std::ptrdiff_t n, float scale, bool multiply) {
    return weigh<Intensity>(reinterpret_cast<float*>(line), n, scale, multiply);
}

SARFOCUS_MULTIVERSION void add_products(const cfloat* a, const cfloat* b, std::ptrdiff_t n, cdouble* sum) {
    const auto* p = reinterpret_cast<const float*>(a);
    const auto* q = reinterpret_cast<const float*>(b);
    auto* s = reinterpret_cast<double*>(sum);
    for (std::ptrdiff_t k = 0; k < n; ++k) {
        s[2 * k] += static_cast<double>(p[2 * k] * q[2 * k] + p[2 * k + 1] * q[2 * k + 1]);
        s[2 * k + 1] += static_cast<double>(p[2 * k + 1] * q[2 * k] - p[2 * k] * q[2 * k + 1]);
    }
}

}  // namespace sarfocus::autofocus::detail
