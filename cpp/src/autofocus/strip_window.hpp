#pragma once

#include <sarfocus/core/array_view.hpp>
#include <sarfocus/geometry/stripmap_geometry.hpp>

namespace sarfocus::autofocus::detail {

/// Half width, azimuth pixels, of a piece of image that holds a moderately defocused point: a twelfth of the aperture of the middle gate.
[[nodiscard]] int narrow_window(const geometry::StripmapGeometry& geometry);

/// Throws ShapeError or ValueError unless the strip is one that the stripmap methods bear: a column for every slant range, small squint,
/// apertures of some length.
void require_strip_image(const ImageView& image, const geometry::StripmapGeometry& geometry);

}  // namespace sarfocus::autofocus::detail
