#pragma once

#include <algorithm>
#include <cstddef>
#include <limits>

#include <sarfocus/core/array_view.hpp>

#include "focus/factorized_lines.hpp"
#include "focus/factorized_plan.hpp"

namespace sarfocus::focus::detail {

/// A line of samples and where it belongs: sample 0 at range `first` (m) less that of the tile's centre, from these antennas.
struct LeafLine {
    Antennas antennas;
    const float* re;
    const float* im;
    std::ptrdiff_t width;
    double first;
    double cycles = 0.0;                                    ///< phase to be added to every pixel's
    double low = -std::numeric_limits<double>::infinity();  ///< m, pixels at lesser ranges less the centre's are left out
    double high = std::numeric_limits<double>::infinity();  ///< and those at greater ones
};

/// The geometry of a smallest tile: the ranges of its pixels to one antenna position, row by row as polynomials in the column.
class LeafGeometry {
public:
    static constexpr std::ptrdiff_t most_rows = 64;

    LeafGeometry(const PixelFrame& frame, const Tile& tile, bool monostatic);

    /// What the rows have in common, taken off their phases: to be multiplied onto the sums as exp(2 pi j (s slope + s^2 bend)).
    void set_reference(const Antennas& antennas, double cycles_per_metre);
    [[nodiscard]] double reference_slope() const { return slope_; }
    [[nodiscard]] double reference_bend() const { return bend_; }

    /// Fills terms[rows] and the ranges of the middle row as a cubic in s, less that of the tile's centre; returns the largest |shift|.
    std::ptrdiff_t locate(const Antennas& antennas, double cycles_per_metre, std::ptrdiff_t phases, RowTerms* terms,
                          double middle[4]) const;

    [[nodiscard]] std::ptrdiff_t rows() const { return rows_; }

    /// to += from, [rows][re, im][columns], where the line was recorded.
    void add_recorded(const LeafLine& line, const float* from, float* to) const;

private:
    void expand(const Antennas& antennas, double* range, double* slope, double* bend, double* third) const;

    std::ptrdiff_t rows_;
    bool monostatic_;
    Vector3 centre_;
    double slope_ = 0.0;
    double bend_ = 0.0;
    alignas(64) double place_[3][most_rows];
    alignas(64) double step_[3][most_rows];
};

/// Memory of one thread for a smallest tile.
struct LeafWorkspace {
    static constexpr std::ptrdiff_t pad = 16;
    RowTable table{};
    alignas(64) RowTerms terms[LeafGeometry::most_rows];
    alignas(64) float sums[LeafGeometry::most_rows * 2 * RowTable::columns];
    alignas(64) float bins[RowTable::most_phases][2][RowTable::span + 2 * pad] = {};
    alignas(64) double place[RowTable::span + 2 * pad];
    alignas(64) float edge_sums[LeafGeometry::most_rows * 2 * RowTable::columns];

    void clear(std::ptrdiff_t rows) { std::fill_n(sums, rows * 2 * RowTable::columns, 0.0f); }
};

/// work.sums += what the line holds for every pixel, the reference of `geometry` taken off.
void add_leaf_line(const Plan& plan, const LeafGeometry& geometry, const LeafLine& line, LeafWorkspace& work);

/// image += work.sums with the reference put back. image: the tile's pixels.
void add_leaf_sums(const LeafGeometry& geometry, const LeafWorkspace& work, MutableImageView image);

}  // namespace sarfocus::focus::detail
