#include <sarfocus/hrws/si_mec.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <sarfocus/core/array.hpp>
#include <sarfocus/core/error.hpp>
#include <sarfocus/hrws/after_reconstruction.hpp>
#include <sarfocus/sim/hrws.hpp>

namespace sarfocus::hrws {
namespace {

using autofocus::TrajectoryUnknowns;
using geometry::ImageGrid;

constexpr std::ptrdiff_t n_pulse = 120;
constexpr double wavelength = 0.031;

// Three channels at 40 m/s and 2 km: points at ground ranges of 3.0 and 3.6 km, whose range changes by 0.55 and 0.49 of a change of height.
struct Scene {
    Array<double, 2> positions{{n_pulse, 3}};
    Array<double, 2> channels{{3, 3}};
    Array<double, 3> centres{{3, n_pulse, 3}};
    Array<double, 2> motion{{n_pulse, 3}};
    Array<double, 1> start{{1}};
    Array<double, 2> targets{{2, 3}};
    Array<cdouble, 1> reflectivity{{2}};
    Array<cfloat, 3> data{{3, n_pulse, 1200}};

    explicit Scene(double height, double side = 0.0, double noise = 0.0, double second = 1.0) {
        std::mt19937 random(7);
        const auto draw = [&random] { return static_cast<double>(random()) * 0x1p-32 - 0.5; };
        for (std::ptrdiff_t n = 0; n < 3; ++n) channels(n, 0) = 0.35 * static_cast<double>(n);
        for (std::ptrdiff_t k = 0; k < n_pulse; ++k) {
            positions(k, 0) = 40.0 / 60.0 * (static_cast<double>(k) - 0.5 * n_pulse);
            positions(k, 2) = 2000.0;
            motion(k, 2) = height * wavelength * draw();
            motion(k, 1) = side * wavelength * draw();
            for (std::ptrdiff_t n = 0; n < 3; ++n)
                for (std::ptrdiff_t d = 0; d < 3; ++d) centres(n, k, d) = positions(k, d) + 0.5 * channels(n, d);
        }
        targets(0, 1) = 3000.0;
        targets(1, 1) = 3600.0;
        reflectivity(0) = 1.0;
        reflectivity(1) = second * std::polar(1.0, 2.0);
        start(0) = 3560.0;
        sim::PointEchoModel model;
        model.range_start = start.view();
        model.range_spacing = 0.5;
        model.wavelength = wavelength;
        model.bandwidth = 250e6;
        model.noise_power = noise;
        sim::hrws({positions.view(), channels.view(), 0, true, motion.view(), {}, 60.0, 0.0, 0.0}, {targets.view(), reflectivity.view()},
                  model, data.view());
    }

