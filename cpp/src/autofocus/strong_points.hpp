#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include <sarfocus/core/array_view.hpp>
#include <sarfocus/detect/point.hpp>

#include "point_source.hpp"

namespace sarfocus::autofocus::detail {

/// Pixels a resolution cell is wide along each axis, 1 to 16: from the correlation of neighbouring pixels, which for a flat spectrum over a
/// share s of the sampling rate is sinc(s). A phase error on the spectrum does not change it.
struct CellSize {
    double azimuth = 1.0;
    double range = 1.0;
};
/// Pixels per cell from the correlation of neighbours.
[[nodiscard]] double pixels_per_cell(double correlation);
[[nodiscard]] CellSize cell_size(const ImageView& image, const PixelLayout& layout);

/// The strongest local maxima, strongest first, no two within `separation` pixels (a box), with sub-pixel positions from a parabola through
/// the logarithm of the intensity. At most `count`; `wanted` [shape] excludes pixels, an empty view none.
[[nodiscard]] std::vector<Pixel> strongest_points(const ImageView& image, const PixelLayout& layout, int count, const CellSize& separation,
                                                  const ArrayView<const bool, 2>& wanted, const Execution& execution);

/// Of a peak between three intensities, from their parabola in logarithms: -0.5 to 0.5.
[[nodiscard]] double sub_pixel(double left, double centre, double right);

/// Half widths of the box that points closer than `separation` share, pixels: at least one.
[[nodiscard]] std::array<std::ptrdiff_t, 2> reach_of(const CellSize& separation);

/// From points by range gate to sub-pixel positions by column.
[[nodiscard]] std::vector<Pixel> to_pixels(const std::vector<detect::Point>& points, const ImageView& image, const PixelLayout& layout);

}  // namespace sarfocus::autofocus::detail
