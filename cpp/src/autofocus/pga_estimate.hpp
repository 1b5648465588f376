#pragma once

#include <sarfocus/autofocus/options.hpp>
#include <sarfocus/autofocus/result.hpp>
#include <sarfocus/core/array_view.hpp>

namespace sarfocus::autofocus::detail {

/// All of `pga` but the correction: estimate and phase_std over the shifted azimuth spectrum [n_azimuth], phase_error left empty. Throws as
/// it does.
[[nodiscard]] Result pga_estimate(const ImageView& image, const PointOptions& options);

}  // namespace sarfocus::autofocus::detail
