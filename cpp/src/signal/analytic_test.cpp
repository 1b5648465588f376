#include <sarfocus/signal/analytic.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include <sarfocus/core/array.hpp>
#include <sarfocus/core/constants.hpp>
#include <sarfocus/core/error.hpp>

namespace sarfocus::signal {
namespace {

TEST(Analytic, TonesTurnOneWayAndKeepTheirRealPart) {
    for (const std::ptrdiff_t n : {1, 2, 9, 10}) {
        Array<double, 2> samples({1, n});
        Array<cfloat, 2> out({1, n});
        for (std::ptrdiff_t k = 0; k <= n / 2; ++k) {
            const bool own_mirror = k == 0 || 2 * k == n;
            const double phase = own_mirror ? 0.0 : 0.4;
            for (std::ptrdiff_t i = 0; i < n; ++i)
                samples(0, i) = std::cos(two_pi * static_cast<double>(k * i) / static_cast<double>(n) + phase);
            analytic_signal(samples.view(), out.view());
            for (std::ptrdiff_t i = 0; i < n; ++i) {
                const double angle = two_pi * static_cast<double>(k * i) / static_cast<double>(n) + phase;
                const cdouble expected = own_mirror ? cdouble(std::cos(angle)) : std::polar(1.0, angle);
                EXPECT_LT(std::abs(cdouble(out(0, i)) - expected), 1e-7) << n << " " << k;  // rounding to single precision
            }
        }
    }
}

TEST(Analytic, DemodulatedEchoKeepsTheCarrierPhaseOfItsRange) {
    // A Gaussian pulse on 4.1 GHz, 9 mm range bins; ranges of two pulses between the bins.
    constexpr std::ptrdiff_t n = 700;
    const double wavelength = speed_of_light / 4.1e9, spacing = 0.009, start = 3.0;
    const double target[] = {5.1234, 6.4567};
    const auto envelope = [](double x) { return std::exp(-0.5 * (x / 0.08) * (x / 0.08)); };
    Array<double, 2> samples({n, 2});
    const ArrayView<const double, 2> turned(samples.data(), {2, n}, {1, 2});
    for (std::ptrdiff_t p = 0; p < 2; ++p)
        for (std::ptrdiff_t i = 0; i < n; ++i) {
            const double x = start + spacing * static_cast<double>(i) - target[p];
            samples(i, p) = envelope(x) * std::cos(4.0 * pi * x / wavelength);
        }
    Array<cfloat, 2> out({2, n}), again({2, n});
    AnalyticOptions options;
    options.execution.threads = 2;
    demodulate(turned, start, spacing, wavelength, out.view(), options);
    for (std::ptrdiff_t p = 0; p < 2; ++p)
        for (std::ptrdiff_t i = 0; i < n; ++i) {
            const double x = start + spacing * static_cast<double>(i) - target[p];
            // Single precision, and exp(-(4 pi 0.08 / wavelength)^2 / 2) = 1e-41 of the pulse at negative frequencies.
            EXPECT_LT(std::abs(cdouble(out(p, i)) - std::polar(envelope(x), -4.0 * pi * target[p] / wavelength)), 1e-6) << p << " " << i;
        }
    options.execution.threads = 1;
    demodulate(turned, start, spacing, wavelength, again.view(), options);
    EXPECT_TRUE(std::equal(out.begin(), out.end(), again.begin()));
}

TEST(Analytic, RefusesHostileInput) {
    Array<double, 2> samples({2, 8});
    Array<cfloat, 2> out({2, 8}), narrow({2, 7});
    EXPECT_THROW(analytic_signal(samples.view(), narrow.view()), ShapeError);
    EXPECT_THROW(analytic_signal({samples.data(), {0, 8}}, {out.data(), {0, 8}}), ShapeError);
    EXPECT_THROW(demodulate(samples.view(), 0.0, 0.0, 0.07, out.view()), ValueError);
    EXPECT_THROW(demodulate(samples.view(), 0.0, 0.01, -0.07, out.view()), ValueError);
    samples(1, 2) = std::numeric_limits<double>::quiet_NaN();
    EXPECT_THROW(demodulate(samples.view(), 0.0, 0.01, 0.07, out.view()), NumericalError);
}

}  // namespace
}  // namespace sarfocus::signal
