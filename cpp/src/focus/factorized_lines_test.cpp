#include "factorized_lines.hpp"

#include <cmath>
#include <cstddef>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "band_kernel.hpp"

namespace sarfocus::focus::detail {
namespace {

constexpr std::ptrdiff_t widths_of_registers[] = {16, 32, 64};
constexpr float untouched = -7.0f;

std::vector<float> noise(std::ptrdiff_t n, unsigned seed) {
    std::mt19937 generator(seed);
    std::normal_distribution<float> normal;
    std::vector<float> out(static_cast<std::size_t>(n));
    for (float& x : out) x = normal(generator);
    return out;
}

double magnitude_of_sum(const std::vector<float>& terms) {
    double out = 0.0;
    for (const float x : terms) out += std::abs(static_cast<double>(x));
    return out;
}

// Single precision rounds every one of at most 16 products and sums by 6e-8 of a few.
constexpr double rounding = 1e-6;

TEST(FactorizedLines, ShiftsAsDefined) {
    for (const std::ptrdiff_t bytes : widths_of_registers)
        for (const std::ptrdiff_t width : {16, 32, 48, 112, 160})
            for (const std::ptrdiff_t taps : {4, 10, 16}) {
                const std::vector<float> re = noise(width + taps, 1), im = noise(width + taps, 2), weights = noise(taps, 3);
                std::vector<float> out(static_cast<std::size_t>(2 * width + line_lanes), untouched);
                shift_line(re.data(), im.data(), weights.data(), taps, 0.6f, -0.8f, out.data(), width, bytes);
                const double bound = rounding * 8.0 * magnitude_of_sum(weights);
                for (std::ptrdiff_t i = 0; i < width; ++i) {
                    double x = 0.0, y = 0.0;
                    for (std::ptrdiff_t t = 0; t < taps; ++t) {
                        x += static_cast<double>(weights[t]) * static_cast<double>(re[i + t]);
                        y += static_cast<double>(weights[t]) * static_cast<double>(im[i + t]);
                    }
                    EXPECT_NEAR(out[i], 0.6 * x + 0.8 * y, bound) << bytes << " bytes, " << width << " wide, " << taps << " taps, " << i;
                    EXPECT_NEAR(out[width + i], -0.8 * x + 0.6 * y, bound) << bytes << " bytes, " << width << " wide, " << i;
                }
                for (std::ptrdiff_t i = 2 * width; i < 2 * width + line_lanes; ++i) EXPECT_EQ(out[i], untouched);
            }
}

TEST(FactorizedLines, AddsAsDefined) {
    for (const std::ptrdiff_t bytes : widths_of_registers)
        for (const std::ptrdiff_t floats : {16, 80, 96, 144, 272})
            for (const std::ptrdiff_t count : {1, 5}) {
                const std::vector<float> lines = noise(floats * count, 4), weights = noise(count, 5), before = noise(floats, 6);
                std::vector<float> out = before;
                out.resize(static_cast<std::size_t>(floats + line_lanes), untouched);
                add_lines(lines.data(), floats, weights.data(), count, out.data(), bytes);
                for (std::ptrdiff_t i = 0; i < floats; ++i) {
                    double sum = before[i];
                    for (std::ptrdiff_t k = 0; k < count; ++k)
                        sum += static_cast<double>(weights[k]) * static_cast<double>(lines[k * floats + i]);
                    EXPECT_NEAR(out[i], sum, rounding * 8.0 * (1.0 + magnitude_of_sum(weights))) << bytes << " bytes, " << floats;
                }
                for (std::ptrdiff_t i = floats; i < floats + line_lanes; ++i) EXPECT_EQ(out[i], untouched);
            }
}

TEST(FactorizedLines, SamplesAsTheKernelsWeightsSay) {
    constexpr std::ptrdiff_t taps = 10;
    constexpr std::ptrdiff_t before = taps / 2 - 1;
    const BandKernel kernel(taps, 0.7);
    const std::vector<float> re = noise(96, 7), im = noise(96, 8);
    std::mt19937 generator(9);
    std::uniform_real_distribution<double> anywhere(before, 70.0);
    for (const std::ptrdiff_t bytes : widths_of_registers)
        for (const std::ptrdiff_t count : {1, 2, 7, 8, 33}) {
            std::vector<double> place(static_cast<std::size_t>(count));
            for (double& p : place) p = anywhere(generator);
            std::vector<float> x(static_cast<std::size_t>(count + 1), untouched), y = x;
            sample_line(re.data(), im.data(), kernel.table(), before, place.data(), count, x.data(), y.data(), bytes);
            for (std::ptrdiff_t b = 0; b < count; ++b) {
                const auto whole = static_cast<std::ptrdiff_t>(place[b]);
                float weights[BandKernel::most_taps];
                kernel.weights(place[b] - static_cast<double>(whole), weights);
                double real = 0.0, imaginary = 0.0;
                for (std::ptrdiff_t t = 0; t < taps; ++t) {
                    real += static_cast<double>(weights[t]) * static_cast<double>(re[whole - before + t]);
                    imaginary += static_cast<double>(weights[t]) * static_cast<double>(im[whole - before + t]);
                }
                EXPECT_NEAR(x[b], real, 10.0 * rounding) << bytes << " bytes, bin " << b << " of " << count;
                EXPECT_NEAR(y[b], imaginary, 10.0 * rounding) << bytes << " bytes, bin " << b << " of " << count;
            }
            EXPECT_EQ(x.back(), untouched);
            EXPECT_EQ(y.back(), untouched);
        }
}

}  // namespace
}  // namespace sarfocus::focus::detail
