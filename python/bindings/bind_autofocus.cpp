#include <string>

#include <pybind11/stl.h>

#include <sarfocus/autofocus/phase_estimate.hpp>

#include "bindings.hpp"
#include "convert.hpp"

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

}  // namespace

void bind_autofocus(py::module_ m) {
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
}

}  // namespace sarfocus::python
