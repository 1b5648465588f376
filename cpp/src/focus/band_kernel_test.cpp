#include "focus/band_kernel.hpp"

#include <cmath>
#include <complex>

#include <gtest/gtest.h>

#include <sarfocus/core/constants.hpp>

namespace sarfocus::focus::detail {
namespace {

double db(double amplitude) {
    return 20.0 * std::log10(amplitude);
}

TEST(BandKernel, InterpolatesItsBandToTheStatedError) {
    for (const std::ptrdiff_t taps : {4, 8, 12, 16})
        for (const double band : {0.5, 0.7}) {
            const BandKernel kernel(taps, band);
            const BandKernel::Error stated = BandKernel::error(taps, band);
            float weights[BandKernel::most_taps];
            double mean = 0.0;
            double largest = 0.0;
            for (int k = 0; k <= 40; ++k) {
                const double w = pi * band * (k - 20) / 20.0;
                double power = 0.0;
                for (int f = 0; f < 50; ++f) {
                    const double fraction = (f + 0.3) / 50.0;
                    kernel.weights(fraction, weights);
                    std::complex<double> sum = -std::polar(1.0, w * fraction);
                    for (std::ptrdiff_t t = 0; t < BandKernel::most_taps; ++t)
                        sum += static_cast<double>(weights[t]) * std::polar(1.0, w * static_cast<double>(t - kernel.before()));
                    power += std::norm(sum) / 50.0;
                }
                largest = std::max(largest, power);
                mean += power * (k == 0 || k == 40 ? 0.5 : 1.0) / 40.0;
            }
            // The table is single precision and linear between 512 fractions: -100 dB. The error rises steeply to the band's edge: sums
            // over it differ.
            EXPECT_NEAR(std::sqrt(largest), stated.largest, 0.05 * stated.largest + 2e-5) << taps << " taps, band " << band;
            EXPECT_NEAR(std::sqrt(mean), stated.mean, 0.15 * stated.mean + 2e-5) << taps << " taps, band " << band;
        }
    // The figures on which the choice of taps rests.
    EXPECT_LT(db(BandKernel::error(8, 0.5).mean), -70.0);
    EXPECT_LT(db(BandKernel::error(12, 0.625).largest), -60.0);
}

TEST(BandKernel, GivesConstantsBack) {
    float weights[BandKernel::most_taps];
    const BandKernel kernel(10, 0.5);
    for (const double fraction : {0.0, 0.25, 0.999}) {
        kernel.weights(fraction, weights);
        float sum = 0.0F;
        for (const float w : weights) sum += w;
        EXPECT_NEAR(sum, 1.0F, 3e-4F);  // the error of ten taps, -74 dB at most
    }
}

TEST(BandCubic, FollowsItsBand) {
    const double band = 0.4;
    const BandCubic cubic(band);
    double power = 0.0;
    for (int k = 0; k < 20; ++k)
        for (int f = 0; f < 20; ++f) {
            const double w = pi * band * (k + 0.5) / 20.0;
            const double x = (f + 0.5) / 20.0 - 0.5;
            std::complex<double> sum = -std::polar(1.0, w * x);
            for (std::ptrdiff_t d = 0; d < 4; ++d)
                for (std::ptrdiff_t t = 0; t < BandCubic::taps; ++t)
                    sum += std::pow(x, static_cast<double>(d)) * static_cast<double>(cubic.weights(d)[t]) *
                           std::polar(1.0, w * static_cast<double>(t - BandCubic::side));
            power += std::norm(sum) / 400.0;
        }
    EXPECT_NEAR(std::sqrt(power), cubic.error(), 0.1 * cubic.error());
    EXPECT_LT(db(cubic.error()), -72.0);
}

}  // namespace
}  // namespace sarfocus::focus::detail
