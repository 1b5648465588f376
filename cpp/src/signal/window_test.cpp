#include <sarfocus/signal/window.hpp>

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include <sarfocus/core/constants.hpp>
#include <sarfocus/core/error.hpp>

namespace sarfocus::signal {
namespace {

const Window every_window[] = {{},
                               {WindowKind::hann},
                               {WindowKind::hamming},
                               {WindowKind::taylor, 4, 35.0},
                               {WindowKind::taylor, 1, 20.0},
                               {WindowKind::taylor, 8, 60.0},
                               {WindowKind::kaiser, 4, 35.0, 0.0},
                               {WindowKind::kaiser, 4, 35.0, 9.0}};

TEST(Window, SymmetricMirrorsAndPeriodicIsTheLongerOneCutShort) {
    for (const Window& window : every_window)
        for (const std::ptrdiff_t n : {1, 2, 5, 16}) {
            const auto samples = window_samples(window, n);
            for (std::size_t i = 0; i < samples.size(); ++i)
                EXPECT_NEAR(samples[i], samples[samples.size() - 1 - i], 1e-13);  // rounding of cosines
            if (n % 2 == 1) EXPECT_NEAR(samples[static_cast<std::size_t>(n / 2)], 1.0, 1e-15);
            if (n == 1) continue;
            const auto periodic = window_samples(window, n, WindowForm::periodic);
            const auto longer = window_samples(window, n + 1);
            for (std::size_t i = 0; i < periodic.size(); ++i) EXPECT_EQ(periodic[i], longer[i]);
        }
}

TEST(Window, ResponseIsTheTransformOfTheWindow) {
    // The integral of a finely sampled continuous window; midpoint rule, and the Taylor window is one whose samples lie at midpoints.
    constexpr std::ptrdiff_t n = 20001;
    for (const Window& window : every_window) {
        const WindowResponse response(window);
        const auto samples = window_samples(window, n);
        const double span = window.kind == WindowKind::taylor ? n : n - 1;
        for (const double x : {0.0, 0.3, 1.0, 1.0 + 1e-7, 2.0 - 1e-5, 2.7, 3.0, 7.5}) {
            double sum = 0.0, total = 0.0;
            for (std::ptrdiff_t i = 0; i < n; ++i) {
                const double weight =
                    samples[static_cast<std::size_t>(i)] * (window.kind != WindowKind::taylor && (i == 0 || i == n - 1) ? 0.5 : 1.0);
                sum += weight * std::cos(two_pi * x * (static_cast<double>(i) - 0.5 * (n - 1)) / span);
                total += weight;
            }
            EXPECT_NEAR(response(x), sum / total, 2e-7)
                << static_cast<int>(window.kind) << " " << x;  // (pi x / n)^2 / 6 of the sums, x <= 7.5
            EXPECT_EQ(response(-x), response(x));
        }
    }
}

TEST(Window, ResponseKeepsItsErrorBesideItsZeros) {
    // Both branches meet: the curve is smooth over 1e-8 steps about a zero of the sine.
    for (const Window& window : every_window) {
        const WindowResponse response(window);
        for (const double m : {1.0, 2.0, 3.0}) EXPECT_NEAR(response(m + 1.0000001e-6), response(m + 0.9999999e-6), 1e-9);
    }
}

TEST(Window, TaylorSidelobesKeepTheirLevel) {
    const WindowResponse response({WindowKind::taylor, 5, 35.0});
    double null = 1.0;
    while (response(null) > 0.0) null += 0.001;
    double highest = 0.0;
    for (double x = null; x < 30.0; x += 0.001) highest = std::max(highest, std::abs(response(x)));
    EXPECT_NEAR(20.0 * std::log10(highest), -35.0, 0.3);  // at nbar = 5 they come near the level, not onto it
}

TEST(Window, RefusesParametersOutsideTheirRange) {
    EXPECT_THROW((void)window_samples({}, 0), ValueError);
    EXPECT_THROW((void)window_samples({WindowKind::taylor, 0, 30.0}, 8), ValueError);
    EXPECT_THROW((void)window_samples({WindowKind::taylor, 4, -30.0}, 8), ValueError);
    EXPECT_THROW(WindowResponse({WindowKind::kaiser, 4, 30.0, -1.0}), ValueError);
    EXPECT_THROW(WindowResponse({WindowKind::kaiser, 4, 30.0, std::numeric_limits<double>::quiet_NaN()}), ValueError);
}

}  // namespace
}  // namespace sarfocus::signal
