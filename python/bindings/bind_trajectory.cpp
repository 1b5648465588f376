#include <string>
#include <vector>

#include <pybind11/native_enum.h>
#include <pybind11/stl.h>

#include <sarfocus/autofocus/trajectory.hpp>

#include "bindings.hpp"
#include "convert.hpp"
#include "radar_arguments.hpp"
#include "trajectory_arguments.hpp"

namespace py = pybind11;

namespace sarfocus::python {
namespace {

using autofocus::Trajectory;
using autofocus::TrajectoryOptions;
using autofocus::TrajectoryPoint;
using autofocus::TrajectoryStatus;

py::array_t<TrajectoryPoint> points_of(const Trajectory& t) {
    return py::array_t<TrajectoryPoint>(static_cast<py::ssize_t>(t.points.size()), t.points.data());
}

py::dict timings_of(const Trajectory& t) {
    py::dict out;
    for (const auto& timing : t.timings) out[timing.phase.c_str()] = timing.seconds;
    return out;
}

Trajectory estimate_trajectory(const py::object& data, const py::object& positions, const std::vector<geometry::ImageGrid>& regions,
                               const py::object& range_start, double range_spacing, double wavelength, const std::string& unknowns,
                               const std::string& pixels, const py::object& knots, const Vector3& up, const py::object& start,
                               double search, int rounds, int iterations, double tolerance, bool do_no_harm, int threads,
                               const py::object& progress) {
    const auto samples = input<cfloat, 2>(data, "data");
    const auto path = real_input<2>(positions, "positions");
    const auto first_range = range_start_of(range_start);
    Input<double, 2> initial;
    if (!start.is_none()) initial = real_input<2>(start, "start");
    TrajectoryOptions options;
    options.unknowns = unknowns_of(unknowns);
    options.pixels = pixels_of(pixels);
    options.knots = knots.is_none() ? 0 : knots.cast<int>();
    options.up = up;
    options.search = search;
    options.rounds = rounds;
    options.iterations = iterations;
    options.tolerance = tolerance;
    options.do_no_harm = do_no_harm;
    options.execution = execution(threads, progress);
    const py::gil_scoped_release release;
    return autofocus::estimate_trajectory({samples.view, first_range.view, range_spacing, wavelength}, path.view, regions, options,
                                          initial.view);
}

py::array_t<double> sharpest_phase(const py::object& data, const py::object& positions, const geometry::ImageGrid& region,
                                   const py::object& range_start, double range_spacing, double wavelength, int iterations, double tolerance,
                                   int threads, const py::object& progress) {
    const auto samples = input<cfloat, 2>(data, "data");
    const auto path = real_input<2>(positions, "positions");
    const auto first_range = range_start_of(range_start);
    autofocus::SharpestPhaseOptions options;
    options.iterations = iterations;
    options.tolerance = tolerance;
    options.execution = execution(threads, progress);
    std::vector<double> phase;
    {
        const py::gil_scoped_release release;
        phase = autofocus::sharpest_phase({samples.view, first_range.view, range_spacing, wavelength}, path.view, region, options);
    }
    return to_numpy(phase);
}

}  // namespace

void bind_trajectory(py::module_ m) {
    PYBIND11_NUMPY_DTYPE(TrajectoryPoint, position, power, coherence_before, coherence, held_out_before, held_out, spread);
    const TrajectoryOptions defaults;
    const autofocus::SharpestPhaseOptions sharpest;

    py::native_enum<TrajectoryStatus>(m, "TrajectoryStatus", "enum.Enum", "How the estimate of a motion ended.")
        .value("converged", TrajectoryStatus::converged)
        .value("max_iterations", TrajectoryStatus::max_iterations)
        .value("not_improved", TrajectoryStatus::not_improved)
        .finalize();

    py::class_<Trajectory>(m, "Trajectory", "The motion of the antenna that strong points tell; see estimate_trajectory.")
        .def_property_readonly(
            "motion", [](const Trajectory& t) { return to_numpy(t.motion.copy()); },
            "float64 [n_pulse, 3], m, to add to the positions; zero where the status is not_improved.")
        .def_property_readonly(
            "motion_std", [](const Trajectory& t) { return to_numpy(t.motion_std.copy()); },
            "float64 [n_pulse, 3], m, of the estimate, from the residual phases; nan where nothing was estimated.")
        .def_property_readonly(
            "estimate", [](const Trajectory& t) { return to_numpy(t.estimate.copy()); },
            "float64 [n_pulse, 3], m, the motion estimated, handed out or not.")
        .def_property_readonly("points", &points_of,
                               "structured array, one for each region: position (m), power, coherence_before, coherence, held_out_before, "
                               "held_out, spread (m).")
        .def_readonly("coherence_before", &Trajectory::coherence_before, "Mean over the regions, without displacement.")
        .def_readonly("coherence", &Trajectory::coherence, "Mean over the regions, with the estimate.")
        .def_readonly("coherence_by_chance", &Trajectory::coherence_by_chance, "What random phases reach, on average.")
        .def_readonly("chance_std", &Trajectory::chance_std, "Scatter of that.")
        .def_readonly("condition", &Trajectory::condition, "Of the geometry: how much worse the worst seen of the unknowns is seen.")
        .def_readonly("line_removed", &Trajectory::line_removed, "Whether constant and line over the pulses were taken out.")
        .def_readonly("rounds", &Trajectory::rounds)
        .def_property_readonly(
            "objective", [](const Trajectory& t) { return to_numpy(t.objective); }, "float64, of the last alternation, step by step.")
        .def_property_readonly("timings", &timings_of, "dict, s.")
        .def_readonly("status", &Trajectory::status)
        .def_readonly("reason", &Trajectory::reason, "One sentence.");

    m.def("estimate_trajectory", &estimate_trajectory, py::arg("data"), py::arg("positions"), py::arg("regions"), py::kw_only(),
          py::arg("range_start"), py::arg("range_spacing"), py::arg("wavelength"), py::arg("unknowns") = "height",
          py::arg("pixels") = "joint", py::arg("knots") = py::none(), py::arg("up") = defaults.up, py::arg("start") = py::none(),
          py::arg("search") = defaults.search, py::arg("rounds") = defaults.rounds, py::arg("iterations") = defaults.iterations,
          py::arg("tolerance") = defaults.tolerance, py::arg("do_no_harm") = true, py::arg("threads") = 0, py::arg("progress") = py::none(),
          R"(The motion of the antenna from strong points in two or more small regions.

Maximises the sum of the regions' coherences |sum b_k|^2 / (sum |b_k|)^2 over the displacement of every pulse [Zhou2022, eq. 9-10], with exact
ranges, and chooses the pixel of every point jointly with the motion. Works for any path and grid.

Parameters
----------
data : complex64 [n_pulse, n_range]
    As for `backproject`.
positions : array_like [n_pulse, 3]
    m, phase centres as measured.
regions : sequence of ImageGrid
    Chips round strong points, far apart in range; the first index along the track.
range_start, range_spacing, wavelength
    As for `backproject`.
unknowns : {"height", "cross_track", "full"}
    Along `up`, in the plane perpendicular to the track, or in space.
pixels : {"joint", "brightest"}
    As for `hrws.si_mec`.
knots : int, optional
    Pulses between the knots of a cubic spline; by default every pulse is free, which takes more regions than unknowns.
up : (float, float, float)
    The direction of the height.
start : array_like [n_pulse, 3], optional
    m, a motion to start from; part of the motion handed back.
search : float
    m, either side, of a free displacement; 0: half of what turns the phase by a full turn, then twice that where the regions
    agree better.
rounds, iterations, tolerance
    At most so many rounds of interpolating the samples anew, and steps of one alternation; relative gain below which it ends.
do_no_harm : bool
    A motion of zero where coherence is not above what random phases reach, or not better than before.
threads, progress
    As everywhere.

Returns
-------
Trajectory
    motion, motion_std, points (coherence, and when the region is held out), status, reason.

Raises
------
ShapeError, ValueError, TypeError, NumericalError, MemoryError)");

    m.def("sharpest_phase", &sharpest_phase, py::arg("data"), py::arg("positions"), py::arg("region"), py::kw_only(),
          py::arg("range_start"), py::arg("range_spacing"), py::arg("wavelength"), py::arg("iterations") = sharpest.iterations,
          py::arg("tolerance") = sharpest.tolerance, py::arg("threads") = 0, py::arg("progress") = py::none(),
          R"(One phase per pulse for the whole scene, by the greatest sharpness sum |I|^4 of one region.

Parameters
----------
data, positions, range_start, range_spacing, wavelength
    As for `backproject`.
region : ImageGrid
    The chip to judge by.
iterations, tolerance
    At most so many steps, none of which lowers the sharpness; they end when it gains relatively less.
threads, progress
    As everywhere.

Returns
-------
float64 [n_pulse]
    rad; the data are corrected by exp(-1j * phase).

Raises
------
ShapeError, ValueError, TypeError, NumericalError, MemoryError)");
}

}  // namespace sarfocus::python
