#pragma once

#include <sarfocus/autofocus/strip.hpp>
#include <sarfocus/core/array_view.hpp>
#include <sarfocus/geometry/stripmap_geometry.hpp>

namespace sarfocus::autofocus::detail {

/// The apertures of stitched points, cut again from their range gates after these have been focused with the coherent phase of all, and
/// that phase put back. In the focused gate a point lies in one place and its spectrum where the taper expects it, whatever the error did;
/// only the gates that hold points are transformed [methods 3].
[[nodiscard]] Apertures recut_apertures(const ImageView& image, const geometry::StripmapGeometry& geometry, const Apertures& apertures,
                                        const Stitching& stitching, const StripExtractOptions& options);

}  // namespace sarfocus::autofocus::detail
