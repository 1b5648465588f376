#include <sarfocus/focus/factorized.hpp>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <random>
#include <stdexcept>
#include <string>

#include <gtest/gtest.h>

#include <sarfocus/core/array.hpp>
#include <sarfocus/core/checks.hpp>
#include <sarfocus/core/constants.hpp>
#include <sarfocus/core/error.hpp>
#include <sarfocus/focus/backproject.hpp>

#include "focus/virtual_track.hpp"

namespace sarfocus::focus {
namespace {

using geometry::ImageGrid;
using geometry::PhaseCentres;
using Image = Array<cfloat, 2>;
using Path = std::function<Vector3(double, std::ptrdiff_t)>;  // of the place along the path, from -1/2 to 1/2, and the pulse's number

constexpr double wavelength = 0.0312;

// Noise that fills 80 % of the band sampled: every pixel and every pulse count, and none of it is on the side of the method. Large enough
// for factorising to be the quicker way.
struct Job {
    double spacing = 0.5;
    Array<double, 2> tx;
    Array<double, 2> rx;
    Array<double, 1> start{{1}};
    Image data;
    bool bistatic;

    Job(std::ptrdiff_t n_pulse, std::ptrdiff_t n_range, double first_range, const Path& path, bool two = false)
        : tx({n_pulse, 3}), rx({n_pulse, 3}), data({n_pulse, n_range}), bistatic(two) {
        start(0) = first_range;
        for (std::ptrdiff_t p = 0; p < n_pulse; ++p) {
            const Vector3 at = path(static_cast<double>(p) / static_cast<double>(n_pulse - 1) - 0.5, p);
            for (std::size_t a = 0; a < 3; ++a) {
                tx(p, a) = at[a];
                rx(p, a) = at[a] + (a == 0 ? 25.0 : -8.0);
            }
        }
        std::mt19937 random(7);
        std::normal_distribution<float> normal;
        constexpr std::ptrdiff_t taps = 16;
        std::vector<cfloat> white(static_cast<std::size_t>(n_range + 2 * taps));
        for (std::ptrdiff_t p = 0; p < n_pulse; ++p) {
            for (cfloat& w : white) w = {normal(random), normal(random)};
            for (std::ptrdiff_t i = 0; i < n_range; ++i)
                for (std::ptrdiff_t t = -taps; t <= taps; ++t) {
                    const double x = 0.8 * static_cast<double>(t);
                    const double window = 0.5 + 0.5 * std::cos(pi * static_cast<double>(t) / (taps + 1.0));
                    const double low_pass = t == 0 ? 1.0 : std::sin(pi * x) / (pi * x);
                    data(p, i) += static_cast<float>(window * low_pass) * white[static_cast<std::size_t>(i + t + taps)];
                }
        }
    }

