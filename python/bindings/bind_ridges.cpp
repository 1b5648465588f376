#include <string>
#include <vector>

#include <pybind11/native_enum.h>
#include <pybind11/stl.h>

#include <sarfocus/autofocus/ridge_path.hpp>
#include <sarfocus/autofocus/ridges.hpp>

#include "bindings.hpp"
#include "convert.hpp"
#include "radar_arguments.hpp"

namespace py = pybind11;

namespace sarfocus::python {
namespace {

using autofocus::Ridge;
using autofocus::RidgeOptions;
using autofocus::RidgePath;
using autofocus::RidgePathOptions;
using autofocus::RidgePathStatus;
using autofocus::RidgePoint;
using autofocus::Ridges;

Ridges track_ridges(const py::object& data, const py::object& range_start, double range_spacing, double wavelength, double resolution,
                    int most, int half_window, double largest_rate, double threshold_db, double smallest_change, double shortest,
                    bool pieces, int threads, const py::object& progress) {
    const auto samples = input<cfloat, 2>(data, "data");
    const auto first_range = range_start_of(range_start);
    RidgeOptions options;
    options.resolution = resolution;
    options.most = most;
    options.half_window = half_window;
    options.largest_rate = largest_rate;
    options.threshold_db = threshold_db;
    options.smallest_change = smallest_change;
    options.shortest = shortest;
    options.pieces = pieces;
    options.execution = execution(threads, progress);
    const py::gil_scoped_release release;
    return autofocus::track_ridges({samples.view, first_range.view, range_spacing, wavelength}, options);
}

RidgePath trajectory_from_ridges(const py::object& range, const py::object& start, const Vector3& look, bool across, int knots,
                                 double range_std, int correlation, double offset_std, double step_change, double length_std,
                                 double across_std, double largest_residual, int iterations, double tolerance) {
    const auto ranges = real_input<2>(range, "range");
    const auto path = real_input<2>(start, "start");
    RidgePathOptions options;
    options.look = look;
    options.across = across;
    options.knots = knots;
    options.range_std = range_std;
    options.correlation = correlation;
    options.offset_std = offset_std;
    options.step_change = step_change;
    options.length_std = length_std;
    options.across_std = across_std;
    options.largest_residual = largest_residual;
    options.iterations = iterations;
    options.tolerance = tolerance;
    const py::gil_scoped_release release;
    return autofocus::trajectory_from_ridges(ranges.view, path.view, options);
}

}  // namespace

void bind_ridges(py::module_ m) {
    PYBIND11_NUMPY_DTYPE(Ridge, first, last, score, power, coherence, envelope_std, change);
    PYBIND11_NUMPY_DTYPE(RidgePoint, position, offset, residual, residual_rms, coverage, used);
    const RidgeOptions tracking;
    const RidgePathOptions fitting;

    py::class_<Ridges>(m, "Ridges", "Ranges of strong scatterers over the pulses; see track_ridges.")
        .def_property_readonly(
            "range", [](const Ridges& r) { return to_numpy(r.range.copy()); }, "float64 [n_ridge, n_pulse], m; nan where not seen.")
        .def_property_readonly(
            "ridges", [](const Ridges& r) { return to_numpy(r.ridges); },
            "structured array [n_ridge]: first, last (pulses), score, power, coherence, envelope_std (m), change (m).")
        .def_readonly("dropped", &Ridges::dropped, "Found, but too short or of a range that does not change.")
        .def_readonly("reason", &Ridges::reason, "One sentence.");

    py::native_enum<RidgePathStatus>(m, "RidgePathStatus", "enum.Enum", "How the fit of a path to ridges ended.")
        .value("converged", RidgePathStatus::converged)
        .value("max_iterations", RidgePathStatus::max_iterations)
        .value("not_determined", RidgePathStatus::not_determined)
        .finalize();

    py::class_<RidgePath>(m, "RidgePath", "The path that the ranges of strong scatterers tell; see trajectory_from_ridges.")
        .def_property_readonly(
            "positions", [](const RidgePath& p) { return to_numpy(p.positions.copy()); }, "float64 [n_pulse, 3], m: start + motion.")
        .def_property_readonly(
            "motion", [](const RidgePath& p) { return to_numpy(p.motion.copy()); },
            "float64 [n_pulse, 3], m; zero where the status is not_determined.")
        .def_property_readonly(
            "motion_std", [](const RidgePath& p) { return to_numpy(p.motion_std.copy()); },
            "float64 [n_pulse, 3], m, of the shape, the length apart; nan where nothing was estimated.")
        .def_property_readonly(
            "points", [](const RidgePath& p) { return to_numpy(p.points); },
            "structured array [n_ridge]: position (m), offset (m), residual (m, robust), residual_rms (m), coverage, used.")
        .def_readonly("residual_rms", &RidgePath::residual_rms, "m, over the ridges used.")
        .def_readonly("coverage", &RidgePath::coverage, "Share of the pulses that see enough ridges to be determined by themselves.")
        .def_readonly("length_ratio", &RidgePath::length_ratio, "Scale along the track by which the start fits the path best.")
        .def_readonly("length_std", &RidgePath::length_std, "Of that; near the one given, the ranges say nothing of the length.")
        .def_readonly("rejected", &RidgePath::rejected, "Ridges left out because they do not fit the others.")
        .def_readonly("iterations", &RidgePath::iterations)
        .def_readonly("status", &RidgePath::status)
        .def_readonly("reason", &RidgePath::reason, "One sentence.");

    m.def("track_ridges", &track_ridges, py::arg("data"), py::kw_only(), py::arg("range_start"), py::arg("range_spacing"),
          py::arg("wavelength"), py::arg("resolution"), py::arg("most") = tracking.most, py::arg("half_window") = tracking.half_window,
          py::arg("largest_rate") = tracking.largest_rate, py::arg("threshold_db") = tracking.threshold_db,
          py::arg("smallest_change") = tracking.smallest_change, py::arg("shortest") = tracking.shortest,
          py::arg("pieces") = tracking.pieces, py::arg("threads") = 0, py::arg("progress") = py::none(),
          R"(Follow strong scatterers over the pulses: the range of each, pulse by pulse.

Short coherent sums along straight pieces of range, carrier included, keep scatterers apart that pass one another; a ridge is the path of
the greatest score through them, and the phase along it refines its range. Changes of range are good to a small fraction of the wavelength,
their constant is that of the envelope. For wide bands and short ranges, where a scatterer moves through several range cells.

Parameters
----------
data : complex64 [n_pulse, n_range]
    As for `backproject`, direct coupling removed.
range_start : float
    m, range of sample 0, the same for all pulses.
range_spacing, wavelength : float
    m.
resolution : float
    m, of range: speed of light / (2 bandwidth).
most : int
    Ridges followed, the strongest first.
half_window : int
    Pulses either side of a coherent sum, over which the range of a scatterer must change evenly to a quarter of the wavelength.
largest_rate : float
    m per pulse, of a range; 0: a quarter of the wavelength.
threshold_db : float
    Above the median power of the sums, of what belongs to a ridge.
smallest_change : float
    m; ridges whose range changes less may be clutter at rest, and are dropped. 0: three times the resolution.
shortest : float
    Share of the pulses that a ridge must cover, or a piece of one.
pieces : bool
    Hand each piece of an interrupted ridge back as a ridge of its own: where scatterers cross, another may follow behind.
threads, progress
    As everywhere.

Returns
-------
Ridges
    range [n_ridge, n_pulse], ridges, dropped, reason. No ridge is no error.

Raises
------
ShapeError, ValueError, TypeError, NumericalError, MemoryError)");

    m.def("trajectory_from_ridges", &trajectory_from_ridges, py::arg("range"), py::arg("start"), py::kw_only(),
          py::arg("look") = fitting.look, py::arg("across") = false, py::arg("knots") = fitting.knots,
          py::arg("range_std") = fitting.range_std, py::arg("correlation") = fitting.correlation,
          py::arg("offset_std") = fitting.offset_std, py::arg("step_change") = fitting.step_change,
          py::arg("length_std") = fitting.length_std, py::arg("across_std") = fitting.across_std,
          py::arg("largest_residual") = fitting.largest_residual, py::arg("iterations") = fitting.iterations,
          py::arg("tolerance") = fitting.tolerance,
          R"(Fit a path and scatterers to the ranges of several ridges, from a rough straight start.

Least squares over a cubic spline of displacements along the track (and across it), the place of every scatterer and a constant of every
ridge, with robust weights; ridges that do not fit the others are left out. Not observable, and left as at the start: the place of the scene
as a whole, its rotation, and on which side of the track and at which height each scatterer lies. The length of the path shows in the
curvature of the ridges; a constant error of all ranges looks almost the same.

Parameters
----------
range : array_like [n_ridge, n_pulse]
    m, nan where a ridge isn't seen; see `track_ridges`.
start : array_like [n_pulse, 3]
    m, a roughly straight track, e.g. at constant speed.
look : (float, float, float)
    Towards the scatterers; (0, 0, 0): to the right of the track, horizontally.
across : bool
    Displacements along `look`, too; takes three ridges at once.
knots : int
    Pulses between the knots of the spline.
range_std : float
    m, of the ranges, their constants apart.
correlation : int
    Pulses over which the errors of a ridge are one.
offset_std : float
    m, of the constant of each ridge.
step_change : float
    m per pulse squared, RMS expected of the curvature of the displacement; 0: a twentieth of the start's mean step.
length_std : float
    Relative, of the length of the start.
across_std : float
    m, of the displacements across.
largest_residual : float
    m, robust standard deviation of a ridge's residuals; while one exceeds it, the ridge without which the others fit best is left out.
iterations, tolerance
    At most so many steps; relative gain below which they end.

Returns
-------
RidgePath
    positions, motion, motion_std, points, residual_rms, coverage, length_ratio and length_std, status, reason. Too few ridges that agree
    are no error: status not_determined, motion zero.

Raises
------
ShapeError, ValueError, TypeError, NumericalError)");
}

}  // namespace sarfocus::python
