// Exact backprojection on two threads of a scene in X band, 300 MHz, range transforms and tables included: speed beside the error
// relative to the sum in double precision.
#include <algorithm>
#include <cmath>
#include <complex>
#include <cstddef>
#include <utility>

#include <benchmark/benchmark.h>

#include <sarfocus/core/array.hpp>
#include <sarfocus/core/constants.hpp>
#include <sarfocus/focus/backproject.hpp>

namespace {

using sarfocus::Array;
using sarfocus::cdouble;
using sarfocus::cfloat;
using sarfocus::pi;
using sarfocus::two_pi;
using sarfocus::Vector3;
using sarfocus::geometry::ImageGrid;
using sarfocus::geometry::PhaseCentres;

constexpr double wavelength = 0.031;
constexpr double cell = 0.5;            // m, of a pulse of 300 MHz
constexpr double spacing = cell / 1.2;  // m, of the samples
constexpr double pixel = 0.3;           // m
constexpr double n_target = 5;

enum class Kind : std::int64_t { plane, points };

struct Scene {
    Array<double, 2> positions;
    Array<double, 1> start{{1}};
    Array<cfloat, 2> data;
    ImageGrid grid;

    Scene(double distance, std::ptrdiff_t size, Kind kind)
        : positions({size, 3}),
          data({size, static_cast<std::ptrdiff_t>(1.1 * static_cast<double>(size) * pixel / spacing) + 64}),
          grid(image(size, kind)) {
        const double aperture = wavelength * distance / (2.0 * pixel);
        for (std::ptrdiff_t p = 0; p < size; ++p) {
            const double t = static_cast<double>(p) / static_cast<double>(size) - 0.5;
            positions(p, 0) = aperture * t;
            positions(p, 1) = -0.9 * distance;
            positions(p, 2) = std::sqrt(1.0 - 0.81) * distance + 0.02 * std::sin(40.0 * t);
        }
        start(0) = distance - 0.5 * spacing * static_cast<double>(data.extent(1));
        for (std::ptrdiff_t p = 0; p < size; ++p)
            for (std::ptrdiff_t i = 0; i < data.extent(1); ++i) {
                cdouble sum{};
                for (int n = 0; n < n_target; ++n) sum += response(p, target(n), start(0) + spacing * static_cast<double>(i));
                data(p, i) = cfloat(sum);
            }
    }

    static Vector3 target(int n) { return {3.1 * n - 6.0, 2.3 * n * n - 9.0, 0.0}; }

    static ImageGrid image(std::ptrdiff_t size, Kind kind) {
        const double corner = -0.5 * pixel * static_cast<double>(size);
        const ImageGrid plane = ImageGrid::plane({corner, corner, 0.0}, {pixel, 0.0, 0.0}, {0.0, pixel, 0.0}, {size, size});
        if (kind == Kind::plane) return plane;
        Array<double, 3> xyz({size, size, 3});
        for (std::ptrdiff_t i = 0; i < size; ++i) {
            plane.row_positions(i, xyz.data() + 3 * i * size);
            for (std::ptrdiff_t j = 0; j < size; ++j)
                xyz(i, j, 2) = 2.0 * std::sin(0.02 * static_cast<double>(i)) * std::cos(0.03 * static_cast<double>(j));
        }
        return ImageGrid::from_points(std::as_const(xyz).view());
    }

    [[nodiscard]] cdouble response(std::ptrdiff_t pulse, const Vector3& scatterer, double range) const {
        const double own = PhaseCentres(positions.view()).range(pulse, scatterer);
        const double x = pi * (range - own) / cell;
        return std::polar(x == 0.0 ? 1.0 : std::sin(x) / x, -two_pi * std::remainder(2.0 * own / wavelength, 1.0));
    }

    // Over pixels round the targets, with the pulse response itself in place of an interpolation.
    [[nodiscard]] double error_db(const Array<cfloat, 2>& made) const {
        const std::ptrdiff_t middle = made.extent(0) / 2;
        const PhaseCentres centres(positions.view());
        double error = 0.0;
        double power = 0.0;
        for (std::ptrdiff_t i = middle - 32; i < middle + 32; i += 3)
            for (std::ptrdiff_t j = middle - 32; j < middle + 32; j += 3) {
                const Vector3 at = grid.position(static_cast<double>(i), static_cast<double>(j));
                cdouble sum{};
                for (std::ptrdiff_t p = 0; p < positions.extent(0); ++p) {
                    const double range = centres.range(p, at);
                    cdouble profile{};
                    for (int n = 0; n < n_target; ++n) profile += response(p, target(n), range);
                    sum += profile * std::polar(1.0, two_pi * std::remainder(2.0 * range / wavelength, 1.0));
                }
                error += std::norm(cdouble(made(i, j)) - sum);
                power += std::norm(sum);
            }
        return 10.0 * std::log10(error / power);
    }
};

void backproject(benchmark::State& state) {
    const auto size = static_cast<std::ptrdiff_t>(state.range(1));
    const Scene scene(static_cast<double>(state.range(0)), size, static_cast<Kind>(state.range(2)));
    sarfocus::focus::BackprojectOptions options;
    options.execution.threads = 2;
    Array<cfloat, 2> image({size, size});
    for (auto _ : state) {
        sarfocus::focus::backproject({scene.data.view(), scene.start.view(), spacing, wavelength}, PhaseCentres(scene.positions.view()),
                                     scene.grid, image.view(), options);
        benchmark::DoNotOptimize(image.data());
    }
    state.SetItemsProcessed(state.iterations() * size * size * size);  // pixels times pulses
    state.counters["error_dB"] = scene.error_db(image);
}
BENCHMARK(backproject)
    ->ArgNames({"distance", "size", "points"})
    ->ArgsProduct({{500, 5000}, {512, 1024}, {0, 1}})
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);

}  // namespace
