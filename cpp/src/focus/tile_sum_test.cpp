// Every set of kernels against the sum in double precision, where tiles are easy and where they are not.
#include "tile_sum.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <functional>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <sarfocus/core/array.hpp>
#include <sarfocus/core/constants.hpp>

#include "range_profile_table.hpp"

namespace sarfocus::focus::detail {
namespace {

using geometry::ImageGrid;
using geometry::PhaseCentres;
using Image = Array<cfloat, 2>;

std::vector<const Kernels*> kernel_sets() {
    std::vector<const Kernels*> sets{&kernels_baseline};
#if defined(__x86_64__)
    if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) sets.push_back(&kernels_avx2);
    if (std::string(select_kernels().name) == "avx512") sets.push_back(&kernels_avx512);
#endif
    return sets;
}

// Pulses along any path; profiles of sines over the whole band, so that their values between the samples are known.
struct Pass {
    double wavelength = 0.031;
    double spacing = 0.4;
    std::ptrdiff_t n_range = 400;
    Array<double, 2> tx;
    Array<double, 2> rx;
    std::vector<double> start;
    bool bistatic;

    // The record is centred on the origin.
    Pass(std::ptrdiff_t n_pulse, const std::function<Vector3(double)>& path, const Vector3& receiver_offset = {})
        : tx({n_pulse, 3}), rx({n_pulse, 3}), bistatic(norm(receiver_offset) > 0.0) {
        for (std::ptrdiff_t p = 0; p < n_pulse; ++p) {
            const Vector3 at = path(n_pulse == 1 ? 0.0 : 2.0 * static_cast<double>(p) / static_cast<double>(n_pulse - 1) - 1.0);
            for (std::size_t d = 0; d < 3; ++d) {
                tx(p, d) = at[d];
                rx(p, d) = at[d] + receiver_offset[d];
            }
        }
        for (std::ptrdiff_t p = 0; p < n_pulse; ++p)
            start.push_back(centres().range(p, {0.0, 0.0, 0.0}) - 0.5 * spacing * static_cast<double>(n_range));
    }

    [[nodiscard]] PhaseCentres centres() const { return bistatic ? PhaseCentres(tx.view(), rx.view()) : PhaseCentres(tx.view()); }

    // Where the record begins at a range of zero at least, it holds whole periods and no more.
    [[nodiscard]] cdouble profile(std::ptrdiff_t pulse, double sample) const {
        cdouble sum{};
        for (const double cycles : {-0.39, -0.23, 0.05, 0.31, 0.4})
            sum += std::polar(
                1.0, two_pi * (cycles * (sample - 0.5 * static_cast<double>(n_range)) + 0.37 * static_cast<double>(pulse) * cycles));
        return sum;
    }

    // Hann's window takes the sines to zero towards the ends, where the interpolation of a cut record differs from them.
    [[nodiscard]] cdouble windowed(std::ptrdiff_t pulse, double sample) const {
        const double x = sample / static_cast<double>(n_range - 1);
        return x < 0.0 || x > 1.0 ? cdouble{} : profile(pulse, sample) * std::pow(std::sin(pi * x), 2);
    }

    [[nodiscard]] cdouble exact(const Vector3& pixel) const {
        cdouble sum{};
        for (std::ptrdiff_t p = 0; p < tx.extent(0); ++p) {
            const double range = centres().range(p, pixel);
            sum += windowed(p, (range - start[static_cast<std::size_t>(p)]) / spacing) *
                   std::polar(1.0, two_pi * std::remainder(2.0 * range / wavelength, 1.0));
        }
        return sum;
    }

    [[nodiscard]] Image form(const Kernels& kernels, const ImageGrid& grid) const {
        const RangeProfileTable builder(n_range, kernels.layout);
        RangeProfileTable::Workspace workspace(builder);
        Image image({grid.shape()[0], grid.shape()[1]});
        TileLattice lattice(grid);
        const TileSum tiles(kernels, lattice, nullptr);
        TileMemory memory;
        PulseGroup group{};
        group.n_bin = builder.n_bin();
        group.bins_per_metre = RangeProfileTable::upsample / spacing;
        group.cycles_per_metre = 2.0 / wavelength;
        group.monostatic = !bistatic;
        for (std::ptrdiff_t begin = 0; begin < tx.extent(0); begin += PulseGroup::capacity) {
            group.count = std::min(PulseGroup::capacity, tx.extent(0) - begin);
            std::vector<Array<float, 1>> tables;
            for (std::ptrdiff_t p = 0; p < PulseGroup::capacity; ++p) {
                const std::ptrdiff_t pulse = begin + std::min(p, group.count - 1);
                Array<cfloat, 1> samples({n_range});
                for (std::ptrdiff_t i = 0; i < n_range; ++i) samples(i) = cfloat(windowed(pulse, static_cast<double>(i)));
                tables.emplace_back(std::array<std::ptrdiff_t, 1>{builder.floats()});
                builder.build(std::as_const(samples).view(), tables.back().data(), workspace);
                for (std::size_t d = 0; d < 3; ++d) {
                    group.tx[d][p] = tx(pulse, d);
                    group.rx[d][p] = rx(pulse, d);
                }
                group.bins[p] = tables.back().data();
                group.first_range[p] = start[static_cast<std::size_t>(pulse)] - ProfileLayout::frame / group.bins_per_metre;
            }
            lattice.turn_to(centres(), begin + group.count / 2);
            for (std::ptrdiff_t row = 0; row < lattice.rows(); row += TileShape::most_rows)
                tiles.sum(group, {row, std::min(TileShape::most_rows, lattice.rows() - row), 0, lattice.lanes()}, begin > 0, image.view(),
                          memory);
        }
        return image;
    }

