#pragma once

#include <cmath>
#include <cstddef>
#include <string>

#include <sarfocus/core/checks.hpp>
#include <sarfocus/sim/points.hpp>

namespace sarfocus::sim {

/// Throws ShapeError, NumericalError unless there is one finite value, or one for each pulse.
inline void require_per_pulse(const ArrayView<const double, 1>& values, const char* argument, std::ptrdiff_t n_pulse) {
    if (values.extent(0) != 1 && values.extent(0) != n_pulse)
        throw ShapeError(argument, "one value or " + std::to_string(n_pulse) + ", one for each pulse", shape_text(values.extents()));
    require_finite(values, argument);
}

inline void require_noise_power(double power, const char* argument = "noise_power") {
    if (!(std::isfinite(power) && power >= 0.0)) throw ValueError(argument, "a finite number >= 0", number_text(power));
}

/// Of the echoes of `points`. Throws ShapeError, ValueError, NumericalError.
void validate(const PointEchoModel& model, std::ptrdiff_t n_pulse);

}  // namespace sarfocus::sim