    [[nodiscard]] PhaseCentres centres() const { return bistatic ? PhaseCentres(tx.view(), rx.view()) : PhaseCentres(tx.view()); }
    [[nodiscard]] RangeProfiles profiles() const { return {data.view(), start.view(), spacing, wavelength}; }
};

Path straight(double length = 180.0) {
    return [=](double u, std::ptrdiff_t) { return Vector3{length * u, -4300.0, 2500.0}; };
}

ImageGrid plane(std::array<std::ptrdiff_t, 2> shape, double pixel = 0.4) {
    return ImageGrid::plane({-0.5 * pixel * static_cast<double>(shape[0]), -0.5 * pixel * static_cast<double>(shape[1]), 0.0},
                            {pixel, 0.0, 0.0}, {0.0, pixel, 0.0}, shape);
}

Job job(const Path& path = straight(), bool bistatic = false) {
    Job out(1041, 820, 4974.0 - 205.0, path, bistatic);
    constexpr std::ptrdiff_t fade = 32;  // samples: between those of a record that ends abruptly there is no one answer
    for (std::ptrdiff_t p = 0; p < out.data.extent(0); ++p)
        for (std::ptrdiff_t i = 0; i < fade; ++i) {
            const double rise = std::sin(0.5 * pi * (static_cast<double>(i) + 0.5) / fade);
            out.data(p, i) *= static_cast<float>(rise * rise);
            out.data(p, out.data.extent(1) - 1 - i) *= static_cast<float>(rise * rise);
        }
    return out;
}

Image form(const Job& job, const ImageGrid& grid, double target, FactorizedReport& report, int threads = 0) {
    Image image({grid.shape()[0], grid.shape()[1]});
    FactorizedOptions options;
    options.target_error_db = target;
    options.execution.threads = threads;
    report = backproject_factorized(job.profiles(), job.centres(), grid, image.view(), options);
    return image;
}

Image form_exactly(const Job& job, const ImageGrid& grid) {
    Image image({grid.shape()[0], grid.shape()[1]});
    backproject(job.profiles(), job.centres(), grid, image.view());
    return image;
}

double difference_db(const Image& image, const Image& truth) {
    double error = 0.0;
    double power = 0.0;
    for (std::ptrdiff_t k = 0; k < truth.size(); ++k) {
        error += std::norm(cdouble(image.data()[k]) - cdouble(truth.data()[k]));
        power += std::norm(cdouble(truth.data()[k]));
    }
    return 10.0 * std::log10(error / power);
}

// The exact way errs itself, by -75 dB at this sampling: targets are tried down to -65 dB. Hands out the image formed.
Image expect_kept(const char* what, const Job& job, const ImageGrid& grid, const Image& truth, double target) {
    FactorizedReport report;
    Image image = form(job, grid, target, report);
    EXPECT_TRUE(report.factorized) << what << ": " << report.reason;
    EXPECT_LE(report.predicted_error_db, target) << what;
    EXPECT_LE(difference_db(image, truth), target) << what << ", target " << target;
    // Noise is what the prediction assumes: it must not be far off either.
    if (target > -55.0) EXPECT_GT(difference_db(image, truth), report.predicted_error_db - 12.0) << what;
    return image;
}

void expect_kept(const char* what, const Job& job, const ImageGrid& grid, std::initializer_list<double> targets) {
    const Image truth = form_exactly(job, grid);
    for (const double target : targets) (void)expect_kept(what, job, grid, truth, target);
}

TEST(Factorized, KeepsTheTargetOnAStraightPath) {
    expect_kept("plane", job(), plane({809, 831}), {-40.0, -50.0, -60.0, -65.0});
}

TEST(Factorized, KeepsTheTargetOnAnyPath) {
    const ImageGrid grid = plane({797, 801});
    std::mt19937 random(3);
    std::normal_distribution<double> normal;
    expect_kept("curved", job([](double u, std::ptrdiff_t) {
                    const double angle = 0.04 * u;
                    return Vector3{5000.0 * std::sin(angle), -4300.0 * std::cos(angle), 2500.0};
                }),
                grid, {-60.0});
    expect_kept("swaying", job([](double u, std::ptrdiff_t) {
                    return Vector3{180.0 * u, -4300.0 + 1.5 * std::sin(14.0 * u), 2500.0 + 1.1 * std::cos(9.0 * u)};
                }),
                grid, {-45.0, -60.0});
    expect_kept("shaken", job([&](double u, std::ptrdiff_t) {
                    return Vector3{180.0 * u + normal(random), -4300.0 + 0.02 * normal(random), 2500.0 + 0.02 * normal(random)};
                }),
                grid, {-60.0});
    expect_kept("uneven", job([](double u, std::ptrdiff_t p) {
                    return Vector3{180.0 * (u + 0.3 * u * u + (p % 7 == 0 ? 0.004 : 0.0)), -4300.0, 2500.0};
                }),
                grid, {-60.0});
}

TEST(Factorized, KeepsTheTargetWithTwoAntennas) {
    expect_kept("bistatic", job(straight(), true), plane({797, 801}), {-60.0});
}

TEST(Factorized, KeepsTheTargetOnEveryKindOfPlane) {
    const Job radar = job();
    expect_kept(
        "polar", radar,
        ImageGrid::polar({0.0, -4300.0, 2500.0}, {0.0, 4300.0, -2500.0}, {1.0, 0.0, 0.0}, 4974.0 - 170.0, 0.4, -0.031, 0.00008, {789, 819}),
        {-60.0});
    expect_kept("axes exchanged", radar, ImageGrid::plane({-160.0, -160.0, 0.0}, {0.0, 0.4, 0.0}, {0.4, 0.0, 0.0}, {797, 801}), {-60.0});
    expect_kept("turned", radar, ImageGrid::plane({-60.0, -170.0, 0.0}, {0.33, 0.23, 0.0}, {-0.23, 0.33, 0.0}, {737, 703}), {-60.0});
}

TEST(Factorized, SumsTermsAtTheEndsOfTheRecord) {
    const ImageGrid grid = plane({797, 2401});
    for (const double start : {4974.0 - 460.0, 4974.0 - 250.0}) {  // a fifth of the grid lies behind the record, or in front of it
        const Job radar(1041, 1420, start, straight());
        const Image image = form_exactly(radar, grid);
        // The record ends abruptly, so its spectrum reaches up to the Nyquist frequency, where the cubic of the exact way errs: in all by
        // -50 dB against the sum in double precision.
        const Image again = expect_kept("partly recorded", radar, grid, image, -45.0);
        std::ptrdiff_t dark = 0;
        for (std::ptrdiff_t k = 0; k < image.size(); ++k)
            if (image.data()[k] == cfloat{}) {
                ++dark;
                EXPECT_EQ(again.data()[k], cfloat{});
            }
        EXPECT_GT(dark, image.size() / 10);
    }
}

TEST(Factorized, LeavesTilesBelowTheTrackToTheExactSum) {
    // The antenna passes over the near edge of the grid: there ranges fall and rise along a row.
    const Job radar(1041, 1400, 2480.0, [](double u, std::ptrdiff_t) { return Vector3{60.0 * u, -1300.0, 2500.0}; });
    const ImageGrid grid = ImageGrid::plane({-160.0, -1340.0, 0.0}, {0.4, 0.0, 0.0}, {0.0, 1.6, 0.0}, {797, 1201});
    FactorizedReport report;
    const Image image = form(radar, grid, -55.0, report);
    EXPECT_TRUE(report.factorized) << report.reason;
    const Image truth = form_exactly(radar, grid);
    EXPECT_LE(difference_db(image, truth), -55.0);
    // Near the track it is the exact sum itself, to the rounding of 1041 terms.
    EXPECT_LT(std::abs(image(5, 3) - truth(5, 3)), 1e-4 * std::sqrt(1041.0));
}

TEST(Factorized, BitsDependNeitherOnThreadsNorOnStrides) {
    const Job radar = job();
    const ImageGrid grid = plane({797, 801});
    FactorizedReport report;
    const Image expected = form(radar, grid, -60.0, report, 1);
    ASSERT_TRUE(report.factorized);
    for (const int threads : {2, 3}) {
        const Image again = form(radar, grid, -60.0, report, threads);
        EXPECT_TRUE(std::equal(again.begin(), again.end(), expected.begin())) << threads;
    }
    const std::ptrdiff_t n_pulse = radar.data.extent(0);
    const std::ptrdiff_t n_range = radar.data.extent(1);
    Image turned({n_range, n_pulse});
    for (std::ptrdiff_t p = 0; p < n_pulse; ++p)
        for (std::ptrdiff_t i = 0; i < n_range; ++i) turned(n_range - 1 - i, p) = radar.data(p, i);
    RangeProfiles profiles = radar.profiles();
    profiles.data = ImageView(turned.data() + (n_range - 1) * n_pulse, {n_pulse, n_range}, {1, -n_pulse});
    Image out({801, 797});
    backproject_factorized(profiles, radar.centres(), grid, MutableImageView(out.data(), {797, 801}, {1, 797}));
    for (std::ptrdiff_t i = 0; i < 797; ++i)
        for (std::ptrdiff_t j = 0; j < 801; ++j) ASSERT_EQ(out(j, i), expected(i, j));
}

TEST(Factorized, SaysWhatItDoes) {
    const Job radar = job();
    FactorizedOptions options;
    const FactorizedReport plan = plan_factorized(radar.profiles(), radar.centres(), plane({797, 801}), options);
    EXPECT_TRUE(plan.factorized) << plan.reason;
    ASSERT_FALSE(plan.stages.empty());
    for (std::size_t k = 0; k + 1 < plan.stages.size(); ++k) {
        EXPECT_GT(plan.stages[k].rows, plan.stages[k + 1].rows);
        EXPECT_GT(plan.stages[k].centres, plan.stages[k + 1].centres);
    }
    EXPECT_LT(plan.work, 0.9);
    EXPECT_GT(plan.memory, 0U);

    const FactorizedReport small = plan_factorized(radar.profiles(), radar.centres(), plane({20, 30}), options);
    EXPECT_FALSE(small.factorized);
    EXPECT_EQ(small.reason, "the job is small");
    FactorizedReport report;
    EXPECT_EQ(form(radar, plane({20, 30}), -60.0, report)(3, 4), form_exactly(radar, plane({20, 30}))(3, 4));

    const Job still = job([](double, std::ptrdiff_t) { return Vector3{0.0, -4300.0, 2500.0}; });
    EXPECT_FALSE(plan_factorized(still.profiles(), still.centres(), plane({797, 801}), options).factorized);
}

TEST(Factorized, RefusesWhatMakesNoSense) {
    Job radar = job();
    const ImageGrid grid = plane({797, 801});
    Image image({797, 801});
    const auto call = [&](const ImageGrid& on, double target = -60.0) {
        FactorizedOptions options;
        options.target_error_db = target;
        backproject_factorized(radar.profiles(), radar.centres(), on, image.view(), options);
    };
    EXPECT_THROW(call(grid, -100.0), ValueError);
    EXPECT_THROW(call(grid, std::nan("")), ValueError);
    EXPECT_THROW(call(plane({797, 800})), ShapeError);
    EXPECT_THROW(call(ImageGrid::plane({0.0, -90000.0, 0.0}, {0.4, 0.0, 0.0}, {0.0, 0.4, 0.0}, {797, 801})), ValueError);
    const Array<double, 3> points({4, 5, 3});
    EXPECT_THROW(call(ImageGrid::from_points(points.view())), ValueError);
    radar.data(100, 7) = {std::numeric_limits<float>::quiet_NaN(), 0.0F};
    EXPECT_THROW(call(grid), NumericalError);
}

TEST(Factorized, StopsWhenAsked) {
    const Job radar = job();
    const ImageGrid grid = plane({797, 801});
    Image image({797, 801});
    FactorizedOptions options;
    options.execution.progress = [](const ProgressUpdate&) { return false; };
    EXPECT_THROW(backproject_factorized(radar.profiles(), radar.centres(), grid, image.view(), options), Cancelled);
    options.execution.progress = [](const ProgressUpdate&) -> bool { throw std::out_of_range("mine"); };
    EXPECT_THROW(backproject_factorized(radar.profiles(), radar.centres(), grid, image.view(), options), std::out_of_range);
}

TEST(VirtualTrack, FollowsThePathAndStaysCalmBeyondIt) {
    Array<double, 2> path({400, 3});
    for (std::ptrdiff_t p = 0; p < 400; ++p) {
        const double u = static_cast<double>(p) / 399.0;
        path(p, 0) = 1e6 + 200.0 * u;
        path(p, 1) = std::sin(12.0 * u);
        path(p, 2) = 3.0 * u * u;
    }
    const PhaseCentres centres(path.view());
    const detail::VirtualTrack track(centres, 0, 400, 16);
    EXPECT_LT(track.deviation(), 1e-3);
    const double length = track.end() - track.begin();
    for (const double t : {track.begin() - 0.2 * length, track.end() + 0.2 * length}) {
        const detail::Antennas place = track.at(t);
        EXPECT_LT(std::abs(place.tx[1]), 8.0);
        EXPECT_LT(std::abs(place.tx[2]), 8.0);
    }
    const double t = 0.37 * length;
    const Vector3 slope = 1e3 * (track.at(t + 5e-4).tx - track.at(t - 5e-4).tx);
    EXPECT_LT(norm(slope - track.rate(t).tx), 1e-5);
}

TEST(VirtualTrack, CutsThePathWhereItTurns) {
    Array<double, 2> circle({1000, 3});
    for (std::ptrdiff_t p = 0; p < 1000; ++p) {
        circle(p, 0) = 3000.0 * std::cos(0.002 * pi * static_cast<double>(p));
        circle(p, 1) = 3000.0 * std::sin(0.002 * pi * static_cast<double>(p));
    }
    const auto ends = detail::pieces_of_path(PhaseCentres(circle.view()));
    EXPECT_EQ(ends.front(), 0);
    EXPECT_EQ(ends.back(), 1000);
    EXPECT_GE(ends.size(), 7U);
    EXPECT_TRUE(std::is_sorted(ends.begin(), ends.end()));
    Array<double, 2> rest({500, 3});
    EXPECT_TRUE(detail::pieces_of_path(PhaseCentres(rest.view())).empty());
}

}  // namespace
}  // namespace sarfocus::focus
