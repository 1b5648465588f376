#include <cmath>

#include <gtest/gtest.h>

#include <sarfocus/core/error.hpp>

#include "strip_scene_test.hpp"

namespace sarfocus::autofocus {
namespace {

using namespace test;

constexpr double fm_rate = 0.004;  // of make_apertures, cycles per sample squared: one pixel is a slope of 2 pi 0.004 = 0.0251 rad a sample

// Slope between two points of `displaced` pixels [Xie2023, eq. 14].
double slope_of(double displaced, double rate = fm_rate) {
    return two_pi * rate * displaced;
}

// Two apertures of 200 samples that overlap by 120, displaced by b1 and b2 pixels.
Apertures pair(double displaced1, double displaced2, double noise = 0.0, unsigned seed = 1, const std::vector<double>& phase = {}) {
    return make_apertures(
        {{10, 200, slope_of(displaced1), 0.7, 2.0, 4.0 * noise}, {90, 200, slope_of(displaced2), -2.1, 0.5, 0.25 * noise}}, 300, phase,
        seed);
}

TEST(StripMatch, SlopeIsThatOfTheTone) {
    const auto phase = smooth_phase(300, 25.0);  // common to both: it cancels whatever it is
    for (const double displaced : {0.0, 0.3, -4.75, 12.0, -31.4}) {
        const Apertures a = pair(displaced, 1.25, 0.0, 1, phase);
        const auto seams = match_slope(a);
        ASSERT_EQ(seams.size(), 1U);
        EXPECT_EQ(seams[0].first, 0);
        EXPECT_EQ(seams[0].second, 1);
        EXPECT_EQ(seams[0].overlap, 120);
        // Samples in single precision; a pixel is 0.025 rad a sample, so this is a hundred-thousandth of one.
        EXPECT_NEAR(seams[0].slope, slope_of(displaced - 1.25), 3e-7) << displaced;
        EXPECT_NEAR(seams[0].coherence, 1.0, 1e-9);
        EXPECT_EQ(seams[0].residual, 0.0);
        EXPECT_LT(seams[0].slope_std, 1e-6);
    }
}

TEST(StripMatch, StatedDeviationIsThatOfManyDraws) {
    // 5 and 15 dB a sample in either line. The bound of a tone in white noise of 120 samples; product noise is not quite Gaussian.
    for (const double noise : {0.3, 0.03}) {
        double square = 0.0;
        double bias = 0.0;
        double stated = 0.0;
        constexpr int draws = 300;
        for (unsigned draw = 0; draw < draws; ++draw) {
            const Seam seam = match_slope(pair(3.0, -2.0, noise, draw + 1))[0];
            const double error = seam.slope - slope_of(5.0);
            square += error * error / draws;
            bias += error / draws;
            stated += seam.slope_std * seam.slope_std / draws;
        }
        // 300 draws: the deviation is known to 4 %; five times that, and a tenth for the noise's product with itself.
        EXPECT_NEAR(std::sqrt(square / stated), 1.0, 0.3) << noise;
        EXPECT_LT(std::abs(bias), 5.0 * std::sqrt(square / draws));
    }
}

TEST(StripMatch, SlopeHoldsForApertureLengthsFromTensToThousands) {
    // Above 512 samples the product is averaged down first; the slopes are near the largest that the window allows.
    for (const std::ptrdiff_t count : {24, 100, 511, 513, 1025, 3000, 6001}) {
        const double rate = 0.8 / static_cast<double>(count);
        const double pixels = static_cast<double>(count) / 12.0;
        const std::vector<Line> lines = {{0, count, slope_of(0.45 * pixels, rate), 0.0, 1.0, 0.001},
                                         {count / 3, count, slope_of(-0.45 * pixels, rate), 1.0, 1.0, 0.001}};
        const Apertures a = make_apertures(lines, 2 * count, {}, 5, rate, pixels);
        const auto seams = match_slope(a);
        ASSERT_EQ(seams.size(), 1U) << count;
        // Five deviations of a tone in white noise of -27 dB over the overlap, twice.
        const double overlap = static_cast<double>(seams[0].overlap);
        const double deviation = std::sqrt(6.0 * 0.002 / (overlap * overlap * overlap));
        EXPECT_NEAR(seams[0].slope, slope_of(0.9 * pixels, rate), 5.0 * deviation) << count;
    }
}

TEST(StripMatch, PairsAreThoseThatOverlapEnough) {
    std::vector<Line> lines;
    for (std::ptrdiff_t i = 0; i < 40; ++i) lines.push_back({10 * i, 200, 0.0, 0.0, 1.0, 0.0});
    const Apertures a = make_apertures(lines, 600, {});
    SlopeMatchOptions options;
    options.minimum_overlap = 0.5;  // 100 samples: ten neighbours behind each point
    const auto all = match_slope(a, options);
    EXPECT_EQ(all.size(), 30U * 10U + 45U);
    for (const Seam& seam : all) {
        EXPECT_LT(seam.first, seam.second);
        EXPECT_EQ(seam.overlap, 200 - 10 * (seam.second - seam.first));
    }
    options.pairs_per_point = 4;
    const auto some = match_slope(a, options);
    std::vector<int> behind(40, 0);
    for (const Seam& seam : some) ++behind[at(seam.first)];
    for (std::size_t i = 0; i < 39; ++i) {
        EXPECT_EQ(behind[i], std::min<int>(4, 39 - static_cast<int>(i)));
        // The nearest is always among them.
        EXPECT_TRUE(std::any_of(some.begin(), some.end(), [&](const Seam& s) {
            return s.first == static_cast<std::int64_t>(i) && s.second == s.first + 1;
        })) << i;
    }
    EXPECT_TRUE(match_slope(make_apertures({{0, 100}, {100, 100}}, 200, {})).empty());
    EXPECT_TRUE(match_slope(make_apertures({{0, 100}}, 100, {})).empty());
    EXPECT_TRUE(match_slope(make_apertures({}, 100, {})).empty());
    EXPECT_TRUE(match_search(make_apertures({{0, 100}, {100, 100}}, 200, {})).empty());
    EXPECT_TRUE(match_search(make_apertures({}, 100, {})).empty());
    EXPECT_EQ(match_search(a).size(), 39U);  // neighbours alone
}

TEST(StripMatch, SearchAgreesWithSlope) {
    const auto phase = smooth_phase(300, 6.0);
    for (const double displaced : {0.0, 0.3, -4.75, 12.2, -14.4}) {
        const Apertures a = pair(displaced, 0.0, 0.0, 1, phase);
        SearchMatchOptions options;
        const double expected = slope_of(displaced);
        Seam seam = match_search(a, options)[0];
        EXPECT_NEAR(seam.slope, expected, 1e-6) << displaced;  // with what is left added, [Xie2023, eq. 22]
        EXPECT_NEAR(seam.coherence, 1.0, 1e-6);
        options.correction = false;
        seam = match_search(a, options)[0];
        EXPECT_LT(std::abs(seam.slope - expected), slope_of(0.5 / 8.0) * 1.001) << displaced;  // half of an eighth of a pixel
        options.interpolation = false;
        seam = match_search(a, options)[0];
        EXPECT_LT(std::abs(seam.slope - expected), slope_of(0.5) * 1.001) << displaced;  // half of a whole one
    }
}

TEST(StripMatch, SearchGrowsItsWidthUntilEquation15Holds) {
    // W reaches W - 1 pixels of relative displacement, equation 15 forgives two more.
    const Apertures a = pair(20.0, 0.0);
    SearchMatchOptions options;
    options.width = 8;
    options.largest_width = 8;
    Seam seam = match_search(a, options)[0];
    EXPECT_EQ(seam.coherence, 0.0);
    EXPECT_EQ(seam.slope, 0.0);
    options.largest_width = 16;
    EXPECT_EQ(match_search(a, options)[0].coherence, 0.0);
    options.largest_width = 31;  // doubling would exceed it
    EXPECT_EQ(match_search(a, options)[0].coherence, 0.0);
    options.largest_width = 32;
    seam = match_search(a, options)[0];
    EXPECT_NEAR(seam.slope, slope_of(20.0), 1e-6);
    EXPECT_GT(seam.coherence, 0.999);
    // What was not matched has no weight in the stitching.
    options.largest_width = 8;
    const Stitching stitching = stitch(a, match_search(a, options));
    EXPECT_EQ(stitching.seams[0].weight, 0.0);
}

TEST(StripMatch, SearchMatrixIsAValleyAlongTheRelativeDisplacement) {
    const Apertures a = pair(3.0, -2.0);
    const Array<double, 2> r = search_matrix(a, 0, 1, 16);
    ASSERT_EQ(r.extents(), (std::array<std::ptrdiff_t, 2>{16, 16}));
    for (std::ptrdiff_t i = 0; i < 16; ++i)
        for (std::ptrdiff_t j = 0; j < 16; ++j) {
            // |r| of [Xie2023, eq. 14] for displacements i - 8 and j - 8.
            const double expected =
                std::abs(std::remainder(slope_of(3.0 - static_cast<double>(i - 8) + 2.0 + static_cast<double>(j - 8)), two_pi));
            EXPECT_NEAR(r(i, j), expected, 1e-6);
            if (i > 0 && j > 0) EXPECT_NEAR(r(i, j), r(i - 1, j - 1), 1e-12);  // of i - j alone: K is the same
        }
    EXPECT_NEAR(r(8 + 5, 8), 0.0, 1e-6);
    EXPECT_NEAR(r(8 + 3, 8 - 2), 0.0, 1e-6);

    Apertures unequal = pair(3.0, -2.0);
    unequal.fm_rate[1] = 1.5 * fm_rate;  // its line keeps its slope
    const Array<double, 2> s = search_matrix(unequal, 0, 1, 16);
    EXPECT_GT(std::abs(s(12, 12) - s(8, 8)), slope_of(1.0));
    EXPECT_NEAR(s(8, 8), r(8, 8), 1e-12);
}

TEST(StripMatch, BitsDependNotOnThreads) {
    std::vector<Line> lines;
    for (std::ptrdiff_t i = 0; i < 25; ++i) lines.push_back({20 * i, 150 + 3 * i, 0.002 * static_cast<double>(i % 7), 0.1, 1.0, 0.5});
    const Apertures a = make_apertures(lines, 900, smooth_phase(900));
    SlopeMatchOptions slope;
    SearchMatchOptions search;
    slope.execution.threads = search.execution.threads = 1;
    const auto first = match_slope(a, slope);
    const auto second = match_search(a, search);
    for (const int threads : {2, 3, 5}) {
        slope.execution.threads = search.execution.threads = threads;
        const auto again = match_slope(a, slope);
        ASSERT_EQ(again.size(), first.size());
        for (std::size_t s = 0; s < first.size(); ++s) {
            EXPECT_EQ(again[s].first, first[s].first);
            EXPECT_EQ(again[s].second, first[s].second);
            EXPECT_EQ(again[s].slope, first[s].slope);
            EXPECT_EQ(again[s].coherence, first[s].coherence);
        }
        const auto searched = match_search(a, search);
        for (std::size_t s = 0; s < second.size(); ++s) EXPECT_EQ(searched[s].slope, second[s].slope);
    }
}

TEST(StripMatch, RefusesHostileInput) {
    const Apertures a = make_apertures({{0, 100}, {50, 100}, {200, 100}}, 300, {});
    SlopeMatchOptions slope;
    slope.pairs_per_point = 0;
    EXPECT_THROW((void)match_slope(a, slope), ValueError);
    for (const double overlap : {0.0, 1.0, -0.2, std::nan("")}) {
        slope = {};
        slope.minimum_overlap = overlap;
        EXPECT_THROW((void)match_slope(a, slope), ValueError) << overlap;
    }
    SearchMatchOptions search;
    for (const int width : {0, 3, -2}) {
        search.width = width;
        EXPECT_THROW((void)match_search(a, search), ValueError) << width;
        EXPECT_THROW((void)search_matrix(a, 0, 1, width), ValueError) << width;
    }
    search = {};
    search.largest_width = 16;
    EXPECT_THROW((void)match_search(a, search), ValueError);
    EXPECT_THROW((void)search_matrix(a, 0, 3, 8), ValueError);
    EXPECT_THROW((void)search_matrix(a, -1, 1, 8), ValueError);
    EXPECT_THROW((void)search_matrix(a, 0, 2, 8), ValueError);  // no overlap
    search = {};
    search.execution.progress = [](const ProgressUpdate&) { return false; };
    EXPECT_THROW((void)match_search(a, search), Cancelled);
    // Lines without any signal match nothing and break nothing.
    Apertures dark = make_apertures({{0, 100, 0.0, 0.0, 0.0}, {50, 100, 0.0, 0.0, 0.0}}, 150, {});
    EXPECT_EQ(match_slope(dark)[0].coherence, 0.0);
    EXPECT_TRUE(std::isfinite(match_slope(dark)[0].slope_std));
    EXPECT_EQ(match_search(dark)[0].coherence, 0.0);
}

}  // namespace
}  // namespace sarfocus::autofocus
