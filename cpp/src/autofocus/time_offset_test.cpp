#include <sarfocus/autofocus/time_offset.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include <sarfocus/core/array.hpp>
#include <sarfocus/core/constants.hpp>
#include <sarfocus/core/error.hpp>
#include <sarfocus/sim/points.hpp>

namespace sarfocus::autofocus {
namespace {

constexpr std::ptrdiff_t n_pulse = 160;
constexpr std::ptrdiff_t n_range = 128;
constexpr std::ptrdiff_t n_track = 700;
constexpr double true_offset = 2.137;

enum class Path { curved, straight, resting_ends };

// A radar carried past a few metres of ground; 160 pulses in 8 s, the motion recorded every 20 ms by a clock 2.137 s ahead.
struct Carried {
    Path path;
    Array<double, 1> pulse_time{{n_pulse}};
    Array<double, 1> track_time{{n_track}};
    Array<double, 2> track_position{{n_track, 3}};
    Array<double, 1> start{{1}};
    Array<cfloat, 2> data{{n_pulse, n_range}};
    double spacing = 0.06;
    double wavelength = 0.07;

    Carried(Path kind, int n_target, double noise_power) : path(kind) {
        for (std::ptrdiff_t k = 0; k < n_track; ++k) {
            track_time(k) = 0.02 * static_cast<double>(k);
            const Vector3 p = position(track_time(k) - true_offset);
            for (std::size_t axis = 0; axis < 3; ++axis) track_position(k, static_cast<std::ptrdiff_t>(axis)) = p[axis];
        }
        Array<double, 2> truth({n_pulse, 3});
        for (std::ptrdiff_t p = 0; p < n_pulse; ++p) {
            pulse_time(p) = 0.05 * static_cast<double>(p);
            const Vector3 at = position(pulse_time(p));
            for (std::size_t axis = 0; axis < 3; ++axis) truth(p, static_cast<std::ptrdiff_t>(axis)) = at[axis];
        }
        start(0) = 2.5;
        std::mt19937 bits(11);
        std::uniform_real_distribution<double> uniform(-1.0, 1.0);
        Array<double, 2> places({std::max(n_target, 1), 3});
        Array<cdouble, 1> reflectivity({std::max(n_target, 1)});  // none: one that reflects nothing
        for (std::ptrdiff_t k = 0; k < n_target; ++k) {
            places(k, 0) = 2.0 * uniform(bits);
            places(k, 1) = 5.0 + 1.5 * uniform(bits);
            reflectivity(k) = std::polar(1.0, pi * uniform(bits));
        }
        if (n_target == 1) {
            places(0, 0) = -1.3;
            places(0, 1) = 4.2;
        }
        sim::PointEchoModel model;
        model.range_start = start.view();
        model.range_spacing = spacing;
        model.wavelength = wavelength;
        model.bandwidth = 1.5e9;
        model.noise_power = noise_power;
        model.seed = 3;
        sim::points(geometry::PhaseCentres(truth.view()), {places.view(), reflectivity.view()}, model, data.view());
    }

