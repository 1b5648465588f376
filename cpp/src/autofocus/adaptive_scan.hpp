#pragma once

#include <cstddef>
#include <vector>

#include <sarfocus/core/array.hpp>
#include <sarfocus/core/array_view.hpp>
#include <sarfocus/core/execution.hpp>
#include <sarfocus/detect/point.hpp>

namespace sarfocus::autofocus::detail {

/// What adaptive and conventional PGA need to know of an image, gathered in one pass over it.
struct Scan {
    std::ptrdiff_t step = 0;  ///< azimuth lines of a cell: half a sub-aperture
    Array<double, 2> energy;  ///< [cell, n_range]; the last cell may be shorter
    std::vector<int> extents;
    /// For every extent the strongest boxes of every gate, gate after gate, the strongest first: middle pixel, mean intensity. Boxes of
    /// more than one pixel lie half their length apart.
    std::vector<std::vector<detect::Point>> strongest;

    [[nodiscard]] bool zero() const;
};

/// extents: 1 or even. Throws NumericalError (NaN, infinity), Cancelled.
[[nodiscard]] Scan scan_image(const ImageView& image, std::ptrdiff_t step, const std::vector<int>& extents, int count,
                              const Execution& execution);

/// Energies of sub-apertures [n_sub_aperture, n_range], each two cells.
[[nodiscard]] Array<double, 2> energies_of(const Scan& scan);

}  // namespace sarfocus::autofocus::detail
