#include <sarfocus/geometry/trajectory.hpp>

#include <cmath>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include <sarfocus/core/array.hpp>
#include <sarfocus/core/error.hpp>

namespace sarfocus::geometry {
namespace {

struct Recording {
    std::vector<double> time{0.0, 1.0, 3.0, 3.5};
    Array<double, 2> position{{4, 3}};

    Recording() {
        const double x[] = {0.0, 2.0, 2.0, -1.0};
        for (std::ptrdiff_t i = 0; i < 4; ++i) {
            position(i, 0) = x[i];
            position(i, 1) = -10.0 * x[i];
            position(i, 2) = 5.0;
        }
    }
    [[nodiscard]] Track track() const { return {{time.data(), {static_cast<std::ptrdiff_t>(time.size())}}, position.view()}; }
};

ArrayView<const double, 1> view(const std::vector<double>& values) {
    return {values.data(), {static_cast<std::ptrdiff_t>(values.size())}};
}

TEST(Trajectory, InterpolatesBetweenUnevenSamplesInAnyOrder) {
    const Recording recording;
    const std::vector<double> at{3.5, 0.0, 0.25, 2.0, 3.0, 3.4};
    const double expected[] = {-1.0, 0.0, 0.5, 2.0, 2.0, 2.0 - 3.0 * 0.8};
    Array<double, 2> turned({3, 6});
    interpolate_track(recording.track(), view(at), ArrayView<double, 2>(turned.data(), {6, 3}, {1, 6}));
    for (std::ptrdiff_t i = 0; i < 6; ++i) {
        EXPECT_NEAR(turned(0, i), expected[i], 1e-14);  // rounding of values up to 3
        EXPECT_NEAR(turned(1, i), -10.0 * expected[i], 1e-13);
        EXPECT_EQ(turned(2, i), 5.0);
    }
}

TEST(Trajectory, RefusesTracksThatAreNone) {
    constexpr double nan = std::numeric_limits<double>::quiet_NaN();
    const std::vector<double> inside{1.0};
    Array<double, 2> out({1, 3});
    const auto run = [&](const Recording& r, const std::vector<double>& at) { interpolate_track(r.track(), view(at), out.view()); };
    EXPECT_THROW(run(Recording(), {-1e-9}), ValueError);
    EXPECT_THROW(run(Recording(), {3.5000001}), ValueError);
    EXPECT_THROW(run(Recording(), {nan}), NumericalError);
    EXPECT_THROW(run(Recording(), {1.0, 2.0}), ShapeError);
    Recording bad;
    bad.time[2] = 1.0;
    EXPECT_THROW(run(bad, inside), ValueError);
    bad.time[2] = nan;
    EXPECT_THROW(run(bad, inside), NumericalError);
    bad = Recording();
    bad.position(3, 1) = nan;
    EXPECT_THROW(run(bad, inside), NumericalError);
    bad = Recording();
    bad.time.pop_back();
    EXPECT_THROW(run(bad, inside), ShapeError);
    bad.time = {1.0};
    EXPECT_THROW(run(bad, inside), ShapeError);
}

TEST(Trajectory, PathWeightsAreLengths) {
    // Rests (with jitter), a slow stretch, a fast one: 0, 0, 0.001 | 1, 2 | 5, 8.
    const double x[] = {0.0, 0.0, 0.001, 1.0, 2.0, 5.0, 8.0};
    Array<double, 2> positions({7, 3});
    for (std::ptrdiff_t i = 0; i < 7; ++i) {
        positions(i, 0) = 0.6 * x[i];
        positions(i, 2) = 100.0 - 0.8 * x[i];
    }
    Array<double, 1> weights({7});
    path_weights(positions.view(), 0.01, weights.view());
    const double length[] = {0.0, 0.0, 0.5, 0.9995, 2.0, 3.0, 3.0};
    for (std::ptrdiff_t i = 0; i < 7; ++i) EXPECT_NEAR(weights(i), length[i] * 5.0 / 9.4995, 1e-13) << i;  // coordinates of 100 m, rounded

    path_weights(positions.view(), 0.0, weights.view());
    EXPECT_EQ(weights(0), 0.0);
    EXPECT_GT(weights(1), 0.0);
}

TEST(Trajectory, PathWeightsRefuseWhatDoesNotMove) {
    Array<double, 2> positions({3, 3});
    Array<double, 1> weights({3}), other({4});
    EXPECT_THROW(path_weights(positions.view(), 0.0, weights.view()), ValueError);
    positions(1, 0) = 1.0;
    EXPECT_THROW(path_weights(positions.view(), 2.0, weights.view()), ValueError);
    EXPECT_THROW(path_weights(positions.view(), -1.0, weights.view()), ValueError);
    EXPECT_THROW(path_weights(positions.view(), std::numeric_limits<double>::quiet_NaN(), weights.view()), ValueError);
    EXPECT_THROW(path_weights(positions.view(), 0.0, other.view()), ShapeError);
    EXPECT_THROW(path_weights(positions.view().slice(0, 0, 1), 0.0, weights.view().slice(0, 0, 1)), ShapeError);
    EXPECT_THROW(path_weights(positions.view().slice(1, 0, 2), 0.0, weights.view()), ShapeError);
    positions(2, 1) = std::numeric_limits<double>::infinity();
    EXPECT_THROW(path_weights(positions.view(), 0.0, weights.view()), NumericalError);
}

}  // namespace
}  // namespace sarfocus::geometry
