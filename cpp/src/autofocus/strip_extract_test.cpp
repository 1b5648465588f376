#include <cmath>
#include <limits>
#include <string>
#include <tuple>

#include <gtest/gtest.h>

#include <sarfocus/core/error.hpp>

#include "strip_scene_test.hpp"

namespace sarfocus::autofocus {
namespace {

using namespace test;

constexpr std::ptrdiff_t n = 1024;

StripPoint point_at(std::int64_t azimuth, std::int64_t range) {
    StripPoint out;
    out.azimuth = azimuth;
    out.range = range;
    return out;
}

std::vector<double> zeros(std::ptrdiff_t count = n) {
    return std::vector<double>(at(count), 0.0);
}

// Is sample k within this share of the aperture, as the band has it, about the point?
bool inside(const Apertures& a, std::ptrdiff_t i, std::ptrdiff_t k, double share) {
    const double half = 0.5 * (200.0 / 240.0) / a.fm_rate[at(i)];
    return std::abs(static_cast<double>(a.start[at(i)] + k - a.points[at(i)].azimuth)) <= share * half;
}

// Largest |line - A exp(j phase)| / |A| over the middle `share` of line i, A fitted.
double misfit(const Apertures& a, std::ptrdiff_t i, const std::vector<double>& phase, double share) {
    cdouble sum{};
    double count = 0.0;
    for (std::ptrdiff_t k = 0; k < a.count[at(i)]; ++k) {
        if (!inside(a, i, k, share)) continue;
        sum += cdouble(a.lines(i, k)) * std::polar(1.0, -phase[at(a.start[at(i)] + k)]);
        count += 1.0;
    }
    const cdouble amplitude = sum / count;
    double worst = 0.0;
    for (std::ptrdiff_t k = 0; k < a.count[at(i)]; ++k) {
        if (!inside(a, i, k, share)) continue;
        const cdouble expected = amplitude * std::polar(1.0, phase[at(a.start[at(i)] + k)]);
        worst = std::max(worst, std::abs(cdouble(a.lines(i, k)) - expected) / std::abs(amplitude));
    }
    return worst;
}

// Largest difference in phase alone, a constant removed.
double phase_misfit(const Apertures& a, std::ptrdiff_t i, const std::vector<double>& phase, double share) {
    cdouble sum{};
    std::vector<cdouble> turned;
    for (std::ptrdiff_t k = 0; k < a.count[at(i)]; ++k) {
        if (!inside(a, i, k, share)) continue;
        turned.push_back(cdouble(a.lines(i, k)) * std::polar(1.0, -phase[at(a.start[at(i)] + k)]));
        sum += turned.back();
    }
    double worst = 0.0;
    for (const cdouble& z : turned) worst = std::max(worst, std::abs(std::arg(z * std::conj(sum))));
    return worst;
}

TEST(StripExtract, LineOfAPointInFocusIsItsReflectivity) {
    // Where the whole band is processed a point at a whole pixel is one sample of the image, which is what it is compared with.
    const auto geometry = strip_geometry(3, 240.0);
    Strip strip = make_strip(geometry, n, {{500.0, 1.0, 30.0}}, zeros());
    const Apertures a = extract_apertures(strip.focused.view(), geometry, {point_at(500, 1)});
    const cfloat expected = strip.focused(500, 1);
    for (std::ptrdiff_t k = 0; k < a.count[0]; ++k) {
        // Single-precision transforms of some 500 samples, a weight as low as 0.02.
        EXPECT_LT(std::abs(a.lines(0, k) - expected), 2e-5F * std::abs(expected)) << k;
    }
    EXPECT_LT(a.points[0].contrast, 1e-8);
    EXPECT_EQ(a.points[0].contrast, aperture_contrast(a, 0));
}

TEST(StripExtract, LineOfADefocusedPointIsThePhaseError) {
    // The piece of image holds what the error spreads the point over. What is left is that the displaced parts of the spectrum meet
    // the taper elsewhere: some per cent in the middle, more towards the ends.
    const auto geometry = strip_geometry(3);
    const auto phase = smooth_phase(n);
    const Strip strip = make_strip(geometry, n, {{500.0, 1.0, 30.0}}, phase);
    StripExtractOptions options;
    options.window = 64;
    const Apertures a = extract_apertures(strip.blurred.view(), geometry, {point_at(500, 1)}, options);
    EXPECT_LT(misfit(a, 0, phase, 0.7), 0.05);
    EXPECT_LT(misfit(a, 0, phase, 0.8), 0.15);
    EXPECT_LT(phase_misfit(a, 0, phase, 0.8), 0.02);
    EXPECT_LT(a.points[0].contrast, 0.002);
}

TEST(StripExtract, ApertureLengthFmRateAndWeightAreThoseOfTheGeometry) {
    const auto geometry = strip_geometry(5, 200.0, 0.0, 700.0);  // slant ranges 4.0 to 6.8 km
    const Strip strip = make_strip(geometry, n, {{500.0, 0.0, 30.0}, {500.0, 4.0, 30.0}}, zeros());
    const Apertures a = extract_apertures(strip.focused.view(), geometry, {point_at(500, 4), point_at(500, 0)});
    ASSERT_EQ(a.size(), 2);
    EXPECT_EQ(a.points[0].range, 0);  // in order of azimuth, then range
    EXPECT_EQ(a.points[1].range, 4);
    for (const std::ptrdiff_t i : {0, 1}) {
        const auto gate = static_cast<std::size_t>(a.points[at(i)].range);
        EXPECT_DOUBLE_EQ(a.fm_rate[at(i)], geometry.fm_rate(gate) / (240.0 * 240.0));
        EXPECT_NEAR(static_cast<double>(a.count[at(i)]), 0.95 * geometry.aperture_samples(gate), 0.1 * geometry.aperture_samples(gate));
        // Symmetric about the point.
        EXPECT_NEAR(static_cast<double>(2 * a.start[at(i)] + a.count[at(i)] - 1), 1000.0, 1.0);
        double middle = 0.0;
        for (std::ptrdiff_t k = a.count[at(i)] / 4; k < 3 * a.count[at(i)] / 4; ++k) middle += static_cast<double>(a.weight(i, k));
        EXPECT_NEAR(middle / static_cast<double>(a.count[at(i)] / 2), 1.0, 0.03);
        EXPECT_LT(misfit(a, i, zeros(), 0.7), 0.03);
        EXPECT_DOUBLE_EQ(a.shift(i, 0.01), 0.01 / (two_pi * a.fm_rate[at(i)]));
        for (std::ptrdiff_t k = a.count[at(i)]; k < a.lines.extent(1); ++k) EXPECT_EQ(a.lines(i, k), cfloat{});
    }
    EXPECT_NEAR(a.fm_rate[0] / a.fm_rate[1], 6800.0 / 4000.0, 1e-12);
    EXPECT_EQ(a.n_azimuth, n);
    EXPECT_EQ(a.window, 32.0);
}

TEST(StripExtract, DopplerCentroidMovesNothing) {
    // A band that is folded round the prf: the same point seen with squint has the same line.
    const auto phase = smooth_phase(n);
    const auto straight = strip_geometry(3);
    const Strip expected = make_strip(straight, n, {{500.0, 1.0, 30.0}}, phase);
    const Apertures a = extract_apertures(expected.blurred.view(), straight, {point_at(500, 1)});
    for (const double centroid : {100.0, -700.0}) {
        const auto geometry = strip_geometry(3, 200.0, centroid);
        const Strip strip = make_strip(geometry, n, {{500.0, 1.0, 30.0}}, phase);
        const Apertures b = extract_apertures(strip.blurred.view(), geometry, {point_at(500, 1)});
        EXPECT_EQ(a.start, b.start);
        EXPECT_EQ(a.count, b.count);
        cdouble product{};
        double power = 0.0;
        for (std::ptrdiff_t k = 0; k < a.count[0]; ++k) {
            product += cdouble(b.lines(0, k)) * std::conj(cdouble(a.lines(0, k)));
            power += std::norm(cdouble(a.lines(0, k)));
        }
        // The band's edges fall between other samples of the spectrum: a thousandth or so.
        EXPECT_NEAR(std::abs(product) / power, 1.0, 0.01) << centroid;
        EXPECT_LT(b.points[0].contrast, 0.01);
    }
}

TEST(StripExtract, ADisplacementIsALinearPhase) {
    const auto geometry = strip_geometry(3);
    const Strip strip = make_strip(geometry, n, {{500.0, 1.0, 30.0}}, zeros());
    const Apertures a = extract_apertures(strip.focused.view(), geometry, {point_at(494, 1), point_at(500, 1), point_at(505, 1)});
    for (const std::ptrdiff_t i : {0, 2}) {
        // [Xie2023, eq. 4, 10]: what lies d pixels behind the point that the line is taken about has the slope 2 pi K d / prf^2.
        const double displaced = 500.0 - static_cast<double>(a.points[at(i)].azimuth);
        std::vector<double> phase(at(n));
        for (std::ptrdiff_t k = 0; k < n; ++k) phase[at(k)] = two_pi * a.fm_rate[at(i)] * displaced * static_cast<double>(k - 500);
        // Not exactly: the envelopes are displaced as well, and the phase of their ends with them (Fresnel ripple; 173 cycles of chirp).
        EXPECT_LT(phase_misfit(a, i, phase, 0.7), 0.1) << displaced;
        EXPECT_NEAR(a.shift(i, two_pi * a.fm_rate[at(i)] * displaced), displaced, 1e-9);
    }
    for (const Seam& seam : match_slope(a)) {
        const auto between = static_cast<double>(a.points[at(seam.second)].azimuth - a.points[at(seam.first)].azimuth);
        EXPECT_NEAR(a.shift(seam.first, seam.slope), between, 0.01);  // the ripple is even about the middle
    }
}

TEST(StripExtract, AperturesAreCutOffAtTheEndsOfTheStrip) {
    const auto geometry = strip_geometry(3);
    const Strip strip = make_strip(geometry, n, {{0.0, 0.0, 30.0}, {40.0, 1.0, 30.0}, {1023.0, 2.0, 30.0}}, zeros());
    const Apertures a = extract_apertures(strip.focused.view(), geometry, {point_at(0, 0), point_at(40, 1), point_at(1023, 2)});
    EXPECT_EQ(a.start[0], 0);
    EXPECT_EQ(a.start[1], 0);
    EXPECT_NEAR(static_cast<double>(a.count[0]), 104.0, 8.0);
    EXPECT_NEAR(static_cast<double>(a.count[1]), 144.0, 8.0);
    EXPECT_EQ(a.start[2] + a.count[2], n);
    EXPECT_NEAR(static_cast<double>(a.count[2]), 104.0, 8.0);
    // Half of the piece of image lies beyond the strip, the side lobes of the point with it.
    for (const std::ptrdiff_t i : {0, 1, 2}) EXPECT_LT(misfit(a, i, zeros(), 0.7), i == 1 ? 0.05 : 0.4) << i;

    const std::ptrdiff_t few = 100;  // half an aperture
    const Strip brief = make_strip(geometry, few, {{50.0, 1.0, 30.0}}, zeros(few));
    const Apertures b = extract_apertures(brief.focused.view(), geometry, {point_at(50, 1)});
    EXPECT_EQ(b.start[0], 0);
    EXPECT_EQ(b.count[0], few);
    EXPECT_LT(misfit(b, 0, zeros(few), 0.7), 0.1);  // periodic over a hundred samples: the spectrum has few of them
}

TEST(StripExtract, ContrastTellsSpeckleAndWeakSignalsFromPoints) {
    const auto geometry = strip_geometry(40);
    const Strip strip = make_strip(geometry, n, {{500.0, 1.0, 40.0}}, zeros(), 1.0);
    std::vector<StripPoint> places;
    for (std::int64_t g = 4; g < 40; ++g)
        for (const std::int64_t u : {200, 420, 640, 860}) places.push_back(point_at(u, g));
    double sum = 0.0;
    const Apertures a = extract_apertures(strip.focused.view(), geometry, places);
    for (const StripPoint& p : a.points) sum += p.contrast;
    // 1 - pi / 4 for an amplitude with the distribution of Rayleigh; a window of 64 pixels is some 50 independent samples, of which Q_k
    // is a biased estimate by about 0.2 / 50. 144 places with a deviation of about 0.04 each.
    EXPECT_NEAR(sum / static_cast<double>(a.size()), 1.0 - pi / 4.0, 0.02);
    const Apertures one = extract_apertures(strip.focused.view(), geometry, {point_at(500, 1)});
    EXPECT_LT(one.points[0].contrast, 0.01);  // 40 dB over clutter of which 50 pixels are let in: Q about half of 1 / 200
    EXPECT_THROW((void)aperture_contrast(one, 1), ValueError);
    EXPECT_THROW((void)aperture_contrast(one, -1), ValueError);
    Image dark({n, 40});
    dark(0, 0) = 1.0F;
    EXPECT_EQ(extract_apertures(dark.view(), geometry, {point_at(500, 1)}).points[0].contrast, 1.0);
}

TEST(StripExtract, WindowGrowsUntilItHoldsThePoints) {
    // A twelfth of the aperture is below the least, 32; a curvature of so many pixels to either side needs as many, up to pieces of more
    // than half an aperture.
    const auto geometry = strip_geometry(32);
    const auto targets = spread_targets(12, n, 32, 35.0);
    std::vector<StripPoint> places;
    for (const Target& t : targets) places.push_back(point_at(std::lround(t.azimuth), std::lround(t.range)));
    int before = 0;
    for (const auto& [pixels, least, most] :
         {std::tuple{0.0, 32, 32}, std::tuple{20.0, 32, 64}, std::tuple{50.0, 64, 64}, std::tuple{400.0, 64, 64}}) {
        // Quadratic over pieces of one aperture: slopes from -pixels to +pixels.
        std::vector<double> phase(at(n));
        const double pixel = two_pi * geometry.fm_rate(16) / (240.0 * 240.0);
        for (std::ptrdiff_t k = 1; k < n; ++k)
            phase[at(k)] = phase[at(k - 1)] + pixel * pixels * (static_cast<double>(k % 208) / 104.0 - 1.0);
        const Strip strip = make_strip(geometry, n, targets, phase, 1.0);
        const int window = containing_window(strip.blurred.view(), geometry, places);
        EXPECT_GE(window, least) << pixels;
        EXPECT_LE(window, most) << pixels;
        EXPECT_GE(window, before);
        before = window;
        EXPECT_EQ(extract_apertures(strip.blurred.view(), geometry, places).window, static_cast<double>(window));
    }
    const Strip strip = make_strip(geometry, n, targets, zeros(), 1.0);
    EXPECT_EQ(containing_window(strip.focused.view(), geometry, {}), 32);
    EXPECT_THROW((void)containing_window(strip.focused.view(), geometry, {point_at(n, 0)}), ValueError);
    EXPECT_THROW((void)containing_window(strip.focused.view(), strip_geometry(3), places), ShapeError);
}

TEST(StripExtract, BitsDependOnNeitherThreadsNorStrides) {
    const auto geometry = strip_geometry(8);
    const Strip strip = make_strip(geometry, n, spread_targets(9, n, 8, 30.0), smooth_phase(n), 1.0);
    std::vector<StripPoint> places;
    for (const Target& t : strip.targets) places.push_back(point_at(std::lround(t.azimuth), std::lround(t.range)));
    StripExtractOptions options;
    options.execution.threads = 1;
    const Apertures expected = extract_apertures(strip.blurred.view(), geometry, places, options);
    Image turned({8, n});
    for (std::ptrdiff_t i = 0; i < n; ++i)
        for (std::ptrdiff_t g = 0; g < 8; ++g) turned(7 - g, i) = strip.blurred(i, g);
    const ImageView strided(turned.data() + 7 * n, {n, 8}, {1, -n});
    for (const int threads : {2, 3, 5}) {
        options.execution.threads = threads;
        const Apertures a = extract_apertures(threads == 3 ? strided : ImageView(strip.blurred.view()), geometry, places, options);
        EXPECT_TRUE(same_bits(a.lines, expected.lines)) << threads;
        EXPECT_TRUE(std::equal(a.weight.begin(), a.weight.end(), expected.weight.begin())) << threads;
        EXPECT_EQ(a.start, expected.start);
        for (std::size_t p = 0; p < places.size(); ++p) EXPECT_EQ(a.points[p].contrast, expected.points[p].contrast);
    }
}

TEST(StripExtract, RefusesHostileInput) {
    const auto geometry = strip_geometry(3);
    Strip strip = make_strip(geometry, n, {{500.0, 1.0, 30.0}}, zeros());
    EXPECT_EQ(extract_apertures(strip.focused.view(), geometry, {}).size(), 0);
    for (const StripPoint& bad : {point_at(-1, 0), point_at(n, 0), point_at(0, -1), point_at(0, 3)})
        EXPECT_THROW((void)extract_apertures(strip.focused.view(), geometry, {bad}), ValueError);
    EXPECT_THROW((void)extract_apertures(strip.focused.view(), strip_geometry(4), {}), ShapeError);
    EXPECT_THROW((void)extract_apertures(strip.focused.view(), strip_geometry(3, 200.0, 800.0), {}), ValueError);            // squint 0.104
    EXPECT_THROW((void)extract_apertures(strip.focused.view(), strip_geometry(3, 200.0, 0.0, 0.5, 500.0), {}), ValueError);  // 26 samples
    StripExtractOptions options;
    options.taper = 1.5;
    EXPECT_THROW((void)extract_apertures(strip.focused.view(), geometry, {}, options), ValueError);
    options = {};
    options.window = -1;
    EXPECT_THROW((void)extract_apertures(strip.focused.view(), geometry, {}, options), ValueError);
    options = {};
    options.execution.threads = -1;
    EXPECT_THROW((void)extract_apertures(strip.focused.view(), geometry, {}, options), ValueError);
    options = {};
    options.execution.progress = [](const ProgressUpdate&) { return false; };
    EXPECT_THROW((void)extract_apertures(strip.focused.view(), geometry, {point_at(500, 1)}, options), Cancelled);

    strip.focused(510, 1) = {0.0F, std::numeric_limits<float>::quiet_NaN()};
    try {
        (void)extract_apertures(strip.focused.view(), geometry, {point_at(300, 1), point_at(500, 1)});
        FAIL();
    } catch (const NumericalError& error) {
        EXPECT_NE(std::string(error.what()).find("[500, 1]"), std::string::npos) << error.what();
    }
    EXPECT_NO_THROW((void)extract_apertures(strip.focused.view(), geometry, {point_at(300, 1)}));  // only what is cut is looked at
}

}  // namespace
}  // namespace sarfocus::autofocus
