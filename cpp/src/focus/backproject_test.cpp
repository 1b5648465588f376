#include <sarfocus/focus/backproject.hpp>

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <sarfocus/core/array.hpp>
#include <sarfocus/core/constants.hpp>
#include <sarfocus/core/error.hpp>

#include "backproject_kernel.hpp"

namespace sarfocus::focus {
namespace {

using geometry::ImageGrid;
using geometry::PhaseCentres;
using Image = Array<cfloat, 2>;

// A short straight pass along x, looking at a patch round the origin; the profiles hold a few scatterers.
struct Scene {
    double stand_off;
    double cell = 0.5;           // m, of a pulse of 300 MHz
    double spacing = 0.5 / 1.2;  // m, 1.2 times the Nyquist rate
    double wavelength = 0.031;   // m
    std::ptrdiff_t n_pulse = 48;
    std::ptrdiff_t n_range = 600;
    Array<double, 2> tx{{48, 3}};
    Array<double, 2> rx{{48, 3}};
    Array<double, 1> start{{1}};
    Image data{{48, 600}};
    std::vector<Vector3> scatterers{{3.3, -2.1, 0.4}, {-5.2, 6.7, 0.0}, {0.1, 0.2, -1.0}};

    explicit Scene(double distance, bool bistatic = false) : stand_off(distance) {
        for (std::ptrdiff_t p = 0; p < n_pulse; ++p) {
            const double half_length = std::min(0.02 * distance, 200.0);
            const double x = half_length * (2.0 * static_cast<double>(p) / static_cast<double>(n_pulse - 1) - 1.0);
            const Vector3 at{x, -distance, 0.3 * distance};
            for (std::size_t d = 0; d < 3; ++d) {
                tx(p, d) = at[d];
                rx(p, d) = at[d] + (bistatic ? 0.05 * distance * static_cast<double>(d) : 0.0);
            }
        }
        bistatic_ = bistatic;
        start(0) = centres().range(n_pulse / 2, {0.0, 0.0, 0.0}) - 0.5 * spacing * static_cast<double>(n_range);
        for (std::ptrdiff_t p = 0; p < n_pulse; ++p)
            for (std::ptrdiff_t i = 0; i < n_range; ++i) {
                cdouble sum{};
                for (const Vector3& s : scatterers) sum += response(p, s, start(0) + spacing * static_cast<double>(i));
                data(p, i) = cfloat(sum);
            }
    }

    [[nodiscard]] PhaseCentres centres() const { return bistatic_ ? PhaseCentres(tx.view(), rx.view()) : PhaseCentres(tx.view()); }
    [[nodiscard]] RangeProfiles profiles() const { return {data.view(), start.view(), spacing, wavelength}; }

    [[nodiscard]] cdouble response(std::ptrdiff_t pulse, const Vector3& scatterer, double range) const {
        const double own = centres().range(pulse, scatterer);
        const double x = pi * (range - own) / cell;
        return std::polar(x == 0.0 ? 1.0 : std::sin(x) / x, -std::remainder(2.0 * two_pi * own / wavelength, two_pi));
    }

