#include <sarfocus/focus/backproject.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include <omp.h>

#include <sarfocus/core/array.hpp>
#include <sarfocus/core/checks.hpp>
#include <sarfocus/core/constants.hpp>
#include <sarfocus/core/error.hpp>

#include "aspect_span.hpp"
#include "backproject_kernel.hpp"
#include "range_profile_table.hpp"
#include "tile_sum.hpp"

namespace sarfocus::focus {
namespace {

using detail::AspectSpan;
using detail::AspectTable;
using detail::PixelBlock;
using detail::ProfileLayout;
using detail::PulseGroup;
using detail::PulseTable;
using detail::RangeProfileTable;
using detail::TileArea;
using detail::TileLattice;
using detail::TileMemory;
using detail::TileShape;
using detail::TileSum;
using geometry::ImageGrid;
using geometry::PhaseCentres;

constexpr std::ptrdiff_t area_lanes = 256;  // tiles side by side use the same bins

// Range of bin 0 of a table, m.
double first_range_of_table(const RangeProfiles& profiles, std::ptrdiff_t pulse) {
    return profiles.first_range(pulse) - ProfileLayout::frame * profiles.range_spacing / RangeProfileTable::upsample;
}

PulseTable pulse_table(const RangeProfiles& profiles, const PhaseCentres& centres, const RangeProfileTable& builder, std::ptrdiff_t pulse,
                       const float* bins) {
    const Vector3 tx = centres.tx(pulse);
    const Vector3 rx = centres.rx(pulse);
    return {bins,
            builder.n_bin(),
            first_range_of_table(profiles, pulse),
            RangeProfileTable::upsample / profiles.range_spacing,
            {tx[0], tx[1], tx[2]},
            {rx[0], rx[1], rx[2]}};
}

void load_pixels(const double* xyz, std::ptrdiff_t count, PixelBlock& block) {
    block.count = count;
    for (std::ptrdiff_t i = 0; i < count; ++i) {
        block.x[i] = xyz[3 * i];
        block.y[i] = xyz[3 * i + 1];
        block.z[i] = xyz[3 * i + 2];
    }
}

// A grid on the wrong side of the track, or at the wrong place altogether, would give an image of zeros without a word.
void require_recorded(const RangeProfiles& profiles, const PhaseCentres& centres, const ImageGrid& grid) {
    const auto shape = grid.shape();
    const double length = static_cast<double>(profiles.data.extent(1) - 1) * profiles.range_spacing;
    double nearest = std::numeric_limits<double>::infinity();
    double farthest = 0.0;
    for (const std::ptrdiff_t pulse : {std::ptrdiff_t{0}, centres.n_pulse() / 2, centres.n_pulse() - 1}) {
        const double first = profiles.first_range(pulse);
        for (int a = 0; a <= 16; ++a)
            for (int r = 0; r <= 16; ++r) {
                const double range = centres.range(pulse, grid.position(std::round(a / 16.0 * static_cast<double>(shape[0] - 1)),
                                                                        std::round(r / 16.0 * static_cast<double>(shape[1] - 1))));
                if (range >= first && range <= first + length) return;
                nearest = std::min(nearest, range);
                farthest = std::max(farthest, range);
            }
    }
    const double first = profiles.first_range(centres.n_pulse() / 2);
    if (farthest > first && nearest < first + length) return;  // a swath narrower than the steps of this check
    throw ValueError("grid", "pixels within the recorded ranges of " + number_text(first) + " to " + number_text(first + length) + " m",
                     "a grid " + number_text(nearest) + " to " + number_text(farthest) + " m away");
}

void check(const RangeProfiles& profiles, const PhaseCentres& centres, const BackprojectOptions& options) {
    profiles.validate(options.execution.threads);
    centres.validate(profiles.data.extent(0));
}

// What one thread works on; all of it is allocated before the parallel region, in which nothing may throw.
struct ThreadMemory {
    RangeProfileTable::Workspace workspace;
    Array<float, 1> table;
    std::vector<double> xyz;
    TileMemory tile;
    PixelBlock pixels;
    alignas(64) float re[PixelBlock::capacity];
    alignas(64) float im[PixelBlock::capacity];
    alignas(64) float offset[PixelBlock::capacity];
    alignas(64) std::int32_t bin[PixelBlock::capacity];

