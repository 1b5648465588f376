#include "sim/random.hpp"

#include <cmath>

#include <gtest/gtest.h>

namespace sarfocus::sim {
namespace {

TEST(Random, PhiloxGivesThePublishedWords) {
    // Known answers of the authors' Random123 distribution.
    using Words = std::array<std::uint32_t, 4>;
    EXPECT_EQ(philox({0, 0, 0, 0}, {0, 0}), (Words{0x6627e8d5, 0xe169c58d, 0xbc57ac4c, 0x9b00dbd8}));
    EXPECT_EQ(philox({~0u, ~0u, ~0u, ~0u}, {~0u, ~0u}), (Words{0x408f276d, 0x41c83b0e, 0xa20bc7c6, 0x6d5451fd}));
    EXPECT_EQ(philox({0x243f6a88, 0x85a308d3, 0x13198a2e, 0x03707344}, {0xa4093822, 0x299f31d0}),
              (Words{0xd16cfe09, 0x94fdcceb, 0x5001e420, 0x24126ea1}));
}

TEST(Random, ComplexNormalHasTheMomentsOfOne) {
    constexpr int n = 200000;
    double real = 0.0, square = 0.0, fourth = 0.0, beyond = 0.0;
    cdouble pseudo = 0.0, neighbours = 0.0, previous = 0.0;
    for (int i = 0; i < n; ++i) {
        const cdouble z = complex_normal(7, Stream::noise, static_cast<std::uint64_t>(i));
        real += z.real();
        square += std::norm(z);
        fourth += std::norm(z) * std::norm(z);
        beyond += std::norm(z) > 5.0 ? 1.0 : 0.0;
        pseudo += z * z;
        neighbours += z * std::conj(previous);
        previous = z;
    }
    // Five standard deviations of each mean: sqrt(1/2), 1, sqrt(20), sqrt(exp(-5)), sqrt(2), 1, over sqrt(n).
    const double five = 5.0 / std::sqrt(n);
    EXPECT_LT(std::abs(real / n), 0.71 * five);
    EXPECT_NEAR(square / n, 1.0, five);
    EXPECT_NEAR(fourth / n, 2.0, 4.5 * five);
    EXPECT_NEAR(beyond / n, std::exp(-5.0), 0.083 * five);
    EXPECT_LT(std::abs(pseudo) / n, 1.42 * five);
    EXPECT_LT(std::abs(neighbours) / n, five);
}

TEST(Random, EveryArgumentMatters) {
    const cdouble z = complex_normal(1, Stream::noise, 5);
    EXPECT_EQ(complex_normal(1, Stream::noise, 5), z);
    EXPECT_NE(complex_normal(2, Stream::noise, 5), z);
    EXPECT_NE(complex_normal(1ull + (1ull << 40), Stream::noise, 5), z);
    EXPECT_NE(complex_normal(1, Stream::clutter, 5), z);
    EXPECT_NE(complex_normal(1, Stream::noise, 5 + (1ull << 33)), z);
}

}  // namespace
}  // namespace sarfocus::sim
