#include <sarfocus/autofocus/ridges.hpp>

#include <cmath>
#include <cstddef>
#include <limits>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include <sarfocus/autofocus/ridge_path.hpp>
#include <sarfocus/core/array.hpp>
#include <sarfocus/core/constants.hpp>
#include <sarfocus/core/error.hpp>

namespace sarfocus::autofocus {
namespace {

constexpr std::ptrdiff_t n_pulse = 240;
constexpr std::ptrdiff_t n_range = 420;
constexpr double spacing = 0.009;
constexpr double first_range = 6.0;
constexpr double wavelength = 0.073;
constexpr double resolution = 0.107;

// A carriage on a rail of 3 m that speeds up and slows down by a third, past scatterers seven metres away.
struct Rail {
    Array<double, 2> truth{{n_pulse, 3}};
    Array<double, 2> start{{n_pulse, 3}};
    Array<double, 1> range_start{{1}};
    Array<cfloat, 2> data{{n_pulse, n_range}};
    std::vector<Vector3> places;

    Rail(std::vector<Vector3> scatterers, double noise) : places(std::move(scatterers)) {
        range_start(0) = first_range;
        for (std::ptrdiff_t p = 0; p < n_pulse; ++p) {
            const double t = static_cast<double>(p) / (n_pulse - 1) - 0.5;
            truth(p, 0) = 3.0 * t + 0.16 * std::sin(4.0 * pi * t);
            start(p, 0) = 2.2 * t;
            for (std::ptrdiff_t bin = 0; bin < n_range; ++bin)
                for (std::size_t k = 0; k < places.size(); ++k) {
                    const double range = range_of(k, p);
                    const double x = (first_range + spacing * static_cast<double>(bin) - range) / resolution;
                    data(p, bin) += cfloat(std::polar(std::exp(-2.0 * x * x), -4.0 * pi * range / wavelength));
                }
        }
        std::mt19937 bits(3);
        std::normal_distribution<float> normal(0.0f, static_cast<float>(noise / std::sqrt(2.0)));
        for (cfloat& value : data) value += cfloat(normal(bits), normal(bits));
    }