    [[nodiscard]] Echo echo() const { return {data.view(), centres.view(), start.view(), 0.5, wavelength, 60.0, 40.0, {}}; }
};

ImageGrid chip(double ground_range, double along = 0.0) {
    return ImageGrid::plane({along - 1.2, ground_range - 1.0, 0.0}, {0.2, 0.0, 0.0}, {0.0, 0.25, 0.0}, {13, 9});
}

std::vector<ImageGrid> both() {
    return {chip(3000.0, 0.3), chip(3600.0, -0.2)};
}

SiMecOptions narrow() {
    SiMecOptions options;
    options.reconstruct.band.doppler_bandwidth = 120.0;
    return options;
}

// RMS of one coordinate of the motion, constant and line removed, wavelengths.
double left_over(const SiMecResult& found, const Scene& scene, std::ptrdiff_t axis) {
    const double middle = 0.5 * (n_pulse - 1);
    double mean = 0.0;
    double slope = 0.0;
    double square = 0.0;
    const auto off = [&](std::ptrdiff_t k) { return found.motion(k, axis) - scene.motion(k, axis); };
    for (std::ptrdiff_t k = 0; k < n_pulse; ++k) {
        const double x = static_cast<double>(k) - middle;
        mean += off(k) / n_pulse;
        slope += off(k) * x;
        square += x * x;
    }
    double sum = 0.0;
    for (std::ptrdiff_t k = 0; k < n_pulse; ++k)
        sum += std::pow(off(k) - mean - slope / square * (static_cast<double>(k) - middle), 2) / n_pulse;
    return std::sqrt(sum) / wavelength;
}

float peak(const Array<cfloat, 2>& image) {
    float most = 0.0f;
    for (const cfloat& v : image) most = std::max(most, std::abs(v));
    return most;
}

TEST(SiMec, FindsTheHeightAndFocuses) {
    const Scene scene(1.0);
    Array<cfloat, 2> image({13, 9});
    const SiMecResult found = si_mec(scene.echo(), chip(3600.0), both(), image.view(), narrow());
    EXPECT_EQ(found.status, SiMecStatus::converged) << found.summary();
    EXPECT_LT(left_over(found, scene, 2), 1e-3);  // the points' pixels are known to a thousandth of a cell
    EXPECT_GT(found.coherence, 0.9999);
    EXPECT_LT(found.spread, 1e-3 * wavelength);
    for (std::size_t i = 1; i < found.objective.size(); ++i) EXPECT_GE(found.objective[i], found.objective[i - 1] - 1e-12);
    Array<cfloat, 2> truth({13, 9});
    reconstruct(scene.echo(), chip(3600.0), scene.motion.view(), truth.view(), narrow().reconstruct);
    EXPECT_GT(peak(image), 0.98f * peak(truth));  // the common shift, the gauge, moves it between pixels
}

TEST(SiMec, SolvesForHeightAndSideWithTwoRegions) {
    const Scene scene(0.3, 0.1);
    SiMecOptions options = narrow();
    options.motion.unknowns = TrajectoryUnknowns::cross_track;
    Array<cfloat, 2> image({13, 9});
    const SiMecResult found = si_mec(scene.echo(), chip(3600.0), both(), image.view(), options);
    EXPECT_EQ(found.status, SiMecStatus::converged) << found.summary();
    EXPECT_TRUE(std::isnan(found.spread));  // no region can vouch for the other
    // White errors hold a little of a line, which is taken out of both.
    EXPECT_LT(left_over(found, scene, 2), 1e-2);
    EXPECT_LT(left_over(found, scene, 1), 1e-2);
}

TEST(SiMec, HandsOutNothingWhereARegionHoldsNoise) {
    const Scene scene(1.0, 0.0, 0.05, 0.0);
    Array<cfloat, 2> image({13, 9});
    const SiMecResult found = si_mec(scene.echo(), chip(3000.0), both(), image.view(), narrow());
    EXPECT_EQ(found.status, SiMecStatus::no_strong_point) << found.summary();
    EXPECT_NE(found.reason.find("region 1"), std::string::npos) << found.reason;
    for (const double x : found.motion) EXPECT_EQ(x, 0.0);
    Array<cfloat, 2> still({13, 9});
    reconstruct(scene.echo(), chip(3000.0), {}, still.view(), narrow().reconstruct);
    for (std::ptrdiff_t i = 0; i < still.size(); ++i) EXPECT_EQ(image.data()[i], still.data()[i]);
}

TEST(SiMec, SameBitsForAnyThreads) {
    const Scene scene(1.0, 0.0, 0.01);
    SiMecOptions options = narrow();
    Array<cfloat, 2> one({13, 9});
    Array<cfloat, 2> three({13, 9});
    options.execution.threads = 1;
    const SiMecResult first = si_mec(scene.echo(), chip(3000.0), both(), one.view(), options);
    options.execution.threads = 3;
    const SiMecResult second = si_mec(scene.echo(), chip(3000.0), both(), three.view(), options);
    for (std::ptrdiff_t i = 0; i < first.motion.size(); ++i) ASSERT_EQ(first.motion.data()[i], second.motion.data()[i]);
    for (std::ptrdiff_t i = 0; i < one.size(); ++i) ASSERT_EQ(one.data()[i], three.data()[i]);
}

template <class Error>
std::string refusal(const Echo& echo, const std::vector<ImageGrid>& regions, const SiMecOptions& options = narrow()) {
    Array<cfloat, 2> image({13, 9});
    try {
        (void)si_mec(echo, chip(3000.0), regions, image.view(), options);
    } catch (const Error& error) {
        return error.what();
    }
    return "nothing of that kind thrown";
}

TEST(SiMec, RefusesRegionsThatTellNothing) {
    const Scene scene(1.0);
    const Echo echo = scene.echo();
    EXPECT_NE(refusal<ValueError>(echo, {chip(3000.0)}).find("regions: expected two or more"), std::string::npos);
    EXPECT_NE(refusal<ValueError>(echo, {chip(3000.0), chip(3000.0, 5.0)}).find("different ranges"), std::string::npos);
    EXPECT_NE(refusal<ValueError>(echo, {chip(3000.0), chip(9000.0)}).find("regions[1]: expected a strong point"), std::string::npos);
    SiMecOptions options = narrow();
    options.motion.unknowns = TrajectoryUnknowns::full;
    EXPECT_NE(refusal<ValueError>(echo, both(), options).find("at least 4 regions"), std::string::npos);
    options = narrow();
    options.agreement = 1.5;
    EXPECT_NE(refusal<ValueError>(echo, both(), options).find("agreement"), std::string::npos);
}

TEST(SiMec, RefusesChannelsThatAreMissingOrCoincide) {
    Scene scene(1.0);
    for (std::ptrdiff_t k = 0; k < n_pulse; ++k)
        for (std::ptrdiff_t n = 0; n < 3; ++n) scene.centres(n, k, 0) = scene.positions(k, 0) + 40.0 / 60.0 * static_cast<double>(n);
    EXPECT_NE(refusal<NumericalError>(scene.echo(), both()).find("channels 0 and 1 sample the same places"), std::string::npos);
    Scene holed(1.0);
    std::fill(holed.data.begin() + n_pulse * 1200, holed.data.begin() + 2 * n_pulse * 1200, cfloat{});
    EXPECT_NE(refusal<ValueError>(holed.echo(), both()).find("data[1]"), std::string::npos);
    holed.data(1, 5, 7) = cfloat(std::numeric_limits<float>::quiet_NaN(), 0.0f);
    EXPECT_NE(refusal<NumericalError>(holed.echo(), both()).find("data[1]"), std::string::npos);
}

TEST(EvenEcho, OfEvenlySpacedChannelsIsTheirSamples) {
    Scene scene(0.0);
    for (std::ptrdiff_t k = 0; k < n_pulse; ++k)
        for (std::ptrdiff_t n = 0; n < 3; ++n) scene.centres(n, k, 0) = scene.positions(k, 0) + 40.0 / 180.0 * static_cast<double>(n);
    BandOptions band;
    band.interpolation = Interpolation::yen;
    const EvenEcho even = even_echo(scene.echo(), band);
    double worst = 0.0;
    for (std::ptrdiff_t k = 0; k < n_pulse; ++k)
        for (std::ptrdiff_t n = 0; n < 3; ++n)
            for (std::ptrdiff_t i = 0; i < 1200; ++i)
                worst = std::max(worst, static_cast<double>(std::abs(even.data(3 * k + n, i) - scene.data(n, k, i))));
    EXPECT_LT(worst, 1e-6);  // single precision of values up to 1
    EXPECT_NEAR(even.positions(3 * 7 + 2, 0), scene.centres(2, 7, 0), 1e-9);
}

TEST(BpFmsa, FocusesItsRegion) {
    const Scene scene(1.0);
    Array<cfloat, 2> before({13, 9});
    Array<cfloat, 2> image({13, 9});
    BandOptions band;
    band.doppler_bandwidth = 120.0;
    reconstruct(scene.echo(), chip(3000.0), {}, before.view(), narrow().reconstruct);
    BpFmsaOptions options;
    options.band = band;
    const PhaseCompensation found = bp_fmsa(scene.echo(), chip(3000.0), chip(3000.0), image.view(), options);
    EXPECT_EQ(found.phase_error.size(), 3U * n_pulse);
    EXPECT_GT(peak(image), 2.0f * peak(before));
}

}  // namespace
}  // namespace sarfocus::hrws
