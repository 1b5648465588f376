#include <sarfocus/focus/doppler_centroid.hpp>

#include <cmath>
#include <complex>
#include <limits>
#include <string>

#include <gtest/gtest.h>

#include <sarfocus/core/array.hpp>
#include <sarfocus/core/constants.hpp>
#include <sarfocus/core/error.hpp>

namespace sarfocus::focus {
namespace {

using Image = Array<cfloat, 2>;

Image tones(std::ptrdiff_t rows, std::ptrdiff_t columns, double cycles) {
    Image out({rows, columns});
    for (std::ptrdiff_t i = 0; i < rows; ++i)
        for (std::ptrdiff_t j = 0; j < columns; ++j)
            out(i, j) =
                cfloat(std::polar(1.0 + static_cast<double>(j), two_pi * cycles * static_cast<double>(i) + static_cast<double>(j * j)));
    return out;
}

TEST(DopplerCentroid, OfATone) {
    // Rounding to single precision: 6e-8 a sample, less after averaging.
    for (const double cycles : {0.0, 0.31, -0.2, 0.499, -0.499, 3.25})
        EXPECT_NEAR(estimate_doppler_centroid(tones(50, 7, cycles).view(), 800.0), 800.0 * std::remainder(cycles, 1.0), 800.0 * 1e-7);
}

TEST(DopplerCentroid, HalfThePrfIsPositive) {
    Image data({4, 2});
    for (std::ptrdiff_t i = 0; i < 4; ++i)
        for (std::ptrdiff_t j = 0; j < 2; ++j) data(i, j) = cfloat(i % 2 == 0 ? 1.0f : -1.0f, -0.0f);
    EXPECT_EQ(estimate_doppler_centroid(data.view(), 600.0), 300.0);
}

TEST(DopplerCentroid, SameBitsForThreadsAndStrides) {
    const Image data = tones(101, 33, 0.123);
    DopplerCentroidOptions options;
    options.execution.threads = 1;
    const double reference = estimate_doppler_centroid(data.view(), 1.0, options);
    Image turned({33, 101});
    const MutableImageView flipped(turned.data() + 100, {101, 33}, {-1, 101});
    for (std::ptrdiff_t i = 0; i < 101; ++i)
        for (std::ptrdiff_t j = 0; j < 33; ++j) flipped(i, j) = data(i, j);
    for (const int threads : {1, 2, 3}) {
        options.execution.threads = threads;
        EXPECT_EQ(estimate_doppler_centroid(data.view(), 1.0, options), reference);
        EXPECT_EQ(estimate_doppler_centroid(flipped, 1.0, options), reference);
    }
}

TEST(DopplerCentroid, RefusesHostileInput) {
    Image data = tones(5, 3, 0.1);
    EXPECT_THROW((void)estimate_doppler_centroid(data.view(), 0.0), ValueError);
    EXPECT_THROW((void)estimate_doppler_centroid(data.view().slice(0, 0, 1), 1.0), ShapeError);
    EXPECT_THROW((void)estimate_doppler_centroid(data.view().slice(1, 0, 0), 1.0), ShapeError);
    EXPECT_THROW((void)estimate_doppler_centroid(Image({5, 3}).view(), 1.0), NumericalError);
    DopplerCentroidOptions options;
    options.execution.progress = [](const ProgressUpdate&) { return false; };
    EXPECT_THROW((void)estimate_doppler_centroid(data.view(), 1.0, options), Cancelled);
    data(3, 1) = cfloat(std::numeric_limits<float>::quiet_NaN(), 0.0f);
    try {
        (void)estimate_doppler_centroid(data.view(), 1.0);
        FAIL();
    } catch (const NumericalError& error) {
        EXPECT_NE(std::string(error.what()).find("[3, 1]"), std::string::npos);
    }
}

}  // namespace
}  // namespace sarfocus::focus
