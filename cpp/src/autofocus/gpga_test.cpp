#include <sarfocus/autofocus/gpga.hpp>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include <sarfocus/core/array.hpp>
#include <sarfocus/core/constants.hpp>
#include <sarfocus/core/error.hpp>
#include <sarfocus/sim/points.hpp>

namespace sarfocus::autofocus {
namespace {

using geometry::ImageGrid;
using geometry::PhaseCentres;

constexpr std::ptrdiff_t n_pulse = 128;
constexpr std::ptrdiff_t n_range = 160;

// A curved pass round a patch of ground with points on it, in noise.
struct Pass {
    Array<double, 2> positions{{n_pulse, 3}};
    Array<double, 1> start{{1}};
    Array<cfloat, 2> data{{n_pulse, n_range}};
    double spacing = 0.4;
    double wavelength = 0.03;

    explicit Pass(const std::vector<double>& phase) {
        for (std::ptrdiff_t p = 0; p < n_pulse; ++p) {
            const double angle = 0.035 * (static_cast<double>(p) / static_cast<double>(n_pulse - 1) - 0.5);
            positions(p, 0) = 3000.0 * std::sin(angle);
            positions(p, 1) = -3000.0 * std::cos(angle);
            positions(p, 2) = 1000.0 + 2.0 * angle;
        }
        start(0) = PhaseCentres(positions.view()).range(n_pulse / 2, {0.0, 0.0, 0.0}) - 0.5 * spacing * static_cast<double>(n_range);
        std::mt19937 bits(5);
        std::uniform_real_distribution<double> uniform(-1.0, 1.0);
        Array<double, 2> places({30, 3});
        Array<cdouble, 1> reflectivity({30});
        for (std::ptrdiff_t k = 0; k < 30; ++k) {
            places(k, 0) = 18.0 * uniform(bits);
            places(k, 1) = 18.0 * uniform(bits);
            reflectivity(k) = std::polar(1.0, pi * uniform(bits));
        }
        sim::PointEchoModel model;
        model.range_start = start.view();
        model.range_spacing = spacing;
        model.wavelength = wavelength;
        model.bandwidth = 300e6;
        model.noise_power = 0.05;
        model.seed = 7;
        sim::points(PhaseCentres(positions.view()), {places.view(), reflectivity.view()}, model, data.view());
        for (std::ptrdiff_t p = 0; p < n_pulse; ++p)
            for (std::ptrdiff_t i = 0; i < n_range; ++i) data(p, i) *= cfloat(std::polar(1.0, phase[static_cast<std::size_t>(p)]));
    }

