#include "tone_sums.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include <sarfocus/core/logarithm.hpp>

namespace sarfocus::autofocus::detail {
namespace {

// Longer and shorter than a vector's lanes, and with a rest.
constexpr std::size_t lengths[] = {1, 7, 8, 37, 1000};
constexpr double slope = 0.037;
constexpr double rounding = 1e-12;  // of sums of up to 1000 terms and of 125 steps of the recurrence; the first and second moments relative

struct Signals {
    std::vector<cdouble> a, b, rotation;
    std::vector<cfloat> line, other;
    std::vector<float> weight, other_weight;

    explicit Signals(std::size_t n) {
        std::mt19937 bits(static_cast<unsigned>(n));
        std::normal_distribution<double> normal;
        std::uniform_real_distribution<float> share(0.0F, 1.0F);
        for (std::size_t k = 0; k < n; ++k) {
            a.emplace_back(normal(bits), normal(bits));
            b.emplace_back(normal(bits), normal(bits));
            rotation.push_back(std::polar(1.0, normal(bits)));
            line.emplace_back(static_cast<float>(normal(bits)), static_cast<float>(normal(bits)));
            other.emplace_back(static_cast<float>(normal(bits)), static_cast<float>(normal(bits)));
            weight.push_back(share(bits));
            other_weight.push_back(share(bits));
        }
    }
};

cdouble turn(double x) {
    return std::polar(1.0, -slope * x);
}

double root(float weight) {
    return std::sqrt(static_cast<double>(weight));
}

TEST(ToneSums, MomentsAreTheSumsTheySay) {
    for (const std::size_t n : lengths) {
        const Signals s(n);
        const double middle = 0.5 * static_cast<double>(n) - 0.3;
        cdouble expected[3] = {};
        double sizes[3] = {};
        double power = 0.0;
        for (std::size_t k = 0; k < n; ++k) {
            const double x = static_cast<double>(k) - middle;
            for (int m = 0; m < 3; ++m) {
                expected[m] += std::pow(x, m) * s.a[k] * turn(x);
                sizes[m] += std::pow(std::abs(x), m) * std::abs(s.a[k]);
            }
            power += std::norm(s.a[k]);
        }
        const auto count = static_cast<std::ptrdiff_t>(n);
        const LineMoments found = tone_moments(s.a.data(), count, slope, middle);
        EXPECT_LT(std::abs(found.zeroth - expected[0]), rounding * sizes[0]) << n;
        EXPECT_LT(std::abs(found.first - expected[1]), rounding * sizes[1]) << n;
        EXPECT_LT(std::abs(found.second - expected[2]), rounding * sizes[2]) << n;
        EXPECT_LT(std::abs(tone_sum(s.a.data(), count, slope, middle) - expected[0]), rounding * sizes[0]) << n;
        EXPECT_NEAR(signal_power(s.a.data(), count), power, rounding * power) << n;
    }
}

TEST(ToneSums, SignalsAreTurnedAndWhitenedSampleBySample) {
    constexpr double single = 3e-7;  // whitening multiplies in single precision
    for (const std::size_t n : lengths) {
        Signals s(n);
        const auto count = static_cast<std::ptrdiff_t>(n);
        const double first = -11.5;
        const std::vector<cdouble> before = s.a;
        turn_signal(s.a.data(), count, slope, first);
        std::vector<cdouble> plain(n);
        std::vector<cdouble> turned(n);
        whiten(s.line.data(), s.weight.data(), nullptr, count, 0.0, first, plain.data());
        whiten(s.line.data(), s.weight.data(), s.rotation.data(), count, slope, first, turned.data());
        for (std::size_t k = 0; k < n; ++k) {
            const cdouble by = turn(first + static_cast<double>(k));
            const cdouble white = root(s.weight[k]) * cdouble(s.line[k]);
            EXPECT_LT(std::abs(s.a[k] - before[k] * by), rounding * std::abs(before[k])) << n << ' ' << k;
            EXPECT_LE(std::abs(plain[k] - white), single * std::abs(white)) << n << ' ' << k;
            EXPECT_LE(std::abs(turned[k] - white * s.rotation[k] * by), single * std::abs(white)) << n << ' ' << k;
        }
    }
}

TEST(ToneSums, ProductsCarryTheRootsOfBothWeights) {
    constexpr double single = 3e-7;  // the root of the product of two weights
    for (const std::size_t n : lengths) {
        const Signals s(n);
        const auto count = static_cast<std::ptrdiff_t>(n);
        std::vector<cdouble> products(n);
        conjugate_products(s.line.data(), s.weight.data(), s.other.data(), s.other_weight.data(), count, products.data());
        const cdouble gain(0.3, -1.7);
        std::vector<cdouble> sum = s.rotation;
        add_weighted(s.a.data(), s.weight.data(), count, gain, sum.data());
        cdouble expected{};
        double size = 0.0;
        for (std::size_t k = 0; k < n; ++k) {
            const double weight = root(s.weight[k]) * root(s.other_weight[k]);
            const cdouble product = weight * cdouble(s.line[k]) * std::conj(cdouble(s.other[k]));
            EXPECT_LE(std::abs(products[k] - product), single * std::abs(product)) << n << ' ' << k;
            const cdouble added = root(s.weight[k]) * gain * s.a[k];
            EXPECT_LE(std::abs(sum[k] - s.rotation[k] - added), single * std::abs(added) + rounding) << n << ' ' << k;
            expected += weight * s.a[k] * std::conj(s.b[k]);
            size += weight * std::abs(s.a[k]) * std::abs(s.b[k]);
        }
        const cdouble found = weighted_product(s.a.data(), s.weight.data(), s.b.data(), s.other_weight.data(), count);
        EXPECT_LE(std::abs(found - expected), single * size) << n;
    }
}

TEST(PlainLogarithm, IsThatOfTheLibrary) {
    for (double x = 1e-300; x < 1e300; x *= 1.37) {
        const double expected = std::log(x);
        EXPECT_NEAR(plain_logarithm(x), expected, 1e-12 * std::max(std::abs(expected), 1.0)) << x;
    }
    EXPECT_TRUE(std::isfinite(plain_logarithm(0.0)));
}

}  // namespace
}  // namespace sarfocus::autofocus::detail
