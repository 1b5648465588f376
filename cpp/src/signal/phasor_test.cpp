#include <sarfocus/signal/phasor.hpp>

#include <cmath>

#include <gtest/gtest.h>

#include <sarfocus/core/constants.hpp>

namespace sarfocus::signal {
namespace {

double phasor_error(double cycles) {
    float real = 0.0f;
    float imag = 0.0f;
    unit_phasor(cycles, real, imag);
    const double angle = two_pi * std::remainder(cycles, 1.0);
    return std::hypot(static_cast<double>(real) - std::cos(angle), static_cast<double>(imag) - std::sin(angle));
}

TEST(Phasor, KeepsItsErrorOverTheWholeCircleAndFarFromZero) {
    for (int i = -4000; i <= 4000; ++i) {
        EXPECT_LT(phasor_error(i / 4000.0), 2e-7) << i;  // 1.5e-7 stated, and the rounding of the two components together
        EXPECT_LT(phasor_error(3.4e8 + i / 7.0), 2e-7) << i;
    }
}

TEST(Phasor, CornersOfTheCircle) {
    for (const double cycles : {0.0, 0.25, 0.5, -0.5, 0.75, 1.0, 1e15}) EXPECT_LT(phasor_error(cycles), 2e-7) << cycles;
}

}  // namespace
}  // namespace sarfocus::signal
