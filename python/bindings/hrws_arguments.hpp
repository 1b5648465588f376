// The arguments of the multichannel bindings.
#pragma once

#include <limits>
#include <optional>
#include <string>
#include <utility>

#include <sarfocus/core/error.hpp>
#include <sarfocus/hrws/echo.hpp>
#include <sarfocus/hrws/reconstruct.hpp>

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

inline hrws::BandOptions band_of(const std::string& interpolation, double doppler_bandwidth, double doppler_centroid,
                                 std::optional<double> margin, double noise, double condition_limit) {
    hrws::BandOptions band;
    if (interpolation == "yen")
        band.interpolation = hrws::Interpolation::yen;
    else if (interpolation != "mmse")
        throw ValueError("interpolation", R"("mmse" or "yen")", "\"" + interpolation + "\"");
    band.doppler_bandwidth = doppler_bandwidth;
    band.doppler_centroid = doppler_centroid;
    band.margin = margin.value_or(std::numeric_limits<double>::quiet_NaN());
    band.noise = noise;
    band.condition_limit = condition_limit;
    return band;
}

inline hrws::Reconstruction reconstruction_of(const std::string& name) {
    if (name == "folded") return hrws::Reconstruction::folded;
    if (name == "sub_image") return hrws::Reconstruction::sub_image;
    throw ValueError("reconstruction", R"("folded" or "sub_image")", "\"" + name + "\"");
}

}  // namespace sarfocus::python