    // The sum over pulses in double precision, with the pulse response itself in place of an interpolation.
    [[nodiscard]] cdouble exact(const Vector3& pixel) const {
        cdouble sum{};
        for (std::ptrdiff_t p = 0; p < n_pulse; ++p) {
            const double range = centres().range(p, pixel);
            cdouble profile{};
            for (const Vector3& s : scatterers) profile += response(p, s, range);
            sum += profile * std::polar(1.0, std::remainder(2.0 * two_pi * range / wavelength, two_pi));
        }
        return sum;
    }

private:
    bool bistatic_ = false;
};

ImageGrid patch(std::array<std::ptrdiff_t, 2> shape = {20, 70}) {
    return ImageGrid::plane({-8.0, -12.0, 0.0}, {0.8, 0.0, 0.02}, {0.0, 0.35, 0.01}, shape);
}

Image form(const Scene& scene, const ImageGrid& grid, int threads = 0) {
    Image image({grid.shape()[0], grid.shape()[1]});
    BackprojectOptions options;
    options.execution.threads = threads;
    backproject(scene.profiles(), scene.centres(), grid, image.view(), options);
    return image;
}

double error_db(const Image& image, const Scene& scene, const ImageGrid& grid) {
    double error = 0.0;
    double power = 0.0;
    for (std::ptrdiff_t i = 0; i < image.extent(0); ++i)
        for (std::ptrdiff_t j = 0; j < image.extent(1); ++j) {
            const cdouble truth = scene.exact(grid.position(static_cast<double>(i), static_cast<double>(j)));
            error += std::norm(cdouble(image(i, j)) - truth);
            power += std::norm(truth);
        }
    return 10.0 * std::log10(error / power);
}

template <class Error, class Call>
std::string message_of(const Call& call) {
    try {
        call();
    } catch (const Error& error) {
        return error.what();
    }
    return "nothing thrown";
}

TEST(Backproject, WeightsEveryTermByItsDirection) {
    for (const bool bistatic : {false, true}) {
        const Scene scene(1000.0, bistatic);
        const ImageGrid grid = patch({5, 7});
        // Runs of equal entries, a jump, and directions outside the table: the sines of the pass reach from -0.03 to 0.03.
        const AspectWeights weights{{1.0, 0.0, 0.0}, -0.012, 0.016, {{0.5f, 1.0f}, {0.5f, 1.0f}, {-1.0f, 0.25f}, {2.0f, 0.0f}}};
        Image image({5, 7});
        for (cfloat& pixel : image) pixel = {3.0f, -1.0f};  // it is added to
        backproject_weighted(scene.profiles(), scene.centres(), grid, weights, image.view());
        Array<double, 2> points({35, 3});
        for (std::ptrdiff_t i = 0; i < 5; ++i) grid.row_positions(i, points.data() + 21 * i);
        Image terms({35, scene.n_pulse});
        backproject_histories(scene.profiles(), scene.centres(), std::as_const(points).view(), terms.view());
        std::ptrdiff_t outside = 0;
        for (std::ptrdiff_t q = 0; q < 35; ++q) {
            cdouble sum(3.0, -1.0);
            for (std::ptrdiff_t p = 0; p < scene.n_pulse; ++p) {
                const Vector3 sight =
                    Vector3{points(q, 0), points(q, 1), points(q, 2)} - 0.5 * (scene.centres().tx(p) + scene.centres().rx(p));
                const double entry = std::floor((sight[0] / norm(sight) + 0.012) / 0.007);
                if (entry < 0.0 || entry > 3.0)
                    ++outside;
                else
                    sum += cdouble(weights.table[static_cast<std::size_t>(entry)]) * cdouble(terms(q, p));
            }
            // The sum takes some values from the cubic of a neighbouring bin: what both err by. No direction lies within rounding of a
            // border of two entries, which would make a difference of 0.5 and more.
            EXPECT_LT(std::abs(cdouble(image.data()[q]) - sum), 1e-3) << q;
        }
        EXPECT_GT(outside, 35);
    }
}

TEST(Backproject, RefusesWeightsThatMakeNoSense) {
    const Scene scene(1000.0);
    Image image({5, 7});
    const auto refused = [&](const AspectWeights& weights) {
        EXPECT_THROW(backproject_weighted(scene.profiles(), scene.centres(), patch({5, 7}), weights, image.view()), ValueError);
    };
    refused({{2.0, 0.0, 0.0}, -0.1, 0.1, {1.0f}});
    refused({{1.0, 0.0, 0.0}, 0.1, 0.1, {1.0f}});
    refused({{1.0, 0.0, 0.0}, -0.1, 1.1, {1.0f}});
    refused({{1.0, 0.0, 0.0}, -0.1, 0.1, {}});
}

TEST(Backproject, AgreesWithTheExactSum) {
    // The cubic of the profile table errs by -75 dB at 1.2 times the Nyquist rate; single-precision sums by less than -100 dB.
    for (const double distance : {500.0, 5000.0, 850e3})
        for (const bool bistatic : {false, true}) {
            const Scene scene(distance, bistatic);
            const ImageGrid grid = patch();
            EXPECT_LT(error_db(form(scene, grid), scene, grid), -72.0) << distance << " m, bistatic " << bistatic;
        }
}

TEST(Backproject, EveryKindOfGridGivesTheSamePixels) {
    const Scene scene(900.0);
    const ImageGrid polar =
        ImageGrid::polar({0.0, -900.0, 270.0}, {0.0, 900.0, -270.0}, {1.0, 0.0, 0.0}, 930.0, 0.4, -0.01, 0.001, {20, 30});
    const Image expected = form(scene, polar);
    EXPECT_LT(error_db(expected, scene, polar), -72.0);
    Array<double, 3> xyz({20, 30, 3});
    for (std::ptrdiff_t i = 0; i < 20; ++i) polar.row_positions(i, xyz.data() + i * 90);
    const Image points = form(scene, ImageGrid::from_points(xyz.view()));
    EXPECT_TRUE(std::equal(points.begin(), points.end(), expected.begin()));
    const Image part = form(scene, polar.subgrid({3, 4}, {5, 6}));
    for (std::ptrdiff_t i = 0; i < 5; ++i)
        for (std::ptrdiff_t j = 0; j < 6; ++j) EXPECT_NEAR(std::abs(part(i, j) - expected(i + 3, j + 4)), 0.0F, 2e-4F);  // 48 terms of 1e-6
}

TEST(Backproject, BitsDependNeitherOnThreadsNorOnStridesNorOnTheCall) {
    const Scene scene(700.0, true);
    const ImageGrid grid = patch({33, 300});
    const Image expected = form(scene, grid, 1);
    for (const int threads : {1, 2, 5}) {
        const Image again = form(scene, grid, threads);
        EXPECT_TRUE(std::equal(again.begin(), again.end(), expected.begin())) << threads;
    }
    // The same samples from a transposed, reversed array, into a transposed image.
    const std::ptrdiff_t n = scene.n_range;
    Image turned({n, scene.n_pulse});
    for (std::ptrdiff_t p = 0; p < scene.n_pulse; ++p)
        for (std::ptrdiff_t i = 0; i < n; ++i) turned(n - 1 - i, p) = scene.data(p, i);
    RangeProfiles profiles = scene.profiles();
    profiles.data = ImageView(turned.data() + (n - 1) * scene.n_pulse, {scene.n_pulse, n}, {1, -scene.n_pulse});
    Image out({300, 33});
    backproject(profiles, scene.centres(), grid, MutableImageView(out.data(), {33, 300}, {1, 33}));
    for (std::ptrdiff_t i = 0; i < 33; ++i)
        for (std::ptrdiff_t j = 0; j < 300; ++j) ASSERT_EQ(out(j, i), expected(i, j));
}

TEST(Backproject, TurnsPulsesByAFactorEach) {
    const Scene scene(700.0);
    const ImageGrid grid = patch();
    std::vector<cfloat> factors;
    Scene turned(700.0);
    for (std::ptrdiff_t p = 0; p < scene.n_pulse; ++p) {
        factors.emplace_back(std::polar(0.5f + 0.01f * static_cast<float>(p), 0.7f * static_cast<float>(p)));
        for (std::ptrdiff_t i = 0; i < scene.n_range; ++i) turned.data(p, i) *= factors.back();
    }
    const Image expected = form(turned, grid);
    Image image({grid.shape()[0], grid.shape()[1]});
    backproject_turned(scene.profiles(), scene.centres(), grid, factors, image.view());
    float largest = 0.0f;
    for (const cfloat& sample : expected) largest = std::max(largest, std::abs(sample));
    for (std::ptrdiff_t k = 0; k < image.size(); ++k) ASSERT_LT(std::abs(image.data()[k] - expected.data()[k]), 1e-5f * largest) << k;

    factors.pop_back();
    EXPECT_EQ(message_of<ShapeError>([&] { backproject_turned(scene.profiles(), scene.centres(), grid, factors, image.view()); }),
              "factors: expected 48 values, one for each pulse, got 47");
}

TEST(Backproject, TakesOneRangeStartForEachPulse) {
    const Scene scene(700.0);
    Scene shifted(700.0);
    shifted.start = Array<double, 1>({scene.n_pulse});
    for (std::ptrdiff_t p = 0; p < scene.n_pulse; ++p) {
        shifted.start(p) = scene.start(0) + 0.37 * static_cast<double>(p % 5);
        for (std::ptrdiff_t i = 0; i < scene.n_range; ++i) {
            cdouble sum{};
            for (const Vector3& s : scene.scatterers)
                sum += scene.response(p, s, shifted.start(p) + scene.spacing * static_cast<double>(i));
            shifted.data(p, i) = cfloat(sum);
        }
    }
    EXPECT_LT(error_db(form(shifted, patch()), scene, patch()), -72.0);
}

TEST(Backproject, HistoriesAddUpToTheImageAndAreZeroOutsideTheRecord) {
    const Scene scene(700.0);
    const ImageGrid grid = patch({3, 4});
    const Image image = form(scene, grid);
    Array<double, 2> points({13, 3});
    for (std::ptrdiff_t i = 0; i < 3; ++i) grid.row_positions(i, points.data() + 12 * i);
    points(12, 1) = 1e4;  // far beyond the swath
    Image histories({13, scene.n_pulse});
    backproject_histories(scene.profiles(), scene.centres(), points.view(), histories.view());
    for (std::ptrdiff_t n = 0; n < 12; ++n) {
        cdouble sum{};
        for (std::ptrdiff_t p = 0; p < scene.n_pulse; ++p) sum += cdouble(histories(n, p));
        EXPECT_LT(std::abs(sum - cdouble(image(n / 4, n % 4))), 1e-5 * 48);  // rounding of 48 terms of at most one
    }
    for (std::ptrdiff_t p = 0; p < scene.n_pulse; ++p) EXPECT_EQ(histories(12, p), cfloat{});
}

TEST(Backproject, ProjectIsTheAdjoint) {
    for (const bool bistatic : {false, true}) {
        const Scene scene(700.0, bistatic);
        const ImageGrid grid = patch({17, 300});
        const Image image = form(scene, grid);
        Image y({17, 300});
        for (std::ptrdiff_t k = 0; k < y.size(); ++k) y.data()[k] = cfloat(std::polar(1.0, 0.37 * static_cast<double>(k * k % 1009)));
        Image projected({scene.n_pulse, scene.n_range});
        project(y.view(), grid, scene.centres(), scene.profiles(), projected.view());
        cdouble left{};
        cdouble right{};
        double scale = 0.0;
        for (std::ptrdiff_t k = 0; k < y.size(); ++k) left += cdouble(image.data()[k]) * std::conj(cdouble(y.data()[k]));
        for (std::ptrdiff_t k = 0; k < projected.size(); ++k) {
            right += cdouble(scene.data.data()[k]) * std::conj(cdouble(projected.data()[k]));
            scale += std::norm(cdouble(scene.data.data()[k]));
        }
        double projected_power = 0.0;
        for (std::ptrdiff_t k = 0; k < projected.size(); ++k) projected_power += std::norm(cdouble(projected.data()[k]));
        // Rounding to 24 bits of sums of 48 x 600 terms is 2e-6 of the product of the norms. The series that takes the place of the range
        // in one of the two errs by up to 5e-4 rad, in 17 x 300 independent pixels: 7e-6.
        EXPECT_LT(std::abs(left - right), 9e-6 * std::sqrt(scale * projected_power));
        Image alone({scene.n_pulse, scene.n_range});
        BackprojectOptions options;
        options.execution.threads = 1;
        project(y.view(), grid, scene.centres(), scene.profiles(), alone.view(), options);
        EXPECT_TRUE(std::equal(alone.begin(), alone.end(), projected.begin()));
    }
}

TEST(Backproject, ProjectWithinABeamIsTheAdjointOfWhatTheBeamSees) {
    for (const bool bistatic : {false, true}) {
        const Scene scene(700.0, bistatic);
        const ImageGrid grid = patch({17, 300});
        const Aspect beam{{1.0, 0.0, 0.0}, -0.004, 0.009};  // the sines of the pass reach from -0.03 to 0.03
        Image image({17, 300});
        backproject_weighted(scene.profiles(), scene.centres(), grid, {beam.axis, beam.sine_start, beam.sine_stop, {{1.0f, 0.0f}}},
                             image.view());
        Image y({17, 300});
        for (std::ptrdiff_t k = 0; k < y.size(); ++k) y.data()[k] = cfloat(std::polar(1.0, 0.37 * static_cast<double>(k * k % 1009)));
        Image projected({scene.n_pulse, scene.n_range});
        project(y.view(), grid, scene.centres(), scene.profiles(), projected.view(), {}, beam);
        cdouble left{};
        cdouble right{};
        double scale = 0.0;
        for (std::ptrdiff_t k = 0; k < y.size(); ++k) left += cdouble(image.data()[k]) * std::conj(cdouble(y.data()[k]));
        for (std::ptrdiff_t k = 0; k < projected.size(); ++k) {
            right += cdouble(scene.data.data()[k]) * std::conj(cdouble(projected.data()[k]));
            scale += std::norm(cdouble(projected.data()[k]));
        }
        for (std::ptrdiff_t k = 0; k < scene.data.size(); ++k) scale += std::norm(cdouble(scene.data.data()[k]));
        // Single precision, and the few directions within rounding of an end of the beam.
        EXPECT_LT(std::abs(left - right), 1e-5 * scale);
        EXPECT_GT(std::abs(right), 0.0);
        // The last pulse looks back at the scene under sines below -0.012 and records nothing of it; the first sees its near end.
        for (std::ptrdiff_t i = 0; i < scene.n_range; ++i) ASSERT_EQ(projected(scene.n_pulse - 1, i), cfloat{});
        EXPECT_NE(projected(0, 300), cfloat{});
    }
    const Scene scene(700.0);
    Image y({17, 300});
    Image projected({scene.n_pulse, scene.n_range});
    const Aspect longer{{2.0, 0.0, 0.0}, -0.1, 0.1};
    EXPECT_THROW(project(y.view(), patch({17, 300}), scene.centres(), scene.profiles(), projected.view(), {}, longer), ValueError);
}

std::vector<const detail::Kernels*> kernel_sets() {
    std::vector<const detail::Kernels*> sets{&detail::kernels_baseline};
#if defined(__x86_64__)
    if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) sets.push_back(&detail::kernels_avx2);
    if (std::string(detail::select_kernels().name) == "avx512") sets.push_back(&detail::kernels_avx512);
#endif
    return sets;
}

TEST(Backproject, AllKernelsAgree) {
    using Layout = detail::ProfileLayout;
    constexpr std::int32_t n_bin = 2 * Layout::frame + 48;
    const auto table_of = [](const Layout& layout) {
        std::vector<float> table(static_cast<std::size_t>(layout.chunk_floats() * n_bin / Layout::chunk));
        for (std::int32_t bin = Layout::frame; bin < n_bin - Layout::frame; ++bin)
            for (std::int32_t k = 0; k < Layout::coefficients; ++k)
                table[static_cast<std::size_t>(layout.offset(bin) + k * layout.pitch)] =
                    std::sin(static_cast<float>((8 * bin + k) * (8 * bin + k) % 101));
        return table;
    };
    detail::PulseTable pulse{nullptr, n_bin, 700.0 - Layout::frame / 4.0, 4.0, {0.0, -700.0, 5.0}, {3.0, -701.0, 6.0}};
    detail::PixelBlock pixels;
    pixels.count = 250;
    for (std::ptrdiff_t i = 0; i < pixels.count; ++i) {
        pixels.x[i] = 0.11 * static_cast<double>(i);
        pixels.y[i] = -3.0 + 0.08 * static_cast<double>(i);  // from before the record to behind it
        pixels.z[i] = 1.0;
    }
    const auto sets = kernel_sets();
    for (const bool monostatic : {true, false}) {
        std::vector<std::vector<float>> sums;
        for (const auto* set : sets) {
            std::vector<float> re(256, 0.0F);
            std::vector<float> im(256, 0.0F);
            const std::vector<float> table = table_of(set->layout);
            pulse.bins = table.data();
            set->gather(pulse, pixels, 2.0 / 0.031, monostatic, re.data(), im.data());
            re.insert(re.end(), im.begin(), im.end());
            sums.push_back(re);
        }
        for (std::size_t s = 1; s < sums.size(); ++s)
            for (std::size_t k = 0; k < sums[0].size(); ++k)
                // Fused or not, a term of at most 4 differs by the rounding of the range phase: 2 pi of 2^-24 and a few ulps.
                EXPECT_NEAR(sums[s][k], sums[0][k], 1e-5F) << sets[s]->name;
    }
}

TEST(Backproject, RefusesWhatMakesNoSense) {
    const Scene scene(700.0);
    const ImageGrid grid = patch({4, 5});
    Image image({4, 5});
    const auto call = [&](const RangeProfiles& profiles) { backproject(profiles, scene.centres(), grid, image.view()); };

    const ImageGrid behind = ImageGrid::plane({0.0, -2400.0, 0.0}, {0.8, 0.0, 0.0}, {0.0, 0.3, 0.0}, {4, 5});
    EXPECT_NE(message_of<ValueError>([&] {
                  backproject(scene.profiles(), scene.centres(), behind, image.view());
              }).find("grid: expected pixels within"),
              std::string::npos);

    Scene broken(700.0);
    broken.data(7, 11) = {1.0F, std::numeric_limits<float>::infinity()};
    EXPECT_EQ(message_of<NumericalError>([&] { call(broken.profiles()); }), "data: expected finite samples, got 1+infj at [7, 11]");

    RangeProfiles profiles = scene.profiles();
    profiles.wavelength = 0.0;
    EXPECT_EQ(message_of<ValueError>([&] { call(profiles); }), "wavelength: expected a finite number > 0, got 0");
    profiles = scene.profiles();
    profiles.range_spacing = std::nan("");
    EXPECT_EQ(message_of<ValueError>([&] { call(profiles); }), "range_spacing: expected a finite number > 0, got nan");
    Array<double, 1> starts({3});
    profiles = scene.profiles();
    profiles.range_start = starts.view();
    EXPECT_EQ(message_of<ShapeError>([&] { call(profiles); }), "range_start: expected one value or 48, one for each pulse, got (3,)");
    profiles = scene.profiles();
    profiles.data = profiles.data.slice(0, 0, 0);
    EXPECT_THROW(call(profiles), ShapeError);
    profiles.data = scene.profiles().data.slice(0, 0, 40);
    EXPECT_EQ(message_of<ShapeError>([&] { call(profiles); }), "positions: expected (40, 3), one position per pulse, got (48, 3)");
    Image small({4, 4});
    EXPECT_THROW(backproject(scene.profiles(), scene.centres(), grid, small.view()), ShapeError);
}

TEST(Backproject, StopsWhenAskedAndPassesOnWhatTheCallbackThrows) {
    const Scene scene(700.0);
    const ImageGrid grid = patch({400, 600});
    Image image({400, 600});
    BackprojectOptions options;
    options.execution.progress = [](const ProgressUpdate&) { return false; };
    EXPECT_THROW(backproject(scene.profiles(), scene.centres(), grid, image.view(), options), Cancelled);
    options.execution.progress = [](const ProgressUpdate&) -> bool { throw std::out_of_range("mine"); };
    EXPECT_THROW(backproject(scene.profiles(), scene.centres(), grid, image.view(), options), std::out_of_range);
}

}  // namespace
}  // namespace sarfocus::focus
