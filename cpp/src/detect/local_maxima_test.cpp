#include <sarfocus/detect/local_maxima.hpp>

#include <cmath>
#include <limits>
#include <random>

#include <gtest/gtest.h>

#include <sarfocus/core/array.hpp>
#include <sarfocus/core/error.hpp>

namespace sarfocus::detect {
namespace {

/// Few different values, so that ties are the rule.
Array<cfloat, 2> coarse(std::ptrdiff_t rows, std::ptrdiff_t columns, unsigned seed, int levels) {
    std::mt19937 generator(seed);
    std::uniform_int_distribution<int> level(0, levels);
    Array<cfloat, 2> out({rows, columns});
    for (cfloat& x : out) x = static_cast<float>(level(generator));
    return out;
}

bool same(const std::vector<Point>& a, const std::vector<Point>& b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const Point& p, const Point& q) {
        return p.azimuth == q.azimuth && p.range == q.range && p.intensity == q.intensity;
    });
}

TEST(LocalMaxima, NoTwoWithinReachAndEveryPixelHasADominator) {
    for (const int levels : {1, 3, 1000}) {
        const auto image = coarse(150, 70, 5, levels);
        LocalMaximaOptions options;
        options.half_width = {2, 1};
        const auto found = local_maxima(image.view(), options);
        ASSERT_FALSE(found.empty());
        for (std::size_t k = 0; k < found.size(); ++k) {
            const Point& p = found[k];
            EXPECT_EQ(p.intensity, std::norm(image(p.azimuth, p.range)));
            if (k > 0) EXPECT_TRUE(stronger(found[k - 1], p));
            for (std::ptrdiff_t i = std::max<std::ptrdiff_t>(0, p.azimuth - 2); i <= std::min<std::ptrdiff_t>(149, p.azimuth + 2); ++i)
                for (std::ptrdiff_t j = std::max<std::ptrdiff_t>(0, p.range - 1); j <= std::min<std::ptrdiff_t>(69, p.range + 1); ++j)
                    if (i != p.azimuth || j != p.range) ASSERT_TRUE(stronger(p, {i, j, std::norm(image(i, j))}));
        }
        std::size_t expected = 0;
        for (std::ptrdiff_t i = 0; i < 150; ++i)
            for (std::ptrdiff_t j = 0; j < 70; ++j) {
                const Point p{i, j, std::norm(image(i, j))};
                bool is_maximum = p.intensity > 0.0;
                for (std::ptrdiff_t r = std::max<std::ptrdiff_t>(0, i - 2); r <= std::min<std::ptrdiff_t>(149, i + 2); ++r)
                    for (std::ptrdiff_t c = std::max<std::ptrdiff_t>(0, j - 1); c <= std::min<std::ptrdiff_t>(69, j + 1); ++c)
                        is_maximum = is_maximum && !stronger({r, c, std::norm(image(r, c))}, p);
                expected += is_maximum;
            }
        EXPECT_EQ(found.size(), expected);
    }
}

TEST(LocalMaxima, ThreadsStridesAndSampleTypeDoNotMatter) {
    const auto image = coarse(200, 60, 6, 9);
    Array<cfloat, 2> transposed({60, 200});
    Array<float, 2> intensity({200, 60});
    for (std::ptrdiff_t i = 0; i < 200; ++i)
        for (std::ptrdiff_t j = 0; j < 60; ++j) {
            transposed(j, i) = image(i, j);
            intensity(i, j) = std::norm(image(i, j));
        }
    LocalMaximaOptions options;
    options.execution.threads = 1;
    const auto once = local_maxima(image.view(), options);
    options.execution.threads = 3;
    EXPECT_TRUE(same(once, local_maxima(ImageView(transposed.data(), {200, 60}, {1, 200}), options)));
    EXPECT_TRUE(same(once, local_maxima(intensity.view(), options)));
}

