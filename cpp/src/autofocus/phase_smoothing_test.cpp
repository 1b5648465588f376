#include "phase_smoothing.hpp"

#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include <sarfocus/core/constants.hpp>

namespace sarfocus::autofocus::detail {
namespace {

using Values = std::vector<double>;

double rms(const Values& a, const Values& b) {
    double sum = 0.0;
    for (std::size_t k = 0; k < a.size(); ++k) sum += (a[k] - b[k]) * (a[k] - b[k]);
    return std::sqrt(sum / static_cast<double>(a.size()));
}

Values noise(std::size_t n, double std, unsigned seed) {
    std::mt19937 bits(seed);
    std::normal_distribution<double> normal(0.0, std);
    Values out(n);
    for (double& v : out) v = normal(bits);
    return out;
}

Values plus(Values a, const Values& b) {
    for (std::size_t k = 0; k < a.size(); ++k) a[k] += b[k];
    return a;
}

Values wave(std::size_t n) {
    Values out;
    for (std::size_t k = 0; k < n; ++k) {
        const double u = 2.0 * static_cast<double>(k) / static_cast<double>(n) - 1.0;
        out.push_back(12.0 * u * u + 2.0 * std::cos(9.0 * u + 1.0));
    }
    return out;
}

// Value k of the cosine of index m, of norm one: the definition.
double cosine(std::size_t m, std::size_t k, std::size_t n) {
    const double angle = pi * static_cast<double>(m) * (static_cast<double>(k) + 0.5) / static_cast<double>(n);
    return std::sqrt((m > 0 ? 2.0 : 1.0) / static_cast<double>(n)) * std::cos(angle);
}

// Every cut-off tried, by explicit sums: the phase with the least estimate of its error.
Values by_trial(const Values& phase, double variance) {
    const std::size_t n = phase.size();
    Values best(n);
    Values kept(n);
    double error = 0.0;
    double least = 0.0;
    for (std::size_t m = 0; m < n; ++m) {
        double a = 0.0;
        for (std::size_t k = 0; k < n; ++k) a += phase[k] * cosine(m, k, n);
        for (std::size_t k = 0; k < n; ++k) kept[k] += a * cosine(m, k, n);
        error += variance - (a * a - variance);
        if (error < least) {
            least = error;
            best = kept;
        }
    }
    return best;
}

TEST(PhaseSmoothing, KeepsTheCosinesThatTheLeastEstimateOfTheErrorSays) {
    for (const std::size_t n : {5U, 64U, 97U, 360U}) {  // odd, prime and even: the short transform takes its samples out of order
        const Values phase = plus(wave(n), noise(n, 0.3, static_cast<unsigned>(n)));
        EXPECT_LT(rms(smoothed(phase, Values(n, 0.3)).phase, by_trial(phase, 0.09)), 1e-12) << n;  // rounding of sums of n terms about 10
    }
}

TEST(PhaseSmoothing, TakesNearlyAllNoiseOffASmoothPhase) {
    constexpr std::size_t n = 2048;
    const Values truth = wave(n);
    const SmoothedPhase out = smoothed(plus(truth, noise(n, 0.1, 1)), Values(n, 0.1));
    // A parabola's cosines fall with the square of their index: about a hundred of 2048 stand out of the noise, whose sqrt(100 / 2048)
    // stays.
    EXPECT_LT(rms(out.phase, truth), 0.03);
    const double stated = 0.1 * std::sqrt(out.variance_share);
    EXPECT_NEAR(stated, rms(out.phase, truth), 0.5 * rms(out.phase, truth));
}

TEST(PhaseSmoothing, DoesNoHarmToAWhitePhase) {
    constexpr std::size_t n = 1024;
    const Values truth = noise(n, 1.0, 2);
    const Values before = plus(truth, noise(n, 0.1, 3));
    const SmoothedPhase out = smoothed(before, Values(n, 0.1));
    // The last few cosines may fall below the noise by chance, and leaving them out then does no more than keeping them.
    EXPECT_LT(rms(out.phase, truth), 1.05 * rms(before, truth));
    EXPECT_GT(out.variance_share, 0.95);
}

TEST(PhaseSmoothing, LeavesAloneWhatIsNotKnown) {
    const Values phase = wave(100);
    for (const double unknown : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(), 0.0}) {
        Values std(100, unknown == 0.0 ? 0.0 : 0.1);
        std[50] = unknown;
        const SmoothedPhase out = smoothed(phase, std);
        EXPECT_EQ(out.phase, phase);
        EXPECT_EQ(out.variance_share, 1.0);
    }
}

}  // namespace
}  // namespace sarfocus::autofocus::detail
