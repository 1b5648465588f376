#include <sarfocus/autofocus/cross_track.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <sarfocus/core/constants.hpp>
#include <sarfocus/core/error.hpp>
#include <sarfocus/focus/azimuth.hpp>

namespace sarfocus::autofocus {
namespace {

constexpr std::ptrdiff_t n = 300;
constexpr double height = 6000.0;
constexpr double wavelength = 0.03;
constexpr double nan = std::numeric_limits<double>::quiet_NaN();

Array<double, 1> list(const std::vector<double>& values) {
    Array<double, 1> out({static_cast<std::ptrdiff_t>(values.size())});
    std::copy(values.begin(), values.end(), out.begin());
    return out;
}

// Constant and line of either component taken out, as the estimate has them: over all samples but [skip, resume).
void remove_lines(Array<double, 2>& d, std::ptrdiff_t skip = n, std::ptrdiff_t resume = n) {
    const auto found = [&](std::ptrdiff_t k) { return k < skip || k >= resume; };
    const auto count = static_cast<double>(n - (resume - skip));
    double middle = 0.0;
    for (std::ptrdiff_t k = 0; k < n; ++k) middle += found(k) ? static_cast<double>(k) / count : 0.0;
    for (std::ptrdiff_t u = 0; u < 2; ++u) {
        double mean = 0.0;
        double moment = 0.0;
        double spread = 0.0;
        for (std::ptrdiff_t k = 0; k < n; ++k) {
            if (!found(k)) continue;
            const double x = static_cast<double>(k) - middle;
            mean += d(k, u) / count;
            moment += x * d(k, u);
            spread += x * x;
        }
        for (std::ptrdiff_t k = 0; k < n; ++k) d(k, u) -= mean + moment / spread * (static_cast<double>(k) - middle);
    }
}

Array<double, 2> wobble() {
    Array<double, 2> out({n, 2});
    for (std::ptrdiff_t k = 0; k < n; ++k) {
        const double t = static_cast<double>(k) / static_cast<double>(n);
        out(k, 0) = 0.03 * std::sin(9.0 * t) + 0.004 * std::cos(40.0 * t);
        out(k, 1) = 0.02 * std::cos(7.0 * t) - 0.01 * t * t;
    }
    remove_lines(out);
    return out;
}

// The phases of a displacement, a constant and a line of its own on each.
Array<double, 2> phases_of(const Array<double, 2>& displacement, const Array<double, 1>& ranges) {
    Array<double, 2> out({ranges.extent(0), n});
    cross_track_phase(displacement.view(), ranges.view(), height, wavelength, out.view());
    for (std::ptrdiff_t b = 0; b < ranges.extent(0); ++b)
        for (std::ptrdiff_t k = 0; k < n; ++k) out(b, k) += 3.0 * static_cast<double>(b) - 0.02 * static_cast<double>(b * b * k);
    return out;
}

double largest_difference(const Array<double, 2>& a, const Array<double, 2>& b) {
    double out = 0.0;
    for (std::ptrdiff_t k = 0; k < a.extent(0); ++k)
        for (std::ptrdiff_t u = 0; u < a.extent(1); ++u) out = std::max(out, std::abs(a(k, u) - b(k, u)));
    return out;
}

TEST(CrossTrack, PhaseIsThatOfTheRangeToAFarPoint) {
    const Array<double, 1> ranges = list({6000.0, 6100.0, 9000.0, 40000.0});
    Array<double, 2> displacement({1, 2});
    displacement(0, 0) = 0.02;
    displacement(0, 1) = -0.015;
    Array<double, 2> phase({4, 1});
    cross_track_phase(displacement.view(), ranges.view(), height, wavelength, phase.view());
    for (std::ptrdiff_t g = 0; g < 4; ++g) {
        const double ground = std::sqrt(ranges(g) * ranges(g) - height * height);
        const double changed = std::hypot(ground - displacement(0, 0), height + displacement(0, 1)) - ranges(g);
        // Second order in the displacement: 0.025^2 / (2 * 6000) m, 2e-5 rad; rounding of 6 km: 1e-12 m.
        EXPECT_NEAR(phase(g, 0), -2.0 * two_pi / wavelength * changed, 4e-5) << g;
    }
}

TEST(CrossTrack, FindsTheDisplacementThroughConstantsAndLines) {
    const Array<double, 2> truth = wobble();
    for (const std::vector<double>& blocks : {std::vector<double>{7000.0, 12000.0}, {8000.0, 9500.0, 11000.0, 13000.0}}) {
        const Array<double, 1> ranges = list(blocks);
        const Array<double, 2> phase = phases_of(truth, ranges);
        const CrossTrackError found = cross_track_error(phase.view(), {}, ranges.view(), height, wavelength);
        // Rounding of phases of 2e3 rad (the lines), 5e-13 rad, in metres and times the condition below 10: 1e-14 m. Allowed: 100 times.
        EXPECT_LT(largest_difference(found.displacement, truth), 1e-12);
        for (const double r : found.residual_rms) EXPECT_LT(r, 1e-9);
        EXPECT_TRUE(std::isnan(found.displacement_std(0, 0)));
    }
}

TEST(CrossTrack, OneUnknownNeedsOneBlock) {
    Array<double, 2> truth = wobble();
    const Array<double, 1> range = list({9000.0});
    for (const bool vertical : {false, true}) {
        Array<double, 2> only = truth.copy();
        for (std::ptrdiff_t k = 0; k < n; ++k) only(k, vertical ? 0 : 1) = 0.0;
        const Array<double, 2> phase = phases_of(only, range);
        CrossTrackOptions options;
        options.unknowns = vertical ? CrossTrackUnknowns::height : CrossTrackUnknowns::horizontal;
        const CrossTrackError found = cross_track_error(phase.view(), {}, range.view(), height, wavelength, options);
        EXPECT_LT(largest_difference(found.displacement, only), 1e-12);
        const double along = vertical ? height / 9000.0 : std::sqrt(1.0 - height * height / 81e6);
        EXPECT_NEAR(found.condition, 1.0 / along, 1e-12);
    }
}

TEST(CrossTrack, ConditionOfTwoBlocksIsThatOfTheAngleBetweenThem) {
    const double middle = 1.0;
    const double half = 0.05;
    const Array<double, 1> ranges = list({height / std::cos(middle - half), height / std::cos(middle + half)});
    const Array<double, 2> phase = phases_of(wobble(), ranges);
    Array<double, 2> sigma({2, n});
    std::fill(sigma.begin(), sigma.end(), 0.06);
    CrossTrackOptions options;
    options.model_std = 0.08;  // 0.1 together
    const CrossTrackError found = cross_track_error(phase.view(), sigma.view(), ranges.view(), height, wavelength, options);
    EXPECT_NEAR(found.condition, 1.0 / std::sin(half), 1e-8);
    // Along the mean line of sight variance sigma^2 / (2 cos^2 half), across it sigma^2 / (2 sin^2 half).
    const double metres = wavelength / (2.0 * two_pi) * 0.1;
    const double along = metres * metres / (2.0 * std::cos(half) * std::cos(half));
    const double across = metres * metres / (2.0 * std::sin(half) * std::sin(half));
    const double s = std::sin(middle);
    const double c = std::cos(middle);
    EXPECT_NEAR(found.displacement_std(7, 0), std::sqrt(along * s * s + across * c * c), 1e-12);
    EXPECT_NEAR(found.displacement_std(7, 1), std::sqrt(along * c * c + across * s * s), 1e-12);
}

TEST(CrossTrack, DeviationIsWhatNoiseGives) {
    const Array<double, 1> ranges = list({8000.0, 10000.0, 13000.0});
    const Array<double, 2> truth = wobble();
    Array<double, 2> phase = phases_of(truth, ranges);
    Array<double, 2> sigma(phase.extents());
    std::mt19937 bits(5);
    std::normal_distribution<double> normal;
    for (std::ptrdiff_t b = 0; b < 3; ++b)
        for (std::ptrdiff_t k = 0; k < n; ++k) {
            sigma(b, k) = 0.02 * static_cast<double>(b + 1) * (1.0 + static_cast<double>(k) / n);
            phase(b, k) += sigma(b, k) * normal(bits);
        }
    CrossTrackOptions options;
    options.model_std = 0.0;
    const CrossTrackError found = cross_track_error(phase.view(), sigma.view(), ranges.view(), height, wavelength, options);
    for (std::ptrdiff_t u = 0; u < 2; ++u) {
        double chi2 = 0.0;
        for (std::ptrdiff_t k = 0; k < n; ++k)
            chi2 += std::pow((found.displacement(k, u) - truth(k, u)) / found.displacement_std(k, u), 2.0) / n;
        // Mean of 300 squares of unit normals, 1 +- 0.08, less the 2 lines' share of 0.01 or so: within 3.5 standard deviations.
        EXPECT_NEAR(chi2, 1.0, 0.3);
    }
}

TEST(CrossTrack, BlocksThatDoNotReachAreLeftOut) {
    const Array<double, 1> ranges = list({8000.0, 10000.0, 13000.0});
    Array<double, 2> truth = wobble();
    Array<double, 2> phase = phases_of(truth, ranges);
    Array<double, 2> sigma(phase.extents());
    std::fill(sigma.begin(), sigma.end(), 0.1);
    for (std::ptrdiff_t k = 100; k < 140; ++k) {  // the middle block alone is wrong there, and says so
        phase(1, k) += 50.0;
        sigma(1, k) = nan;
    }
    const CrossTrackError found = cross_track_error(phase.view(), sigma.view(), ranges.view(), height, wavelength);
    EXPECT_LT(largest_difference(found.displacement, truth), 1e-12);  // as without noise above

    for (std::ptrdiff_t k = 200; k < 220; ++k) {  // one block is left: too few for two unknowns
        sigma(0, k) = std::numeric_limits<double>::infinity();
        sigma(1, k) = nan;
    }
    const CrossTrackError bridged = cross_track_error(phase.view(), sigma.view(), ranges.view(), height, wavelength);
    EXPECT_TRUE(std::isnan(bridged.displacement_std(210, 1)));
    EXPECT_FALSE(std::isnan(bridged.displacement_std(199, 1)));
    for (std::ptrdiff_t u = 0; u < 2; ++u) {
        const double line = bridged.displacement(199, u) + 10.0 / 21.0 * (bridged.displacement(220, u) - bridged.displacement(199, u));
        EXPECT_NEAR(bridged.displacement(209, u), line, 1e-15);
    }
    remove_lines(truth, 200, 220);
    for (std::ptrdiff_t k = 0; k < n; ++k)
        for (std::ptrdiff_t u = 0; u < 2 && (k < 200 || k >= 220); ++u) EXPECT_NEAR(bridged.displacement(k, u), truth(k, u), 1e-12);
}

TEST(CrossTrack, ABlockWhosePhaseDoesNotFitShowsInTheResidual) {
    const Array<double, 1> ranges = list({8000.0, 9500.0, 11000.0, 13000.0});
    Array<double, 2> phase = phases_of(wobble(), ranges);
    for (std::ptrdiff_t k = 150; k < n; ++k) phase(2, k) += two_pi;
    const CrossTrackError found = cross_track_error(phase.view(), {}, ranges.view(), height, wavelength);
    // A step of 2 pi leaves 2 pi sqrt(1/4 - 3/16) = 1.57 rad beside its best line; more than a third of it can't be explained away.
    EXPECT_GT(found.residual_rms[2], 0.5);
}

TEST(CrossTrack, RefusesWhatCannotBeSolved) {
    const Array<double, 2> truth = wobble();
    const Array<double, 1> close = list({9000.0, 9000.0, 9010.0});
    const Array<double, 2> phase = phases_of(truth, close);
    try {
        (void)cross_track_error(phase.view(), {}, close.view(), height, wavelength);
        FAIL() << "blocks at one look angle";
    } catch (const NumericalError& error) {
        EXPECT_NE(std::string(error.what()).find("slant_range: expected blocks at look angles"), std::string::npos) << error.what();
    }
    CrossTrackOptions one;
    one.unknowns = CrossTrackUnknowns::height;
    EXPECT_NO_THROW((void)cross_track_error(phase.view(), {}, close.view(), height, wavelength, one));

    const Array<double, 1> below = list({5000.0, 9000.0, 9900.0});
    EXPECT_THROW((void)cross_track_error(phase.view(), {}, below.view(), height, wavelength), ValueError);
    const Array<double, 1> two = list({8000.0, 9000.0});
    EXPECT_THROW((void)cross_track_error(phase.view(), {}, two.view(), height, wavelength), ShapeError);
    const Array<double, 1> apart = list({8000.0, 9000.0, 12000.0});
    EXPECT_THROW((void)cross_track_error(phase.view(), {}, apart.view(), -1.0, wavelength), ValueError);
    EXPECT_THROW((void)cross_track_error(phase.view(), {}, apart.view(), height, 0.0), ValueError);
    Array<double, 2> sigma(phase.extents());
    one.model_std = 0.0;
    EXPECT_THROW((void)cross_track_error(phase.view(), sigma.view(), apart.view(), height, wavelength, one), ValueError);
    sigma(2, 7) = -0.1;
    EXPECT_THROW((void)cross_track_error(phase.view(), sigma.view(), apart.view(), height, wavelength), ValueError);
    std::fill(sigma.begin(), sigma.end(), nan);
    EXPECT_THROW((void)cross_track_error(phase.view(), sigma.view(), apart.view(), height, wavelength), NumericalError);
    const Array<double, 2> small({3, n - 1});
    EXPECT_THROW((void)cross_track_error(phase.view(), small.view(), apart.view(), height, wavelength), ShapeError);
    Array<double, 2> broken = phase.copy();
    broken(1, 4) = nan;
    EXPECT_THROW((void)cross_track_error(broken.view(), {}, apart.view(), height, wavelength), NumericalError);
    one.model_std = -1.0;
    EXPECT_THROW(one.validate(), ValueError);
    CrossTrackOptions options;
    options.maximum_condition = 0.5;
    EXPECT_THROW((void)cross_track_error(phase.view(), {}, apart.view(), height, wavelength, options), ValueError);
}

TEST(CrossTrack, StridesDoNotMatter) {
    const Array<double, 1> ranges = list({8000.0, 10000.0, 13000.0});
    const Array<double, 2> phase = phases_of(wobble(), ranges);
    Array<double, 2> transposed({n, 3});
    for (std::ptrdiff_t b = 0; b < 3; ++b)
        for (std::ptrdiff_t k = 0; k < n; ++k) transposed(n - 1 - k, b) = phase(b, k);
    const ArrayView<const double, 2> view(&transposed(n - 1, 0), {3, n}, {1, -3});
    const CrossTrackError a = cross_track_error(phase.view(), {}, ranges.view(), height, wavelength);
    const CrossTrackError b = cross_track_error(view, {}, ranges.view(), height, wavelength);
    EXPECT_EQ(largest_difference(a.displacement, b.displacement), 0.0);
}

class CrossTrackStrip : public ::testing::Test {
protected:
    CrossTrackStrip() {
        geometry.wavelength = wavelength;
        geometry.prf = 300.0;
        geometry.velocity = 120.0;
        geometry.doppler_bandwidth = 200.0;
        for (int g = 0; g < 40; ++g) geometry.slant_range.push_back(7000.0 + 100.0 * g);
        std::mt19937 bits(3);
        std::normal_distribution<float> normal;
        for (cfloat& z : image) z = {normal(bits), normal(bits)};
    }