    [[nodiscard]] double error_db(const Image& image, const ImageGrid& grid) const {
        double error = 0.0;
        double power = 0.0;
        for (std::ptrdiff_t i = 0; i < image.extent(0); ++i)
            for (std::ptrdiff_t j = 0; j < image.extent(1); ++j) {
                const cdouble truth = exact(grid.position(static_cast<double>(i), static_cast<double>(j)));
                error += std::norm(cdouble(image(i, j)) - truth);
                power += std::norm(truth);
            }
        return 10.0 * std::log10(error / power);
    }
};

std::function<Vector3(double)> straight(double distance, double half_length) {
    return [=](double t) { return Vector3{half_length * t, -distance, 0.4 * distance}; };
}

ImageGrid ground(double azimuth_step, double range_step, std::array<std::ptrdiff_t, 2> shape = {37, 45}) {
    return ImageGrid::plane({-0.5 * azimuth_step * static_cast<double>(shape[0]), -0.5 * range_step * static_cast<double>(shape[1]), 0.0},
                            {azimuth_step, 0.0, 0.0}, {0.0, range_step, 0.1 * range_step}, shape);
}

// The table's cubic errs by -72 dB at 0.4 cycles a sample and by less below; the series by no more than -70 dB.
constexpr double least_error_db = -64.0;

void expect_exact(const Pass& pass, const ImageGrid& grid, const std::string& what) {
    for (const Kernels* kernels : kernel_sets())
        EXPECT_LT(pass.error_db(pass.form(*kernels, grid), grid), least_error_db) << what << ", " << kernels->name;
}

TEST(TileSum, PlaneGridsAtAnyDistance) {
    for (const double distance : {20.0, 100.0, 500.0, 5000.0, 850e3})
        for (const Vector3& receiver : {Vector3{}, Vector3{0.3 * distance, -0.05 * distance, 0.1 * distance}}) {
            const Pass pass(40, straight(distance, std::min(0.3 * distance, 300.0)), receiver);
            expect_exact(pass, ground(0.3, 0.3), std::to_string(distance) + " m, receiver " + std::to_string(norm(receiver)));
        }
}

TEST(TileSum, PulsesCloseTogether) {
    // As close as pulses follow one another, and farther apart: what the phase bends over a tile is the same for all pulses of a group,
    // nearly so, or not. Seen abeam and from ahead, where the lanes share in the bend.
    for (const auto& [distance, step] : {std::pair{100.0, 0.3}, std::pair{420.0, 0.3}, std::pair{5000.0, 0.3}, std::pair{5000.0, 2.1}})
        for (const double ahead : {0.0, 0.4 * distance, 0.9 * distance})
            for (const double angle : {0.0005, 0.002, 0.01}) {
                const auto path = straight(distance, angle * distance);
                const Pass pass(70, [&, ahead = ahead](double t) { return path(t) + Vector3{ahead, 0.0, 0.0}; });
                expect_exact(pass, ground(step, step),
                             std::to_string(distance) + " m, " + std::to_string(ahead) + " m ahead, " + std::to_string(angle) +
                                 " rad to either side, steps of " + std::to_string(step));
            }
}

TEST(TileSum, PointsAndPolarGrids) {
    for (const double distance : {100.0, 500.0, 5000.0})
        for (const Vector3& receiver : {Vector3{}, Vector3{0.1 * distance, 0.0, 0.0}}) {
            const Pass pass(40, straight(distance, 0.1 * distance), receiver);
            const ImageGrid flat = ground(0.3, 0.35);
            Array<double, 3> xyz({37, 45, 3});
            for (std::ptrdiff_t i = 0; i < 37; ++i) {
                flat.row_positions(i, xyz.data() + 135 * i);
                for (std::ptrdiff_t j = 0; j < 45; ++j)
                    xyz(i, j, 2) += 3.0 * std::sin(0.3 * static_cast<double>(i)) * std::cos(0.2 * static_cast<double>(j));
            }
            expect_exact(pass, ImageGrid::from_points(std::as_const(xyz).view()), "terrain at " + std::to_string(distance));
            const ImageGrid polar = ImageGrid::polar({0.0, -distance, 0.4 * distance}, {0.0, distance, -0.4 * distance}, {1.0, 0.0, 0.0},
                                                     1.077 * distance - 8.0, 0.4, -0.3 * 20 / distance, 0.3 / distance, {40, 45});
            expect_exact(pass, polar, "polar at " + std::to_string(distance));
        }
}

TEST(TileSum, PointsInAnyOrder) {
    const Pass pass(33, straight(800.0, 60.0));
    Array<double, 3> xyz({1, 1001, 3});
    for (std::ptrdiff_t k = 0; k < 1001; ++k) {
        xyz(0, k, 0) = 0.05 * static_cast<double>(k * 389 % 1001) - 25.0;
        xyz(0, k, 1) = 0.05 * static_cast<double>(k * 577 % 1001) - 25.0;
        xyz(0, k, 2) = 0.01 * static_cast<double>(k * 131 % 1001);
    }
    expect_exact(pass, ImageGrid::from_points(std::as_const(xyz).view()), "scattered points");
}

TEST(TileSum, GridsOfAnyShape) {
    const Pass pass(35, straight(700.0, 50.0));
    for (const std::array<std::ptrdiff_t, 2> shape : {std::array<std::ptrdiff_t, 2>{1, 1}, {1, 70}, {70, 1}, {3, 5}, {2, 33}, {65, 17}})
        expect_exact(pass, ground(0.3, 0.3, shape), std::to_string(shape[0]) + " x " + std::to_string(shape[1]));
}

TEST(TileSum, WidePixelsAndSquint) {
    // Up to 12 bins from lane to lane: every width of look-up is used, and single pixels where the tiles are too large.
    for (const double step : {0.2, 0.5, 1.0, 2.5}) {
        const Pass pass(40, [](double t) { return Vector3{900.0 + 100.0 * t, -1000.0, 500.0}; });
        expect_exact(pass, ground(step, step, {20, 37}), "squinted, steps of " + std::to_string(step));
    }
}

TEST(TileSum, CircularPathTurnsTheLanes) {
    const Pass pass(200, [](double t) { return Vector3{600.0 * std::cos(pi * t), 600.0 * std::sin(pi * t), 400.0}; });
    expect_exact(pass, ground(0.25, 0.25), "circular path");
}

TEST(TileSum, GridsCrossedByThePath) {
    // Pixels pass by at no more than metres from the antenna, two at no distance at all.
    for (const Vector3& receiver : {Vector3{}, Vector3{1.2, 0.6, 0.0}}) {
        const Pass pass(41, [](double t) { return Vector3{6.0 * t, 0.9, 0.0}; }, receiver);
        expect_exact(pass, ImageGrid::plane({-6.0, -4.5, 0.0}, {0.3, 0.0, 0.0}, {0.0, 0.3, 0.0}, {40, 33}), "crossed grid");
    }
}

TEST(TileSum, EdgesOfTheRecord) {
    // Ground range +-90 m leaves the record of 160 m in both directions.
    const Pass pass(40, straight(1000.0, 80.0));
    expect_exact(pass, ground(0.5, 1.0, {19, 180}), "edges of the record");
}

TEST(TileSum, KernelsAgreeMoreCloselyThanTheyErr) {
    const ImageGrid grid = ground(0.3, 0.3);
    // Seen obliquely, they differ in the rounding and in whether one slope does for all rows. Abeam, longer vectors take fewer places from
    // the cubic of a neighbouring bin.
    for (const auto& [ahead, limit] : {std::pair{700.0, -76.0}, std::pair{0.0, -68.0}}) {
        const Pass pass(40, [ahead = ahead](double u) { return straight(2000.0, 100.0)(u) + Vector3{ahead, 0.0, 0.0}; });
        const Image first = pass.form(kernels_baseline, grid);
        EXPECT_LT(pass.error_db(first, grid), -60.0);
        double power = 0.0;
        for (const cfloat pixel : first) power += std::norm(pixel);
        for (const Kernels* kernels : kernel_sets()) {
            const Image other = pass.form(*kernels, grid);
            double difference = 0.0;
            for (std::ptrdiff_t k = 0; k < first.size(); ++k) difference += std::norm(first.data()[k] - other.data()[k]);
            EXPECT_LT(10.0 * std::log10(difference / power + 1e-30), limit) << kernels->name << " seen from " << ahead << " m ahead";
        }
    }
}

}  // namespace
}  // namespace sarfocus::focus::detail
