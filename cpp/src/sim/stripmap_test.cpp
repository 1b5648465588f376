#include <sarfocus/sim/stripmap.hpp>

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

geometry::StripmapGeometry strip_geometry(std::ptrdiff_t n_range, double doppler_centroid = 0.0) {
    geometry::StripmapGeometry out;
    out.wavelength = 0.03;
    out.prf = 500.0;
    out.velocity = 120.0;
    for (std::ptrdiff_t j = 0; j < n_range; ++j) out.slant_range.push_back(3000.0 + 0.5 * static_cast<double>(j));
    out.doppler_bandwidth = 350.0;
    out.doppler_centroid = doppler_centroid;
    return out;
}

struct Targets {
    std::vector<double> pixels;
    std::vector<cdouble> reflectivity;
    [[nodiscard]] StripmapTargets view() const {
        const auto n = static_cast<std::ptrdiff_t>(reflectivity.size());
        return {{pixels.data(), {n, 2}}, {reflectivity.data(), {n}}};
    }
};

TEST(Stripmap, BandLimitedTargetIsTheSumOfItsTones) {
    constexpr std::ptrdiff_t n = 60;
    for (const double centroid : {0.0, 777.0}) {
        const auto geometry = strip_geometry(2, centroid);
        const Targets targets{{20.25, 1.0, 58.5, 1.0}, {2.0, cdouble(0.0, 1.0)}};
        Image out({n, 2});
        stripmap(geometry, targets.view(), out.view());
        const double rate = 2.0 * 120.0 * 120.0 / (0.03 * 3000.5);
        std::vector<double> frequencies;
        for (std::ptrdiff_t k = -600; k < 600; ++k) {
            const double f = 500.0 * static_cast<double>(k) / n;
            if (f >= centroid - 175.0 && f < centroid + 175.0) frequencies.push_back(f);
        }
        for (std::ptrdiff_t i = 0; i < n; ++i) {
            cdouble expected = 0.0;
            for (const double f : frequencies)
                for (std::size_t t = 0; t < 2; ++t)
                    expected += targets.reflectivity[t] / static_cast<double>(frequencies.size()) *
                                std::polar(1.0, pi * (f - centroid) * (f - centroid) / rate +
                                                    two_pi * f * (static_cast<double>(i) - targets.pixels[2 * t]) / 500.0);
            EXPECT_LT(std::abs(cdouble(out(i, 1)) - expected), 1e-6) << i;  // rounding to single precision of values below 3
            EXPECT_EQ(out(i, 0), cfloat());
        }
    }
}

TEST(Stripmap, ChirpIsTheTruncatedSignalInTime) {
    constexpr std::ptrdiff_t n = 1200;
    const auto geometry = strip_geometry(1, 60.0);
    const Targets targets{{300.4, 0.0, -2000.0, 0.0}, {2.0, 1.0}};
    Image out({n, 1});
    StripmapOptions options;
    options.model = StripmapModel::chirp;
    stripmap(geometry, targets.view(), out.view(), options);
    const double rate = 2.0 * 120.0 * 120.0 / (0.03 * 3000.0);
    for (std::ptrdiff_t i = 0; i < n; ++i) {
        const double t = (static_cast<double>(i) - 300.4) / 500.0;
        const cdouble chirp = std::polar(2.0 / std::sqrt(350.0 * 350.0 / rate), 0.25 * pi - pi * rate * t * t + two_pi * 60.0 * t);
        EXPECT_LT(std::abs(cdouble(out(i, 0)) - (std::abs(t) <= 0.5 * 350.0 / rate ? chirp : 0.0)), 1e-7) << i;
    }
}

TEST(Stripmap, PhaseErrorMultipliesAndComesBeforeTheNoise) {
    const auto geometry = strip_geometry(3);
    const Targets targets{{20.0, 1.0}, {1.0}};
    std::vector<double> error(64);
    for (std::size_t i = 0; i < 64; ++i) error[i] = 0.1 * static_cast<double>(i * i % 50);
    Image clean({64, 3}), bent({64, 3}), noise({64, 3}), all({64, 3});
    stripmap(geometry, targets.view(), clean.view());
    StripmapOptions options;
    options.effects.phase_error = {error.data(), {64}};
    stripmap(geometry, targets.view(), bent.view(), options);
    options.effects.noise_power = 1.0;
    stripmap(geometry, targets.view(), all.view(), options);
    stripmap(geometry, {{nullptr, {0, 2}}, {nullptr, {0}}}, noise.view(), options);
    for (std::ptrdiff_t i = 0; i < 64; ++i)
        for (std::ptrdiff_t j = 0; j < 3; ++j) {
            EXPECT_LT(std::abs(cdouble(bent(i, j)) - cdouble(clean(i, j)) * std::polar(1.0, error[static_cast<std::size_t>(i)])), 1e-7);
            EXPECT_LT(std::abs(all(i, j) - bent(i, j) - noise(i, j)), 1e-6);  // single-precision sums of values below 4
        }
}

