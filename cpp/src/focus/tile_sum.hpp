// The sum over pulses, tile by tile: which pixels make a tile, and by which kernel each pulse is added to it.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include <sarfocus/core/array_view.hpp>
#include <sarfocus/geometry/image_grid.hpp>
#include <sarfocus/geometry/phase_centres.hpp>

#include "backproject_kernel.hpp"

namespace sarfocus::focus::detail {

/// A part of a lattice of rows and lanes.
struct TileArea {
    std::ptrdiff_t first_row;
    std::ptrdiff_t rows;
    std::ptrdiff_t first_lane;
    std::ptrdiff_t lanes;
};

/// The pixels of a grid as rows of lanes. Lanes lie along the image axis on which the range changes least; a single line of pixels is
/// folded into rows of 16.
class TileLattice {
public:
    explicit TileLattice(const geometry::ImageGrid& grid);

    /// Chooses the axis of the lanes by the range of one pulse.
    void turn_to(const geometry::PhaseCentres& centres, std::ptrdiff_t pulse);

    [[nodiscard]] std::ptrdiff_t rows() const;
    [[nodiscard]] std::ptrdiff_t lanes() const;
    [[nodiscard]] bool contains(std::ptrdiff_t row, std::ptrdiff_t lane) const;
    /// Image indices of a pixel.
    [[nodiscard]] std::array<std::ptrdiff_t, 2> pixel(std::ptrdiff_t row, std::ptrdiff_t lane) const;
    /// From row to row and from lane to lane of an image of the grid; none where a line of pixels is folded.
    [[nodiscard]] std::optional<std::array<std::ptrdiff_t, 2>> strides(const MutableImageView& image) const;
    [[nodiscard]] Vector3 position(std::ptrdiff_t row, std::ptrdiff_t lane) const;

    [[nodiscard]] bool is_plane() const { return grid_.kind() == geometry::ImageGrid::Kind::plane; }
    [[nodiscard]] PlaneTile plane_tile(std::ptrdiff_t first_row, std::ptrdiff_t rows, std::ptrdiff_t first_lane) const;
    void fill(std::ptrdiff_t first_row, std::ptrdiff_t rows, std::ptrdiff_t first_lane, std::ptrdiff_t run, PointTile& tile) const;

private:
    enum class Lanes { along_azimuth, along_range, folded };

    const geometry::ImageGrid& grid_;
    std::array<std::ptrdiff_t, 2> shape_;
    Lanes direction_ = Lanes::along_azimuth;
    std::vector<double> cosine_;  // polar grids, [n_azimuth]
    std::vector<double> sine_;
};

/// Memory of one thread for one tile.
struct TileMemory {
    alignas(64) float re[TileShape::pixels];
    alignas(64) float im[TileShape::pixels];
    PointTile points;
    PixelBlock pixels;
};

/// image (=, or += where `add`) the sum over the pulses of a group, for the pixels of an area.
class TileSum {
public:
    TileSum(const Kernels& kernels, const TileLattice& lattice, const AspectTable* aspect)
        : kernels_(kernels), lattice_(lattice), aspect_(aspect) {}

    void sum(const PulseGroup& pulses, const TileArea& area, bool add, const MutableImageView& image, TileMemory& own) const;

private:
    struct Part {
        std::ptrdiff_t first_row;
        std::ptrdiff_t rows;
        std::ptrdiff_t first_lane;
        float* re;
        float* im;
    };

    void add_tile(const PulseGroup& pulses, PulseMask wanted, const Part& part, TileMemory& own) const;
    void add_points(const PulseGroup& pulses, PulseMask wanted, const Part& part, TileMemory& own) const;
    void add_one_by_one(const PulseGroup& pulses, PulseMask wanted, const Part& part, TileMemory& own) const;
    void fetch(const Part& part, std::ptrdiff_t lanes, const MutableImageView& image) const;
    void store(const Part& part, std::ptrdiff_t lanes, bool add, const MutableImageView& image) const;
    static void store_across(const Part& part, std::ptrdiff_t lanes, std::ptrdiff_t rows, bool add, cfloat* image,
                             std::ptrdiff_t lane_stride);

    const Kernels& kernels_;
    const TileLattice& lattice_;
    const AspectTable* aspect_;
};

}  // namespace sarfocus::focus::detail