    [[nodiscard]] focus::RangeProfiles profiles() const { return {data.view(), start.view(), spacing, wavelength}; }
};

ImageGrid ground(std::ptrdiff_t size = 200) {
    return ImageGrid::plane({-20.0, -20.0, 0.0}, {0.2, 0.0, 0.0}, {0.0, 0.2, 0.0}, {size, size});
}

std::vector<double> wobble(double amplitude) {
    std::vector<double> out;
    for (std::ptrdiff_t p = 0; p < n_pulse; ++p) {
        const double t = static_cast<double>(p) / static_cast<double>(n_pulse);
        out.push_back(amplitude * (std::sin(two_pi * 2.3 * t) + 2.0 * t * t));
    }
    return out;
}

double residual(const std::vector<double>& found, const std::vector<double>& truth) {
    std::vector<double> error;
    for (std::size_t k = 0; k < truth.size(); ++k) error.push_back(found[k] - truth[k]);
    for (std::size_t k = 1; k < error.size(); ++k) error[k] = error[k - 1] + std::remainder(error[k] - error[k - 1], two_pi);
    remove_linear(error);
    double sum = 0.0;
    for (const double e : error) sum += e * e / static_cast<double>(error.size());
    return std::sqrt(sum);
}

TEST(Gpga, FindsWhatWasInjectedAndFormsTheImageWithIt) {
    const auto truth = wobble(4.0);
    const Pass pass(truth);
    const PhaseCentres centres(pass.positions.view());
    Array<cfloat, 2> image({200, 200});
    const Result result = gpga(pass.profiles(), centres, ground(), image.view());
    EXPECT_EQ(result.status, Status::converged) << result.score.reason;
    // 30 points at 13 dB a sample: bound 0.029 rad; neighbours in the same range cell add to the noise, three times the bound is allowed.
    EXPECT_LT(residual(result.phase_error, truth), 0.09);

    Array<cfloat, 2> corrected({n_pulse, n_range});
    for (std::ptrdiff_t p = 0; p < n_pulse; ++p)
        for (std::ptrdiff_t i = 0; i < n_range; ++i)
            corrected(p, i) = pass.data(p, i) * cfloat(std::polar(1.0, -result.phase_error[static_cast<std::size_t>(p)]));
    focus::RangeProfiles profiles = pass.profiles();
    profiles.data = corrected.view();
    Array<cfloat, 2> expected({200, 200});
    focus::backproject(profiles, centres, ground(), expected.view());
    EXPECT_TRUE(std::equal(image.begin(), image.end(), expected.begin()));
}

TEST(Gpga, HandsBackTheUncorrectedImageWhereNothingIsWrong) {
    const Pass pass(std::vector<double>(n_pulse, 0.0));
    const PhaseCentres centres(pass.positions.view());
    Array<cfloat, 2> image({200, 200});
    const Result result = gpga(pass.profiles(), centres, ground(), image.view());
    EXPECT_EQ(result.status, Status::not_improved) << result.score.reason;
    Array<cfloat, 2> expected({200, 200});
    focus::backproject(pass.profiles(), centres, ground(), expected.view());
    EXPECT_TRUE(std::equal(image.begin(), image.end(), expected.begin()));
    EXPECT_LT(residual(result.estimate, std::vector<double>(n_pulse, 0.0)), 0.09);  // as above
}

TEST(Gpga, TakesAListOfPoints) {
    const auto truth = wobble(0.5);
    const Pass pass(truth);
    // The scatterers' own places: the error is small enough for them to stay within their cells.
    std::mt19937 bits(5);
    std::uniform_real_distribution<double> uniform(-1.0, 1.0);
    Array<double, 3> places({30, 1, 3});
    for (std::ptrdiff_t k = 0; k < 30; ++k) {
        places(k, 0, 0) = 18.0 * uniform(bits);
        places(k, 0, 1) = 18.0 * uniform(bits);
        (void)uniform(bits);
    }
    Array<cfloat, 2> image({30, 1});
    PointOptions options;
    options.do_no_harm = false;
    const Result result =
        gpga(pass.profiles(), PhaseCentres(pass.positions.view()), ImageGrid::from_points(places.view()), image.view(), options);
    EXPECT_LT(residual(result.phase_error, truth), 0.09);
}

TEST(Gpga, BitsDoNotDependOnThreads) {
    const Pass pass(wobble(3.0));
    const PhaseCentres centres(pass.positions.view());
    Array<cfloat, 2> one({100, 100});
    Array<cfloat, 2> three({100, 100});
    PointOptions options;
    options.execution.threads = 1;
    const Result a = gpga(pass.profiles(), centres, ground(100), one.view(), options);
    options.execution.threads = 3;
    const Result b = gpga(pass.profiles(), centres, ground(100), three.view(), options);
    EXPECT_EQ(a.estimate, b.estimate);
    EXPECT_TRUE(std::equal(one.begin(), one.end(), three.begin()));
}

TEST(Gpga, RefusesWhatMakesNoSense) {
    const Pass pass(wobble(3.0));
    const PhaseCentres centres(pass.positions.view());
    Array<cfloat, 2> image({200, 100});
    EXPECT_THROW((void)gpga(pass.profiles(), centres, ground(), image.view()), ShapeError);
    focus::RangeProfiles few = pass.profiles();
    few.data = few.data.slice(0, 0, 5);
    const PhaseCentres five(ArrayView<const double, 2>(pass.positions.view()).slice(0, 0, 5));
    Array<cfloat, 2> square({200, 200});
    EXPECT_THROW((void)gpga(few, five, ground(), square.view()), ShapeError);
    const ImageGrid behind = ImageGrid::plane({-20.0, -9000.0, 0.0}, {0.2, 0.0, 0.0}, {0.0, 0.2, 0.0}, {200, 200});
    EXPECT_THROW((void)gpga(pass.profiles(), centres, behind, square.view()), ValueError);
}

}  // namespace
}  // namespace sarfocus::autofocus
