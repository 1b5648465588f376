#include <sarfocus/fft/plan.hpp>

#include <cmath>
#include <complex>
#include <cstddef>
#include <limits>
#include <thread>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <sarfocus/core/array.hpp>
#include <sarfocus/core/constants.hpp>
#include <sarfocus/core/error.hpp>

namespace sarfocus::fft {
namespace {

template <class Real>
Array<std::complex<Real>, 1> sequence(std::ptrdiff_t n) {
    Array<std::complex<Real>, 1> x({n});
    for (std::ptrdiff_t i = 0; i < n; ++i) {
        const auto t = static_cast<double>(i);
        x(i) = {static_cast<Real>(std::sin(1.3 * t * t)), static_cast<Real>(std::cos(0.7 * t + 0.1 * t * t))};
    }
    return x;
}

// The definition, summed in long double.
template <class Real>
std::vector<std::complex<long double>> explicit_sum(const Array<std::complex<Real>, 1>& x, int sign) {
    const auto n = x.extent(0);
    std::vector<std::complex<long double>> out(static_cast<std::size_t>(n));
    for (std::ptrdiff_t k = 0; k < n; ++k)
        for (std::ptrdiff_t i = 0; i < n; ++i) {
            const long double angle = sign * 2.0L * std::acos(-1.0L) * static_cast<long double>((k * i) % n) / static_cast<long double>(n);
            out[static_cast<std::size_t>(k)] += std::complex<long double>(x(i)) * std::polar(1.0L, angle);
        }
    return out;
}

template <class Real>
class PlanTest : public testing::Test {};
using Precisions = testing::Types<float, double>;
TYPED_TEST_SUITE(PlanTest, Precisions, );

TYPED_TEST(PlanTest, AgreesWithTheExplicitSum) {
    for (const std::ptrdiff_t n : {1, 2, 7, 64, 97, 360}) {
        for (const auto direction : {Direction::forward, Direction::inverse}) {
            auto x = sequence<TypeParam>(n);
            const auto expected = explicit_sum(x, direction == Direction::forward ? -1 : 1);
            Plan<TypeParam>(n, direction).execute(x.data());
            // Rounding of a transform grows like log2(n) units in the last place of the norm, sqrt(n) per output; 8 leaves room for prime
            // lengths.
            const double scale = static_cast<double>(n) * (1.0 + std::log2(static_cast<double>(n)));
            const double tolerance = 8.0 * static_cast<double>(std::numeric_limits<TypeParam>::epsilon()) * scale;
            for (std::ptrdiff_t k = 0; k < n; ++k) {
                const auto error = std::complex<long double>(x(k)) - expected[static_cast<std::size_t>(k)];
                EXPECT_LE(static_cast<double>(std::abs(error)), tolerance) << "length " << n << ", bin " << k;
            }
        }
    }
}

TYPED_TEST(PlanTest, OnePlanServesManyThreadsWithTheSameBits) {
    constexpr std::ptrdiff_t n = 1000;
    const Plan<TypeParam> plan(n, Direction::forward);
    auto expected = sequence<TypeParam>(n);
    plan.execute(expected.data());
    std::vector<Array<std::complex<TypeParam>, 1>> copies;
    for (int i = 0; i < 4; ++i) copies.push_back(sequence<TypeParam>(n));
    std::vector<std::thread> threads;
    for (auto& copy : copies) threads.emplace_back([&plan, &copy] { plan.execute(copy.data()); });
    for (auto& thread : threads) thread.join();
    for (const auto& copy : copies)
        for (std::ptrdiff_t k = 0; k < n; ++k) EXPECT_EQ(copy(k), expected(k));
}

TEST(Plan, MovesAndRefusesBadLengths) {
    Plan<float> first(8, Direction::forward);
    const Plan<float> second = std::move(first);
    EXPECT_EQ(second.length(), 8);
    EXPECT_THROW(Plan<float>(0, Direction::forward), ValueError);
    EXPECT_THROW(Plan<double>(-1, Direction::inverse), ValueError);
    EXPECT_THROW(Plan<float>((std::ptrdiff_t{1} << 30) + 1, Direction::forward), ValueError);
}

TEST(Plan, IsTheSameToTheBitAmongMoreLengthsThanAreKept) {
    auto expected = sequence<float>(96);
    Plan<float>(96, Direction::forward).execute(expected.data());
    for (std::ptrdiff_t n = 100; n < 200; ++n) {
        auto x = sequence<float>(n);
        auto again = sequence<float>(n);
        Plan<float>(n, Direction::forward).execute(x.data());
        Plan<float>(n, Direction::forward).execute(again.data());
        for (std::ptrdiff_t k = 0; k < n; ++k) ASSERT_EQ(x(k), again(k)) << "length " << n;
    }
    auto x = sequence<float>(96);
    Plan<float>(96, Direction::forward).execute(x.data());
    for (std::ptrdiff_t k = 0; k < 96; ++k) EXPECT_EQ(x(k), expected(k));
}

TEST(Plan, GoodSizeIsTheSmallestSmoothLength) {
    EXPECT_EQ(good_size(-3), 1);
    EXPECT_EQ(good_size(1), 1);
    EXPECT_EQ(good_size(7), 7);
    EXPECT_EQ(good_size(11), 12);
    EXPECT_EQ(good_size(1025), 1029);
    EXPECT_EQ(good_size(4097), 4116);
}

int host_locks = 0;
int host_unlocks = 0;

TEST(Plan, UsesTheLockOfTheHost) {
    set_planner_lock([] { ++host_locks; }, [] { ++host_unlocks; });
    {
        const Plan<float> plan(16, Direction::forward);
    }
    set_planner_lock(nullptr, nullptr);
    EXPECT_GE(host_locks, 1);  // to plan; once more to destroy, where the process keeps enough plans already
    EXPECT_EQ(host_unlocks, host_locks);
    const int so_far = host_locks;
    {
        const Plan<float> plan(16, Direction::forward);
    }
    EXPECT_EQ(host_locks, so_far);
    EXPECT_THROW(set_planner_lock([] {}, nullptr), ValueError);
}

}  // namespace
}  // namespace sarfocus::fft
