#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>

#include <pybind11/stl.h>

#include <sarfocus/core/checks.hpp>
#include <sarfocus/sim/points.hpp>

#include "bindings.hpp"
#include "convert.hpp"
#include "radar_arguments.hpp"
#include "window_argument.hpp"

namespace py = pybind11;

namespace sarfocus::python {
namespace {

// Any array-like of numbers is taken, as complex128.
Input<cdouble, 1> complex_input(const py::object& object, const char* argument) {
    try {
        return input<cdouble, 1>(py::module_::import("numpy").attr("atleast_1d")(object).attr("astype")(py::dtype::of<cdouble>()),
                                 argument);
    } catch (py::error_already_set& error) {
        if (!error.matches(PyExc_TypeError) && !error.matches(PyExc_ValueError)) throw;
        throw py::type_error(std::string(argument) + ": expected an array of complex numbers, got " +
                             py::str(py::type::of(object).attr("__name__")).cast<std::string>());
    }
}

void require_output_memory(const py::object& out, std::ptrdiff_t rows, std::ptrdiff_t columns, const char* purpose) {
    if (out.is_none()) require_memory(sizeof(cfloat) * static_cast<std::uint64_t>(rows) * static_cast<std::uint64_t>(columns), purpose);
}

void require_count(std::ptrdiff_t n, const char* argument) {
    if (n < 1) throw ValueError(argument, "a number of samples > 0", std::to_string(n));
}

py::array points(const py::object& positions, const py::object& targets, const py::object& reflectivity, std::ptrdiff_t n_range,
                 const py::object& range_start, double range_spacing, double wavelength, double bandwidth, const py::object& window,
                 std::optional<double> support, double noise_power, std::uint64_t seed, const py::object& out, int threads,
                 const py::object& progress) {
    require_count(n_range, "n_range");
    const Positions centres = positions_of(positions);
    const auto xyz = real_input<2>(targets, "targets");
    const auto amplitudes = complex_input(reflectivity, "reflectivity");
    const auto start = range_start_of(range_start);
    const std::ptrdiff_t n_pulse = centres.transmit.view.extent(0);
    require_output_memory(out, n_pulse, n_range, "points");
    const auto data = output<cfloat, 2>(out, {n_pulse, n_range});
    sim::PointEchoModel model;
    model.range_start = start.view;
    model.range_spacing = range_spacing;
    model.wavelength = wavelength;
    model.bandwidth = bandwidth;
    model.window = window_of(window);
    model.support = support.value_or(std::numeric_limits<double>::infinity());
    model.noise_power = noise_power;
    model.seed = seed;
    const sim::PointOptions options{execution(threads, progress)};
    {
        const py::gil_scoped_release release;
        sim::points(centres.view(), {xyz.view, amplitudes.view}, model, data.view, options);
    }
    return data.owner;
}

py::array points_frequency(const py::object& positions, const py::object& targets, const py::object& reflectivity,
                           std::ptrdiff_t n_frequency, double frequency_start, double frequency_spacing, const py::object& reference_range,
                           double noise_power, std::uint64_t seed, const py::object& out, int threads, const py::object& progress) {
    require_count(n_frequency, "n_frequency");
    const Positions centres = positions_of(positions);
    const auto xyz = real_input<2>(targets, "targets");
    const auto amplitudes = complex_input(reflectivity, "reflectivity");
    const auto reference = real_input<1>(py::module_::import("numpy").attr("atleast_1d")(reference_range), "reference_range");
    const std::ptrdiff_t n_pulse = centres.transmit.view.extent(0);
    require_output_memory(out, n_pulse, n_frequency, "points_frequency");
    const auto data = output<cfloat, 2>(out, {n_pulse, n_frequency});
    sim::PointHistoryModel model;
    model.reference_range = reference.view;
    model.frequency_start = frequency_start;
    model.frequency_spacing = frequency_spacing;
    model.noise_power = noise_power;
    model.seed = seed;
    const sim::PointOptions options{execution(threads, progress)};
    {
        const py::gil_scoped_release release;
        sim::points_frequency(centres.view(), {xyz.view, amplitudes.view}, model, data.view, options);
    }
    return data.owner;
}

void bind_points(py::module_& m) {
    m.def("points", &points, py::arg("positions"), py::arg("targets"), py::arg("reflectivity"), py::kw_only(), py::arg("n_range"),
          py::arg("range_start"), py::arg("range_spacing"), py::arg("wavelength"), py::arg("bandwidth"), py::arg("window") = py::none(),
          py::arg("support") = py::none(), py::arg("noise_power") = 0.0, py::arg("seed") = 0, py::arg("out") = py::none(),
          py::arg("threads") = 0, py::arg("progress") = py::none(),
          R"(Range-compressed echoes of point scatterers, as backproject takes them.

A scatterer at range R contributes reflectivity * exp(-4j pi R / wavelength) times the pulse response centred at R. To simulate a
trajectory error, simulate with the true positions and process with the assumed ones.

Parameters
----------
positions : array_like [n_pulse, 3], or a pair (tx, rx) of such
    Antenna phase centres, m.
targets : array_like [n_target, 3]
    m, in the same frame.
reflectivity : array_like [n_target], complex
n_range : int
    Samples of a pulse.
range_start : float or array_like [n_pulse]
    Range of sample 0, m.
range_spacing : float
    m, at most c / (2 bandwidth).
wavelength : float
    m.
bandwidth : float
    Hz: the pulse response is sin(pi x) / (pi x), x = 2 bandwidth (r - R) / c, or what the window makes of it.
window : str or tuple, optional
    Over the band, as for `signal.window`.
support : float, optional
    Samples farther than this from a scatterer, m, get nothing from it; all do where None.
noise_power : float
    Mean square of complex white Gaussian noise.
seed : int
    Of the noise: the same numbers on every platform.
out : complex64 [n_pulse, n_range], optional
threads : int
    0: all. The result does not depend on it.
progress : callable (phase, done, total), optional
    Return False to stop.

Returns
-------
complex64 [n_pulse, n_range]

Raises
------
ShapeError, ValueError, TypeError, NumericalError, MemoryError)");
    m.def("points_frequency", &points_frequency, py::arg("positions"), py::arg("targets"), py::arg("reflectivity"), py::kw_only(),
          py::arg("n_frequency"), py::arg("frequency_start"), py::arg("frequency_spacing"), py::arg("reference_range"),
          py::arg("noise_power") = 0.0, py::arg("seed") = 0, py::arg("out") = py::none(), py::arg("threads") = 0,
          py::arg("progress") = py::none(), R"(Frequency-domain phase history of point scatterers, as compress_frequency takes it.

Sample [p, m] is the sum of reflectivity * exp(-4j pi f_m (R - reference_range[p]) / c), f_m = frequency_start + m * frequency_spacing.
Error relative to the exact sum: below 5e-7, root mean square.

Parameters
----------
positions : array_like [n_pulse, 3], or a pair (tx, rx) of such
    Antenna phase centres, m.
targets : array_like [n_target, 3]
    m, in the same frame.
reflectivity : array_like [n_target], complex
n_frequency : int
frequency_start, frequency_spacing : float
    Hz.
reference_range : float or array_like [n_pulse]
    m.
noise_power, seed, out, threads, progress
    As for `points`; out is complex64 [n_pulse, n_frequency].

Returns
-------
complex64 [n_pulse, n_frequency]

Raises
------
ShapeError, ValueError, TypeError, NumericalError, MemoryError)");
}

}  // namespace

void bind_sim(py::module_ m) {
    bind_points(m);
}

}  // namespace sarfocus::python