    [[nodiscard]] Vector3 position(double t) const {
        const double s = t - 4.0;
        if (path == Path::straight) return {0.4 * s, 0.0, 1.0};
        const double moved = path == Path::resting_ends ? std::clamp(s, -2.5, 2.5) : s;
        return {0.4 * moved + 0.15 * std::sin(1.3 * moved), 0.08 * std::cos(0.9 * moved), 1.0 + 0.02 * std::sin(2.0 * moved)};
    }
    [[nodiscard]] focus::RangeProfiles profiles() const { return {data.view(), start.view(), spacing, wavelength}; }
    [[nodiscard]] geometry::Track track() const { return {track_time.view(), track_position.view()}; }
    [[nodiscard]] TimeOffset estimate(const TimeOffsetOptions& options) const {
        const auto grid = geometry::ImageGrid::plane({-2.2, 3.3, 0.0}, {0.03, 0.0, 0.0}, {0.0, 0.04, 0.0}, {147, 85});
        return estimate_time_offset(profiles(), pulse_time.view(), track(), grid, options);
    }
};

TimeOffsetOptions from(double start) {
    TimeOffsetOptions options;
    options.start = start;
    options.minimum_step = 1e-4;
    return options;
}

TEST(TimeOffset, IsFoundFromEitherSide) {
    for (const Path path : {Path::curved, Path::resting_ends}) {
        const Carried carried(path, 12, 0.05);
        for (const double error : path == Path::curved ? std::vector{-0.15, 0.04} : std::vector{0.11}) {
            const TimeOffset found = carried.estimate(from(true_offset + error));
            EXPECT_EQ(found.status, TimeOffsetStatus::converged) << found.reason;
            // The platform moves 0.4 m/s: 1 ms is 0.4 mm, a 180th of the wavelength, far below what defocuses.
            EXPECT_NEAR(found.offset, true_offset, 1e-3) << found.reason;
            EXPECT_EQ(found.offset, found.estimate);
            // The halves have six points each, in noise; their curves are some 60 ms wide.
            EXPECT_GT(found.offset_std, 0.0);
            EXPECT_LT(found.offset_std, 5e-3);
            EXPECT_GT(found.log_sharpness_after, found.log_sharpness_before);
            EXPECT_TRUE(std::is_sorted(found.offsets.begin(), found.offsets.end()));
            EXPECT_EQ(found.offsets.size(), 17u + 12u);
            // No image that was formed is sharper than the one handed out, but for the parabola's error.
            EXPECT_GT(found.log_sharpness_after, *std::max_element(found.log_sharpness.begin(), found.log_sharpness.end()) - 1e-4);
        }
    }
}

TEST(TimeOffset, ASinglePointIsEnough) {
    const Carried carried(Path::curved, 1, 0.01);
    const TimeOffset found = carried.estimate(from(true_offset - 0.1));
    EXPECT_EQ(found.status, TimeOffsetStatus::converged) << found.reason;
    EXPECT_NEAR(found.offset, true_offset, 2e-3);
    EXPECT_TRUE(std::isnan(found.offset_std));
}

TEST(TimeOffset, HandsTheStartBackWhereNothingIsGained) {
    const Carried right(Path::curved, 12, 0.05);
    TimeOffset found = right.estimate(from(true_offset));
    EXPECT_EQ(found.status, TimeOffsetStatus::not_improved) << found.reason;
    EXPECT_EQ(found.offset, true_offset);
    TimeOffsetOptions always = from(true_offset);
    always.do_no_harm = false;
    found = right.estimate(always);
    EXPECT_EQ(found.status, TimeOffsetStatus::converged);
    EXPECT_EQ(found.offset, found.estimate);

    const Carried noise(Path::curved, 0, 1.0);
    found = noise.estimate(from(true_offset - 0.1));
    EXPECT_NE(found.status, TimeOffsetStatus::converged) << found.reason;
    EXPECT_EQ(found.offset, true_offset - 0.1);

    // A straight path at constant speed: the image is shifted, that is all.
    const Carried straight(Path::straight, 12, 0.05);
    found = straight.estimate(from(true_offset - 0.1));
    EXPECT_NE(found.status, TimeOffsetStatus::converged) << found.reason;
    EXPECT_EQ(found.offset, true_offset - 0.1);
}

TEST(TimeOffset, SaysWhenItLiesBeyondTheSearch) {
    const Carried carried(Path::curved, 12, 0.05);
    TimeOffsetOptions options = from(true_offset - 0.12);
    options.search = 0.1;
    const TimeOffset found = carried.estimate(options);
    EXPECT_EQ(found.status, TimeOffsetStatus::at_the_edge) << found.reason;
    EXPECT_EQ(found.offset, options.start);
    EXPECT_EQ(found.estimate, found.offsets.back());
    EXPECT_TRUE(std::isnan(found.offset_std));
}

TEST(TimeOffset, TriesOnlyWhatTheTrackCovers) {
    const Carried carried(Path::curved, 12, 0.05);
    const auto grid = geometry::ImageGrid::plane({-2.2, 3.3, 0.0}, {0.03, 0.0, 0.0}, {0.0, 0.04, 0.0}, {147, 85});
    // 0.02 * 507 = 10.14 s; the last pulse is sent at 7.95 s: offsets up to 2.19 s.
    const geometry::Track cut{carried.track().time.slice(0, 0, 508), carried.track().position.slice(0, 0, 508)};
    const auto run = [&](double start) {
        return estimate_time_offset(carried.profiles(), carried.pulse_time.view(), cut, grid, from(start));
    };
    const TimeOffset found = run(2.1);
    EXPECT_NEAR(found.offset, true_offset, 1e-3) << found.reason;
    EXPECT_LE(found.offsets.back(), 2.19);
    EXPECT_THROW(run(2.2), ValueError);
}

TEST(TimeOffset, SameBitsForAnyThreadsAndStrides) {
    const Carried carried(Path::curved, 12, 0.05);
    TimeOffsetOptions options = from(true_offset + 0.06);
    options.execution.threads = 1;
    const TimeOffset one = carried.estimate(options);
    options.execution.threads = 2;
    const TimeOffset two = carried.estimate(options);
    EXPECT_EQ(one.offset, two.offset);
    EXPECT_EQ(one.log_sharpness, two.log_sharpness);

    Array<cfloat, 2> turned({n_range, n_pulse});
    for (std::ptrdiff_t p = 0; p < n_pulse; ++p)
        for (std::ptrdiff_t i = 0; i < n_range; ++i) turned(i, n_pulse - 1 - p) = carried.data(p, i);
    focus::RangeProfiles profiles = carried.profiles();
    profiles.data = ImageView(turned.data() + n_pulse - 1, {n_pulse, n_range}, {-1, n_pulse});
    const auto grid = geometry::ImageGrid::plane({-2.2, 3.3, 0.0}, {0.03, 0.0, 0.0}, {0.0, 0.04, 0.0}, {147, 85});
    const TimeOffset strided = estimate_time_offset(profiles, carried.pulse_time.view(), carried.track(), grid, options);
    EXPECT_EQ(strided.log_sharpness, one.log_sharpness);
}

TEST(TimeOffset, ReportsProgressAndStops) {
    const Carried carried(Path::curved, 2, 0.05);
    TimeOffsetOptions options = from(true_offset);
    std::int64_t calls = 0;
    std::int64_t last = 0;
    options.execution.progress = [&](const ProgressUpdate& update) {
        EXPECT_STREQ(update.phase, "time offset");
        EXPECT_LE(last, update.done);
        EXPECT_LE(update.done, update.total);
        last = update.done;
        return ++calls < 5;
    };
    EXPECT_THROW((void)carried.estimate(options), Cancelled);
    EXPECT_EQ(calls, 5);
}

TEST(TimeOffset, RefusesHostileInput) {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    const auto refuses = [](const Carried& carried, auto change) {
        TimeOffsetOptions options = from(true_offset);
        change(options);
        EXPECT_THROW((void)carried.estimate(options), ValueError);
    };
    Carried carried(Path::curved, 2, 0.05);
    refuses(carried, [&](TimeOffsetOptions& o) { o.start = nan; });
    refuses(carried, [&](TimeOffsetOptions& o) { o.search = 0.0; });
    refuses(carried, [&](TimeOffsetOptions& o) { o.step = -0.01; });
    refuses(carried, [&](TimeOffsetOptions& o) { o.step = 0.3; });
    refuses(carried, [&](TimeOffsetOptions& o) { o.step = 1e-9; });
    refuses(carried, [&](TimeOffsetOptions& o) { o.minimum_step = nan; });
    refuses(carried, [&](TimeOffsetOptions& o) { o.minimum_step = 1.0; });  // then the platform never moves
    refuses(carried, [&](TimeOffsetOptions& o) { o.start = -1.0; });
    refuses(carried, [&](TimeOffsetOptions& o) { o.execution.threads = -1; });

    const auto grid = geometry::ImageGrid::plane({-2.2, 3.3, 0.0}, {0.03, 0.0, 0.0}, {0.0, 0.04, 0.0}, {147, 85});
    const ArrayView<const double, 1> few = ArrayView<const double, 1>(carried.pulse_time.view()).slice(0, 0, 10);
    EXPECT_THROW((void)estimate_time_offset(carried.profiles(), few, carried.track(), grid, from(true_offset)), ShapeError);
    Carried broken(Path::curved, 2, 0.05);
    broken.pulse_time(3) = nan;
    EXPECT_THROW((void)broken.estimate(from(true_offset)), NumericalError);
    Carried hole(Path::curved, 2, 0.05);
    hole.data(3, 4) = {0.0f, std::numeric_limits<float>::infinity()};
    EXPECT_THROW((void)hole.estimate(from(true_offset)), NumericalError);
    Carried silent(Path::curved, 0, 0.0);
    EXPECT_THROW((void)silent.estimate(from(true_offset)), NumericalError);
    Carried backwards(Path::curved, 2, 0.05);
    backwards.track_time(7) = backwards.track_time(6);
    EXPECT_THROW((void)backwards.estimate(from(true_offset)), ValueError);
}

}  // namespace
}  // namespace sarfocus::autofocus
