#include <sarfocus/sim/motion.hpp>

#include <cmath>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include <sarfocus/core/constants.hpp>
#include <sarfocus/core/error.hpp>

namespace sarfocus::sim {
namespace {

std::vector<double> error_of(const MotionModel& model, std::ptrdiff_t n, std::uint32_t axis = 0) {
    std::vector<double> out(static_cast<std::size_t>(n), -7.0);
    motion_error({out.data(), {n}}, model, axis);
    return out;
}

TEST(Motion, DriftAndAccelerationAreCentred) {
    MotionModel model;
    model.sampling_rate = 10.0;
    model.drift = 2.0;
    model.acceleration = 3.0;
    const auto error = error_of(model, 101);
    for (std::size_t i = 0; i < 101; ++i) {
        const double t = (static_cast<double>(i) - 50.0) / 10.0;
        EXPECT_NEAR(error[i], 2.0 * t + 1.5 * t * t, 1e-13);  // rounding of values to 50
    }
}

TEST(Motion, VibrationIsASinusoidOfItsAmplitude) {
    MotionModel model;
    model.sampling_rate = 1000.0;
    model.vibrations = {{0.5, 40.0}};
    const auto error = error_of(model, 1000);  // 40 whole periods
    cdouble tone = 0.0;
    double square = 0.0;
    for (std::size_t i = 0; i < 1000; ++i) {
        tone += error[i] * std::polar(2.0 / 1000.0, -two_pi * 40.0 * static_cast<double>(i) / 1000.0);
        square += error[i] * error[i] / 1000.0;
    }
    EXPECT_NEAR(std::abs(tone), 0.5, 1e-12);
    EXPECT_NEAR(square, 0.125, 1e-12);
}

TEST(Motion, RandomPartHasItsRmsAndItsBand) {
    MotionModel model;
    model.sampling_rate = 500.0;
    model.random_rms = 0.3;
    model.random_bandwidth = 20.0;
    constexpr std::ptrdiff_t n = 2000;
    double power = 0.0, steps = 0.0, product = 0.0;
    for (std::uint64_t seed = 0; seed < 50; ++seed) {
        model.seed = seed;
        const auto error = error_of(model, n), other = error_of(model, n, 1);
        for (std::size_t i = 1; i < error.size(); ++i) {
            power += error[i] * error[i];
            product += error[i] * other[i];
            steps += (error[i] - error[i - 1]) * (error[i] - error[i - 1]);
        }
    }
    const double count = 50.0 * (n - 1);
    // 160 modes in 50 draws: 4000 independent halves of squares, a standard deviation of 1.6-2.2 %.
    EXPECT_NEAR(power / count, 0.09, 0.09 * 0.1);
    EXPECT_LT(std::abs(product) / count, 0.09 * 0.1);
    // Mean square derivative of a flat spectrum to B: (2 pi B)^2 / 3 of the variance.
    EXPECT_NEAR(steps / count, 0.09 * std::pow(two_pi * 20.0 / 500.0, 2) / 3.0, 0.1 * 0.09 * std::pow(two_pi * 20.0 / 500.0, 2) / 3.0);
}

TEST(Motion, RefusesWhatHasNoMeaning) {
    MotionModel model;
    EXPECT_THROW((void)error_of(model, 8), ValueError);
    model.sampling_rate = 100.0;
    EXPECT_THROW((void)error_of(model, 0), ShapeError);
    model.random_rms = 1.0;
    model.random_bandwidth = 51.0;
    EXPECT_THROW((void)error_of(model, 8), ValueError);
    model.random_bandwidth = 50.0;
    EXPECT_NO_THROW((void)error_of(model, 1));
    model.vibrations = {{1.0, 0.0}};
    EXPECT_THROW((void)error_of(model, 8), ValueError);
    model.vibrations = {{std::numeric_limits<double>::quiet_NaN(), 1.0}};
    EXPECT_THROW((void)error_of(model, 8), ValueError);
}

}  // namespace
}  // namespace sarfocus::sim
