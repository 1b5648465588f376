#include <sarfocus/sim/points.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include <sarfocus/core/array.hpp>
#include <sarfocus/core/constants.hpp>
#include <sarfocus/core/error.hpp>

namespace sarfocus::sim {
namespace {

using Image = Array<cfloat, 2>;

struct Scene {
    std::ptrdiff_t n_pulse;
    Array<double, 2> transmit, receive, targets;
    std::vector<cdouble> reflectivity;
    std::vector<double> range_start;

    Scene(std::ptrdiff_t pulses, std::ptrdiff_t n_target)
        : n_pulse(pulses),
          transmit({pulses, 3}),
          receive({pulses, 3}),
          targets({n_target, 3}),
          reflectivity(static_cast<std::size_t>(n_target)) {
        for (std::ptrdiff_t p = 0; p < pulses; ++p) {
            transmit(p, 0) = 3.0 * static_cast<double>(p);
            transmit(p, 2) = receive(p, 2) = 3000.0;
            receive(p, 0) = transmit(p, 0) + 50.0;
            receive(p, 1) = -20.0 * std::sin(static_cast<double>(p));
            range_start.push_back(4960.0 + 0.37 * static_cast<double>(p));
        }
        for (std::ptrdiff_t t = 0; t < n_target; ++t) {
            targets(t, 0) = 40.0 * std::sin(3.1 * static_cast<double>(t));
            targets(t, 1) = 4000.0 + 40.0 * std::cos(5.7 * static_cast<double>(t * t));
            reflectivity[static_cast<std::size_t>(t)] = std::polar(1.0 + std::sin(static_cast<double>(t)), 2.2 * static_cast<double>(t));
        }
    }