    geometry::StripmapGeometry geometry;
    Array<cfloat, 2> image{{n, 40}};
    Array<double, 2> displacement = wobble();
};

TEST_F(CrossTrackStrip, EveryGateGetsThePhaseOfItsLookAngle) {
    Array<double, 2> phase({40, n});
    const ArrayView<const double, 1> ranges(geometry.slant_range.data(), {40});
    cross_track_phase(displacement.view(), ranges, height, wavelength, phase.view());
    std::vector<double> gates;
    for (int g = 0; g < 40; ++g) gates.push_back(g);
    Array<cfloat, 2> expected({n, 40});
    focus::azimuth_correct(image.view(), geometry, phase.view(), gates, expected.view());
    Array<cfloat, 2> reference({n, 40});
    for (const int threads : {1, 2, 3}) {
        Execution execution;
        execution.threads = threads;
        Array<cfloat, 2> corrected({n, 40});
        correct_cross_track(image.view(), geometry, displacement.view(), height, corrected.view(), execution);
        if (threads == 1) reference = corrected.copy();
        for (std::ptrdiff_t i = 0; i < n; ++i)
            for (std::ptrdiff_t j = 0; j < 40; ++j) {
                EXPECT_LT(std::abs(corrected(i, j) - expected(i, j)), 1e-5F);  // one rounding of the phasor of samples of about 1
                EXPECT_EQ(corrected(i, j), reference(i, j));
            }
    }
    Array<cfloat, 2> in_place = image.copy();
    correct_cross_track(in_place.view(), geometry, displacement.view(), height, in_place.view());
    EXPECT_TRUE(std::equal(in_place.begin(), in_place.end(), reference.begin()));
}

TEST_F(CrossTrackStrip, RefusesWhatDoesNotFit) {
    Array<cfloat, 2> out({n, 40});
    EXPECT_THROW(correct_cross_track(image.view(), geometry, displacement.view(), 7001.0, out.view()), ValueError);
    const Array<double, 2> narrow({n, 1});
    EXPECT_THROW(correct_cross_track(image.view(), geometry, narrow.view(), height, out.view()), ShapeError);
    displacement(5, 1) = nan;
    EXPECT_THROW(correct_cross_track(image.view(), geometry, displacement.view(), height, out.view()), NumericalError);
    const Array<double, 2> rows({2, n});
    const Array<double, 2> scale({2, 39});
    EXPECT_THROW(focus::azimuth_correct(image.view(), geometry, rows.view(), scale.view(), out.view()), ShapeError);
}

}  // namespace
}  // namespace sarfocus::autofocus
