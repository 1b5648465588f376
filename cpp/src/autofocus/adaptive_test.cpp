#include <sarfocus/autofocus/adaptive.hpp>

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include <sarfocus/autofocus/pga.hpp>
#include <sarfocus/core/array.hpp>
#include <sarfocus/core/constants.hpp>
#include <sarfocus/core/error.hpp>
#include <sarfocus/quality/image_measures.hpp>

namespace sarfocus::autofocus {
namespace {

using Image = Array<cfloat, 2>;

constexpr std::ptrdiff_t n = 256;
constexpr std::ptrdiff_t m = 96;

/// Points of one pixel in speckle of power one.
Image scene(int points, double peak_db, unsigned seed) {
    std::mt19937 generator(seed);
    std::normal_distribution<float> normal(0.0F, std::sqrt(0.5F));
    Image out({n, m});
    for (cfloat& sample : out) sample = {normal(generator), normal(generator)};
    for (int p = 0; p < points; ++p) {
        const auto i = 30 + static_cast<std::ptrdiff_t>(generator() % (n - 60));
        out(i, static_cast<std::ptrdiff_t>(generator() % m)) += static_cast<float>(std::pow(10.0, peak_db / 20.0));
    }
    return out;
}

Image defocused(const Image& image, double peak) {
    std::vector<double> phase;
    for (std::ptrdiff_t k = 0; k < n; ++k)
        phase.push_back(-peak * std::pow(2.0 * static_cast<double>(k) / static_cast<double>(n) - 1.0, 2));
    Image out(image.extents());
    correct_azimuth_spectrum(image.view(), phase, out.view());
    return out;
}

bool same_bits(const Image& a, const Image& b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end());
}

TEST(Adaptive, LongerBoxesFindWhatFillsItsOwnReferenceCells) {
    CfarGateOptions paper;
    paper.extents = {1};
    const Image sharp = scene(1, 30.0, 1);
    const Image blurred = defocused(sharp, 10.0);
    EXPECT_TRUE(cfar_gate(sharp.view(), paper).strong_points);
    EXPECT_FALSE(cfar_gate(blurred.view(), paper).strong_points);
    EXPECT_TRUE(cfar_gate(blurred.view()).strong_points);
    EXPECT_FALSE(cfar_gate(scene(0, 0.0, 1).view()).strong_points);
}

TEST(Adaptive, AGateWithoutReferenceCellsDetectsNothing) {
    Image image({3, 5});
    image(1, 2) = 5.0F;
    const CfarGate gate = cfar_gate(image.view());
    ASSERT_FALSE(gate.cells.empty());
    EXPECT_FALSE(gate.strong_points);
    EXPECT_TRUE(std::isinf(gate.cells.front().threshold));
}

TEST(Adaptive, ChoosesGatesByHalving) {
    // m1 / m2: of 4 gates (9 + 9 + 1 + 1) / 4 = 5 to 1, of 2 gates 9 to 1.
    const std::vector<double> energies = {1.0, 9.0, 1.0, 1.0, 9.0, 1.0, 1.0, 1.0};
    const ArrayView<const double, 1> view(energies.data(), {8});
    EXPECT_EQ(choose_gates(view, 4, 4.9).gates, (std::vector<std::ptrdiff_t>{1, 4, 0, 2}));
    EXPECT_EQ(choose_gates(view, 5, 5.0).gates, (std::vector<std::ptrdiff_t>{1, 4}));
    EXPECT_EQ(choose_gates(view, 128, 5.0).gates, (std::vector<std::ptrdiff_t>{1, 4}));
    const GateChoice none = choose_gates(view, 4, 9.0);
    EXPECT_TRUE(none.gates.empty());
    EXPECT_DOUBLE_EQ(none.mean_strong, 9.0);
    EXPECT_DOUBLE_EQ(none.mean_rest, 15.0 / 7.0);
}

TEST(Adaptive, FocusesAndHandsBack) {
    const Image blurred = defocused(scene(25, 35.0, 2), 9.0);
    Image out({n, m});
    const Result result = adaptive_pga(blurred.view(), out.view());
    EXPECT_FALSE(result.input_returned()) << result.score.reason;
    EXPECT_LT(quality::entropy(out.view()), quality::entropy(blurred.view()));
    EXPECT_TRUE(result.adaptive.strong_points);
    const Image plain = scene(0, 0.0, 3);
    const Result nothing = adaptive_pga(plain.view(), out.view());
    EXPECT_TRUE(nothing.input_returned());
    EXPECT_TRUE(same_bits(out, plain));
    for (const double p : nothing.phase_error) EXPECT_EQ(p, 0.0);
    EXPECT_EQ(nothing.adaptive.denoised, m / 16);
}

TEST(Adaptive, IsNeverWorseThanTheInputNorThanPga) {
    for (unsigned seed = 10; seed < 12; ++seed)
        for (const int points : {0, 3, 60}) {
            const Image blurred = defocused(scene(points, 30.0, seed), 6.0);
            Image out({n, m});
            AdaptiveOptions ours;
            ours.execution.threads = 1;  // small images: threads would wait for one another
            PointOptions theirs;
            theirs.execution.threads = 1;
            ConventionalOptions classic;
            classic.execution.threads = 1;
            const double before = quality::entropy(blurred.view());
            (void)adaptive_pga(blurred.view(), out.view(), ours);
            const double adaptive = quality::entropy(out.view());
            EXPECT_LE(adaptive, before);
            (void)pga(blurred.view(), out.view(), theirs);
            EXPECT_LT(adaptive, quality::entropy(out.view()) + 1e-3) << points << " points, seed " << seed;
            (void)conventional_pga(blurred.view(), out.view(), classic);
            EXPECT_LE(quality::entropy(out.view()), before);
        }
}

TEST(Adaptive, RefusesWhatMakesNoSense) {
    Image image = scene(3, 30.0, 1);
    Image out({n, m});
    AdaptiveOptions options;
    options.k = 0;
    EXPECT_THROW((void)adaptive_pga(image.view(), out.view(), options), ValueError);
    options = {};
    options.sub_aperture = 33;
    EXPECT_THROW((void)adaptive_pga(image.view(), out.view(), options), ValueError);
    options = {};
    options.eta = -1.0;
    EXPECT_THROW((void)adaptive_pga(image.view(), out.view(), options), ValueError);
    EXPECT_THROW((void)sub_apertures(100, 7), ValueError);
    EXPECT_THROW((void)gate_energies(image.view(), 0), ValueError);
    image(4, 5) = {std::numeric_limits<float>::infinity(), 0.0F};
    EXPECT_THROW((void)adaptive_pga(image.view(), out.view()), NumericalError);
    EXPECT_THROW((void)conventional_pga(image.view(), out.view()), NumericalError);
    EXPECT_THROW((void)cfar_gate(image.view()), NumericalError);
    EXPECT_THROW((void)adaptive_pga(image.view().slice(0, 0, 15), out.view().slice(0, 0, 15)), ShapeError);
}

}  // namespace
}  // namespace sarfocus::autofocus
