// The arguments that say where the radar was and what it recorded, the same for every binding.
#pragma once

#include <sarfocus/geometry/phase_centres.hpp>

#include "convert.hpp"

namespace sarfocus::python {

/// positions= of a binding: [n_pulse, 3], or a pair (tx, rx) of such.
struct Positions {
    Input<double, 2> transmit;
    Input<double, 2> receive;
    bool monostatic = true;

    [[nodiscard]] geometry::PhaseCentres view() const {
        return monostatic ? geometry::PhaseCentres(transmit.view) : geometry::PhaseCentres(transmit.view, receive.view);
    }
};

inline Positions positions_of(const py::object& positions) {
    if (py::isinstance<py::tuple>(positions)) {
        const auto pair = positions.cast<py::tuple>();
        if (pair.size() != 2) throw ShapeError("positions", "[n_pulse, 3] or a pair (tx, rx)", std::to_string(pair.size()) + " arrays");
        return {real_input<2>(pair[0], "positions"), real_input<2>(pair[1], "receive positions"), false};
    }
    return {real_input<2>(positions, "positions"), {}, true};
}

/// range_start= of a binding: a number or one for each pulse.
inline Input<double, 1> range_start_of(const py::object& range_start) {
    return real_input<1>(py::module_::import("numpy").attr("atleast_1d")(range_start), "range_start");
}

}  // namespace sarfocus::python