TEST(LocalMaxima, MaskMinimumAndCount) {
    Array<cfloat, 2> image({10, 10});
    image(2, 2) = 5.0F;
    image(2, 7) = 4.0F;
    image(7, 2) = 3.0F;
    image(7, 7) = 2.0F;
    Array<bool, 2> mask({10, 10});
    mask(2, 7) = mask(7, 2) = mask(7, 7) = true;
    EXPECT_EQ(local_maxima(image.view()).size(), 4U);
    LocalMaximaOptions options;
    options.minimum = 4.0;
    options.count = 1;
    const auto found = local_maxima(image.view(), options, mask.view());
    ASSERT_EQ(found.size(), 1U);
    EXPECT_EQ(found[0].range, 7);
    options.minimum = 16.0;  // what is as strong as the minimum does not count
    EXPECT_TRUE(local_maxima(image.view(), options, mask.view()).empty());
    EXPECT_TRUE(local_maxima(Array<cfloat, 2>({4, 4}).view()).empty());
    EXPECT_TRUE(std::isnan(found[0].contrast));
}

TEST(LocalMaxima, Refuses) {
    auto image = coarse(6, 6, 7, 9);
    const auto refused = [&](auto change) {
        LocalMaximaOptions options;
        change(options);
        EXPECT_THROW((void)local_maxima(image.view(), options), ValueError);
    };
    refused([](auto& o) { o.half_width = {-1, 1}; });
    refused([](auto& o) { o.minimum = std::numeric_limits<double>::quiet_NaN(); });
    refused([](auto& o) { o.count = -1; });
    EXPECT_THROW((void)local_maxima(image.view(), {}, Array<bool, 2>({6, 5}).view()), ShapeError);
    LocalMaximaOptions wide;
    wide.half_width = {std::numeric_limits<std::ptrdiff_t>::max() / 4, std::numeric_limits<std::ptrdiff_t>::max() / 4};
    EXPECT_EQ(local_maxima(image.view(), wide).size(), 1U);
    image(1, 1) = std::numeric_limits<float>::quiet_NaN();
    EXPECT_THROW((void)local_maxima(image.view()), NumericalError);
    EXPECT_THROW((void)strongest_samples(image.view()), NumericalError);
    EXPECT_THROW((void)strongest_samples(image.view(), 0), ValueError);
}

TEST(StrongestSamples, FiveOfEveryGate) {
    const auto image = coarse(90, 130, 8, 50);
    const auto found = strongest_samples(image.view(), 5);
    ASSERT_EQ(found.size(), 130U * 5U);
    for (std::ptrdiff_t j = 0; j < 130; ++j) {
        std::vector<Point> gate;
        for (std::ptrdiff_t i = 0; i < 90; ++i) gate.push_back({i, j, std::norm(image(i, j))});
        std::sort(gate.begin(), gate.end(), stronger);
        gate.resize(5);
        EXPECT_TRUE(same(gate, {found.begin() + 5 * j, found.begin() + 5 * j + 5}));
    }
    EXPECT_TRUE(strongest_samples(Array<cfloat, 2>({4, 4}).view()).empty());
    EXPECT_EQ(strongest_samples(image.view(), 1000).size() > 130U * 80U, true);
}

TEST(Coalesce, AgreesWithTheGreedyDefinition) {
    std::mt19937 generator(9);
    std::uniform_int_distribution<std::ptrdiff_t> place(-40, 40);
    std::uniform_int_distribution<int> level(1, 6);
    for (const std::array<std::ptrdiff_t, 2> half_width : {std::array<std::ptrdiff_t, 2>{4, 4}, {0, 3}, {7, 1}, {0, 0}}) {
        std::vector<Point> points;
        for (int k = 0; k < 600; ++k) points.push_back({place(generator), place(generator), static_cast<double>(level(generator))});
        std::vector<Point> sorted = points;
        std::sort(sorted.begin(), sorted.end(), stronger);
        std::vector<Point> expected;
        for (const Point& p : sorted) {
            bool taken = false;
            for (const Point& q : expected)
                taken = taken || (std::abs(p.azimuth - q.azimuth) <= half_width[0] && std::abs(p.range - q.range) <= half_width[1]);
            if (!taken) expected.push_back(p);
        }
        EXPECT_TRUE(same(coalesce(points, half_width), expected));
        std::shuffle(points.begin(), points.end(), generator);
        EXPECT_TRUE(same(coalesce(points, half_width), expected));
        EXPECT_TRUE(same(coalesce(expected, half_width), expected));
    }
    EXPECT_TRUE(coalesce({}).empty());
    EXPECT_THROW((void)coalesce({}, {-1, 0}), ValueError);
}

}  // namespace
}  // namespace sarfocus::detect
