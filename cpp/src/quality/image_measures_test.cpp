#include <sarfocus/quality/image_measures.hpp>

#include <cmath>
#include <limits>
#include <random>

#include <gtest/gtest.h>
#include <complex>
#include <vector>

#include <sarfocus/core/array.hpp>
#include <sarfocus/core/error.hpp>

namespace sarfocus::quality {
namespace {

Array<cfloat, 2> speckle(std::ptrdiff_t rows, std::ptrdiff_t columns, unsigned seed = 1) {
    std::mt19937 generator(seed);
    std::normal_distribution<float> normal;
    Array<cfloat, 2> out({rows, columns});
    for (cfloat& x : out) x = {normal(generator), normal(generator)};
    return out;
}

Array<cfloat, 2> constant(std::ptrdiff_t rows, std::ptrdiff_t columns, cfloat value) {
    Array<cfloat, 2> out({rows, columns});
    for (cfloat& x : out) x = value;
    return out;
}

TEST(ImageMeasures, FlatImage) {
    const auto image = constant(37, 53, {3.0F, -4.0F});
    const double pixels = 37.0 * 53.0;
    // All terms are equal: only the rounding of some 2000 additions remains.
    EXPECT_NEAR(entropy(image.view()), std::log(pixels), 1e-12);
    EXPECT_NEAR(entropy_log10(image.view()), std::log10(pixels), 1e-12);
    EXPECT_NEAR(contrast(image.view()), 0.0, 1e-12);
    EXPECT_NEAR(sharpness(image.view()), 1.0 / pixels, 1e-15);
}

TEST(ImageMeasures, SinglePixel) {
    Array<cfloat, 2> image({16, 8});
    image(5, 7) = {0.0F, 1e-30F};
    EXPECT_NEAR(entropy(image.view()), 0.0, 1e-12);  // logarithms of size 140 cancel
    EXPECT_DOUBLE_EQ(sharpness(image.view()), 1.0);
    EXPECT_DOUBLE_EQ(contrast(image.view()), std::sqrt(127.0));  // (n - 1)^2 / n^2 and n - 1 times 1 / n^2, over 1 / n
}

TEST(ImageMeasures, ExtremeScalesDoNotOverflow) {
    for (const float scale : {1e-38F, 1e37F}) {
        auto image = speckle(20, 30);
        const double expected[] = {entropy(image.view()), contrast(image.view()), sharpness(image.view())};
        for (cfloat& x : image) x *= scale;
        // Scaling rounds every sample to 24 bits (fewer where it becomes subnormal).
        const double tolerance = scale < 1.0F ? 1e-5 : 1e-6;
        EXPECT_NEAR(entropy(image.view()), expected[0], tolerance);
        EXPECT_NEAR(contrast(image.view()), expected[1], tolerance);
        EXPECT_NEAR(sharpness(image.view()), expected[2], tolerance);
    }
}

TEST(ImageMeasures, SameBitsForAnyThreadsAndStrides) {
    const auto image = speckle(131, 77);
    const auto reference = speckle(131, 77, 2);
    Array<cfloat, 2> transposed({77, 131});
    for (std::ptrdiff_t i = 0; i < 131; ++i)
        for (std::ptrdiff_t j = 0; j < 77; ++j) transposed(j, i) = image(i, j);
    const ImageView column_major(transposed.data(), {131, 77}, {1, 131});
    for (const auto measure : {&entropy, &entropy_log10, &contrast, &sharpness}) {
        const double once = measure(image.view(), {.threads = 1, .progress = {}});
        EXPECT_EQ(measure(image.view(), {.threads = 3, .progress = {}}), once);
        EXPECT_EQ(measure(column_major, {.threads = 2, .progress = {}}), once);
    }
    const double once = psnr(image.view(), reference.view(), {.threads = 1, .progress = {}});
    EXPECT_EQ(psnr(column_major, reference.view(), {.threads = 4, .progress = {}}), once);
}

TEST(ImageMeasures, Psnr) {
    const auto reference = constant(4, 4, {2.0F, 0.0F});
    auto image = constant(4, 4, {0.0F, 2.0F});
    EXPECT_EQ(psnr(image.view(), reference.view()), std::numeric_limits<double>::infinity());
    image(0, 0) = {3.0F, 0.0F};
    EXPECT_NEAR(psnr(image.view(), reference.view()), 10.0 * std::log10(4.0 * 16.0), 1e-12);  // peak^2 = 4, MSE = 1/16
    EXPECT_NEAR(psnr(reference.view(), image.view()), 10.0 * std::log10(9.0 * 16.0), 1e-12);  // the peak is the reference's
}

TEST(ImageMeasures, RefusesWhatCannotBeMeasured) {
    const Array<cfloat, 2> zero({3, 3});
    const Array<cfloat, 2> empty({0, 3});
    auto image = speckle(3, 3);
    for (const auto measure : {&entropy, &entropy_log10, &contrast, &sharpness}) {
        EXPECT_THROW((void)measure(zero.view(), {}), NumericalError);
        EXPECT_THROW((void)measure(empty.view(), {}), ShapeError);
    }
    EXPECT_THROW((void)psnr(image.view(), zero.view()), NumericalError);
    EXPECT_THROW((void)psnr(image.view(), empty.view()), ShapeError);
    image(1, 2) = {std::numeric_limits<float>::quiet_NaN(), 0.0F};
    EXPECT_THROW((void)entropy(image.view()), NumericalError);
    EXPECT_THROW((void)psnr(speckle(3, 3).view(), image.view()), NumericalError);
}

}  // namespace
TEST(EntropySums, AgreeWithTheLogarithmOfTheLibrary) {
    // Every length modulo the eight lanes, amplitudes from 1e-15 to 1e15, zeros among them.
    for (const std::ptrdiff_t n : {1, 7, 8, 9, 100, 4093}) {
        std::vector<cfloat> samples;
        double power = 0.0;
        double weighted = 0.0;
        double size = 0.0;
        for (std::ptrdiff_t i = 0; i < n; ++i) {
            const auto amplitude = static_cast<float>(std::pow(10.0, 15.0 * std::sin(0.37 * static_cast<double>(i))));
            samples.emplace_back(i % 11 == 5 ? cfloat{} : std::polar(amplitude, static_cast<float>(i)));
            const double x = std::norm(std::complex<double>(samples.back()));
            power += x;
            if (x > 0.0) weighted += x * std::log(x);
            if (x > 0.0) size += x * std::abs(std::log(x));
        }
        const EntropySums sums = entropy_sums(samples.data(), n);
        EXPECT_NEAR(sums.power, power, 5e-7 * power) << n;  // the stated error
        EXPECT_NEAR(sums.weighted, weighted, 5e-7 * size) << n;
    }
}

TEST(EntropySums, OfZerosAndOfInfinityIsNotANumber) {
    std::vector<cfloat> samples(16);
    EXPECT_TRUE(std::isnan(entropy_sums(samples.data(), 16).entropy()));
    samples[3] = cfloat(std::numeric_limits<float>::infinity(), 0.0f);
    EXPECT_TRUE(std::isnan(entropy_sums(samples.data(), 16).entropy()));
    samples[3] = 2.0f;
    EXPECT_NEAR(entropy_sums(samples.data(), 16).entropy(), 0.0, 1e-12);  // a single bright pixel
}

}  // namespace sarfocus::quality