    ThreadMemory(const RangeProfileTable& builder, std::ptrdiff_t columns)
        : workspace(builder), table({builder.floats()}), xyz(static_cast<std::size_t>(3 * columns)) {}

    void clear_sums() {
        std::fill_n(re, pixels.count, 0.0f);
        std::fill_n(im, pixels.count, 0.0f);
    }
};

Vector3 antenna_of(const PulseTable& pulse) {
    return {0.5 * (pulse.tx[0] + pulse.rx[0]), 0.5 * (pulse.tx[1] + pulse.rx[1]), 0.5 * (pulse.tx[2] + pulse.rx[2])};
}

// The adjoint of evaluating a bin's cubic at offset x.
void spread(cfloat value, float x, float* entry) {
    for (int d = 0; d <= ProfileLayout::degree; ++d, value *= x) {
        entry[2 * d] += value.real();
        entry[2 * d + 1] += value.imag();
    }
}

std::vector<std::unique_ptr<ThreadMemory>> thread_memory(int threads, const RangeProfileTable& builder, std::ptrdiff_t columns) {
    std::vector<std::unique_ptr<ThreadMemory>> out;
    for (int t = 0; t < threads; ++t) out.push_back(std::make_unique<ThreadMemory>(builder, columns));
    return out;
}

// What does not change from pulse to pulse, and the last pulse in the places behind the end.
PulseGroup empty_group(const RangeProfiles& profiles, const PhaseCentres& centres, const RangeProfileTable& builder) {
    PulseGroup out{};
    out.n_bin = builder.n_bin();
    out.bins_per_metre = RangeProfileTable::upsample / profiles.range_spacing;
    out.cycles_per_metre = 2.0 / profiles.wavelength;
    out.monostatic = centres.monostatic();
    return out;
}

void set_pulse(const RangeProfiles& profiles, const PhaseCentres& centres, std::ptrdiff_t pulse, const float* table, std::ptrdiff_t place,
               PulseGroup& group) {
    const Vector3 tx = centres.tx(pulse);
    const Vector3 rx = centres.rx(pulse);
    for (std::size_t d = 0; d < 3; ++d) {
        group.tx[d][place] = tx[d];
        group.rx[d][place] = rx[d];
    }
    group.first_range[place] = first_range_of_table(profiles, pulse);
    group.bins[place] = table;
}

// An image cut into areas of a band of rows by up to `area_lanes` lanes.
class Areas {
public:
    explicit Areas(const TileLattice& lattice)
        : rows_(lattice.rows()), lanes_(lattice.lanes()), across_((lanes_ + area_lanes - 1) / area_lanes) {}

