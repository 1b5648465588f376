#include <sarfocus/detect/selection.hpp>

#include <cmath>
#include <limits>
#include <random>

#include <gtest/gtest.h>

#include <sarfocus/core/array.hpp>
#include <sarfocus/core/constants.hpp>
#include <sarfocus/core/error.hpp>

namespace sarfocus::detect {
namespace {

TEST(Contrast, KnownSignals) {
    Array<cfloat, 1> signal({100000});
    for (std::ptrdiff_t i = 0; i < signal.extent(0); ++i) signal(i) = std::polar(3.0F, 0.001F * static_cast<float>(i));
    EXPECT_NEAR(contrast(signal.view()), 0.0, 1e-7);  // amplitudes of 24 bits
    std::mt19937 generator(1);
    std::normal_distribution<float> normal;
    for (cfloat& x : signal) x = {normal(generator), normal(generator)};
    EXPECT_NEAR(contrast(signal.view()), 1.0 - pi / 4.0, 0.01);  // standard error of the ratio below 0.002
    for (cfloat& x : signal) x = 0.0F;
    signal(17) = 1e-20F;
    EXPECT_NEAR(contrast(signal.view()), 1.0 - 1e-5, 1e-12);
    signal(17) = 0.0F;
    EXPECT_THROW((void)contrast(signal.view()), NumericalError);
    signal(17) = std::numeric_limits<float>::quiet_NaN();
    EXPECT_THROW((void)contrast(signal.view()), NumericalError);
    EXPECT_THROW((void)contrast(ArrayView<const cfloat, 1>(signal.data(), {0})), ShapeError);
}

TEST(Contrast, FilterKeepsOrderAndDropsUnknown) {
    const auto kept = filter_contrast({{1, 0, 1.0, 0.3}, {2, 0, 1.0, 0.1}, {3, 0, 1.0}, {4, 0, 1.0, 0.2}}, 0.2);
    ASSERT_EQ(kept.size(), 2U);
    EXPECT_EQ(kept[0].azimuth, 2);
    EXPECT_EQ(kept[1].azimuth, 4);
    EXPECT_THROW((void)filter_contrast({}, std::numeric_limits<double>::quiet_NaN()), ValueError);
}

TEST(StrongestGates, EnergyAndPeakToMean) {
    Array<cfloat, 2> image({50, 200});
    for (std::ptrdiff_t i = 0; i < 50; ++i) image(i, 120) = 2.0F;
    image(7, 30) = 10.0F;
    image(8, 31) = 10.0F;
    const auto energy = strongest_gates(image.view(), {.count = 3, .score = GateScore::energy, .execution = {}});
    ASSERT_EQ(energy.size(), 3U);
    EXPECT_EQ(energy[0].range, 120);
    EXPECT_DOUBLE_EQ(energy[0].score, 200.0);
    EXPECT_EQ(energy[1].range, 30);  // of equals the nearer
    EXPECT_EQ(energy[2].range, 31);
    const auto peak = strongest_gates(image.view(), {.count = 0, .score = GateScore::peak_to_mean, .execution = {}});
    ASSERT_EQ(peak.size(), 200U);
    EXPECT_EQ(peak[0].range, 30);
    EXPECT_DOUBLE_EQ(peak[0].score, 50.0);
    EXPECT_EQ(peak[2].range, 120);
    EXPECT_DOUBLE_EQ(peak[2].score, 1.0);
    EXPECT_DOUBLE_EQ(peak[3].score, 0.0);
    EXPECT_THROW((void)strongest_gates(image.view(), {.count = -1, .score = GateScore::energy, .execution = {}}), ValueError);
}

TEST(StrongestGates, SameBitsForAnyThreadsAndStrides) {
    std::mt19937 generator(2);
    std::normal_distribution<float> normal;
    Array<cfloat, 2> image({70, 150});
    Array<cfloat, 2> transposed({150, 70});
    for (std::ptrdiff_t i = 0; i < 70; ++i)
        for (std::ptrdiff_t j = 0; j < 150; ++j) image(i, j) = transposed(j, i) = {normal(generator), normal(generator)};
    GateOptions options;
    options.execution.threads = 1;
    const auto once = strongest_gates(image.view(), options);
    options.execution.threads = 3;
    const auto again = strongest_gates(ImageView(transposed.data(), {70, 150}, {1, 70}), options);
    for (std::size_t k = 0; k < once.size(); ++k) {
        EXPECT_EQ(once[k].range, again[k].range);
        EXPECT_EQ(once[k].score, again[k].score);
    }
}

TEST(SpreadEvenly, RoundsOverSectionsUpToTheLimit) {
    // Section 0 of four holds five points, section 2 one, section 3 two.
    const std::vector<Point> points{{1, 0, 9.0, 0.5}, {2, 0, 8.0, 0.1},  {3, 0, 7.0, 0.2},  {4, 0, 6.0},
                                    {5, 0, 5.0},      {60, 0, 0.1, 0.9}, {99, 0, 2.0, 0.3}, {80, 0, 3.0, 0.4}};
    const auto chosen = [&](std::ptrdiff_t limit, PointOrder order) {
        std::vector<std::ptrdiff_t> out;
        for (const Point& p : spread_evenly(points, 100, {.limit = limit, .sections = 4, .order = order})) out.push_back(p.azimuth);
        return out;
    };
    using List = std::vector<std::ptrdiff_t>;
    EXPECT_EQ(chosen(3, PointOrder::intensity), (List{1, 60, 80}));
    EXPECT_EQ(chosen(2, PointOrder::intensity), (List{1, 80}));
    EXPECT_EQ(chosen(4, PointOrder::intensity), (List{1, 2, 60, 80}));
    EXPECT_EQ(chosen(5, PointOrder::intensity), (List{1, 2, 60, 80, 99}));
    EXPECT_EQ(chosen(3, PointOrder::contrast), (List{2, 60, 99}));
    EXPECT_EQ(chosen(100, PointOrder::contrast), (List{1, 2, 3, 4, 5, 60, 80, 99}));
    EXPECT_EQ(chosen(0, PointOrder::contrast).size(), 8U);
    EXPECT_TRUE(spread_evenly({}, 100).empty());
    EXPECT_THROW((void)spread_evenly(points, 99), ValueError);
    EXPECT_THROW((void)spread_evenly(points, 100, {.limit = -1, .sections = 4, .order = PointOrder::intensity}), ValueError);
    EXPECT_THROW((void)spread_evenly(points, 100, {.limit = 1, .sections = 0, .order = PointOrder::intensity}), ValueError);
}

TEST(PointLimit, Equation25) {
    EXPECT_EQ(point_limit(4096, 6), 1201);  // sqrt(2) * 3.83366 * sqrt(4096 * 12) = 1201.99
    EXPECT_EQ(point_limit(4096, 1), 313);   // 313.53
    EXPECT_EQ(point_limit(1), 1);
    EXPECT_THROW((void)point_limit(0), ValueError);
    EXPECT_THROW((void)point_limit(10, 0), ValueError);
}

}  // namespace
}  // namespace sarfocus::detect
