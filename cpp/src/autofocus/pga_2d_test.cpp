#include <sarfocus/autofocus/pga_2d.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include <sarfocus/autofocus/phase_estimate.hpp>
#include <sarfocus/core/array.hpp>
#include <sarfocus/core/constants.hpp>
#include <sarfocus/core/error.hpp>
#include <sarfocus/quality/image_measures.hpp>

namespace sarfocus::autofocus {
namespace {

using Image = Array<cfloat, 2>;
constexpr std::ptrdiff_t n = 128;
constexpr double ratio = 0.25;

// Points of one pixel in speckle.
Image scene(int points, unsigned seed) {
    std::mt19937 bits(seed);
    std::normal_distribution<float> noise(0.0F, std::sqrt(0.5F));
    std::uniform_real_distribution<double> uniform(0.0, 1.0);
    Image out({n, n});
    for (cfloat& s : out) s = {noise(bits), noise(bits)};
    for (int p = 0; p < points; ++p) {
        const auto i = static_cast<std::ptrdiff_t>((0.1 + 0.8 * uniform(bits)) * static_cast<double>(n));
        const auto j = static_cast<std::ptrdiff_t>((0.1 + 0.8 * uniform(bits)) * static_cast<double>(n));
        out(i, j) += cfloat(std::polar(60.0, two_pi * uniform(bits)));
    }
    return out;
}

std::vector<double> quadratic(double peak) {
    std::vector<double> out;
    for (std::ptrdiff_t k = 0; k < n; ++k) out.push_back(peak * std::pow(2.0 * static_cast<double>(k) / static_cast<double>(n) - 1.0, 2));
    remove_linear(out);
    return out;
}

Image defocused(const Image& image, std::vector<double> phase) {
    for (double& p : phase) p = -p;
    Image out(image.extents());
    correct_two_dimensional(image.view(), phase, ratio, MigrationModel::range_doppler, out.view());
    return out;
}

double residual(const Result& result, const std::vector<double>& truth) {
    std::vector<double> error;
    for (std::size_t k = 0; k < truth.size(); ++k) error.push_back(result.phase_error[k] - truth[k]);
    remove_linear(error);
    double sum = 0.0;
    for (const double e : error) sum += e * e / static_cast<double>(error.size());
    return std::sqrt(sum);
}

bool same_bits(const Image& a, const Image& b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end());
}

// A phase that does not change along azimuth moves the range axis: (1 + y) phi with phi = -2 pi d / ratio puts a point d gates farther
// out, so taking it off brings the point d gates nearer.
TEST(Pga2d, ALongerPathIsTakenOffTowardsNearRange) {
    Image image({n, n});
    image(5, 40) = {1.0F, 0.0F};
    constexpr double gates = 3.0;
    const std::vector<double> phase(static_cast<std::size_t>(n), -two_pi * gates / ratio);
    Image out({n, n});
    correct_two_dimensional(image.view(), phase, ratio, MigrationModel::range_doppler, out.view());
    EXPECT_NEAR(std::abs(out(5, 37)), 1.0, 1e-5);
    correct_two_dimensional(image.view(), phase, ratio, MigrationModel::polar_format, out.view());
    EXPECT_NEAR(std::abs(out(5, 37)), 1.0, 1e-5);
}

TEST(Pga2d, MigrationIsThatOfTheModel) {
    const auto phase = quadratic(30.0);
    EXPECT_NEAR(range_migration(phase, ratio, MigrationModel::range_doppler), 30.0 * ratio / two_pi, 0.05);
    // phi - u dphi/du of a parabola is the parabola turned over, less what the one-sided slope at the ends lacks.
    EXPECT_NEAR(range_migration(phase, ratio, MigrationModel::polar_format), 30.0 * ratio / two_pi, 0.05);
    EXPECT_EQ(range_migration(phase, 0.0, MigrationModel::range_doppler), 0.0);
}

TEST(Pga2d, FindsPhaseAndRatio) {
    const Image focused = scene(30, 1);
    const auto truth = quadratic(60.0);
    const Image blurred = defocused(focused, truth);
    Pga2dOptions options;
    for (const double given : {ratio, std::numeric_limits<double>::quiet_NaN()}) {
        options.bandwidth_ratio = given;
        Image out({n, n});
        const Result result = pga_2d(blurred.view(), out.view(), options);
        EXPECT_FALSE(result.input_returned()) << result.score.reason;
        EXPECT_EQ(result.method, "pga_2d");
        // 30 points of 36 dB: 15 dB a sample, bound 0.023 rad; twice that allowed.
        EXPECT_LT(residual(result, truth), 0.046);
        EXPECT_NEAR(result.migration.bandwidth_ratio, ratio, 0.005);
        EXPECT_LT(quality::entropy(out.view()), quality::entropy(focused.view()) + 0.02);
    }
}

TEST(Pga2d, HandsBackTheInputWhereNothingIsWrong) {
    for (const int points : {0, 1, 30}) {
        const Image image = scene(points, 20 + static_cast<unsigned>(points));
        Image out({n, n});
        const Result result = pga_2d(image.view(), out.view());
        EXPECT_TRUE(result.input_returned()) << points << " points: " << result.score.reason;
        EXPECT_TRUE(same_bits(out, image));
    }
}

TEST(Pga2d, BitsDependNeitherOnThreadsNorOnStridesNorOnThePlaceOfTheOutput) {
    const Image blurred = defocused(scene(30, 4), quadratic(40.0));
    Pga2dOptions options;
    options.points.execution.threads = 1;
    Image expected({n, n});
    const Result first = pga_2d(blurred.view(), expected.view(), options);
    options.points.execution.threads = 3;
    Image turned({n, n});
    for (std::ptrdiff_t i = 0; i < n; ++i)
        for (std::ptrdiff_t j = 0; j < n; ++j) turned(j, i) = blurred(i, j);
    Image out({n, n});
    const Result second = pga_2d(ImageView(turned.data(), {n, n}, {1, n}), out.view(), options);
    EXPECT_EQ(first.phase_error, second.phase_error);
    EXPECT_TRUE(same_bits(out, expected));
    Image in_place = blurred.copy();
    (void)pga_2d(in_place.view(), in_place.view(), options);
    EXPECT_TRUE(same_bits(in_place, expected));
}

TEST(Pga2d, RefusesWhatMakesNoSense) {
    Image image({n, n});
    Image out({n, n});
    EXPECT_THROW((void)pga_2d(image.view(), out.view()), NumericalError);
    image = scene(3, 1);
    Pga2dOptions options;
    options.bandwidth_ratio = 1.0;
    EXPECT_THROW((void)pga_2d(image.view(), out.view(), options), ValueError);
    const auto correct = [&](const std::vector<double>& phase, double with) {
        correct_two_dimensional(image.view(), phase, with, MigrationModel::range_doppler, out.view());
    };
    EXPECT_THROW(correct(std::vector<double>(5, 0.0), ratio), ShapeError);
    EXPECT_THROW(correct(std::vector<double>(static_cast<std::size_t>(n), std::numeric_limits<double>::infinity()), ratio), NumericalError);
    EXPECT_THROW(correct(std::vector<double>(static_cast<std::size_t>(n), 0.0), std::numeric_limits<double>::quiet_NaN()), ValueError);
}

}  // namespace
}  // namespace sarfocus::autofocus
