#include "sim/stripmap_arguments.hpp"

#include <array>
#include <complex>
#include <string>

#include <sarfocus/core/checks.hpp>

#include "sim/point_arguments.hpp"

namespace sarfocus::sim {

void StripmapTargets::validate() const {
    const std::ptrdiff_t n = reflectivity.extent(0);
    if (pixels.extents() != std::array<std::ptrdiff_t, 2>{n, 2})
        throw ShapeError("targets", "(" + std::to_string(n) + ", 2), azimuth sample and range gate for each reflectivity",
                         shape_text(pixels.extents()));
    require_finite(pixels, "targets");
    require_finite(reflectivity, "reflectivity");
}

void require_strip(const geometry::StripmapGeometry& geometry, const StripmapTargets& targets, const StripmapEffects& effects,
                   const MutableImageView& out) {
    geometry.validate();
    require_not_empty(out, "out");
    if (out.extent(1) != static_cast<std::ptrdiff_t>(geometry.slant_range.size()))
        throw ShapeError("out",
                         "(n_azimuth, " + std::to_string(geometry.slant_range.size()) + "), a column for every slant_range of the geometry",
                         shape_text(out.extents()));
    targets.validate();
    require_noise_power(effects.noise_power);
    if (effects.phase_error.empty()) return;
    if (effects.phase_error.extent(0) != out.extent(0))
        throw ShapeError("phase_error", "(" + std::to_string(out.extent(0)) + ",), one for each pulse",
                         shape_text(effects.phase_error.extents()));
    require_finite(effects.phase_error, "phase_error");
}

cdouble phase_error_factor(const StripmapEffects& effects, std::ptrdiff_t i) {
    return effects.phase_error.empty() ? cdouble(1.0) : std::polar(1.0, effects.phase_error(i));
}

}  // namespace sarfocus::sim
