#pragma once

#include <sarfocus/autofocus/options.hpp>
#include <sarfocus/autofocus/result.hpp>
#include <sarfocus/core/array.hpp>
#include <sarfocus/core/array_view.hpp>

namespace sarfocus::autofocus::detail {

/// All of `pga` but the correction: estimate and phase_std over the shifted azimuth spectrum [n_azimuth], phase_error left empty. Throws as
/// it does. spent: memory that is released once it is no longer needed, that of the image.
[[nodiscard]] Result pga_estimate(const ImageView& image, const PointOptions& options, Array<cfloat, 2> spent = {});

}  // namespace sarfocus::autofocus::detail
