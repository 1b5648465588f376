#include <sarfocus/autofocus/autofocus.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <sarfocus/autofocus/pga.hpp>
#include <sarfocus/core/constants.hpp>
#include <sarfocus/core/error.hpp>
#include <sarfocus/fft/plan.hpp>
#include <sarfocus/quality/image_measures.hpp>

#include "strip_scene_test.hpp"

namespace sarfocus::autofocus {
namespace {

using test::Image;
using test::same_bits;

constexpr std::ptrdiff_t n = 128;
constexpr std::ptrdiff_t gates = 96;

Image speckle(unsigned seed) {
    std::mt19937 bits(seed);
    std::normal_distribution<double> noise(0.0, std::sqrt(0.5));
    Image out({n, gates});
    for (cfloat& pixel : out) pixel = cfloat(cdouble(noise(bits), noise(bits)));
    return out;
}

void put(Image& image, std::ptrdiff_t azimuth, std::ptrdiff_t gate, double db) {
    image(azimuth, gate) += cfloat(static_cast<float>(std::pow(10.0, db / 20.0)), 0.0f);
}

// Points in every stripe of 24 gates.
Image points_in_speckle(unsigned seed) {
    Image out = speckle(seed);
    for (std::ptrdiff_t p = 0; p < 18; ++p) put(out, (17 + 31 * p) % n, 2 + (5 * p) % (gates - 4), 33.0);
    return out;
}

std::vector<double> quadratic(double peak) {
    std::vector<double> out;
    for (std::ptrdiff_t k = 0; k < n; ++k) out.push_back(peak * std::pow(2.0 * static_cast<double>(k) / static_cast<double>(n) - 1.0, 2));
    return out;
}

Image defocused(const Image& image, std::vector<double> phase) {
    for (double& p : phase) p = -p;
    Image out(image.extents());
    correct_azimuth_spectrum(image.view(), phase, out.view());
    return out;
}

const MethodTrial& trial_of(const Result& result, const std::string& name) {
    const auto found = std::find_if(result.trials.begin(), result.trials.end(), [&](const MethodTrial& t) { return t.method == name; });
    if (found == result.trials.end()) throw std::runtime_error("no trial of " + name);
    return *found;
}

TEST(Autofocus, ChoosesAMethodThatFocuses) {
    const Image focused = points_in_speckle(1);
    Image out({n, gates});
    const Result result = autofocus(defocused(focused, quadratic(6.0)).view(), out.view());
    ASSERT_FALSE(result.input_returned()) << result.score.reason;
    // 18 points, 33 dB over clutter of 128 samples: 12 dB a sample, bound 0.042 rad; twice that.
    EXPECT_LT(test::gauge_free_rms(result.phase_error, quadratic(6.0), result.phase_std), 0.084);
    EXPECT_TRUE(trial_of(result, result.method).chosen);
    EXPECT_EQ(std::count_if(result.trials.begin(), result.trials.end(), [](const MethodTrial& t) { return t.chosen; }), 1);
    EXPECT_EQ(result.trials.size(), method_names(Scene::spotlight).size());
    for (const MethodTrial& t : result.trials) {
        EXPECT_FALSE(t.reason.empty()) << t.method;
        EXPECT_GT(t.held_out_points, 3) << t.method;
    }
    // 6 rad of quadratic error over the band take a peak down by about 6 dB.
    EXPECT_GT(trial_of(result, result.method).held_out_gain_db, 3.0);
}

TEST(Autofocus, HandsBackWhatIsInFocus) {
    for (const bool with_points : {true, false}) {
        const Image image = with_points ? points_in_speckle(2) : speckle(3);
        Image out({n, gates});
        const Result result = autofocus(image.view(), out.view());
        EXPECT_TRUE(result.input_returned()) << result.method << ": " << result.score.reason;
        EXPECT_TRUE(same_bits(out, image));
        for (const double p : result.phase_error) EXPECT_EQ(p, 0.0);
        EXPECT_FALSE(result.score.reason.empty());
    }
}

TEST(Autofocus, ASinglePointLeavesNothingToHoldBack) {
    Image focused = speckle(4);
    put(focused, 60, 40, 45.0);
    Image out({n, gates});
    const Result result = autofocus(defocused(focused, quadratic(8.0)).view(), out.view());
    ASSERT_FALSE(result.input_returned()) << result.score.reason;
    EXPECT_EQ(result.method, "pga");
    EXPECT_NE(trial_of(result, "pga").reason.find("too few to hold any back"), std::string::npos) << trial_of(result, "pga").reason;
}

TEST(Autofocus, OfAStripTheMethodThatKeepsTheLinearPhase) {
    const auto geometry = test::strip_geometry(64);
    const std::ptrdiff_t length = 1024;
    std::vector<double> phase;
    const double pixel = two_pi * geometry.fm_rate(32) / (geometry.prf * geometry.prf);  // slope that displaces by a pixel
    const std::vector<double> shift = {0.0, 8.0, 0.0, -4.0, 4.0, 8.0, 0.0};
    double sum = 0.0;
    for (std::ptrdiff_t k = 0; k < length; ++k) {
        sum += pixel * shift[static_cast<std::size_t>(7 * k / length)];
        phase.push_back(sum);
    }
    const auto strip = test::make_strip(geometry, length, test::spread_targets(40, length, 64, 28.0), phase, 1.0);
    Image out(strip.blurred.extents());
    const Result result = autofocus(strip.blurred.view(), geometry, out.view());
    ASSERT_FALSE(result.input_returned()) << result.summary();
    EXPECT_GT(trial_of(result, "spga_linear").held_out_gain_db, trial_of(result, "spga").held_out_gain_db);
    EXPECT_TRUE(result.method == "spga_linear" || result.method == "adaptive_pga") << result.method;
    // By the truth the choice is no worse than either alone: entropy.
    const double chosen = quality::entropy(out.view());
    AutofocusOptions options;
    options.method = "spga";
    (void)autofocus(strip.blurred.view(), geometry, out.view(), options);
    EXPECT_LT(chosen, quality::entropy(out.view()));
    EXPECT_LT(chosen, quality::entropy(strip.blurred.view()));
}

TEST(Autofocus, BitsDependNeitherOnThreadsNorOnStridesNorOnThePlaceOfTheOutput) {
    const Image blurred = defocused(points_in_speckle(5), quadratic(6.0));
    AutofocusOptions options;
    options.methods = {"pga"};
    options.execution.threads = 1;
    Image expected({n, gates});
    const Result first = autofocus(blurred.view(), expected.view(), options);
    Image turned({gates, n});
    for (std::ptrdiff_t i = 0; i < n; ++i)
        for (std::ptrdiff_t j = 0; j < gates; ++j) turned(j, i) = blurred(i, j);
    options.execution.threads = 3;
    Image out({n, gates});
    const Result second = autofocus(ImageView(turned.data(), {n, gates}, {1, n}), out.view(), options);
    EXPECT_EQ(first.phase_error, second.phase_error);
    EXPECT_EQ(first.trials.front().held_out_gain_db, second.trials.front().held_out_gain_db);
    EXPECT_TRUE(same_bits(out, expected));
    Image in_place = blurred.copy();
    (void)autofocus(in_place.view(), in_place.view(), options);
    EXPECT_TRUE(same_bits(in_place, expected));
    Image untouched = speckle(6);
    const Image kept = untouched.copy();
    EXPECT_TRUE(autofocus(untouched.view(), untouched.view(), options).input_returned());
    EXPECT_TRUE(same_bits(untouched, kept));
}

TEST(Autofocus, AMethodThatRefusesAnImageDoesNotEndTheCall) {
    const Image image = speckle(7);
    Image out({8, gates});
    const Result result = autofocus(image.view().slice(0, 0, 8), out.view());  // pga needs 16 lines
    EXPECT_TRUE(result.input_returned());
    EXPECT_NE(trial_of(result, "pga").reason.find("16 azimuth lines"), std::string::npos) << trial_of(result, "pga").reason;
    Image narrow({n, 3});
    EXPECT_NO_THROW((void)autofocus(image.view().slice(1, 0, 3), narrow.view()));
}

TEST(Autofocus, RefusesWhatMakesNoSense) {
    Image image = speckle(8);
    Image out({n, gates});
    AutofocusOptions options;
    options.method = "spga";
    try {
        (void)autofocus(image.view(), out.view(), options);
        FAIL();
    } catch (const ValueError& error) {
        EXPECT_NE(std::string(error.what()).find("adaptive_pga"), std::string::npos) << error.what();
    }
    options.methods = {"pga"};
    options.method = "pga";
    EXPECT_THROW((void)autofocus(image.view(), out.view(), options), ValueError);
    options.method = "auto";
    options.methods = {"magic"};
    EXPECT_THROW((void)autofocus(image.view(), out.view(), options), ValueError);
    Image small({n, gates - 1});
    EXPECT_THROW((void)autofocus(image.view(), small.view()), ShapeError);
    AutofocusOptions cancelled;
    cancelled.execution.progress = [](const ProgressUpdate&) { return false; };
    EXPECT_THROW((void)autofocus(image.view(), out.view(), cancelled), Cancelled);
    image(5, 6) = {std::numeric_limits<float>::quiet_NaN(), 0.0F};
    EXPECT_THROW((void)autofocus(image.view(), out.view()), NumericalError);
    image = Image({n, gates});
    EXPECT_THROW((void)autofocus(image.view(), out.view()), NumericalError);
}

}  // namespace
}  // namespace sarfocus::autofocus
