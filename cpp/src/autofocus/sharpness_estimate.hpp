#pragma once

#include <sarfocus/autofocus/result.hpp>
#include <sarfocus/autofocus/sharpness.hpp>
#include <sarfocus/core/array_view.hpp>

namespace sarfocus::autofocus::detail {

/// All of `minimum_entropy` of an image without stripmap geometry but the correction and the verdict of the whole image: estimate and
/// phase_std over the shifted azimuth spectrum [n_azimuth], phase_error left empty. Throws as it does.
[[nodiscard]] Result minimum_entropy_estimate(const ImageView& image, const SharpnessOptions& options);

}  // namespace sarfocus::autofocus::detail
