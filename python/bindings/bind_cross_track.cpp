#include <string>

#include <sarfocus/autofocus/cross_track.hpp>

#include "bindings.hpp"
#include "convert.hpp"

namespace py = pybind11;

namespace sarfocus::python {
namespace {

using autofocus::CrossTrackError;
using autofocus::CrossTrackUnknowns;
using geometry::StripmapGeometry;

CrossTrackUnknowns unknowns_of(const std::string& name) {
    if (name == "height") return CrossTrackUnknowns::height;
    if (name == "horizontal") return CrossTrackUnknowns::horizontal;
    if (name == "cross_track") return CrossTrackUnknowns::cross_track;
    throw ValueError("unknowns", R"("height", "horizontal" or "cross_track")", "\"" + name + "\"");
}

CrossTrackError cross_track_error(const py::object& block_phase, const py::object& slant_range, double height, double wavelength,
                                  const py::object& phase_std, const std::string& unknowns, double maximum_condition, double model_std) {
    const auto phase = real_input<2>(block_phase, "block_phase");
    const auto ranges = real_input<1>(slant_range, "slant_range");
    Input<double, 2> deviation;
    if (!phase_std.is_none()) {
        deviation = real_input<2>(phase_std, "phase_std");
        require_same_shape(deviation.view, "phase_std", phase.view, "block_phase");
    }
    autofocus::CrossTrackOptions options;
    options.unknowns = unknowns_of(unknowns);
    options.maximum_condition = maximum_condition;
    options.model_std = model_std;
    const py::gil_scoped_release release;
    return autofocus::cross_track_error(phase.view, deviation.view, ranges.view, height, wavelength, options);
}

py::array cross_track_phase(const py::object& displacement, const py::object& slant_range, double height, double wavelength,
                            const py::object& out, int threads, const py::object& progress) {
    const auto in = real_input<2>(displacement, "displacement");
    const auto ranges = real_input<1>(slant_range, "slant_range");
    const auto phase = output<double, 2>(out, {ranges.view.extent(0), in.view.extent(0)}, &in.owner);
    if (!out.is_none()) require_no_overlap(phase.owner, "out", ranges.owner, "slant_range");
    const Execution run = execution(threads, progress);
    {
        const py::gil_scoped_release release;
        autofocus::cross_track_phase(in.view, ranges.view, height, wavelength, phase.view, run);
    }
    return phase.owner;
}

py::array correct_cross_track(const py::object& image, const StripmapGeometry& geometry, const py::object& displacement, double height,
                              const py::object& out, int threads, const py::object& progress) {
    const auto source = input<cfloat, 2>(image, "image");
    const auto in = real_input<2>(displacement, "displacement");
    const auto corrected = output<cfloat, 2>(out, source.view.extents(), out.is(image) ? nullptr : &source.owner);
    const Execution run = execution(threads, progress);
    {
        const py::gil_scoped_release release;
        autofocus::correct_cross_track(source.view, geometry, in.view, height, corrected.view, run);
    }
    return corrected.owner;
}

}  // namespace

void bind_cross_track(py::module_ m) {
    const autofocus::CrossTrackOptions options;
    py::class_<CrossTrackError>(m, "CrossTrackError", "Displacement of the antenna across its track; see cross_track_error.")
        .def_property_readonly(
            "displacement", [](const CrossTrackError& e) { return to_numpy(e.displacement.copy()); },
            "float64 [n_azimuth, 2], m: towards the scene, up; constant and line of either removed.")
        .def_property_readonly(
            "displacement_std", [](const CrossTrackError& e) { return to_numpy(e.displacement_std.copy()); },
            "float64 [n_azimuth, 2], m, from phase_std and model_std; nan where too few blocks reach, or without phase_std.")
        .def_property_readonly(
            "residual_rms", [](const CrossTrackError& e) { return to_numpy(e.residual_rms); },
            "float64 [n_block], rad, what the displacement leaves of the phase of every block.")
        .def_readonly("condition", &CrossTrackError::condition,
                      "How much worse the worst known direction is known than a displacement along the line of sight of all blocks.");

    m.def("cross_track_error", &cross_track_error, py::arg("block_phase"), py::arg("slant_range"), py::kw_only(), py::arg("height"),
          py::arg("wavelength"), py::arg("phase_std") = py::none(), py::arg("unknowns") = "cross_track",
          py::arg("maximum_condition") = options.maximum_condition, py::arg("model_std") = options.model_std,
          R"(Displacement of the antenna across its track from phase errors in several range blocks.

Flat ground, broadside: at slant range R, cos(theta) = height / R, a displacement (y towards the scene, z up) changes the range by
-y sin(theta) + z cos(theta) and the phase by -4 pi / wavelength times that. Weighted least squares for y and z at every slow-time sample,
together with a constant and a line of every block, which the phases are known up to. A constant and a line of y and z are not observable
and are taken out.

Parameters
----------
block_phase : array_like [n_block, n_azimuth]
    rad, unwrapped along slow time; diagnostics["strip"]["block_phase"] of spga_linear(..., range_blocks=B).
slant_range : array_like [n_block]
    m, that the phase of a block belongs to: np.interp(block_centre, np.arange(n_range), geometry.slant_range).
height : float
    m, of the antenna above the ground.
wavelength : float
    m
phase_std : array_like [n_block, n_azimuth], optional
    rad; nan where a block is not to be used. None: all samples alike.
unknowns : {"height", "horizontal", "cross_track"}
    z, y, or both.
maximum_condition : float
    Blocks at so nearly the same look angle that the condition exceeds this are refused.
model_std : float
    rad, added in squares to phase_std: what one range for a whole block and flat ground leave unexplained.

Returns
-------
CrossTrackError
    displacement is interpolated over samples that too few blocks reach.

Raises
------
ShapeError, ValueError, TypeError
NumericalError
    Look angles too close, no sample that enough blocks reach, NaN.)");
    m.def("cross_track_phase", &cross_track_phase, py::arg("displacement"), py::arg("slant_range"), py::kw_only(), py::arg("height"),
          py::arg("wavelength"), py::arg("out") = py::none(), py::arg("threads") = 0, py::arg("progress") = py::none(),
          R"(The phase error that a displacement of the antenna makes at every slant range; signs as for cross_track_error.

Parameters
----------
displacement : array_like [n_azimuth, 2]
    m, towards the scene and up.
slant_range : array_like [n_range]
    m
height, wavelength : float
    m
out : float64 [n_range, n_azimuth], optional
threads, progress
    As everywhere.

Returns
-------
float64 [n_range, n_azimuth]
    rad

Raises
------
ShapeError, ValueError, TypeError, NumericalError)");
    m.def("correct_cross_track", &correct_cross_track, py::arg("image"), py::arg("geometry"), py::arg("displacement"), py::kw_only(),
          py::arg("height"), py::arg("out") = py::none(), py::arg("threads") = 0, py::arg("progress") = py::none(),
          R"(Takes the phase error of a displacement of the antenna off a compressed strip, each range gate by that of its look angle.

Parameters
----------
image : complex64 [n_azimuth, n_range]
geometry : StripmapGeometry
displacement : array_like [n_azimuth, 2]
    m, towards the scene and up, as cross_track_error finds it.
height : float
    m, of the antenna above the ground.
out : complex64 [n_azimuth, n_range], optional
    May be the image itself.
threads, progress
    As everywhere.

Returns
-------
complex64 [n_azimuth, n_range]

Raises
------
ShapeError, ValueError, TypeError, NumericalError)");
}

}  // namespace sarfocus::python