    [[nodiscard]] double range_of(std::size_t k, std::ptrdiff_t p) const {
        return norm(places[k] - Vector3{truth(p, 0), truth(p, 1), truth(p, 2)});
    }
    [[nodiscard]] focus::RangeProfiles profiles() const { return {data.view(), range_start.view(), spacing, wavelength}; }
};

RidgeOptions usual() {
    RidgeOptions options;
    options.resolution = resolution;
    return options;
}

const std::vector<Vector3> crossing{{-1.8, 7.2, 0.0}, {2.1, 7.0, 0.0}};

RidgePathOptions towards_scene() {
    RidgePathOptions options;
    options.look = {0.0, 1.0, 0.0};
    return options;
}

TEST(Ridges, FollowTwoScatterersThatPassEachOther) {
    const Rail rail(crossing, 0.3);
    const Ridges found = track_ridges(rail.profiles(), usual());
    ASSERT_EQ(found.ridges.size(), 2U) << found.reason;
    for (std::ptrdiff_t ridge = 0; ridge < 2; ++ridge) {
        const std::size_t k = std::abs(found.range(ridge, 0) - rail.range_of(0, 0)) < 0.1 ? 0 : 1;
        double squares = 0.0;
        double sum = 0.0;
        int seen = 0;
        for (std::ptrdiff_t p = 0; p < n_pulse; ++p) {
            const double error = found.range(ridge, p) - rail.range_of(k, p);
            if (std::isnan(error)) continue;
            sum += error;
            squares += error * error;
            ++seen;
        }
        EXPECT_GT(seen, 220);
        const double mean = sum / seen;
        EXPECT_LT(std::abs(mean), 0.01) << "the envelope's constant: a tenth of a cell";
        EXPECT_LT(std::sqrt(squares / seen - mean * mean), 0.0025) << "the phase: a thirtieth of the wavelength, mostly where they cross";
    }
}

TEST(Ridges, AreTheSameForAnyNumberOfThreads) {
    const Rail rail(crossing, 0.3);
    RidgeOptions options = usual();
    options.execution.threads = 1;
    const Ridges one = track_ridges(rail.profiles(), options);
    options.execution.threads = 3;
    const Ridges three = track_ridges(rail.profiles(), options);
    ASSERT_EQ(one.range.extents(), three.range.extents());
    for (std::ptrdiff_t i = 0; i < one.range.size(); ++i)
        EXPECT_TRUE(one.range.data()[i] == three.range.data()[i] || std::isnan(one.range.data()[i]));
}

// Scatterers that are hidden over a few pulses: the ridges go on behind, and may be had in pieces.
TEST(Ridges, AreHandedOutInPieces) {
    Rail rail(crossing, 0.3);
    const Rail hidden({}, 0.3);
    for (std::ptrdiff_t p = 114; p < 126; ++p)
        for (std::ptrdiff_t bin = 0; bin < n_range; ++bin) rail.data(p, bin) = hidden.data(p, bin);
    RidgeOptions options = usual();
    const Ridges whole = track_ridges(rail.profiles(), options);
    options.pieces = true;
    const Ridges pieces = track_ridges(rail.profiles(), options);
    ASSERT_EQ(whole.ridges.size(), 2U) << whole.reason;
    ASSERT_EQ(pieces.ridges.size(), 4U) << pieces.reason;
    for (std::ptrdiff_t k = 0; k < pieces.range.extent(0); ++k) {
        const Ridge& piece = pieces.ridges[static_cast<std::size_t>(k)];
        for (std::ptrdiff_t p = 0; p < n_pulse; ++p) {
            const double range = pieces.range(k, p);
            EXPECT_EQ(std::isnan(range), p < piece.first || p > piece.last) << "no interruption";
            if (!std::isnan(range)) EXPECT_TRUE(range == whole.range(0, p) || range == whole.range(1, p));
        }
    }
    options.shortest = 0.7;
    EXPECT_EQ(track_ridges(rail.profiles(), options).range.extent(0), 0) << "long enough as a whole, no piece is";
}

TEST(Ridges, NoneInNoiseOrSilence) {
    Rail rail({}, 1.0);
    EXPECT_EQ(track_ridges(rail.profiles(), usual()).range.extent(0), 0);
    for (cfloat& value : rail.data) value = {};
    const Ridges silent = track_ridges(rail.profiles(), usual());
    EXPECT_EQ(silent.range.extent(0), 0);
    EXPECT_EQ(silent.range.extent(1), n_pulse);
    EXPECT_EQ(silent.reason, "the echoes are zero");
}

TEST(Ridges, RefuseWhatTheyCannotUse) {
    Rail rail(crossing, 0.0);
    EXPECT_THROW((void)track_ridges(rail.profiles(), {}), ValueError) << "no resolution";
    RidgeOptions options = usual();
    options.half_window = 120;
    EXPECT_THROW((void)track_ridges(rail.profiles(), options), ShapeError);
    rail.data(17, 3) = {std::numeric_limits<float>::quiet_NaN(), 0.0f};
    EXPECT_THROW((void)track_ridges(rail.profiles(), usual()), NumericalError);
}

// RMS of the difference along the track, its mean removed.
double away(const RidgePath& path, const Rail& rail) {
    double sum = 0.0;
    double squares = 0.0;
    for (std::ptrdiff_t p = 0; p < n_pulse; ++p) {
        const double error = path.positions(p, 0) - rail.truth(p, 0);
        sum += error;
        squares += error * error;
    }
    return std::sqrt(squares / n_pulse - sum * sum / (n_pulse * n_pulse));
}

TEST(RidgePath, FindsTheMotionFromALineThatIsAQuarterTooShort) {
    const Rail rail(crossing, 0.3);
    const Ridges ridges = track_ridges(rail.profiles(), usual());
    const RidgePath path = trajectory_from_ridges(ridges.range.view(), rail.start.view(), towards_scene());
    EXPECT_EQ(path.status, RidgePathStatus::converged) << path.reason;
    // The sine's share of the line that fits it best: 0.16 m times the mean of t sin(4 pi t) over that of t^2, -1/(4 pi) * 12.
    EXPECT_NEAR(path.length_ratio, (3.0 - 0.16 * 12.0 / (4.0 * pi)) / 2.2, 0.006) << "four standard deviations";
    // A constant of 1 cm in 7 m that the envelope leaves changes the length by 0.07 %; the rest is what two ranges of 2 mm give.
    EXPECT_LT(away(path, rail), 0.012);
    EXPECT_LT(path.residual_rms, 0.004);
}

// Exact ranges: what is left is the fit's own.
Array<double, 2> exact(const Rail& rail) {
    Array<double, 2> out({static_cast<std::ptrdiff_t>(rail.places.size()), n_pulse});
    for (std::ptrdiff_t k = 0; k < out.extent(0); ++k)
        for (std::ptrdiff_t p = 0; p < n_pulse; ++p) out(k, p) = rail.range_of(static_cast<std::size_t>(k), p);
    return out;
}

TEST(RidgePath, LeavesOutARidgeThatDoesNotFit) {
    const Rail rail({crossing[0], crossing[1], {0.2, 6.5, 0.0}, {-0.4, 7.5, 0.0}}, 0.0);
    Array<double, 2> range = exact(rail);
    for (std::ptrdiff_t p = 0; p < n_pulse; ++p) range(2, p) = 8.0 - 0.01 * static_cast<double>(p);  // something that moves
    const RidgePath path = trajectory_from_ridges(range.view(), rail.start.view(), towards_scene());
    EXPECT_EQ(path.rejected, 1);
    EXPECT_FALSE(path.points[2].used);
    EXPECT_LT(away(path, rail), 0.003);
}

TEST(RidgePath, FindsMotionAcrossTheTrackFromSeveralRidges) {
    Rail rail({crossing[0], crossing[1], {0.2, 6.5, 0.0}, {-0.6, 8.4, 0.0}}, 0.0);
    for (std::ptrdiff_t p = 0; p < n_pulse; ++p) {
        const double t = static_cast<double>(p) / (n_pulse - 1) - 0.5;
        rail.truth(p, 1) = 0.03 * std::cos(6.0 * pi * t);  // no line in it
    }
    RidgePathOptions options = towards_scene();
    options.across = true;
    const RidgePath path = trajectory_from_ridges(exact(rail).view(), rail.start.view(), options);
    EXPECT_EQ(path.status, RidgePathStatus::converged) << path.reason;
    double squares = 0.0;
    for (std::ptrdiff_t p = 0; p < n_pulse; ++p) squares += std::pow(path.positions(p, 1) - rail.truth(p, 1), 2);
    EXPECT_LT(std::sqrt(squares / n_pulse), 0.006) << "of 21 mm; a curve of constant curvature is nearly a change of length";
}

TEST(RidgePath, SaysWhereTooLittleIsKnown) {
    const Rail rail({crossing[0]}, 0.0);
    const RidgePath one = trajectory_from_ridges(exact(rail).view(), rail.start.view(), towards_scene());
    EXPECT_EQ(one.status, RidgePathStatus::not_determined);
    EXPECT_NE(one.reason.find("1 of 1 ridges"), std::string::npos) << one.reason;
    for (std::ptrdiff_t p = 0; p < n_pulse; ++p) EXPECT_EQ(one.motion(p, 0), 0.0);
    const Array<double, 2> none({0, n_pulse});
    EXPECT_EQ(trajectory_from_ridges(none.view(), rail.start.view(), towards_scene()).status, RidgePathStatus::not_determined);

    const Rail two(crossing, 0.0);
    RidgePathOptions across = towards_scene();
    across.across = true;
    EXPECT_EQ(trajectory_from_ridges(exact(two).view(), two.start.view(), across).status, RidgePathStatus::not_determined);
    Array<double, 2> apart = exact(two);  // never seen together
    for (std::ptrdiff_t p = 0; p < n_pulse; ++p) apart(p < n_pulse / 2 ? 0 : 1, p) = std::numeric_limits<double>::quiet_NaN();
    EXPECT_EQ(trajectory_from_ridges(apart.view(), two.start.view(), towards_scene()).status, RidgePathStatus::not_determined);
}

TEST(RidgePath, RefusesWhatItCannotUse) {
    const Rail rail(crossing, 0.0);
    Array<double, 2> range = exact(rail);
    RidgePathOptions options = towards_scene();
    options.look = {1.0, 0.0, 0.0};
    EXPECT_THROW((void)trajectory_from_ridges(range.view(), rail.start.view(), options), ValueError) << "along the track";
    const Array<double, 2> still({n_pulse, 3});
    EXPECT_THROW((void)trajectory_from_ridges(range.view(), still.view(), towards_scene()), ValueError);
    const Array<double, 2> shorter({n_pulse - 1, 3});
    EXPECT_THROW((void)trajectory_from_ridges(range.view(), shorter.view(), towards_scene()), ShapeError);
    range(1, 5) = -2.0;
    EXPECT_THROW((void)trajectory_from_ridges(range.view(), rail.start.view(), towards_scene()), ValueError);
    range(1, 5) = std::numeric_limits<double>::infinity();
    EXPECT_THROW((void)trajectory_from_ridges(range.view(), rail.start.view(), towards_scene()), ValueError);
}

}  // namespace
}  // namespace sarfocus::autofocus
