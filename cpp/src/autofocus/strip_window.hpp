#pragma once

#include <sarfocus/core/array_view.hpp>
#include <sarfocus/geometry/stripmap_geometry.hpp>

namespace sarfocus::autofocus::detail {

/// Half width of the piece of image cut round a point, pixels: `window`, or a twelfth of the aperture of the middle gate where it is 0.
[[nodiscard]] double extraction_window(const geometry::StripmapGeometry& geometry, int window);

/// Throws ShapeError or ValueError unless the strip is one that the stripmap methods bear: a column for every slant range, small squint,
/// apertures of some length.
void require_strip_image(const ImageView& image, const geometry::StripmapGeometry& geometry);

}  // namespace sarfocus::autofocus::detail
