#pragma once

#include <cstddef>

#include <sarfocus/sim/stripmap.hpp>

namespace sarfocus::sim {

/// Everything both strip models have in common. Throws ValueError, ShapeError, NumericalError.
void require_strip(const geometry::StripmapGeometry& geometry, const StripmapTargets& targets, const StripmapEffects& effects,
                   const MutableImageView& out);

/// exp(+j phase_error(i)); 1 where there is none.
[[nodiscard]] cdouble phase_error_factor(const StripmapEffects& effects, std::ptrdiff_t i);

}  // namespace sarfocus::sim