    [[nodiscard]] geometry::PhaseCentres centres(bool bistatic) const {
        return bistatic ? geometry::PhaseCentres(transmit.view(), receive.view()) : geometry::PhaseCentres(transmit.view());
    }
    [[nodiscard]] PointTargets points() const {
        return {targets.view(), {reflectivity.data(), {static_cast<std::ptrdiff_t>(reflectivity.size())}}};
    }
    // Half the path, written out with coordinates.
    [[nodiscard]] double range(std::ptrdiff_t p, std::ptrdiff_t t, bool bistatic) const {
        const auto leg = [&](const Array<double, 2>& antenna) {
            return std::hypot(targets(t, 0) - antenna(p, 0), targets(t, 1) - antenna(p, 1), targets(t, 2) - antenna(p, 2));
        };
        return bistatic ? 0.5 * (leg(transmit) + leg(receive)) : leg(transmit);
    }
};

PointEchoModel echo_model(const Scene& scene) {
    PointEchoModel model;
    model.range_start = {scene.range_start.data(), {scene.n_pulse}};
    model.range_spacing = 0.6;
    model.wavelength = 0.031;
    model.bandwidth = 200e6;
    return model;
}

TEST(Points, AreTheSumOfDelayedPulses) {
    const Scene scene(5, 7);
    for (const bool bistatic : {false, true}) {
        const PointEchoModel model = echo_model(scene);
        Image out({5, 150});
        points(scene.centres(bistatic), scene.points(), model, out.view());
        for (std::ptrdiff_t p = 0; p < 5; ++p)
            for (std::ptrdiff_t i = 0; i < 150; ++i) {
                cdouble expected = 0.0;
                for (std::ptrdiff_t t = 0; t < 7; ++t) {
                    const double range = scene.range(p, t, bistatic);
                    const double x = pi * 2.0 * 200e6 / speed_of_light *
                                     (scene.range_start[static_cast<std::size_t>(p)] + 0.6 * static_cast<double>(i) - range);
                    expected += scene.reflectivity[static_cast<std::size_t>(t)] * std::polar(std::sin(x) / x, -4.0 * pi * range / 0.031);
                }
                // Rounding to single precision of sums up to 10: half of 2^-23 times 8; the phase of 5 km: 1e-10 rad.
                EXPECT_LT(std::abs(cdouble(out(p, i)) - expected), 6e-7) << p << " " << i;
            }
    }
}

TEST(Points, SupportCutsAndOneStartServesAllPulses) {
    Scene scene(3, 1);
    PointEchoModel model = echo_model(scene);
    Image whole({3, 150}), cut({3, 150});
    model.range_start = {scene.range_start.data(), {1}};
    points(scene.centres(false), scene.points(), model, whole.view());
    model.support = 4.0;
    points(scene.centres(false), scene.points(), model, cut.view());
    for (std::ptrdiff_t p = 0; p < 3; ++p)
        for (std::ptrdiff_t i = 0; i < 150; ++i) {
            const bool inside = std::abs(scene.range_start[0] + 0.6 * static_cast<double>(i) - scene.range(p, 0, false)) <= 4.0;
            EXPECT_EQ(cut(p, i), inside ? whole(p, i) : cfloat());
        }
    // A scatterer far outside the recorded ranges.
    scene.targets(0, 1) = 9e5;
    points(scene.centres(false), scene.points(), model, cut.view());
    EXPECT_TRUE(std::all_of(cut.begin(), cut.end(), [](const cfloat& x) { return x == cfloat(); }));
}

TEST(Points, NoiseHasItsPowerAndItsSeed) {
    Scene scene(40, 1);
    scene.reflectivity[0] = 0.0;
    PointEchoModel model = echo_model(scene);
    model.noise_power = 4.0;
    model.seed = 3;
    Image out({40, 500}), again({40, 500}), other({40, 500});
    PointOptions options;
    options.execution.threads = 1;
    points(scene.centres(false), scene.points(), model, out.view(), options);
    options.execution.threads = 2;
    points(scene.centres(false), scene.points(), model, again.view(), options);
    model.seed = 4;
    points(scene.centres(false), scene.points(), model, other.view(), options);
    EXPECT_TRUE(std::equal(out.begin(), out.end(), again.begin()));
    double power = 0.0;
    cdouble product = 0.0;
    for (std::ptrdiff_t i = 0; i < out.size(); ++i) {
        power += std::norm(cdouble(out.data()[i]));
        product += cdouble(out.data()[i]) * std::conj(cdouble(other.data()[i]));
    }
    EXPECT_NEAR(power / 20000.0, 4.0, 5.0 * 4.0 / std::sqrt(20000.0));  // five standard deviations
    EXPECT_LT(std::abs(product) / 20000.0, 5.0 * 4.0 / std::sqrt(20000.0));
}

TEST(Points, RefusesHostileInput) {
    Scene scene(3, 2);
    Image out({3, 50}), other({4, 50});
    const auto run = [&](const PointEchoModel& model, Image& to) { points(scene.centres(true), scene.points(), model, to.view()); };
    EXPECT_THROW(run(echo_model(scene), other), ShapeError);
    PointEchoModel model = echo_model(scene);
    model.range_start = {scene.range_start.data(), {2}};
    EXPECT_THROW(run(model, out), ShapeError);
    model = echo_model(scene);
    model.range_spacing = 0.8;  // below the Nyquist rate of 200 MHz
    EXPECT_THROW(run(model, out), ValueError);
    model = echo_model(scene);
    model.noise_power = -1.0;
    EXPECT_THROW(run(model, out), ValueError);
    model = echo_model(scene);
    model.support = std::numeric_limits<double>::quiet_NaN();
    EXPECT_THROW(run(model, out), ValueError);
    scene.reflectivity[1] = {0.0, std::numeric_limits<double>::infinity()};
    EXPECT_THROW(run(echo_model(scene), out), NumericalError);
    scene.reflectivity[1] = 1.0;
    scene.targets(1, 2) = std::numeric_limits<double>::quiet_NaN();
    EXPECT_THROW(run(echo_model(scene), out), NumericalError);
}

PointHistoryModel history_model(const std::vector<double>& reference) {
    PointHistoryModel model;
    model.reference_range = {reference.data(), {static_cast<std::ptrdiff_t>(reference.size())}};
    model.frequency_start = 9.3e9;
    model.frequency_spacing = 1.47e6;
    return model;
}

TEST(PointsFrequency, KeepsItsErrorAgainstTheDirectSum) {
    // 300 targets: more than a block. 1, 16, 17 and 100 frequencies: lanes, their multiple, and what is left over.
    const Scene scene(3, 300);
    const std::vector<double> reference{5000.0, 5001.5, 4990.25};
    for (const bool bistatic : {false, true})
        for (const std::ptrdiff_t n_frequency : {1, 16, 17, 100}) {
            Image out({3, n_frequency});
            points_frequency(scene.centres(bistatic), scene.points(), history_model(reference), out.view());
            double error = 0.0, power = 0.0;
            for (std::ptrdiff_t p = 0; p < 3; ++p)
                for (std::ptrdiff_t m = 0; m < n_frequency; ++m) {
                    cdouble expected = 0.0;
                    for (std::ptrdiff_t t = 0; t < 300; ++t) {
                        const double offset = scene.range(p, t, bistatic) - reference[static_cast<std::size_t>(p)];
                        const double f = 9.3e9 + 1.47e6 * static_cast<double>(m);
                        expected +=
                            scene.reflectivity[static_cast<std::size_t>(t)] * std::polar(1.0, -4.0 * pi * f * offset / speed_of_light);
                    }
                    error += std::norm(cdouble(out(p, m)) - expected);
                    power += std::norm(expected);
                }
            EXPECT_LT(std::sqrt(error / power), 5e-7) << n_frequency;  // stated in the header
        }
}

TEST(PointsFrequency, BitsDependOnNeitherThreadsNorStrides) {
    const Scene scene(8, 20);
    const std::vector<double> reference{5000.0};
    PointHistoryModel model = history_model(reference);
    model.noise_power = 1.0;
    Image out({8, 33}), turned({33, 8});
    PointOptions options;
    options.execution.threads = 1;
    points_frequency(scene.centres(true), scene.points(), model, out.view(), options);
    options.execution.threads = 2;
    const MutableImageView flipped(turned.data() + 7, {8, 33}, {-1, 8});
    points_frequency(scene.centres(true), scene.points(), model, flipped, options);
    for (std::ptrdiff_t p = 0; p < 8; ++p)
        for (std::ptrdiff_t m = 0; m < 33; ++m) ASSERT_EQ(flipped(p, m), out(p, m));
}

TEST(PointsFrequency, RefusesHostileInput) {
    Scene scene(3, 2);
    Image out({3, 50});
    std::vector<double> reference{5000.0, 5001.0};
    const auto run = [&](const PointHistoryModel& model) { points_frequency(scene.centres(false), scene.points(), model, out.view()); };
    EXPECT_THROW(run(history_model(reference)), ShapeError);
    reference = {std::numeric_limits<double>::infinity()};
    EXPECT_THROW(run(history_model(reference)), NumericalError);
    reference = {5000.0};
    PointHistoryModel model = history_model(reference);
    model.frequency_spacing = 0.0;
    EXPECT_THROW(run(model), ValueError);
}

}  // namespace
}  // namespace sarfocus::sim