TEST(Stripmap, BitsDependOnNeitherThreadsNorStrides) {
    const auto geometry = strip_geometry(20, 90.0);
    const Targets targets{{20.0, 1.0, 33.3, 17.0}, {1.0, 5.0}};
    StripmapOptions options;
    options.clutter_power = 0.3;
    options.effects.noise_power = 0.1;
    options.effects.seed = 5;
    options.execution.threads = 1;
    Image out({100, 20}), turned({20, 100});
    stripmap(geometry, targets.view(), out.view(), options);
    options.execution.threads = 2;
    const MutableImageView flipped(turned.data() + 99, {100, 20}, {-1, 100});
    stripmap(geometry, targets.view(), flipped, options);
    for (std::ptrdiff_t i = 0; i < 100; ++i)
        for (std::ptrdiff_t j = 0; j < 20; ++j) ASSERT_EQ(flipped(i, j), out(i, j));
}

TEST(StripmapEcho, FollowsTheHyperbolaWithItsCarrier) {
    const auto geometry = strip_geometry(80, 40.0);
    const Targets targets{{300.5, 30.25}, {cdouble(0.0, 2.0)}};
    StripmapEchoOptions options;
    options.range_bandwidth = 250e6;
    Image out({700, 80});
    stripmap_echo(geometry, targets.view(), out.view(), options);
    for (std::ptrdiff_t i = 0; i < 700; ++i) {
        const double t = (static_cast<double>(i) - 300.5) / 500.0;
        const double range = std::sqrt(3015.125 * 3015.125 + 120.0 * 120.0 * t * t);
        const double doppler = -2.0 * 120.0 * 120.0 * t / (0.03 * range);
        for (std::ptrdiff_t j = 0; j < 80; ++j) {
            const double x = pi * 2.0 * 250e6 / speed_of_light * (3000.0 + 0.5 * static_cast<double>(j) - range);
            const cdouble echo = cdouble(0.0, 2.0) * std::polar(std::sin(x) / x, -4.0 * pi * range / 0.03);
            EXPECT_LT(std::abs(cdouble(out(i, j)) - (std::abs(doppler - 40.0) <= 175.0 ? echo : 0.0)), 3e-7) << i << " " << j;
        }
    }
}

TEST(Stripmap, RefusesHostileInput) {
    const auto geometry = strip_geometry(4);
    Image out({50, 4}), narrow({50, 3});
    const auto run = [&](const Targets& targets, Image& to, const StripmapOptions& options = {}) {
        stripmap(geometry, targets.view(), to.view(), options);
    };
    EXPECT_THROW(run({{1.0, 1.0}, {1.0}}, narrow), ShapeError);
    EXPECT_THROW(run({{1.0, 1.5}, {1.0}}, out), ValueError);
    EXPECT_THROW(run({{1.0, 4.0}, {1.0}}, out), ValueError);
    EXPECT_THROW(run({{std::numeric_limits<double>::infinity(), 1.0}, {1.0}}, out), NumericalError);
    EXPECT_THROW(run({{1.0, 1.0}, {std::numeric_limits<double>::quiet_NaN()}}, out), NumericalError);
    StripmapOptions options;
    options.clutter_power = -1.0;
    EXPECT_THROW(run({{1.0, 1.0}, {1.0}}, out, options), ValueError);
    options.clutter_power = 0.0;
    const std::vector<double> error(49);
    options.effects.phase_error = {error.data(), {49}};
    EXPECT_THROW(run({{1.0, 1.0}, {1.0}}, out, options), ShapeError);

    StripmapEchoOptions echo;
    const Targets target{{1.0, 1.0}, {1.0}};
    EXPECT_THROW(stripmap_echo(geometry, target.view(), out.view(), echo), ValueError);
    echo.range_bandwidth = 400e6;  // c / (2 * 0.5 m) is 300 MHz
    EXPECT_THROW(stripmap_echo(geometry, target.view(), out.view(), echo), ValueError);
    echo.range_bandwidth = 200e6;
    auto uneven = geometry;
    uneven.slant_range[1] += 0.1;
    EXPECT_THROW(stripmap_echo(uneven, target.view(), out.view(), echo), ValueError);
    std::reverse(uneven.slant_range.begin(), uneven.slant_range.end());
    EXPECT_THROW(stripmap_echo(uneven, target.view(), out.view(), echo), ValueError);
}

}  // namespace
}  // namespace sarfocus::sim
