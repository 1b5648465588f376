#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <pybind11/native_enum.h>
#include <pybind11/stl.h>

#include <sarfocus/autofocus/gpga.hpp>
#include <sarfocus/autofocus/pga.hpp>
#include <sarfocus/autofocus/pga_2d.hpp>
#include <sarfocus/autofocus/phase_estimate.hpp>
#include <sarfocus/autofocus/time_offset.hpp>

#include "bindings.hpp"
#include "convert.hpp"
#include "python_result.hpp"
#include "radar_arguments.hpp"

namespace py = pybind11;

namespace sarfocus::python {
namespace {

autofocus::Estimator estimator_of(const std::string& name) {
    if (name == "ml") return autofocus::Estimator::maximum_likelihood;
    if (name == "gradient") return autofocus::Estimator::gradient;
    throw ValueError("estimator", "\"ml\" or \"gradient\"", "\"" + name + "\"");
}

autofocus::PhaseEstimate estimate_phase(const py::object& lines, const std::string& estimator, bool linear_terms, int max_iterations,
                                        double tolerance, int threads, const py::object& progress) {
    const auto samples = input<cfloat, 2>(lines, "lines");
    autofocus::PhaseEstimateOptions options;
    options.estimator = estimator_of(estimator);
    options.linear_terms = linear_terms;
    options.max_iterations = max_iterations;
    options.tolerance = tolerance;
    options.execution = execution(threads, progress);
    const py::gil_scoped_release release;
    return autofocus::estimate_phase(samples.view, options);
}

py::array_t<autofocus::StrongPoint> points(const autofocus::Result& result) {
    return py::array_t<autofocus::StrongPoint>(static_cast<py::ssize_t>(result.points.size()), result.points.data());
}

autofocus::PointOptions point_options(const std::string& estimator, const std::vector<double>& coarse_windows, int coarse_points,
                                      int fine_points, double minimum_contrast, int fine_rounds, double tolerance, bool do_no_harm,
                                      int threads, const py::object& progress) {
    autofocus::PointOptions options;
    options.estimator = estimator_of(estimator);
    options.coarse_windows = coarse_windows;
    options.coarse_points = coarse_points;
    options.fine_points = fine_points;
    options.minimum_contrast = minimum_contrast;
    options.fine_rounds = fine_rounds;
    options.tolerance = tolerance;
    options.do_no_harm = do_no_harm;
    options.execution = execution(threads, progress);
    return options;
}

PythonResult pga(const py::object& image, const std::string& estimator, const std::vector<double>& coarse_windows, int coarse_points,
                 int fine_points, double minimum_contrast, int fine_rounds, double tolerance, bool do_no_harm, const py::object& out,
                 int threads, const py::object& progress) {
    const auto source = input<cfloat, 2>(image, "image");
    const auto corrected = output<cfloat, 2>(out, source.view.extents(), &source.owner);
    const auto options = point_options(estimator, coarse_windows, coarse_points, fine_points, minimum_contrast, fine_rounds, tolerance,
                                       do_no_harm, threads, progress);
    PythonResult answer;
    {
        const py::gil_scoped_release release;
        answer.result = autofocus::pga(source.view, corrected.view, options);
    }
    answer.image = out.is_none() && answer.result.input_returned() ? image : py::object(corrected.owner);
    return answer;
}

autofocus::MigrationModel model_of(const std::string& name) {
    if (name == "range_doppler") return autofocus::MigrationModel::range_doppler;
    if (name == "polar_format") return autofocus::MigrationModel::polar_format;
    throw ValueError("model", "\"range_doppler\" or \"polar_format\"", "\"" + name + "\"");
}

PythonResult pga_2d(const py::object& image, std::optional<double> bandwidth_ratio, const std::string& model, int passes,
                    const std::string& estimator, const std::vector<double>& coarse_windows, int coarse_points, int fine_points,
                    double minimum_contrast, int fine_rounds, double tolerance, bool do_no_harm, const py::object& out, int threads,
                    const py::object& progress) {
    const auto source = input<cfloat, 2>(image, "image");
    const auto corrected = output<cfloat, 2>(out, source.view.extents(), &source.owner);
    autofocus::Pga2dOptions options;
    if (bandwidth_ratio) {
        require_finite_value(*bandwidth_ratio, "bandwidth_ratio");
        options.bandwidth_ratio = *bandwidth_ratio;
    }
    options.model = model_of(model);
    options.passes = passes;
    options.points = point_options(estimator, coarse_windows, coarse_points, fine_points, minimum_contrast, fine_rounds, tolerance,
                                   do_no_harm, threads, progress);
    PythonResult answer;
    {
        const py::gil_scoped_release release;
        answer.result = autofocus::pga_2d(source.view, corrected.view, options);
    }
    answer.image = out.is_none() && answer.result.input_returned() ? image : py::object(corrected.owner);
    return answer;
}

py::array correct_two_dimensional(const py::object& image, const py::object& phase, double bandwidth_ratio, const std::string& model,
                                  const py::object& out, int threads, const py::object& progress) {
    const auto source = input<cfloat, 2>(image, "image");
    const auto values = real_input<1>(phase, "phase");
    const auto corrected = output<cfloat, 2>(out, source.view.extents(), &source.owner);
    const auto how = execution(threads, progress);
    const autofocus::MigrationModel term = model_of(model);
    std::vector<double> error;
    for (std::ptrdiff_t k = 0; k < values.view.extent(0); ++k) error.push_back(values.view(k));
    {
        const py::gil_scoped_release release;
        autofocus::correct_two_dimensional(source.view, error, bandwidth_ratio, term, corrected.view, how);
    }
    return corrected.owner;
}

PythonResult gpga(const py::object& data, const py::object& positions, const geometry::ImageGrid& grid, const py::object& range_start,
                  double range_spacing, double wavelength, const std::string& estimator, const std::vector<double>& coarse_windows,
                  int coarse_points, int fine_points, double minimum_contrast, int fine_rounds, double tolerance, bool do_no_harm,
                  const py::object& out, int threads, const py::object& progress) {
    const auto samples = input<cfloat, 2>(data, "data");
    const Positions centres = positions_of(positions);
    const auto start = range_start_of(range_start);
    const auto image = output<cfloat, 2>(out, grid.shape(), &samples.owner);
    const auto options = point_options(estimator, coarse_windows, coarse_points, fine_points, minimum_contrast, fine_rounds, tolerance,
                                       do_no_harm, threads, progress);
    PythonResult answer;
    {
        const py::gil_scoped_release release;
        answer.result = autofocus::gpga({samples.view, start.view, range_spacing, wavelength}, centres.view(), grid, image.view, options);
    }
    answer.image = image.owner;
    return answer;
}

autofocus::TimeOffset estimate_time_offset(const py::object& data, const py::object& pulse_time, const py::object& track_time,
                                           const py::object& track_position, const geometry::ImageGrid& grid, const py::object& range_start,
                                           double range_spacing, double wavelength, double start, double search, double step,
                                           double minimum_step, bool do_no_harm, int threads, const py::object& progress) {
    const auto samples = input<cfloat, 2>(data, "data");
    const auto moments = real_input<1>(pulse_time, "pulse_time");
    const auto time = real_input<1>(track_time, "track_time");
    const auto position = real_input<2>(track_position, "track_position");
    const auto first_range = range_start_of(range_start);
    autofocus::TimeOffsetOptions options;
    options.start = start;
    options.search = search;
    options.step = step;
    options.minimum_step = minimum_step;
    options.do_no_harm = do_no_harm;
    options.execution = execution(threads, progress);
    const py::gil_scoped_release release;
    return autofocus::estimate_time_offset({samples.view, first_range.view, range_spacing, wavelength}, moments.view,
                                           {time.view, position.view}, grid, options);
}

void bind_time_offset(py::module_ m) {
    using autofocus::TimeOffset;
    using autofocus::TimeOffsetStatus;
    const autofocus::TimeOffsetOptions defaults;

    py::native_enum<TimeOffsetStatus>(m, "TimeOffsetStatus", "enum.Enum", "How the search for a time offset ended.")
        .value("converged", TimeOffsetStatus::converged)
        .value("not_improved", TimeOffsetStatus::not_improved)
        .value("at_the_edge", TimeOffsetStatus::at_the_edge)
        .finalize();

    py::class_<TimeOffset>(m, "TimeOffset", "The time between two clocks; see estimate_time_offset.")
        .def_readonly("offset", &TimeOffset::offset, "s, to use: the estimate where the status is converged, else the start.")
        .def_readonly("estimate", &TimeOffset::estimate, "s, the sharpest.")
        .def_readonly("offset_std", &TimeOffset::offset_std,
                      "s, half the difference between the two halves of the scene, an order of magnitude; nan where one half has no say.")
        .def_readonly("log_sharpness_before", &TimeOffset::log_sharpness_before, "nat, at the start.")
        .def_readonly("log_sharpness_after", &TimeOffset::log_sharpness_after, "nat, at the estimate.")
        .def_property_readonly(
            "offsets", [](const TimeOffset& t) { return to_numpy(t.offsets); }, "float64 [n], s, where the sharpness was taken.")
        .def_property_readonly(
            "log_sharpness", [](const TimeOffset& t) { return to_numpy(t.log_sharpness); }, "float64 [n], nat.")
        .def_readonly("held_out_gain", &TimeOffset::held_out_gain, "nat, mean gain of a half of the scene with the other's offset.")
        .def_readonly("held_out_noise", &TimeOffset::held_out_noise, "nat, what speckle would give by chance.")
        .def_readonly("status", &TimeOffset::status)
        .def_readonly("reason", &TimeOffset::reason, "One sentence.");

    m.def("estimate_time_offset", &estimate_time_offset, py::arg("data"), py::arg("pulse_time"), py::arg("track_time"),
          py::arg("track_position"), py::arg("grid"), py::kw_only(), py::arg("range_start"), py::arg("range_spacing"),
          py::arg("wavelength"), py::arg("start") = defaults.start, py::arg("search") = defaults.search, py::arg("step") = defaults.step,
          py::arg("minimum_step") = defaults.minimum_step, py::arg("do_no_harm") = defaults.do_no_harm, py::arg("threads") = 0,
          py::arg("progress") = py::none(), R"(The time to add to the radar's clock to get that of the recorded track.

The offset with which the scene is sharpest: sum |I|^4 / (sum |I|^2)^2 of images formed with the pulses placed on the track and weighted
by the path they stand for. One phase per pulse can't stand for such an error. On a straight path at constant speed an offset only shifts
the image and can't be found.

Parameters
----------
data : complex64 [n_pulse, n_range]
    As for `backproject`; all pulses, those of a resting platform too.
pulse_time : array_like [n_pulse]
    s, on the radar's clock.
track_time : array_like [n]
    s, increasing, on the clock of the track.
track_position : array_like [n, 3]
    m.
grid : ImageGrid
    The scene to judge by: at least a few strong points.
range_start, range_spacing, wavelength
    As for `backproject`.
start, search, step : float
    s: offset known so far, how far from it to look, steps of the first look (refined to a 27th). Offsets with which the track doesn't
    cover all pulses are not tried.
minimum_step : float
    m, as for `path_weights`.
do_no_harm : bool
    Hand the start back where held-out sharpness is not better: the offset from one half of the scene must sharpen the other.
threads, progress
    As everywhere.

Returns
-------
TimeOffset

Raises
------
ShapeError, ValueError, TypeError, NumericalError, MemoryError)");
}

void bind_pga_2d(py::module_ m) {
    const autofocus::PointOptions defaults;
    m.def("pga_2d", &pga_2d, py::arg("image"), py::kw_only(), py::arg("bandwidth_ratio") = py::none(), py::arg("model") = "range_doppler",
          py::arg("passes") = 3, py::arg("estimator") = "ml", py::arg("coarse_windows") = defaults.coarse_windows,
          py::arg("coarse_points") = defaults.coarse_points, py::arg("fine_points") = defaults.fine_points,
          py::arg("minimum_contrast") = defaults.minimum_contrast, py::arg("fine_rounds") = defaults.fine_rounds,
          py::arg("tolerance") = defaults.tolerance, py::arg("do_no_harm") = true, py::arg("out") = py::none(), py::arg("threads") = 0,
          py::arg("progress") = py::none(),
          R"(Two-dimensional phase gradient autofocus, for errors that move points through range gates.

An error of the path multiplies the two-dimensional spectrum of the image by exp(1j * (1 + y) * phi(u)), y the baseband range frequency
over the carrier. phi is estimated as by `pga`, in a range band so narrow that no point moves by more than half a cell, corrected in two
dimensions, and what is left estimated again. Constant and line of phi are gauge: what a line moves through range stays.

Parameters
----------
image : complex64 [n_azimuth, n_range]
    Range increasing with the gate (decreasing: negative ratio); any strides.
bandwidth_ratio : float, optional
    Range sampling rate over carrier frequency, -0.9 to 0.9. None: found from the image, between -0.5 and 0.5; 0, the correction of
    `pga`, where one half of the strongest range stripes is no sharper with the other half's ratio.
model : {"range_doppler", "polar_format"}
    exp(1j * (1 + y) * phi(u)), or exp(1j * (1 + y) * phi(u / (1 + y))) of images by the polar format algorithm.
passes : int
    At most so many estimates, each after a correction by those before.
estimator, coarse_windows, coarse_points, fine_points, minimum_contrast, fine_rounds, tolerance
    As for `pga`.
do_no_harm : bool
    Hand the input back where the score is not better.
out : complex64 [n_azimuth, n_range], optional
    Where the corrected image goes.
threads, progress
    As everywhere.

Returns
-------
Result
    phase_error and phase_std are over fftshift(fft(image, axis=0), axes=0); diagnostics["migration"] has the ratio.

Raises
------
ShapeError, ValueError, TypeError, NumericalError, MemoryError)");
    m.def("correct_two_dimensional", &correct_two_dimensional, py::arg("image"), py::arg("phase"), py::arg("bandwidth_ratio"),
          py::kw_only(), py::arg("model") = "range_doppler", py::arg("out") = py::none(), py::arg("threads") = 0,
          py::arg("progress") = py::none(),
          R"(Takes a phase error and the range migration that comes with it off an image.

Parameters
----------
image : complex64 [n_azimuth, n_range]
    Any strides.
phase : array_like [n_azimuth]
    rad, over fftshift(fft(image, axis=0), axes=0).
bandwidth_ratio, model
    As for `pga_2d`; a ratio is needed here.
out : complex64 [n_azimuth, n_range], optional
    Where the corrected image goes.
threads, progress
    As everywhere.

Returns
-------
complex64 [n_azimuth, n_range]
    The image with its two-dimensional spectrum multiplied by exp(-1j * (1 + y) * phase), circular along both axes.

Raises
------
ShapeError, ValueError, TypeError, NumericalError, MemoryError)");
}

}  // namespace

void bind_autofocus(py::module_ m) {
    PYBIND11_NUMPY_DTYPE(autofocus::StrongPoint, azimuth, range, shift, weight, contrast);
    const autofocus::PointOptions defaults;

    py::native_enum<autofocus::Status>(m, "Status", "enum.Enum", "How an autofocus ended.")
        .value("converged", autofocus::Status::converged)
        .value("max_iterations", autofocus::Status::max_iterations)
        .value("not_improved", autofocus::Status::not_improved)
        .value("no_strong_points", autofocus::Status::no_strong_points)
        .value("gaps", autofocus::Status::gaps)
        .finalize();

    py::class_<PythonResult>(m, "Result", "What an autofocus found and made.")
        .def_readonly("image", &PythonResult::image,
                      "complex64; the input itself, bit for bit, where the status is not_improved or no_strong_points.")
        .def_property_readonly(
            "phase_error", [](const PythonResult& r) { return to_numpy(r.result.phase_error); },
            "float64, rad; the correction multiplied by exp(-1j * phase_error); zero where the input came back.")
        .def_property_readonly(
            "phase_std", [](const PythonResult& r) { return to_numpy(r.result.phase_std); },
            "float64, rad, standard deviation of the estimate; nan where no aperture reaches.")
        .def_property_readonly(
            "estimate", [](const PythonResult& r) { return to_numpy(r.result.estimate); },
            "float64, rad, the phase that was estimated, applied or not.")
        .def_property_readonly("status", [](const PythonResult& r) { return r.result.status; })
        .def_property_readonly(
            "points", [](const PythonResult& r) { return points(r.result); },
            "structured array: azimuth, range, shift (pixels), weight, contrast.")
        .def_property_readonly(
            "diagnostics", [](const PythonResult& r) { return diagnostics(r.result); },
            "dict: method, rounds, score, timings, threads; where the method decides them: strip, adaptive, trials.")
        .def("summary", [](const PythonResult& r) { return r.result.summary(); }, "A few lines for people.");

    py::class_<autofocus::PhaseEstimate>(m, "PhaseEstimate", "The phase common to a set of lines; see estimate_phase.")
        .def_property_readonly(
            "phase", [](const autofocus::PhaseEstimate& e) { return to_numpy(e.phase); }, "float64 [n_pulse], rad.")
        .def_property_readonly(
            "phase_std", [](const autofocus::PhaseEstimate& e) { return to_numpy(e.phase_std); }, "float64 [n_pulse], rad.")
        .def_property_readonly(
            "linear_terms", [](const autofocus::PhaseEstimate& e) { return to_numpy(e.linear_terms); }, "float64 [n_line], rad a pulse.")
        .def_property_readonly(
            "amplitude", [](const autofocus::PhaseEstimate& e) { return to_numpy(e.amplitude); }, "complex128 [n_line].")
        .def_property_readonly(
            "signal_power", [](const autofocus::PhaseEstimate& e) { return to_numpy(e.signal_power); }, "float64 [n_line].")
        .def_property_readonly(
            "noise_power", [](const autofocus::PhaseEstimate& e) { return to_numpy(e.noise_power); }, "float64 [n_line].")
        .def_readonly("iterations", &autofocus::PhaseEstimate::iterations);

    m.def("estimate_phase", &estimate_phase, py::arg("lines"), py::kw_only(), py::arg("estimator") = "ml", py::arg("linear_terms") = true,
          py::arg("max_iterations") = 100, py::arg("tolerance") = 1e-4, py::arg("threads") = 0, py::arg("progress") = py::none(),
          R"(The phase common to all lines: line n is A_n exp(1j * (phase[k] + b_n * k)) plus noise.

Parameters
----------
lines : complex64 [n_line, n_pulse]
    Dechirped histories of strong points; zeros where a pulse has no data.
estimator : {"ml", "gradient"}
    Maximum likelihood by alternation, which reaches the Cramer-Rao bound sqrt(1 / (2 M SNR)), or the classic phase gradient.
linear_terms : bool
    Whether every line has a linear phase b_n of its own.
max_iterations, tolerance
    Of the alternation; the tolerance is the largest change of the phase, rad.

Returns
-------
PhaseEstimate
    phase, phase_std (rad), linear_terms, amplitude, noise_power, iterations. Constant and line are removed from the phase.

Raises
------
ShapeError, ValueError, NumericalError)");

    m.def("pga", &pga, py::arg("image"), py::kw_only(), py::arg("estimator") = "ml", py::arg("coarse_windows") = defaults.coarse_windows,
          py::arg("coarse_points") = defaults.coarse_points, py::arg("fine_points") = defaults.fine_points,
          py::arg("minimum_contrast") = defaults.minimum_contrast, py::arg("fine_rounds") = defaults.fine_rounds,
          py::arg("tolerance") = defaults.tolerance, py::arg("do_no_harm") = true, py::arg("out") = py::none(), py::arg("threads") = 0,
          py::arg("progress") = py::none(),
          R"(Phase gradient autofocus of a spotlight image.

Parameters
----------
image : complex64 [n_azimuth, n_range]
    Focused up to a phase error on its azimuth spectrum that all range gates share; any strides.
estimator : {"ml", "gradient"}
    Maximum likelihood, or the classic phase gradient.
coarse_windows : sequence of float
    Half widths of the windows of the coarse rounds, as shares of the aperture's bandwidth, 0 to 0.5.
coarse_points, fine_points : int
    Strong points of a coarse and, at most, of a fine round.
minimum_contrast : float
    Of a point of the fine rounds: peak power over that of the speckle which its range cell would make there.
fine_rounds, tolerance
    At most so many; they end when the phase changes by less than this, rad RMS.
do_no_harm : bool
    Hand the input back where the score is not better.
out : complex64 [n_azimuth, n_range], optional
    Where the corrected image goes.
threads, progress
    As everywhere.

Returns
-------
Result
    phase_error and phase_std are over fftshift(fft(image, axis=0), axes=0).

Raises
------
ShapeError, ValueError, TypeError, NumericalError)");
    m.def("gpga", &gpga, py::arg("data"), py::arg("positions"), py::arg("grid"), py::kw_only(), py::arg("range_start"),
          py::arg("range_spacing"), py::arg("wavelength"), py::arg("estimator") = "ml", py::arg("coarse_windows") = defaults.coarse_windows,
          py::arg("coarse_points") = defaults.coarse_points, py::arg("fine_points") = defaults.fine_points,
          py::arg("minimum_contrast") = defaults.minimum_contrast, py::arg("fine_rounds") = defaults.fine_rounds,
          py::arg("tolerance") = defaults.tolerance, py::arg("do_no_harm") = true, py::arg("out") = py::none(), py::arg("threads") = 0,
          py::arg("progress") = py::none(),
          R"(Phase gradient autofocus by backprojection: one phase per pulse, any path, any grid.

Parameters
----------
data, positions, grid, range_start, range_spacing, wavelength
    As for `backproject`.
estimator : {"ml", "gradient"}
    Maximum likelihood, or the classic phase gradient.
coarse_windows : sequence of float
    Half widths of the windows of the coarse rounds, as shares of the aperture's bandwidth, 0 to 0.5.
coarse_points, fine_points : int
    Strong points of a coarse and, at most, of a fine round.
minimum_contrast : float
    Of a point of the fine rounds: peak power over that of the speckle which its range cell would make there.
fine_rounds, tolerance
    At most so many; they end when the phase changes by less than this, rad RMS.
do_no_harm : bool
    Hand the input back where the score is not better.
out : complex64 [grid.shape], optional
    Where the image goes.
threads, progress
    As everywhere.

Returns
-------
Result
    phase_error and phase_std are over the pulses; image is formed from data * exp(-1j * phase_error)[:, None].

Raises
------
ShapeError, ValueError, TypeError, NumericalError, MemoryError)");
    bind_pga_2d(m);
    bind_time_offset(m);
}

}  // namespace sarfocus::python
