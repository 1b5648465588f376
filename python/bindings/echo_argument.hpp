// echo= of the multichannel bindings.
#pragma once

#include <utility>

#include <sarfocus/hrws/echo.hpp>

#include "convert.hpp"

namespace sarfocus::python {

/// hrws.Echo: the arrays and the view of them.
struct PythonEcho {
    Input<cfloat, 3> data;
    Input<double, 3> phase_centres;
    Input<double, 1> range_start;
    Input<double, 2> baselines;
    double range_spacing = 0.0;
    double wavelength = 0.0;
    double prf = 0.0;
    double velocity = 0.0;

    [[nodiscard]] hrws::Echo view() const {
        return {data.view, phase_centres.view, range_start.view, range_spacing, wavelength, prf, velocity, baselines.view};
    }
};

/// motion= of a binding: [n_pulse, 3], or None for an empty view.
inline Input<double, 2> motion_of(const py::object& motion) {
    return motion.is_none() ? Input<double, 2>() : real_input<2>(motion, "motion");
}

}  // namespace sarfocus::python
