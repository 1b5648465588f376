// Compiled without contraction to fused operations, which would change the last bit from one processor to another.
#include "sim/random.hpp"

#include <cmath>

namespace sarfocus::sim {
namespace {

constexpr double minus_one_to_one(std::uint32_t high, std::uint32_t low) {
    const std::uint64_t bits = (static_cast<std::uint64_t>(high) << 32 | low) >> 11;
    return static_cast<double>(bits) * 0x1p-52 - 1.0;
}

// Natural logarithm of x in (0, 1], relative error 1e-15, from operations that IEEE 754 rounds correctly; std::log differs between
// platforms.
double logarithm(double x) {
    int exponent = 0;
    double mantissa = std::frexp(x, &exponent);
    if (mantissa < 0.70710678118654752) {
        mantissa *= 2.0;
        --exponent;
    }
    const double s = (mantissa - 1.0) / (mantissa + 1.0);
    const double square = s * s;
    double series = 0.0;
    for (int k = 23; k >= 3; k -= 2) series = (series + 1.0 / k) * square;
    return 2.0 * s * (1.0 + series) + 0.69314718055994531 * exponent;
}

}  // namespace

std::array<std::uint32_t, 4> philox(std::array<std::uint32_t, 4> counter, std::array<std::uint32_t, 2> key) {
    for (int round = 0; round < 10; ++round) {
        const std::uint64_t a = std::uint64_t{0xD2511F53u} * counter[0];
        const std::uint64_t b = std::uint64_t{0xCD9E8D57u} * counter[2];
        counter = {static_cast<std::uint32_t>(b >> 32) ^ counter[1] ^ key[0], static_cast<std::uint32_t>(b),
                   static_cast<std::uint32_t>(a >> 32) ^ counter[3] ^ key[1], static_cast<std::uint32_t>(a)};
        key[0] += 0x9E3779B9u;
        key[1] += 0xBB67AE85u;
    }
    return counter;
}

cdouble complex_normal(std::uint64_t seed, Stream stream, std::uint64_t index) {
    // Marsaglia's polar method: a point in the unit disc; the attempts, 1.27 on average, are the last word of the counter.
    for (std::uint32_t attempt = 0;; ++attempt) {
        const auto words = philox(
            {static_cast<std::uint32_t>(index), static_cast<std::uint32_t>(index >> 32), static_cast<std::uint32_t>(stream), attempt},
            {static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32)});
        const double x = minus_one_to_one(words[0], words[1]);
        const double y = minus_one_to_one(words[2], words[3]);
        const double square = x * x + y * y;
        if (square >= 1.0 || square == 0.0) continue;
        const double scale = std::sqrt(-logarithm(square) / square);
        return {x * scale, y * scale};
    }
}

}  // namespace sarfocus::sim
