#include <sarfocus/autofocus/spga.hpp>

#include <chrono>
#include <cmath>
#include <limits>
#include <numeric>
#include <string>

#include <gtest/gtest.h>

#include <sarfocus/core/error.hpp>
#include <sarfocus/quality/image_measures.hpp>

#include "strip_scene_test.hpp"

namespace sarfocus::autofocus {
namespace {

using namespace test;

constexpr std::ptrdiff_t n = 1024;
constexpr std::ptrdiff_t gates = 32;

// 32 points in 32 gates over five apertures, 30 dB over clutter.
Strip usual_strip(double centroid = 0.0, double range_step = 0.5, unsigned seed = 1) {
    return make_strip(strip_geometry(gates, 200.0, centroid, range_step), n, spread_targets(32, n, gates, 30.0), smooth_phase(n), 1.0,
                      seed);
}

struct Outcome {
    Image image;
    Result result;
};

Outcome run(const Strip& strip, const SpgaLinearOptions& options = {}) {
    Outcome out{Image(strip.blurred.extents()), {}};
    out.result = spga_linear(strip.blurred.view(), strip.geometry, out.image.view(), options);
    return out;
}

// Share of the entropy lost that comes back with this phase, the open line taken from the truth: the strip is periodic, a line is not, so
// that apertures round its ends depend on it.
double recovered(const Strip& strip, const std::vector<double>& estimate, const std::vector<double>& truth) {
    Array<double, 2> phase({1, static_cast<std::ptrdiff_t>(truth.size())});
    std::vector<double> error(truth.size());
    for (std::size_t k = 0; k < truth.size(); ++k) error[k] = estimate[k] - truth[k];
    remove_linear(error);
    for (std::size_t k = 0; k < truth.size(); ++k) phase.data()[k] = truth[k] + error[k];
    Image image(strip.blurred.extents());
    focus::azimuth_correct(strip.blurred.view(), strip.geometry, std::as_const(phase).view(), {0.0}, image.view());
    const double lost = quality::entropy(strip.blurred.view());
    return (lost - quality::entropy(image.view())) / (lost - quality::entropy(strip.focused.view()));
}

// Pixels by which the peak of a target in `image` lies from where it is; parabola through the three largest powers.
double displacement(const Image& image, const Target& target, std::ptrdiff_t reach = 40) {
    const auto gate = static_cast<std::ptrdiff_t>(target.range);
    const auto middle = static_cast<std::ptrdiff_t>(target.azimuth);
    std::ptrdiff_t peak = middle;
    for (std::ptrdiff_t i = std::max<std::ptrdiff_t>(middle - reach, 1); i < std::min(middle + reach, image.extent(0) - 1); ++i)
        if (std::norm(image(i, gate)) > std::norm(image(peak, gate))) peak = i;
    const double left = std::abs(image(peak - 1, gate));
    const double here = std::abs(image(peak, gate));
    const double right = std::abs(image(peak + 1, gate));
    return static_cast<double>(peak) + 0.5 * (left - right) / (left - 2.0 * here + right) - target.azimuth;
}

TEST(SpgaLinear, FindsWhatWasInjected) {
    for (const double centroid : {0.0, -300.0}) {
        for (const double range_step : {0.5, 60.0}) {  // K the same in all gates, or half as large in the last as in the first
            const Strip strip = usual_strip(centroid, range_step);
            const Outcome out = run(strip);
            EXPECT_EQ(out.result.status, Status::converged) << out.result.score.reason;
            // [methods 3]: 0.15 rad with 40 points at 25 dB.
            EXPECT_LT(gauge_free_rms(out.result.phase_error, smooth_phase(n)), 0.15) << centroid << ' ' << range_step;
            EXPECT_GT(recovered(strip, out.result.phase_error, smooth_phase(n)), 0.94);
            EXPECT_LT(out.result.score.entropy_after, out.result.score.entropy_before);
            EXPECT_TRUE(out.result.score.improved);
            double weights = 0.0;
            for (const StrongPoint& p : out.result.points) weights += p.weight;
            EXPECT_NEAR(weights, 1.0, 1e-9);
            EXPECT_EQ(out.result.estimate, out.result.phase_error);
            EXPECT_EQ(out.result.strip.segments, 1);
        }
    }
}

TEST(SpgaLinear, ImageIsCorrectedByThePhaseItNames) {
    const Strip strip = usual_strip(150.0);
    const Outcome out = run(strip);
    Image raw(strip.blurred.extents());
    focus::azimuth_decompress(strip.blurred.view(), strip.geometry, raw.view());
    for (std::ptrdiff_t k = 0; k < n; ++k)
        for (std::ptrdiff_t g = 0; g < gates; ++g) raw(k, g) = cfloat(cdouble(raw(k, g)) * std::polar(1.0, -out.result.phase_error[at(k)]));
    const Image expected = compressed(raw, strip.geometry);
    float largest = 0.0F;
    float worst = 0.0F;
    for (std::ptrdiff_t i = 0; i < expected.size(); ++i) {
        largest = std::max(largest, std::abs(expected.data()[i]));
        worst = std::max(worst, std::abs(expected.data()[i] - out.image.data()[i]));
    }
    EXPECT_LT(worst, 5e-6F * largest);  // three transforms in single precision
}

TEST(SpgaLinear, KeepsTheLinearPhase) {
    // Slopes that displace by 0, 5, -3, 4 pixels, as in the experiment of the paper: the points come back to where they are, but for one
    // common linear phase.
    std::vector<double> phase(at(n), 0.0);
    const auto geometry = strip_geometry(gates);
    const double pixel = two_pi * geometry.fm_rate(gates / 2) / (240.0 * 240.0);
    constexpr double slopes[] = {0.0, 5.0, -3.0, 4.0};
    for (std::ptrdiff_t k = 1; k < n; ++k) phase[at(k)] = phase[at(k - 1)] + pixel * slopes[4 * k / n];
    for (const Matching matching : {Matching::slope, Matching::search}) {
        // The traversal knows neighbours alone, so that one false alarm between them breaks the chain: few points and no clutter, as in the
        // experiment of the paper.
        const bool slope = matching == Matching::slope;
        const Strip strip = make_strip(geometry, n, spread_targets(slope ? 32 : 9, n, gates, 35.0), phase, slope ? 1.0 : 0.0);
        SpgaLinearOptions options;
        options.matching = matching;
        options.do_no_harm = slope;  // without one point of six the chain of neighbours falls apart: nothing to judge by
        const Outcome out = run(strip, options);
        ASSERT_FALSE(out.result.input_returned()) << out.result.score.reason;
        double mean = 0.0;
        double square = 0.0;
        double before = 0.0;
        double count = 0.0;
        for (const Target& t : strip.targets) {
            if (t.azimuth < 104.0 || t.azimuth > 920.0) continue;  // whole apertures
            const double d = displacement(out.image, t);
            mean += d;
            square += d * d;
            before += std::pow(displacement(strip.blurred, t), 2);
            count += 1.0;
        }
        mean /= count;
        const double scatter = std::sqrt(square / count - mean * mean);
        // A phase known to 0.1 rad over apertures of 208 samples: a few hundredths of a pixel and as much from clutter.
        EXPECT_LT(scatter, 0.15) << static_cast<int>(matching);
        EXPECT_GT(std::sqrt(before / count), 1.0);
    }
}

TEST(SpgaLinear, GaugesDifferByALineAlone) {
    const Strip strip = usual_strip();
    SpgaLinearOptions options;
    const Outcome mean = run(strip, options);
    ASSERT_EQ(mean.result.status, Status::converged) << mean.result.score.reason;
    options.gauge = Gauge::first_point;
    const Outcome first = run(strip, options);
    options.gauge = Gauge::tie_points;
    for (const std::size_t t : {6U, 14U, 25U})
        options.tie_points.push_back({strip.targets[t].azimuth, std::lround(strip.targets[t].range)});
    const Outcome tied = run(strip, options);
    EXPECT_LT(gauge_free_rms(first.result.phase_error, mean.result.phase_error), 1e-9);
    EXPECT_LT(gauge_free_rms(tied.result.phase_error, mean.result.phase_error), 1e-9);
    EXPECT_NEAR(first.result.points.front().shift, 0.0, 1e-9);  // rounding of the line that is taken off
    // Not moved on average, all alike but for those that tell next to nothing.
    double shift = 0.0;
    double count = 0.0;
    for (const StrongPoint& p : mean.result.points) {
        if (p.weight < 0.02 / static_cast<double>(mean.result.points.size())) continue;
        shift += p.shift;
        count += 1.0;
    }
    EXPECT_NEAR(shift / count, 0.0, 0.02);  // pixels; K differs by 0.4 % over the strip
    for (const std::size_t t : {6U, 14U, 25U}) EXPECT_NEAR(displacement(tied.image, strip.targets[t]), 0.0, 0.15) << t;
    // In the tied image everything else is where it belongs as well.
    for (const StrongPoint& p : tied.result.points) {
        double nearest = 1e9;
        for (const Target& t : strip.targets)
            if (t.range == p.range && std::abs(t.azimuth - p.azimuth) < std::abs(nearest)) nearest = t.azimuth - p.azimuth;
        const bool counts = p.weight > 0.3 / static_cast<double>(tied.result.points.size());  // no false alarm of clutter
        if (counts && p.azimuth > 104.0 && p.azimuth < 920.0) EXPECT_NEAR(nearest, 0.0, 0.3);
    }

    options.tie_points = {{500.0, 3}};  // nobody there
    EXPECT_THROW((void)run(strip, options), ValueError);
    options.tie_points = {};
    EXPECT_THROW((void)run(strip, options), ValueError);
    options.tie_points = {{std::nan(""), 3}};
    EXPECT_THROW((void)run(strip, options), ValueError);
}

TEST(SpgaLinear, TiePointsAreNeededInEverySegment) {
    // Two groups with half a strip between them.
    std::vector<Target> targets;
    for (int t = 0; t < 10; ++t) targets.push_back({20.0 + 15.0 * t, static_cast<double>((5 + 7 * t) % gates), 32.0});
    for (int t = 0; t < 10; ++t) targets.push_back({820.0 + 15.0 * t, static_cast<double>((4 + 7 * t) % gates), 32.0});
    const Strip strip = make_strip(strip_geometry(gates), n, targets, smooth_phase(n), 1.0);
    SpgaLinearOptions options;
    const Outcome apart = run(strip, options);
    EXPECT_EQ(apart.result.status, Status::gaps) << apart.result.score.reason;
    EXPECT_GE(apart.result.strip.segments, 2);
    options.gauge = Gauge::tie_points;
    options.tie_points = {{targets[5].azimuth, std::lround(targets[5].range)}};
    EXPECT_THROW((void)run(strip, options), ValueError);
    options.tie_points.push_back({targets[15].azimuth, std::lround(targets[15].range)});
    if (apart.result.strip.segments == 2) {
        const Outcome tied = run(strip, options);
        EXPECT_NEAR(displacement(tied.image, targets[5]), 0.0, 0.3);
        EXPECT_NEAR(displacement(tied.image, targets[15]), 0.0, 0.3);
    }
}

TEST(SpgaLinear, RangeBlocksHaveAPhaseEach) {
    // An error that grows with range: one phase for all is wrong at both ends.
    const auto geometry = strip_geometry(64);
    const auto phase = smooth_phase(n);
    const Strip unblurred = make_strip(geometry, n, spread_targets(64, n, 64, 32.0), std::vector<double>(at(n), 0.0), 1.0);
    Array<double, 2> errors({2, n});
    for (std::ptrdiff_t k = 0; k < n; ++k) {
        errors(0, k) = -0.7 * phase[at(k)];
        errors(1, k) = -1.3 * phase[at(k)];
    }
    Strip strip{geometry, unblurred.targets, unblurred.focused.copy(), Image({n, 64})};
    focus::azimuth_correct(unblurred.focused.view(), geometry, std::as_const(errors).view(), {0.0, 63.0}, strip.blurred.view());
    SpgaLinearOptions options;
    const Outcome one = run(strip, options);
    options.range_blocks = 2;
    const Outcome pair = run(strip, options);
    ASSERT_FALSE(pair.result.input_returned()) << pair.result.score.reason;
    const std::vector<double>& centre = pair.result.strip.block_centre;
    ASSERT_EQ(centre.size(), 2U);
    EXPECT_NEAR(centre[0], 15.5, 5.0);  // mean gates of some tens of points, each +- 9 gates
    EXPECT_NEAR(centre[1], 47.5, 5.0);
    ASSERT_EQ(pair.result.strip.block_phase.size(), at(2 * n));
    for (const std::ptrdiff_t b : {0, 1}) {
        const auto begin = pair.result.strip.block_phase.begin() + b * n;
        std::vector<double> expected = phase;
        for (double& p : expected) p *= 0.7 + 0.6 * centre[at(b)] / 63.0;
        // The two differ by 0.9 rad RMS, and the error itself by 0.26 RMS within a block.
        EXPECT_LT(gauge_free_rms({begin, begin + n}, expected), 0.55) << b;
    }
    EXPECT_LT(quality::entropy(pair.image.view()), quality::entropy(one.image.view()));
    options.range_blocks = 65;
    EXPECT_THROW((void)run(strip, options), ValueError);
    options.range_blocks = 0;
    EXPECT_THROW((void)run(strip, options), ValueError);
}

TEST(SpgaLinear, StripsOfAboutOneApertureAndLess) {
    for (const std::ptrdiff_t length : {120, 208, 300}) {
        std::vector<double> phase;
        for (std::ptrdiff_t k = 0; k < length; ++k)
            phase.push_back(8.0 * std::pow(2.0 * static_cast<double>(k) / static_cast<double>(length) - 1.0, 2));
        const Strip strip = make_strip(strip_geometry(gates), length, spread_targets(12, length, gates, 35.0), phase, 1.0);
        const Outcome out = run(strip);
        EXPECT_EQ(out.result.phase_error.size(), at(length));
        EXPECT_LE(quality::entropy(out.image.view()), quality::entropy(strip.blurred.view())) << length;
        EXPECT_FALSE(out.result.score.reason.empty());
    }
}

TEST(SpgaLinear, HandsBackTheInputWhereNothingIsWrongOrNothingIsThere) {
    for (const int points : {0, 1, 32}) {
        const Strip strip = make_strip(strip_geometry(gates), n, spread_targets(points, n, gates, 30.0), std::vector<double>(at(n), 0.0),
                                       1.0, 40U + static_cast<unsigned>(points));
        const Outcome out = run(strip);
        EXPECT_TRUE(out.result.input_returned()) << points << ": " << out.result.score.reason;
        EXPECT_TRUE(same_bits(out.image, strip.blurred));
        for (const double p : out.result.phase_error) EXPECT_EQ(p, 0.0);
        EXPECT_FALSE(out.result.score.reason.empty());
        EXPECT_EQ(out.result.estimate.size(), at(n));
        if (points == 0) EXPECT_EQ(out.result.status, Status::no_strong_points);
    }
    const Strip strip = make_strip(strip_geometry(gates), n, spread_targets(32, n, gates, 30.0), std::vector<double>(at(n), 0.0), 1.0, 3);
    SpgaLinearOptions options;
    options.do_no_harm = false;
    EXPECT_FALSE(run(strip, options).result.input_returned());
    Image in_place = strip.blurred.copy();
    EXPECT_TRUE(spga_linear(in_place.view(), strip.geometry, in_place.view()).input_returned());
    EXPECT_TRUE(same_bits(in_place, strip.blurred));
}

TEST(SpgaLinear, BitsDependNeitherOnThreadsNorOnStridesNorOnThePlaceOfTheOutput) {
    const Strip strip = usual_strip();
    SpgaLinearOptions options;
    options.range_blocks = 2;
    options.execution.threads = 1;
    const Outcome expected = run(strip, options);
    ASSERT_FALSE(expected.result.input_returned());
    Image turned({gates, n});
    for (std::ptrdiff_t i = 0; i < n; ++i)
        for (std::ptrdiff_t g = 0; g < gates; ++g) turned(g, n - 1 - i) = strip.blurred(i, g);
    const ImageView strided(turned.data() + (n - 1), {n, gates}, {-1, n});
    for (const int threads : {2, 3, 5}) {
        options.execution.threads = threads;
        Image image({n, gates});
        const Result result = spga_linear(threads == 2 ? ImageView(strip.blurred.view()) : strided, strip.geometry, image.view(), options);
        EXPECT_TRUE(same_bits(image, expected.image)) << threads;
        EXPECT_EQ(result.phase_error, expected.result.phase_error);
        EXPECT_EQ(result.score.held_out_gain, expected.result.score.held_out_gain);
        EXPECT_EQ(result.score.entropy_after, expected.result.score.entropy_after);
    }
    Image in_place = strip.blurred.copy();
    (void)spga_linear(in_place.view(), strip.geometry, in_place.view(), options);
    EXPECT_TRUE(same_bits(in_place, expected.image));
    // The output may have strides of its own.
    Image wide({n, 2 * gates});
    (void)spga_linear(strip.blurred.view(), strip.geometry, MutableImageView(wide.data(), {n, gates}, {2 * gates, 2}), options);
    bool same = true;
    for (std::ptrdiff_t i = 0; i < n; ++i)
        for (std::ptrdiff_t g = 0; g < gates; ++g) same = same && wide(i, 2 * g) == expected.image(i, g) && wide(i, 2 * g + 1) == cfloat{};
    EXPECT_TRUE(same);
}

TEST(SpgaLinear, ScaleAndPhaseOfTheImageDoNotMatter) {
    const Strip strip = usual_strip();
    const Outcome expected = run(strip);
    for (const float scale : {1e-12F, 1e9F}) {
        Strip other{strip.geometry, strip.targets, strip.focused.copy(), strip.blurred.copy()};
        for (cfloat& x : other.blurred) x *= cfloat(0.6F * scale, -0.8F * scale);
        const Outcome out = run(other);
        EXPECT_EQ(out.result.status, expected.result.status) << scale;
        // Rounding alone, and where the rounds end.
        EXPECT_LT(gauge_free_rms(out.result.phase_error, expected.result.phase_error), 5e-3) << scale;
    }
}

TEST(SpgaLinear, RefusesHostileInput) {
    Strip strip = usual_strip();
    Image out(strip.blurred.extents());
    const auto geometry = strip.geometry;
    Image dark({n, gates});
    EXPECT_THROW((void)spga_linear(dark.view(), geometry, out.view()), NumericalError);
    Image narrow({n, gates - 1});
    EXPECT_THROW((void)spga_linear(strip.blurred.view(), geometry, narrow.view()), ShapeError);
    EXPECT_THROW((void)spga_linear(strip.blurred.view(), strip_geometry(gates - 1), out.view()), ShapeError);
    EXPECT_THROW((void)spga_linear(strip.blurred.view(), strip_geometry(gates, 200.0, 800.0), out.view()), ValueError);
    EXPECT_THROW((void)spga_linear(strip.blurred.view(), strip_geometry(gates, 200.0, -800.0), out.view()), ValueError);
    EXPECT_THROW((void)spga_linear(strip.blurred.view(), strip_geometry(gates, 200.0, 0.0, 0.5, 500.0), out.view()), ValueError);
    const auto refused = [&](const auto& change) {
        SpgaLinearOptions options;
        change(options);
        EXPECT_THROW((void)spga_linear(strip.blurred.view(), geometry, out.view(), options), ValueError);
    };
    refused([](SpgaLinearOptions& o) { o.select.points = -1; });
    refused([](SpgaLinearOptions& o) { o.extract.taper = -0.1; });
    refused([](SpgaLinearOptions& o) { o.slope.pairs_per_point = 0; });
    refused([](SpgaLinearOptions& o) { o.search.width = 5; });
    refused([](SpgaLinearOptions& o) { o.refinement.rounds = 0; });
    refused([](SpgaLinearOptions& o) { o.execution.threads = -2; });
    strip.blurred(77, 13) = {0.0F, -std::numeric_limits<float>::infinity()};
    for (const bool baseline : {false, true}) {
        try {
            (void)(baseline ? spga(strip.blurred.view(), geometry, out.view()) : spga_linear(strip.blurred.view(), geometry, out.view()));
            FAIL();
        } catch (const NumericalError& error) {
            EXPECT_NE(std::string(error.what()).find("[77, 13]"), std::string::npos) << error.what();
        }
    }
}

TEST(SpgaLinear, StopsWhereverItIsAskedTo) {
    // Each phase of the work in turn; the callback is asked at least at the end of every loop, so that each one is a place to stop.
    const Strip strip = usual_strip();
    std::vector<std::string> phases;
    SpgaLinearOptions options;
    options.execution.progress = [&](const ProgressUpdate& update) {
        if (std::find(phases.begin(), phases.end(), update.phase) == phases.end()) phases.emplace_back(update.phase);
        return true;
    };
    (void)run(strip, options);
    EXPECT_GE(phases.size(), 5U);
    for (const std::string& stop : phases) {
        std::string last;
        options.execution.progress = [&](const ProgressUpdate& update) {
            last = update.phase;
            return update.phase != stop;
        };
        EXPECT_THROW((void)run(strip, options), Cancelled) << stop;
        EXPECT_EQ(last, stop);
    }
    options.execution.progress = [](const ProgressUpdate&) -> bool { throw std::runtime_error("enough"); };
    EXPECT_THROW((void)run(strip, options), std::runtime_error);
}

TEST(Spga, FocusesButLosesTheLinearPhase) {
    const Strip strip = usual_strip();
    Image image(strip.blurred.extents());
    const Result result = spga(strip.blurred.view(), strip.geometry, image.view());
    EXPECT_FALSE(result.input_returned()) << result.score.reason;
    EXPECT_GT(recovered(strip, result.phase_error, smooth_phase(n)), 0.5);
    EXPECT_TRUE(result.strip.seams.empty());
    const Outcome linear = run(strip);
    EXPECT_LT(gauge_free_rms(linear.result.phase_error, smooth_phase(n)), gauge_free_rms(result.phase_error, smooth_phase(n)));
    EXPECT_GT(recovered(strip, linear.result.phase_error, smooth_phase(n)), recovered(strip, result.phase_error, smooth_phase(n)));

    Image again(strip.blurred.extents());
    SpgaOptions options;
    for (const int threads : {1, 3, 5}) {
        options.execution.threads = threads;
        EXPECT_EQ(spga(strip.blurred.view(), strip.geometry, again.view(), options).phase_error, result.phase_error) << threads;
        EXPECT_TRUE(same_bits(again, image));
    }
    Image in_place = strip.blurred.copy();
    (void)spga(in_place.view(), strip.geometry, in_place.view(), options);
    EXPECT_TRUE(same_bits(in_place, image));
}

TEST(Spga, DoesNoHarmAndRefusesNonsense) {
    for (const int points : {0, 32}) {
        const Strip strip = make_strip(strip_geometry(gates), n, spread_targets(points, n, gates, 30.0), std::vector<double>(at(n), 0.0),
                                       1.0, 40U + static_cast<unsigned>(points));
        Image out(strip.blurred.extents());
        const Result result = spga(strip.blurred.view(), strip.geometry, out.view());
        EXPECT_TRUE(result.input_returned()) << points << ": " << result.score.reason;
        EXPECT_TRUE(same_bits(out, strip.blurred));
    }
    const Strip strip = usual_strip();
    Image out(strip.blurred.extents());
    SpgaOptions options;
    options.iterations = 0;
    EXPECT_THROW((void)spga(strip.blurred.view(), strip.geometry, out.view(), options), ValueError);
    for (const double narrowing : {0.0, 1.5, -1.0}) {
        options = {};
        options.narrowing = narrowing;
        EXPECT_THROW((void)spga(strip.blurred.view(), strip.geometry, out.view(), options), ValueError) << narrowing;
    }
    options = {};
    options.execution.progress = [](const ProgressUpdate&) { return false; };
    EXPECT_THROW((void)spga(strip.blurred.view(), strip.geometry, out.view(), options), Cancelled);
}

}  // namespace
}  // namespace sarfocus::autofocus
