#pragma once

#include <functional>
#include <vector>

#include <sarfocus/autofocus/spga.hpp>
#include <sarfocus/autofocus/strip.hpp>

namespace sarfocus::autofocus::detail {

/// The strong points of a strip, or a block of its range gates.
using StripChooser = std::function<std::vector<StripPoint>(const ImageView& image, const geometry::StripmapGeometry& geometry,
                                                           const StripSelectOptions& options)>;

/// `spga_linear` and `spga` with points chosen in another way.
[[nodiscard]] Result spga_linear_with(const ImageView& image, const geometry::StripmapGeometry& geometry, MutableImageView corrected,
                                      const SpgaLinearOptions& options, const StripChooser& choose);
[[nodiscard]] Result spga_with(const ImageView& image, const geometry::StripmapGeometry& geometry, MutableImageView corrected,
                               const SpgaOptions& options, const StripChooser& choose);

/// Of candidates, the most striking of which are cut out and looked at: those with a contrast below the maximum, spread evenly along
/// azimuth, as many as are worth it. window: half width of the piece cut, 0: automatic.
[[nodiscard]] std::vector<StripPoint> best_spread(const ImageView& image, const geometry::StripmapGeometry& geometry,
                                                  std::vector<StripPoint> kept, const StripSelectOptions& options);

}  // namespace sarfocus::autofocus::detail
