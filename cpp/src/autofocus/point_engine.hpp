#pragma once

#include <vector>

#include <sarfocus/autofocus/options.hpp>
#include <sarfocus/autofocus/result.hpp>

#include "point_source.hpp"

namespace sarfocus::autofocus::detail {

/// Estimates the phase of a source's pulses from its strong points and decides whether it helps. Fills everything of the result but the
/// caller's image; estimate and phase_std are over the source's pulses.
[[nodiscard]] Result estimate_from_points(PointSource& source, const PointOptions& options);

}  // namespace sarfocus::autofocus::detail
