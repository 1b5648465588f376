#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include <sarfocus/core/error.hpp>

#include "strip_scene_test.hpp"

namespace sarfocus::autofocus {
namespace {

using namespace test;

// `count` apertures of 256 samples, one every `step`, with linear terms and constants of their own.
std::vector<Line> chain(int count, std::ptrdiff_t step, double noise, std::ptrdiff_t first = 0) {
    std::vector<Line> out;
    for (int i = 0; i < count; ++i) {
        Line line;
        line.start = first + step * i;
        line.count = 256;
        line.slope = 0.02 * std::sin(1.3 * i);
        line.constant = 0.9 * i * i;
        line.amplitude = 1.0 + 0.3 * std::cos(2.0 * i);
        line.noise = noise;
        out.push_back(line);
    }
    return out;
}

std::ptrdiff_t extent_of(const std::vector<Line>& lines) {
    return lines.back().start + lines.back().count;
}

Stitching stitched(const Apertures& a) {
    return stitch(a, match_slope(a));
}

// b_n of two sets less their common slope: what is left of one point's slope against the others'.
double slope_rms(const std::vector<double>& found, const std::vector<Line>& lines) {
    double mean = 0.0;
    double square = 0.0;
    const auto count = static_cast<double>(lines.size());
    for (std::size_t i = 0; i < lines.size(); ++i) mean += (found[i] - lines[i].slope) / count;
    for (std::size_t i = 0; i < lines.size(); ++i) square += std::pow(found[i] - lines[i].slope - mean, 2) / count;
    return std::sqrt(square);
}

std::vector<double> rough_phase(std::ptrdiff_t n, double deviation, unsigned seed) {
    std::mt19937 bits(seed);
    std::normal_distribution<double> normal(0.0, deviation);
    std::vector<double> out(at(n));
    for (double& p : out) p = normal(bits);
    return out;
}

TEST(StripGradient, SumsUpToThePhase) {
    const auto lines = chain(9, 100, 0.0);
    const std::ptrdiff_t n = extent_of(lines);
    const auto phase = smooth_phase(n, 8.0);
    const Apertures a = make_apertures(lines, n, phase);
    const StripPhase out = integrate_gradient(a, stitched(a));
    // A thousand steps of some 6e-8 rad, and slopes known to as much: 1e-4 at the very worst.
    EXPECT_LT(gauge_free_rms(out.phase, phase), 1e-4);
    EXPECT_LT(slope_rms(out.slope, lines), 1e-6);
    double information = 0.0;
    for (std::size_t i = 0; i < lines.size(); ++i) {
        EXPECT_NEAR(out.signal[i], std::pow(lines[i].amplitude, 2), 1e-3);
        EXPECT_LT(out.noise[i], 1e-6);
        information += out.information[i];
    }
    EXPECT_NEAR(information, 1.0, 1e-12);
    EXPECT_EQ(out.coverage[0], 1.0);
    EXPECT_EQ(out.coverage[120], 2.0);
    EXPECT_EQ(out.coverage[250], 3.0);
}

TEST(StripGradient, DeviationIsThatOfARandomWalk) {
    const auto lines = chain(12, 64, 0.1);
    const std::ptrdiff_t n = extent_of(lines);
    const auto phase = smooth_phase(n);
    double square = 0.0;
    double stated = 0.0;
    constexpr int draws = 20;
    for (unsigned draw = 1; draw <= draws; ++draw) {
        const Apertures a = make_apertures(lines, n, phase, draw);
        const StripPhase out = integrate_gradient(a, stitched(a));
        square += std::pow(gauge_free_rms(out.phase, phase), 2) / draws;
        for (const double s : out.phase_std) stated += s * s / draws / static_cast<double>(n);
    }
    // A random walk less its line has few independent values: 20 draws tell its RMS to some 10 %. What is stated leaves out that noise of
    // neighbouring steps is anticorrelated, which makes the walk smaller: no less than a third of it.
    EXPECT_LT(std::sqrt(square / stated), 1.5);
    EXPECT_GT(std::sqrt(square / stated), 0.3);
}

TEST(StripRefine, RecoversASmoothPhaseBetterThanTheGradient) {
    const auto lines = chain(10, 100, 0.3);
    const std::ptrdiff_t n = extent_of(lines);
    const auto phase = smooth_phase(n, 6.0);
    double gradient = 0.0;
    double refined = 0.0;
    double stated = 0.0;
    for (unsigned draw = 1; draw <= 5; ++draw) {
        const Apertures a = make_apertures(lines, n, phase, draw);
        const Stitching stitching = stitched(a);
        ASSERT_EQ(stitching.segments, 1);
        gradient += std::pow(gauge_free_rms(integrate_gradient(a, stitching).phase, phase), 2) / 5.0;
        const StripPhase out = refine_strip_phase(a, stitching);
        refined += std::pow(gauge_free_rms(out.phase, phase), 2) / 5.0;
        for (const double s : out.phase_std) stated += s * s / 5.0 / static_cast<double>(n);
        EXPECT_LT(slope_rms(out.slope, lines), 4e-3);  // of slopes that differ by 0.02
        for (std::size_t i = 0; i < lines.size(); ++i) {
            EXPECT_NEAR(out.signal[i], std::pow(lines[i].amplitude, 2), 0.3 * std::pow(lines[i].amplitude, 2));
            EXPECT_NEAR(out.noise[i], 0.3, 0.15);  // 256 samples of it: 6 %, and what is left of phase error
        }
    }
    // What is left of it is mostly the slow waves that the points' own slopes leave open, in either method.
    EXPECT_LT(refined, 0.25 * gradient);
    EXPECT_GT(std::sqrt(refined / stated), 0.5);
    EXPECT_LT(std::sqrt(refined / stated), 2.0);
}

TEST(StripRefine, ReachesTheCramerRaoBoundOfAPhaseWithoutStructure) {
    // 16 lines of 512 pulses as in [methods 3], phases of neighbouring samples independent: nothing for a prior to use. Bound
    // sqrt(1 / (2 M SNR)); constants and slopes of the lines cost next to nothing beside 512 phases.
    for (const double db : {5.0, 10.0, 20.0}) {
        std::vector<Line> lines(16);
        for (std::size_t i = 0; i < lines.size(); ++i)
            lines[i] = {0, 512, 0.004 * static_cast<double>(i % 5), 0.7 * static_cast<double>(i), 1.0, std::pow(10.0, -0.1 * db)};
        const auto phase = rough_phase(512, 0.35, 3);
        const Apertures a = make_apertures(lines, 512, phase, 11, 0.8 / 512.0, 512.0);
        StripRefineOptions options;
        options.windows = {1.0};
        const StripPhase out = refine_strip_phase(a, stitched(a), options);
        ASSERT_EQ(out.knot, 1.0);
        const double bound = std::sqrt(std::pow(10.0, -0.1 * db) / 32.0);
        EXPECT_LT(gauge_free_rms(out.phase, phase), 1.15 * bound) << db;  // 512 samples: 3 %; weak signals lose some of it
        double stated = 0.0;
        for (const double s : out.phase_std) stated += s * s / 512.0;
        EXPECT_NEAR(std::sqrt(stated) / bound, 1.0, 0.2) << db;
    }
}

TEST(StripRefine, LeavesOutWhatFitsNothing) {
    auto lines = chain(16, 50, 0.1);
    const std::ptrdiff_t n = extent_of(lines);
    const auto phase = smooth_phase(n);
    Apertures a = make_apertures(lines, n, phase, 4);
    std::mt19937 bits(9);
    std::normal_distribution<float> normal(0.0F, 3.0F);
    for (std::ptrdiff_t k = 0; k < 256; ++k) a.lines(4, k) = {normal(bits), normal(bits)};  // ten times the power of the others
    const Stitching stitching = stitched(a);
    EXPECT_EQ(stitching.segment[4], -1);
    for (const bool refine : {false, true}) {
        const StripPhase out = refine ? refine_strip_phase(a, stitching) : integrate_gradient(a, stitching);
        EXPECT_EQ(out.segment[4], -1);
        EXPECT_EQ(out.information[4], 0.0);
        double stated = 0.0;
        for (const double sigma : out.phase_std) stated += sigma * sigma / static_cast<double>(n);
        EXPECT_LT(gauge_free_rms(out.phase, phase), 2.0 * std::sqrt(stated));
        EXPECT_LT(gauge_free_rms(out.phase, phase), refine ? 0.15 : 0.8);
    }
}

TEST(StripRefine, GapsSplitTheStripAndAreSaid) {
    auto lines = chain(4, 80, 0.05, 100);
    for (const Line& line : chain(5, 80, 0.05, 700)) lines.push_back(line);
    const std::ptrdiff_t n = extent_of(lines) + 60;
    const auto phase = smooth_phase(n);
    const Apertures a = make_apertures(lines, n, phase);
    const Stitching stitching = stitched(a);
    ASSERT_EQ(stitching.segments, 2);
    for (const bool refine : {false, true}) {
        const StripPhase out = refine ? refine_strip_phase(a, stitching) : integrate_gradient(a, stitching);
        for (std::ptrdiff_t k = 0; k < n; ++k) {
            const bool reached = (k >= 100 && k < 596) || (k >= 700 && k < 1276);
            EXPECT_EQ(out.coverage[at(k)] > 0.0, reached) << k;
            EXPECT_EQ(std::isfinite(out.phase_std[at(k)]), reached) << k;
            EXPECT_TRUE(std::isfinite(out.phase[at(k)])) << k;
        }
        // Each on its own is right; the line between them is open.
        for (const auto& [begin, end] : {std::pair{100, 596}, std::pair{700, 1276}}) {
            const std::vector<double> found(out.phase.begin() + begin, out.phase.begin() + end);
            const std::vector<double> expected(phase.begin() + begin, phase.begin() + end);
            EXPECT_LT(gauge_free_rms(found, expected), refine ? 0.08 : 0.6);
        }
        if (!refine) continue;
        // Beyond the apertures a line.
        for (const std::ptrdiff_t k : {std::ptrdiff_t{10}, std::ptrdiff_t{50}, n - 20})
            EXPECT_NEAR(out.phase[at(k + 5)] - 2.0 * out.phase[at(k)] + out.phase[at(k - 5)], 0.0, 1e-6) << k;
        EXPECT_EQ(out.smoothness.size(), 2U);
    }
}

TEST(StripRefine, LinesOfTheDataAreLinesOfTheResult) {
    // A constant and a line more in the phase change nothing but those.
    const auto lines = chain(8, 90, 0.1);
    const std::ptrdiff_t n = extent_of(lines);
    const auto phase = smooth_phase(n);
    const Apertures a = make_apertures(lines, n, phase, 3);
    Apertures b = make_apertures(lines, n, phase, 3);
    for (std::ptrdiff_t i = 0; i < b.size(); ++i)
        for (std::ptrdiff_t k = 0; k < b.count[at(i)]; ++k)
            b.lines(i, k) = cfloat(cdouble(b.lines(i, k)) * std::polar(1.0, 1.3 + 0.01 * static_cast<double>(b.start[at(i)] + k)));
    const StripPhase first = refine_strip_phase(a, stitched(a));
    const StripPhase second = refine_strip_phase(b, stitched(b));
    // Where the rounds end depends on the tolerance, 1e-3 rad RMS.
    EXPECT_LT(gauge_free_rms(first.phase, second.phase), 2e-3);
    for (std::size_t i = 0; i < lines.size(); ++i) EXPECT_NEAR(first.information[i], second.information[i], 1e-3);
}

TEST(StripRefine, BitsDependNotOnThreads) {
    const auto lines = chain(10, 100, 0.3);
    const std::ptrdiff_t n = extent_of(lines);
    const Apertures a = make_apertures(lines, n, smooth_phase(n));
    const Stitching stitching = stitched(a);
    StripRefineOptions options;
    options.execution.threads = 1;
    const StripPhase expected = refine_strip_phase(a, stitching, options);
    for (const int threads : {2, 3, 5}) {
        options.execution.threads = threads;
        const StripPhase out = refine_strip_phase(a, stitching, options);
        EXPECT_EQ(out.phase, expected.phase) << threads;
        EXPECT_EQ(out.slope, expected.slope);
        EXPECT_EQ(out.phase_std, expected.phase_std);
        EXPECT_EQ(out.information, expected.information);
    }
}

TEST(StripRefine, RefusesHostileInput) {
    const auto lines = chain(3, 100, 0.1);
    const std::ptrdiff_t n = extent_of(lines);
    const Apertures a = make_apertures(lines, n, smooth_phase(n));
    const Stitching good = stitched(a);
    Stitching other = good;
    other.slope.pop_back();
    EXPECT_THROW((void)refine_strip_phase(a, other), ShapeError);
    EXPECT_THROW((void)integrate_gradient(a, other), ShapeError);
    for (const double window : {0.0, -0.5, 1.01, std::numeric_limits<double>::quiet_NaN()}) {
        StripRefineOptions options;
        options.windows = {window};
        EXPECT_THROW((void)refine_strip_phase(a, good, options), ValueError) << window;
    }
    StripRefineOptions options;
    options.rounds = 0;
    EXPECT_THROW((void)refine_strip_phase(a, good, options), ValueError);
    options = {};
    options.tolerance = 0.0;
    EXPECT_THROW((void)refine_strip_phase(a, good, options), ValueError);
    options = {};
    options.execution.progress = [](const ProgressUpdate&) { return false; };
    EXPECT_THROW((void)refine_strip_phase(a, good, options), Cancelled);
    // Nothing at all, a single point, lines without signal.
    const Apertures none = make_apertures({}, 50, {});
    for (const double p : refine_strip_phase(none, stitched(none)).phase) EXPECT_EQ(p, 0.0);
    const Apertures single = make_apertures(chain(1, 1, 0.01), 256, smooth_phase(256));
    const StripPhase of_one = refine_strip_phase(single, stitched(single));
    EXPECT_LT(gauge_free_rms(of_one.phase, smooth_phase(256)), 0.15);
    EXPECT_EQ(of_one.information, std::vector<double>{1.0});
    auto dark = chain(3, 100, 0.0);
    for (Line& line : dark) line.amplitude = 0.0;
    const Apertures black = make_apertures(dark, n, {});
    for (const double p : refine_strip_phase(black, stitched(black)).phase) EXPECT_TRUE(std::isfinite(p));
    for (const double p : integrate_gradient(black, stitched(black)).phase) EXPECT_TRUE(std::isfinite(p));
}

}  // namespace
}  // namespace sarfocus::autofocus