    [[nodiscard]] std::ptrdiff_t count() const { return (rows_ + TileShape::most_rows - 1) / TileShape::most_rows * across_; }
    [[nodiscard]] TileArea operator[](std::ptrdiff_t k) const {
        const std::ptrdiff_t row = k / across_ * TileShape::most_rows;
        const std::ptrdiff_t lane = k % across_ * area_lanes;
        return {row, std::min(TileShape::most_rows, rows_ - row), lane, std::min(area_lanes, lanes_ - lane)};
    }

private:
    std::ptrdiff_t rows_;
    std::ptrdiff_t lanes_;
    std::ptrdiff_t across_;
};

// What the terms of a sum are multiplied by; empty: nothing.
struct Factors {
    const AspectTable* aspect = nullptr;
    const std::vector<cfloat>* of_pulse = nullptr;
};

// Adds the sum over all pulses to the image, or puts it there.
void sum_pulses(const RangeProfiles& profiles, const PhaseCentres& centres, const ImageGrid& grid, const Factors& factors, bool add,
                MutableImageView image, const BackprojectOptions& options) {
    check(profiles, centres, options);
    if (image.extents() != grid.shape())
        throw ShapeError("image", "the shape of the grid " + shape_text(grid.shape()), shape_text(image.extents()));
    require_recorded(profiles, centres, grid);

    const RangeProfileTable builder(profiles.data.extent(1), detail::select_kernels().layout);
    const std::ptrdiff_t n_pulse = centres.n_pulse();
    const std::ptrdiff_t rows = grid.shape()[0];
    const int threads = resolve_threads(options.execution.threads);
    const std::ptrdiff_t block_pulses = std::min(PulseGroup::capacity, n_pulse);
    const std::ptrdiff_t table_floats = builder.floats() + 16;  // not a power of two: the tables of a block do not share cache sets
    require_memory(static_cast<std::uint64_t>(block_pulses * table_floats) * sizeof(float), "profile tables of backproject");
    Array<float, 1> tables({block_pulses * table_floats});
    PulseGroup group = empty_group(profiles, centres, builder);
    TileLattice lattice(grid);
    const TileSum tiles(detail::select_kernels(), lattice, factors.aspect);
    const auto memory = thread_memory(threads, builder, 0);

    Monitor monitor(options.execution, "backproject", n_pulse * rows);
    for (std::ptrdiff_t begin = 0; begin < n_pulse && !monitor.stopped(); begin += block_pulses) {
        group.count = std::min(block_pulses, n_pulse - begin);
        lattice.turn_to(centres, begin + group.count / 2);
        const Areas areas(lattice);
        const std::ptrdiff_t n_area = areas.count();
#pragma omp parallel num_threads(threads) if (threads > 1)
        {
            ThreadMemory& own = *memory[static_cast<std::size_t>(omp_get_thread_num())];
#pragma omp for schedule(static)
            for (std::ptrdiff_t p = 0; p < PulseGroup::capacity; ++p) {
                const std::ptrdiff_t used = std::min(p, group.count - 1);
                float* table = tables.data() + used * table_floats;
                const cfloat factor = factors.of_pulse != nullptr ? (*factors.of_pulse)[static_cast<std::size_t>(begin + used)] : 1.0f;
                if (p == used) builder.build(profiles.data.row(begin + p), table, own.workspace, factor);
                set_pulse(profiles, centres, begin + used, table, p, group);
            }
#pragma omp for schedule(dynamic)
            for (std::ptrdiff_t k = 0; k < n_area; ++k) {
                if (monitor.stopped()) continue;
                tiles.sum(group, areas[k], add || begin > 0, image, own.tile);
                monitor.advance(group.count * ((k + 1) * rows / n_area - k * rows / n_area));
            }
        }
    }
    monitor.finish();
}

}  // namespace

void RangeProfiles::validate(int threads) const {
    require_not_empty(data, "data");
    require_positive(range_spacing, "range_spacing");
    require_positive(wavelength, "wavelength");
    if (range_start.extent(0) != 1 && range_start.extent(0) != data.extent(0))
        throw ShapeError("range_start", "one value or " + std::to_string(data.extent(0)) + ", one for each pulse",
                         shape_text(range_start.extents()));
    sarfocus::require_finite(range_start, "range_start");
    sarfocus::require_finite(data, "data", threads);
}

void AspectWeights::validate() const {
    if (std::abs(norm(axis) - 1.0) > 1e-6) throw ValueError("axis", "a vector of length 1", "one of length " + number_text(norm(axis)));
    if (!(sine_start < sine_stop && sine_start >= -1.0 && sine_stop <= 1.0))
        throw ValueError("sine_start, sine_stop", "-1 <= start < stop <= 1", number_text(sine_start) + ", " + number_text(sine_stop));
    if (table.empty()) throw ValueError("table", "at least one entry", "none");
    for (const cfloat w : table)
        if (!std::isfinite(w.real()) || !std::isfinite(w.imag())) throw NumericalError("table: expected finite weights");
}

void backproject(const RangeProfiles& profiles, const PhaseCentres& centres, const ImageGrid& grid, MutableImageView image,
                 const BackprojectOptions& options) {
    sum_pulses(profiles, centres, grid, {}, false, image, options);
}

void backproject_turned(const RangeProfiles& profiles, const PhaseCentres& centres, const ImageGrid& grid,
                        const std::vector<cfloat>& factors, MutableImageView image, const BackprojectOptions& options) {
    if (static_cast<std::ptrdiff_t>(factors.size()) != profiles.data.extent(0))
        throw ShapeError("factors", std::to_string(profiles.data.extent(0)) + " values, one for each pulse",
                         std::to_string(factors.size()));
    sum_pulses(profiles, centres, grid, {nullptr, &factors}, false, image, options);
}

void backproject_weighted(const RangeProfiles& profiles, const PhaseCentres& centres, const ImageGrid& grid, const AspectWeights& weights,
                          MutableImageView image, const BackprojectOptions& options) {
    weights.validate();
    std::vector<cfloat> entries(weights.table.size() + 2);
    for (std::size_t k = 0; k < weights.table.size(); ++k) entries[k + 1] = weights.table[k];
    const auto n = static_cast<std::int32_t>(weights.table.size());
    float most_power = 0.0f;
    for (const cfloat w : entries) most_power = std::max(most_power, std::norm(w));
    std::vector<std::int32_t> run_end(entries.size());
    for (std::size_t k = entries.size(); k-- > 0;)
        run_end[k] = k + 1 < entries.size() && entries[k + 1] == entries[k] ? run_end[k + 1] : static_cast<std::int32_t>(k);
    const AspectTable aspect{
        reinterpret_cast<const float*>(entries.data()),
        run_end.data(),
        n,
        {static_cast<float>(weights.axis[0]), static_cast<float>(weights.axis[1]), static_cast<float>(weights.axis[2])},
        static_cast<float>(weights.sine_start),
        static_cast<float>(n / (weights.sine_stop - weights.sine_start)),
        most_power};
    sum_pulses(profiles, centres, grid, {&aspect, nullptr}, true, image, options);
}

void backproject_histories(const RangeProfiles& profiles, const PhaseCentres& centres, const ArrayView<const double, 2>& points,
                           MutableImageView histories, const BackprojectOptions& options) {
    check(profiles, centres, options);
    require_not_empty(points, "points");
    if (points.extent(1) != 3) throw ShapeError("points", "(n_point, 3)", shape_text(points.extents()));
    require_finite(points, "points");
    const std::ptrdiff_t n_point = points.extent(0);
    const std::ptrdiff_t n_pulse = centres.n_pulse();
    if (histories.extents() != std::array<std::ptrdiff_t, 2>{n_point, n_pulse})
        throw ShapeError("histories", shape_text(std::array<std::ptrdiff_t, 2>{n_point, n_pulse}), shape_text(histories.extents()));

    const detail::Kernels& kernels = detail::select_kernels();
    const RangeProfileTable builder(profiles.data.extent(1), detail::select_kernels().layout);
    const double cycles_per_metre = 2.0 / profiles.wavelength;
    const bool monostatic = centres.monostatic();
    const int threads = resolve_threads(options.execution.threads);
    Monitor monitor(options.execution, "backproject histories", n_pulse);
    const auto memory = thread_memory(threads, builder, 0);
#pragma omp parallel for schedule(static) num_threads(threads) if (threads > 1)
    for (std::ptrdiff_t p = 0; p < n_pulse; ++p) {
        if (monitor.stopped()) continue;
        ThreadMemory& own = *memory[static_cast<std::size_t>(omp_get_thread_num())];
        builder.build(profiles.data.row(p), own.table.data(), own.workspace);
        const PulseTable pulse = pulse_table(profiles, centres, builder, p, own.table.data());
        for (std::ptrdiff_t begin = 0; begin < n_point; begin += PixelBlock::capacity) {
            PixelBlock& pixels = own.pixels;
            pixels.count = std::min(PixelBlock::capacity, n_point - begin);
            for (std::ptrdiff_t k = 0; k < pixels.count; ++k) {
                pixels.x[k] = points(begin + k, 0);
                pixels.y[k] = points(begin + k, 1);
                pixels.z[k] = points(begin + k, 2);
            }
            own.clear_sums();
            kernels.gather(pulse, pixels, cycles_per_metre, monostatic, own.re, own.im);
            for (std::ptrdiff_t k = 0; k < pixels.count; ++k) histories(begin + k, p) = {own.re[k], own.im[k]};
        }
        monitor.advance();
    }
    monitor.finish();
}

void project(const ImageView& scene, const ImageGrid& grid, const PhaseCentres& centres, const RangeProfiles& profiles,
             MutableImageView data, const BackprojectOptions& options, const Aspect& aspect) {
    centres.validate(data.extent(0));
    if (aspect.limited() && std::abs(norm(aspect.axis) - 1.0) > 1e-6)
        throw ValueError("axis", "a vector of length 1 or 0", "one of length " + number_text(norm(aspect.axis)));
    if (!(aspect.sine_start < aspect.sine_stop))
        throw ValueError("sine_start, sine_stop", "start < stop", number_text(aspect.sine_start) + ", " + number_text(aspect.sine_stop));
    require_not_empty(data, "data");
    require_positive(profiles.range_spacing, "range_spacing");
    require_positive(profiles.wavelength, "wavelength");
    if (profiles.range_start.extent(0) != 1 && profiles.range_start.extent(0) != data.extent(0))
        throw ShapeError("range_start", "one value or one for each pulse", shape_text(profiles.range_start.extents()));
    require_finite(profiles.range_start, "range_start");
    if (scene.extents() != grid.shape())
        throw ShapeError("scene", "the shape of the grid " + shape_text(grid.shape()), shape_text(scene.extents()));
    require_finite(scene, "scene", options.execution.threads);

    const detail::Kernels& kernels = detail::select_kernels();
    const RangeProfileTable builder(data.extent(1), detail::select_kernels().layout);
    const double cycles_per_metre = 2.0 / profiles.wavelength;
    const bool monostatic = centres.monostatic();
    const std::ptrdiff_t n_pulse = centres.n_pulse();
    const std::ptrdiff_t rows = grid.shape()[0];
    const std::ptrdiff_t columns = grid.shape()[1];
    const int threads = resolve_threads(options.execution.threads);
    Monitor monitor(options.execution, "project", n_pulse);
    const auto memory = thread_memory(threads, builder, columns);
#pragma omp parallel for schedule(dynamic) num_threads(threads) if (threads > 1)
    for (std::ptrdiff_t p = 0; p < n_pulse; ++p) {
        if (monitor.stopped()) continue;
        ThreadMemory& own = *memory[static_cast<std::size_t>(omp_get_thread_num())];
        std::fill(own.table.begin(), own.table.end(), 0.0f);
        const PulseTable pulse = pulse_table(profiles, centres, builder, p, own.table.data());
        const Vector3 antenna = antenna_of(pulse);
        for (std::ptrdiff_t i = 0; i < rows; ++i) {
            bool placed = false;
            for (std::ptrdiff_t j = 0; j < columns; j += PixelBlock::capacity) {
                const std::ptrdiff_t count = std::min(PixelBlock::capacity, columns - j);
                if (aspect.limited() && AspectSpan(grid, i, j, count, aspect.axis).outside(antenna, aspect.sine_start, aspect.sine_stop))
                    continue;
                if (!placed) grid.row_positions(i, own.xyz.data());
                placed = true;
                load_pixels(own.xyz.data() + 3 * j, count, own.pixels);
                kernels.locate(pulse, own.pixels, cycles_per_metre, monostatic, own.bin, own.offset, own.re, own.im);
                for (std::ptrdiff_t k = 0; k < count; ++k) {
                    if (aspect.limited() && !aspect.sees(antenna, {own.pixels.x[k], own.pixels.y[k], own.pixels.z[k]})) continue;
                    spread(scene(i, j + k) * cfloat(own.re[k], own.im[k]), own.offset[k],
                           own.table.data() + static_cast<std::ptrdiff_t>(own.bin[k]) * ProfileLayout::coefficients);
                }
            }
        }
        builder.build_adjoint(own.table.data(), data.row(p), own.workspace);
        monitor.advance();
    }
    monitor.finish();
}

}  // namespace sarfocus::focus
