#pragma once

#include <sarfocus/core/array_view.hpp>
#include <sarfocus/core/execution.hpp>
#include <sarfocus/fft/plan.hpp>

namespace sarfocus::autofocus::detail {

/// Unnormalised transform of every column, some columns at a time. `to` may be `from`.
void transform_azimuth(const ImageView& from, fft::Direction direction, const MutableImageView& to, const Execution& execution);

}  // namespace sarfocus::autofocus::detail
