#include "focus/factorized_leaf.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include <sarfocus/core/multiversion.hpp>

namespace sarfocus::focus::detail {
namespace {

constexpr double middle_column = 0.5 * static_cast<double>(RowTable::columns - 1);

// R(s) = |place + s step - antenna| = range + slope s + bend s^2 + third s^3 + …, added with the given share.
SARFOCUS_MULTIVERSION void expand_rows(const double (*place)[LeafGeometry::most_rows], const double (*step)[LeafGeometry::most_rows],
                                       const double* antenna, double share, std::ptrdiff_t n, double* range, double* slope, double* bend,
                                       double* third) {
    const double ax = antenna[0], ay = antenna[1], az = antenna[2];
#pragma omp simd
    for (std::ptrdiff_t i = 0; i < n; ++i) {
        const double x = place[0][i] - ax, y = place[1][i] - ay, z = place[2][i] - az;
        const double u = step[0][i], v = step[1][i], w = step[2][i];
        const double r = __builtin_sqrt(x * x + y * y + z * z);
        const double inverse = 1.0 / r;
        const double b = (x * u + y * v + z * w) * inverse;
        const double c = 0.5 * (u * u + v * v + w * w - b * b) * inverse;
        range[i] += share * r;
        slope[i] += share * b;
        bend[i] += share * c;
        third[i] -= share * b * c * inverse;
    }
}

// Cubics round the bins, from the bins: see BandCubic.
SARFOCUS_MULTIVERSION void fit_cubics(const float (*bins)[2][RowTable::span + 2 * LeafWorkspace::pad], std::ptrdiff_t phases,
                                      const float* weights, std::ptrdiff_t begin, std::ptrdiff_t end, RowTable& table) {
    constexpr std::ptrdiff_t block = 16;
    for (std::ptrdiff_t u = 0; u < phases; ++u)
        for (std::ptrdiff_t part = 0; part < 2; ++part)
            for (std::ptrdiff_t at = begin; at < end; at += block) {
                float sum[4][block] = {};
                for (std::ptrdiff_t t = 0; t < BandCubic::taps; ++t) {
                    const std::ptrdiff_t bin = u + t - BandCubic::side + phases * LeafWorkspace::pad;
                    const float* __restrict from = bins[bin % phases][part] + at + bin / phases;
                    for (std::ptrdiff_t d = 0; d < 4; ++d) {
                        const float w = weights[d * BandCubic::taps + t];
#pragma omp simd
                        for (std::ptrdiff_t k = 0; k < block; ++k) sum[d][k] += w * from[k];
                    }
                }
                for (std::ptrdiff_t d = 0; d < 4; ++d) std::memcpy(table.cubic[u][d][part] + at, sum[d], sizeof sum[d]);
            }
}

}  // namespace

LeafGeometry::LeafGeometry(const PixelFrame& frame, const Tile& tile, bool monostatic)
    : rows_(tile.rows), monostatic_(monostatic), centre_(tile.centre) {
    for (std::ptrdiff_t i = 0; i < rows_; ++i) {
        const auto row = static_cast<double>(tile.row + i);
        const Vector3 p = frame.position(row, static_cast<double>(tile.column) + middle_column);
        const Vector3 v = frame.along_row(row);
        for (std::size_t a = 0; a < 3; ++a) {
            place_[a][i] = p[a];
            step_[a][i] = v[a];
        }
    }
}

void LeafGeometry::expand(const Antennas& antennas, double* range, double* slope, double* bend, double* third) const {
    const double own = -range_of(antennas, centre_, monostatic_);
    std::fill_n(range, rows_, own);
    std::fill_n(slope, rows_, 0.0);
    std::fill_n(bend, rows_, 0.0);
    std::fill_n(third, rows_, 0.0);
    expand_rows(place_, step_, antennas.tx.data(), monostatic_ ? 1.0 : 0.5, rows_, range, slope, bend, third);
    if (!monostatic_) expand_rows(place_, step_, antennas.rx.data(), 0.5, rows_, range, slope, bend, third);
}

void LeafGeometry::set_reference(const Antennas& antennas, double cycles_per_metre) {
    double range[most_rows];
    double slope[most_rows];
    double bend[most_rows];
    double third[most_rows];
    expand(antennas, range, slope, bend, third);
    slope_ = cycles_per_metre * slope[rows_ / 2];
    bend_ = cycles_per_metre * bend[rows_ / 2];
}

std::ptrdiff_t LeafGeometry::locate(const Antennas& antennas, double cycles_per_metre, std::ptrdiff_t phases, RowTerms* terms,
                                    double middle[4]) const {
    alignas(64) double range[most_rows];
    alignas(64) double slope[most_rows];
    alignas(64) double bend[most_rows];
    alignas(64) double third[most_rows];
    expand(antennas, range, slope, bend, third);
    const std::ptrdiff_t m = rows_ / 2;
    const double a = range[m];
    const double b = slope[m];
    const double c = bend[m];
    middle[0] = a;
    middle[1] = b;
    middle[2] = c;
    middle[3] = third[m];
    std::ptrdiff_t most = 0;
    const auto scale = static_cast<double>(phases);
    for (std::ptrdiff_t i = 0; i < rows_; ++i) {
        // The column e behind s at which the middle row has the range of column s of this one: e0 + e1 s + e2 s^2.
        const double away = (range[i] - a) / b;
        const double e0 = away * (1.0 - c * away / b);
        const double local = 1.0 / (b + 2.0 * c * e0);
        const double e1 = (slope[i] - b - 2.0 * c * e0) * local;
        const double e2 = (bend[i] - c - 2.0 * c * e1) * local;
        const double bins = std::clamp(e0, static_cast<double>(-RowTable::margin), static_cast<double>(RowTable::margin)) * scale;
        const double nearest = std::nearbyint(bins);
        const auto whole = static_cast<std::ptrdiff_t>(nearest) + phases * LeafWorkspace::pad;
        RowTerms& term = terms[i];
        term.shift = static_cast<std::int32_t>(whole / phases - LeafWorkspace::pad);
        term.phase = static_cast<std::int32_t>(whole % phases);
        term.place[0] = static_cast<float>(bins - nearest);
        term.place[1] = static_cast<float>(e1 * scale);
        term.place[2] = static_cast<float>(e2 * scale);
        const double cycles = range[i] * cycles_per_metre;
        term.cycles[0] = static_cast<float>(cycles - std::nearbyint(cycles));
        term.cycles[1] = static_cast<float>(slope[i] * cycles_per_metre - slope_);
        term.cycles[2] = static_cast<float>(bend[i] * cycles_per_metre - bend_);
        term.cycles[3] = static_cast<float>(third[i] * cycles_per_metre);
        most = std::max(most, static_cast<std::ptrdiff_t>(std::abs(term.shift)));
    }
    return most;
}

void add_leaf_line(const Plan& plan, const LeafGeometry& geometry, const LeafLine& line, LeafWorkspace& work) {
    constexpr std::ptrdiff_t pad = LeafWorkspace::pad;
    constexpr std::ptrdiff_t first_pixel = RowTable::margin + 1;
    const std::ptrdiff_t phases = plan.row_phases;
    const BandKernel& kernel = *plan.range_kernel;
    const auto least = static_cast<double>(kernel.before());
    const std::ptrdiff_t behind = kernel.taps() / 2 + 1;
    const auto last = static_cast<double>(line.width - behind);
    double middle[4];
    const std::ptrdiff_t displaced = geometry.locate(line.antennas, plan.cycles_per_metre, phases, work.terms, middle);
    // Pixels that need a cubic, and those that the cubics need: indices as in RowTable.
    const std::ptrdiff_t low = first_pixel - std::min(displaced + 1, first_pixel);
    const std::ptrdiff_t high = first_pixel + RowTable::columns + std::min(displaced + 1, first_pixel);
    const std::ptrdiff_t low_bin = low - BandCubic::side - 1;
    const std::ptrdiff_t count = high + BandCubic::side + 1 - low_bin;
    const double inverse = 1.0 / plan.spacing;
    for (std::ptrdiff_t u = 0; u < phases; ++u) {
        const double start =
            static_cast<double>(low_bin - first_pixel) + static_cast<double>(u) / static_cast<double>(phases) - middle_column;
        for (std::ptrdiff_t k = 0; k < count; ++k) {
            const double s = start + static_cast<double>(k);
            const double at = (middle[0] + s * (middle[1] + s * (middle[2] + s * middle[3])) - line.first) * inverse;
            work.place[k] = std::clamp(at, least, last);
        }
        sample_line(line.re, line.im, kernel.table(), kernel.before(), work.place, count, work.bins[u][0] + pad + low_bin,
                    work.bins[u][1] + pad + low_bin);
    }
    fit_cubics(work.bins, phases, plan.cubic->weights(0), low, high, work.table);
    if (line.low == -std::numeric_limits<double>::infinity() && line.high == std::numeric_limits<double>::infinity()) {
        add_rows(work.table, work.terms, geometry.rows(), work.sums);
        return;
    }
    const std::ptrdiff_t rows = geometry.rows();
    std::fill_n(work.edge_sums, rows * 2 * RowTable::columns, 0.0f);
    for (std::ptrdiff_t i = 0; i < rows; ++i) work.terms[i].cycles[0] += static_cast<float>(line.cycles - std::nearbyint(line.cycles));
    add_rows(work.table, work.terms, rows, work.edge_sums);
    geometry.add_recorded(line, work.edge_sums, work.sums);
}

void LeafGeometry::add_recorded(const LeafLine& line, const float* from, float* to) const {
    alignas(64) double range[most_rows];
    alignas(64) double slope[most_rows];
    alignas(64) double bend[most_rows];
    alignas(64) double third[most_rows];
    expand(line.antennas, range, slope, bend, third);
    constexpr std::ptrdiff_t n = RowTable::columns;
    for (std::ptrdiff_t i = 0; i < rows_; ++i)
        for (std::ptrdiff_t j = 0; j < n; ++j) {
            const double s = static_cast<double>(j) - middle_column;
            const double r = range[i] + s * (slope[i] + s * (bend[i] + s * third[i]));
            const bool recorded = r >= line.low && r <= line.high;
            to[2 * n * i + j] += recorded ? from[2 * n * i + j] : 0.0f;
            to[2 * n * i + n + j] += recorded ? from[2 * n * i + n + j] : 0.0f;
        }
}

void add_leaf_sums(const LeafGeometry& geometry, const LeafWorkspace& work, MutableImageView image) {
    constexpr std::ptrdiff_t columns = RowTable::columns;
    double cycles[columns];
    float cosine[columns];
    float sine[columns];
    for (std::ptrdiff_t j = 0; j < columns; ++j) {
        const double s = static_cast<double>(j) - middle_column;
        cycles[j] = s * (geometry.reference_slope() + s * geometry.reference_bend());
    }
    phasors(cycles, columns, cosine, sine);
    for (std::ptrdiff_t i = 0; i < image.extent(0); ++i) {
        const float* re = work.sums + 2 * columns * i;
        const float* im = re + columns;
        for (std::ptrdiff_t j = 0; j < image.extent(1); ++j)
            image(i, j) += cfloat(re[j] * cosine[j] - im[j] * sine[j], re[j] * sine[j] + im[j] * cosine[j]);
    }
}

}  // namespace sarfocus::focus::detail
