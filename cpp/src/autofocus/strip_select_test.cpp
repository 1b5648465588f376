#include <cmath>
#include <limits>
#include <set>
#include <string>

#include <gtest/gtest.h>

#include <sarfocus/core/error.hpp>
#include <sarfocus/detect/selection.hpp>

#include "strip_scene_test.hpp"

namespace sarfocus::autofocus {
namespace {

using namespace test;

constexpr std::ptrdiff_t n = 1024;
constexpr std::ptrdiff_t gates = 48;

std::vector<double> zeros() {
    return std::vector<double>(at(n), 0.0);
}

// Targets with a chosen point within so many pixels of azimuth.
std::set<std::size_t> found(const std::vector<StripPoint>& points, const std::vector<Target>& targets, double pixels) {
    std::set<std::size_t> out;
    for (const StripPoint& p : points)
        for (std::size_t t = 0; t < targets.size(); ++t)
            if (static_cast<double>(p.range) == targets[t].range && std::abs(static_cast<double>(p.azimuth) - targets[t].azimuth) <= pixels)
                out.insert(t);
    return out;
}

void expect_in_order(const std::vector<StripPoint>& points) {
    for (std::size_t i = 1; i < points.size(); ++i) {
        EXPECT_LE(points[i - 1].azimuth, points[i].azimuth);
        if (points[i - 1].azimuth == points[i].azimuth) EXPECT_LT(points[i - 1].range, points[i].range);
    }
}

TEST(StripSelect, FindsThePointsOfAFocusedStrip) {
    const auto geometry = strip_geometry(gates);
    for (const unsigned seed : {1U, 2U, 3U}) {
        const Strip strip = make_strip(geometry, n, spread_targets(20, n, gates, 28.0), zeros(), 1.0, seed);
        const auto points = select_strip_points(strip.focused.view(), geometry);
        EXPECT_EQ(found(points, strip.targets, 1.0).size(), 20U) << seed;
        EXPECT_LE(points.size(), 21U) << seed;  // 1e-6 of some ten thousand independent boxes, and chance
        expect_in_order(points);
        for (const StripPoint& p : points) {
            EXPECT_GE(p.contrast, 0.0);
            EXPECT_LE(p.contrast, 0.25);
            EXPECT_GT(p.statistic, 0.0);
            EXPECT_GT(p.energy, 0.0);
        }
    }
}

TEST(StripSelect, FindsPointsThatNoSinglePixelShows) {
    // A curvature that spreads a point over some 40 pixels: each holds 1/30 of its energy.
    const auto geometry = strip_geometry(gates);
    std::vector<double> phase;
    for (std::ptrdiff_t k = 0; k < n; ++k) phase.push_back(40.0 * std::sin(two_pi * static_cast<double>(k) / 300.0));
    const Strip strip = make_strip(geometry, n, spread_targets(16, n, gates, 28.0), phase, 1.0, 3);
    StripSelectOptions options;
    const auto points = select_strip_points(strip.blurred.view(), geometry, options);
    options.extents = {1};
    const auto sharp = select_strip_points(strip.blurred.view(), geometry, options);
    EXPECT_GE(found(points, strip.targets, 45.0).size(), 13U);
    EXPECT_GT(found(points, strip.targets, 45.0).size(), found(sharp, strip.targets, 45.0).size());
}

TEST(StripSelect, FindsNothingInClutter) {
    const auto geometry = strip_geometry(gates);
    std::size_t all = 0;
    for (unsigned seed = 1; seed <= 10; ++seed)
        all += select_strip_points(make_strip(geometry, n, {}, zeros(), 1.0, seed).focused.view(), geometry).size();
    // 10 strips of 49 000 pixels at 1e-6: half a false alarm among single pixels, no more among longer boxes; 1e-6 holds within 5 % of the
    // factor. More than 6 has a probability below 1e-4.
    EXPECT_LE(all, 6U);
    Image dark({n, gates});
    EXPECT_TRUE(select_strip_points(dark.view(), geometry).empty());
    dark(500, 20) = 1.0F;  // a single pixel: all there is
    EXPECT_EQ(select_strip_points(dark.view(), geometry).size(), 1U);
}

TEST(StripSelect, SpreadsPointsEvenlyAndKeepsTheCap) {
    const auto geometry = strip_geometry(gates);
    // A cluster of the strongest in the first eighth, a few weak ones everywhere else.
    std::vector<Target> targets;
    for (int t = 0; t < 24; ++t) targets.push_back({5.0 + 5.0 * t, static_cast<double>((5 + 7 * t) % gates), 36.0});
    for (int t = 0; t < 8; ++t) targets.push_back({180.0 + 105.0 * t, static_cast<double>((2 + 11 * t) % gates), 27.0});
    const Strip strip = make_strip(geometry, n, targets, zeros(), 1.0);
    StripSelectOptions options;
    options.points = 12;
    const auto points = select_strip_points(strip.focused.view(), geometry, options);
    EXPECT_EQ(points.size(), 12U);
    std::size_t late = 0;
    for (const StripPoint& p : points) late += p.azimuth > 150 ? 1U : 0U;
    EXPECT_EQ(late, 8U);
    options.points = 1;
    EXPECT_EQ(select_strip_points(strip.focused.view(), geometry, options).size(), 1U);

    // The default is the smaller of K_up [Xie2023, eq. 25] and so many for each of the 4.9 apertures.
    EXPECT_EQ(detect::point_limit(4096), static_cast<std::ptrdiff_t>(std::sqrt(2.0) * std::pow(6.0, 0.75) * std::sqrt(4096.0 * 12.0)));
    const Strip many = make_strip(geometry, n, spread_targets(60, n, gates, 32.0), zeros(), 1.0);
    options = {};
    options.points_per_aperture = 4;
    EXPECT_EQ(select_strip_points(many.focused.view(), geometry, options).size(), 20U);
}

TEST(StripSelect, SideLobesAreNoPoints) {
    // 60 dB over clutter: the side lobes of the sinc, -13 dB and falling as 1 / x, stand out of it over a thousand pixels.
    const auto geometry = strip_geometry(gates);
    const Strip strip = make_strip(geometry, n, {{500.3, 20.0, 60.0}}, smooth_phase(n), 1.0);
    for (const Image* image : {&strip.focused, &strip.blurred}) {
        const auto points = select_strip_points(image->view(), geometry);
        for (const StripPoint& p : points)
            if (std::abs(p.azimuth - 500) <= 104) EXPECT_NEAR(static_cast<double>(p.azimuth), 500.3, 8.0);
        EXPECT_EQ(found(points, strip.targets, 8.0).size(), 1U);
        EXPECT_LE(points.size(), 4U);
    }
}

TEST(StripSelect, ContrastFiltersWhatIsNoPoint) {
    // A patch of bright speckle as strong as the points: its decompressed signal is uneven.
    const auto geometry = strip_geometry(gates);
    Strip strip = make_strip(geometry, n, spread_targets(8, n, gates / 2, 30.0), zeros(), 1.0);
    const Strip bright = make_strip(geometry, n, {}, zeros(), 1000.0, 77);
    for (std::ptrdiff_t i = 400; i < 430; ++i) strip.focused(i, 40) = bright.focused(i, 40);
    StripSelectOptions options;
    options.maximum_contrast = 0.1;
    const auto strict = select_strip_points(strip.focused.view(), geometry, options);
    EXPECT_EQ(found(strict, strip.targets, 2.0).size(), 8U);  // Q about 0.03
    for (const StripPoint& p : strict) EXPECT_NE(p.range, 40);
    options.maximum_contrast = 1.0;
    const auto lax = select_strip_points(strip.focused.view(), geometry, options);
    EXPECT_TRUE(std::any_of(lax.begin(), lax.end(), [](const StripPoint& p) { return p.range == 40; }));
}

TEST(StripSelect, BitsDependOnNeitherThreadsNorStrides) {
    const auto geometry = strip_geometry(gates, 200.0, 90.0, 20.0);
    const Strip strip = make_strip(geometry, n, spread_targets(25, n, gates, 25.0), smooth_phase(n), 1.0);
    StripSelectOptions options;
    options.execution.threads = 1;
    const auto expected = select_strip_points(strip.blurred.view(), geometry, options);
    EXPECT_GE(expected.size(), 20U);
    Image turned({gates, n});
    for (std::ptrdiff_t i = 0; i < n; ++i)
        for (std::ptrdiff_t g = 0; g < gates; ++g) turned(g, n - 1 - i) = strip.blurred(i, g);
    const ImageView strided(turned.data() + (n - 1), {n, gates}, {-1, n});
    Image by_gates({gates, n});
    for (std::ptrdiff_t i = 0; i < n; ++i)
        for (std::ptrdiff_t g = 0; g < gates; ++g) by_gates(g, i) = strip.blurred(i, g);
    const ImageView layouts[] = {strided, strip.blurred.view(), ImageView(by_gates.data(), {n, gates}, {1, n})};
    for (const int threads : {1, 2, 3, 4, 5}) {
        options.execution.threads = threads;
        const auto points = select_strip_points(layouts[threads % 3], geometry, options);
        ASSERT_EQ(points.size(), expected.size()) << threads;
        for (std::size_t p = 0; p < points.size(); ++p) {
            EXPECT_EQ(points[p].azimuth, expected[p].azimuth);
            EXPECT_EQ(points[p].range, expected[p].range);
            EXPECT_EQ(points[p].energy, expected[p].energy);
            EXPECT_EQ(points[p].contrast, expected[p].contrast);
        }
    }
}

TEST(StripSelect, TakesStripsOfAnySize) {
    for (const auto& [rows, columns] : {std::pair<std::ptrdiff_t, std::ptrdiff_t>{1, 1}, {7, 3}, {63, 1}, {100, 17}, {2000, 2}}) {
        const auto geometry = strip_geometry(columns);
        Image image({rows, columns});
        image(rows / 2, columns / 2) = {3.0F, -1.0F};
        for (const StripPoint& p : select_strip_points(image.view(), geometry)) {
            EXPECT_EQ(p.range, columns / 2);
            EXPECT_LE(std::abs(p.azimuth - rows / 2), 2);
        }
    }
}

TEST(StripSelect, RefusesHostileInput) {
    const auto geometry = strip_geometry(gates);
    Strip strip = make_strip(geometry, n, {{500.0, 1.0, 30.0}}, zeros(), 1.0);
    const auto refused = [&](const auto& change) {
        StripSelectOptions options;
        change(options);
        EXPECT_THROW((void)select_strip_points(strip.focused.view(), geometry, options), ValueError);
    };
    refused([](StripSelectOptions& o) { o.extents = {}; });
    refused([](StripSelectOptions& o) { o.extents = {4, 0}; });
    refused([](StripSelectOptions& o) { o.maximum_contrast = 0.0; });
    refused([](StripSelectOptions& o) { o.maximum_contrast = 1.1; });
    refused([](StripSelectOptions& o) { o.points = -1; });
    refused([](StripSelectOptions& o) { o.points_per_aperture = 0; });
    refused([](StripSelectOptions& o) { o.dynamic_range_db = 0.0; });
    refused([](StripSelectOptions& o) { o.window = -1; });
    refused([](StripSelectOptions& o) { o.execution.threads = -1; });
    refused([](StripSelectOptions& o) { o.cfar.false_alarm_probability = 0.0; });
    EXPECT_THROW((void)select_strip_points(strip.focused.view(), strip_geometry(gates + 1)), ShapeError);
    StripSelectOptions options;
    options.execution.progress = [](const ProgressUpdate&) { return false; };
    EXPECT_THROW((void)select_strip_points(strip.focused.view(), geometry, options), Cancelled);
    strip.focused(77, 13) = {std::numeric_limits<float>::infinity(), 0.0F};
    try {
        (void)select_strip_points(strip.focused.view(), geometry);
        FAIL();
    } catch (const NumericalError& error) {
        EXPECT_NE(std::string(error.what()).find("[77, 13]"), std::string::npos) << error.what();
    }
}

}  // namespace
}  // namespace sarfocus::autofocus
