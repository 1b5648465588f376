#include <sarfocus/signal/interpolation.hpp>

#include <cmath>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include <sarfocus/core/constants.hpp>
#include <sarfocus/core/error.hpp>

namespace sarfocus::signal {
namespace {

// Samples x(i / factor) of a tone of `cycles` whole periods in `length` samples.
std::vector<cdouble> tone(std::ptrdiff_t length, double cycles, std::ptrdiff_t factor) {
    std::vector<cdouble> out;
    for (std::ptrdiff_t i = 0; i < length * factor; ++i)
        out.push_back(std::polar(1.0, two_pi * cycles * static_cast<double>(i) / static_cast<double>(length * factor)));
    return out;
}

double largest_difference(const std::vector<cdouble>& a, const std::vector<cdouble>& b) {
    double worst = 0.0;
    for (std::size_t i = 0; i < a.size(); ++i) worst = std::max(worst, std::abs(a[i] - b[i]));
    return worst;
}

std::vector<cdouble> upsampled(const std::vector<cdouble>& line, std::ptrdiff_t factor, double band_centre) {
    const auto n = static_cast<std::ptrdiff_t>(line.size());
    std::vector<cdouble> out(line.size() * static_cast<std::size_t>(factor));
    LineUpsampler<double>(n, factor, band_centre).apply({line.data(), {n}}, {out.data(), {n * factor}});
    return out;
}

TEST(LineUpsampler, ContinuesEveryToneOfTheBand) {
    // Tolerance: a few roundings of an FFT of 9 * 5 points of unit size.
    for (const std::ptrdiff_t n : {1, 2, 7, 8, 9})
        for (const std::ptrdiff_t factor : {1, 2, 3, 5})
            for (std::ptrdiff_t k = -((n - 1) / 2); k <= (n - 1) / 2; ++k) {
                const auto cycles = static_cast<double>(k);
                EXPECT_LT(largest_difference(upsampled(tone(n, cycles, 1), factor, 0.0), tone(n, cycles, factor)), 1e-14)
                    << n << " " << factor << " " << k;
            }
}

TEST(LineUpsampler, NyquistBinStaysRealAndKeepsItsSamples) {
    const std::vector<cdouble> line{1.0, -1.0, 1.0, -1.0, 1.0, -1.0};
    const auto fine = upsampled(line, 4, 0.0);
    for (std::size_t i = 0; i < fine.size(); ++i)
        EXPECT_LT(std::abs(fine[i] - std::cos(pi * static_cast<double>(i) / 4.0)), 1e-14);  // rounding of a 24-point FFT
}

TEST(LineUpsampler, BandCentreMovesTheGapOfTheSpectrum) {
    // A centroid of 1.25 sampling rates: bins 6 … 14 of 8 about bin 10, the tone at 12 is inside.
    EXPECT_LT(largest_difference(upsampled(tone(8, 12.0, 1), 4, 1.25), tone(8, 12.0, 4)), 1e-14);
    EXPECT_LT(largest_difference(upsampled(tone(8, -7.0, 1), 4, -0.75), tone(8, -7.0, 4)), 1e-14);
}

TEST(LineUpsampler, FloatAgreesWithDoubleThroughNegativeStrides) {
    constexpr std::ptrdiff_t n = 10, factor = 3;
    std::vector<cfloat> line(n);
    std::vector<cdouble> wide(n);
    for (std::ptrdiff_t i = 0; i < n; ++i) {
        const cfloat value(std::sin(1.3f * static_cast<float>(i)), std::cos(0.7f * static_cast<float>(i * i)));
        line[static_cast<std::size_t>(n - 1 - i)] = value;
        wide[static_cast<std::size_t>(i)] = cdouble(value);
    }
    std::vector<cfloat> out(2 * n * factor);
    LineUpsampler<float>(n, factor).apply({line.data() + n - 1, {n}, {-1}}, {out.data(), {n * factor}, {2}});
    const auto reference = upsampled(wide, factor, 0.0);
    for (std::size_t i = 0; i < reference.size(); ++i) {
        EXPECT_LT(std::abs(cdouble(out[2 * i]) - reference[i]), 1e-6);  // single precision: 6e-8 times log2(30) times a size of 1.4
        EXPECT_EQ(out[2 * i + 1], cfloat());
    }
}

TEST(LineUpsampler, RefusesWhatItCannotDo) {
    EXPECT_THROW(LineUpsampler<double>(0, 2), ValueError);
    EXPECT_THROW(LineUpsampler<double>(8, 0), ValueError);
    EXPECT_THROW(LineUpsampler<double>(1 << 20, 1 << 20), ValueError);
    EXPECT_THROW(LineUpsampler<double>(8, 2, std::numeric_limits<double>::infinity()), ValueError);
    std::vector<cdouble> line(8), out(15);
    EXPECT_THROW(LineUpsampler<double>(8, 2).apply({line.data(), {8}}, {out.data(), {15}}), ShapeError);
}

TEST(Upsample, SeparableToneOnTransposedChip) {
    constexpr std::ptrdiff_t rows = 6, columns = 5, factor = 4;
    const auto down = tone(rows, 2.0, factor);
    const auto across = tone(columns, -1.0, factor);
    std::vector<cfloat> memory(rows * columns);
    const ArrayView<cfloat, 2> chip(memory.data(), {rows, columns}, {1, rows});
    for (std::ptrdiff_t i = 0; i < rows; ++i)
        for (std::ptrdiff_t j = 0; j < columns; ++j)
            chip(i, j) = cfloat(down[static_cast<std::size_t>(i * factor)] * across[static_cast<std::size_t>(j * factor)]);
    const auto fine = upsample(ImageView(chip), factor);
    ASSERT_EQ(fine.extents(), (std::array<std::ptrdiff_t, 2>{rows * factor, columns * factor}));
    for (std::ptrdiff_t i = 0; i < fine.extent(0); ++i)
        for (std::ptrdiff_t j = 0; j < fine.extent(1); ++j)  // the chip itself is rounded to single precision
            EXPECT_LT(std::abs(fine(i, j) - down[static_cast<std::size_t>(i)] * across[static_cast<std::size_t>(j)]), 3e-7);
}

TEST(Upsample, RefusesNaNAndEmptyChips) {
    std::vector<cdouble> memory(4);
    EXPECT_THROW((void)upsample(ArrayView<const cdouble, 2>(memory.data(), {0, 4}), 2), ShapeError);
    memory[3] = {0.0, std::numeric_limits<double>::quiet_NaN()};
    EXPECT_THROW((void)upsample(ArrayView<const cdouble, 2>(memory.data(), {2, 2}), 2), NumericalError);
}

}  // namespace
}  // namespace sarfocus::signal
