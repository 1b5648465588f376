#include <sarfocus/signal/chirp.hpp>

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include <sarfocus/core/constants.hpp>
#include <sarfocus/core/error.hpp>

namespace sarfocus::signal {
namespace {

TEST(Chirp, SweepsItsBandInItsDirection) {
    const Chirp up{40e6, 5e-6, 50e6};
    Chirp down = up;
    down.direction = ChirpDirection::down;
    const auto samples = up.samples();
    const auto mirrored = down.samples();
    ASSERT_EQ(samples.size(), 250);
    for (std::ptrdiff_t i = 0; i + 1 < samples.size(); ++i) {
        const double frequency = 50e6 / two_pi * std::arg(cdouble(samples.data()[i + 1]) * std::conj(cdouble(samples.data()[i])));
        EXPECT_NEAR(frequency, 40e6 / 5e-6 * (static_cast<double>(i) + 1 - 125.0) / 50e6, 10.0);  // single-precision phases: 1e-7 of 50 MHz
        EXPECT_EQ(mirrored.data()[i], std::conj(samples.data()[i]));
    }
}

TEST(Chirp, RefusesWhatCannotBeSampled) {
    EXPECT_THROW((void)Chirp({60e6, 5e-6, 50e6}).samples(), ValueError);
    EXPECT_THROW((void)Chirp({40e6, -5e-6, 50e6}).samples(), ValueError);
    EXPECT_THROW((void)Chirp({40e6, 1e6, 50e6}).samples(), ValueError);
    EXPECT_THROW((void)Chirp({40e6, 5e-6, std::numeric_limits<double>::quiet_NaN()}).samples(), ValueError);
}

}  // namespace
}  // namespace sarfocus::signal
