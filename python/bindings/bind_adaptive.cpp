#include <string>
#include <utility>
#include <vector>

#include <pybind11/native_enum.h>
#include <pybind11/stl.h>

#include <sarfocus/autofocus/adaptive.hpp>

#include "bindings.hpp"
#include "convert.hpp"
#include "python_result.hpp"

namespace py = pybind11;

namespace sarfocus::python {
namespace {

using autofocus::CfarGateOptions;
using autofocus::GateCell;
using autofocus::SubAperture;
using geometry::StripmapGeometry;

autofocus::Estimator estimator_of(const std::string& name) {
    if (name == "ml") return autofocus::Estimator::maximum_likelihood;
    if (name == "gradient") return autofocus::Estimator::gradient;
    throw ValueError("estimator", "\"ml\" or \"gradient\"", "\"" + name + "\"");
}

autofocus::WeakScene weak_scene_of(const std::string& name) {
    if (name == "denoise") return autofocus::WeakScene::denoise;
    if (name == "skip") return autofocus::WeakScene::skip;
    throw ValueError("weak_scene", "\"denoise\" or \"skip\"", "\"" + name + "\"");
}

CfarGateOptions gate_options(const std::vector<int>& extents, double mu, double false_alarm_probability) {
    CfarGateOptions out;
    out.extents = extents;
    out.mu = mu;
    out.false_alarm_probability = false_alarm_probability;
    return out;
}

py::tuple cfar_gate(const py::object& image, const std::vector<int>& extents, double mu, double false_alarm_probability, int reference,
                    int guard, int cells, int threads, const py::object& progress) {
    const auto in = input<cfloat, 2>(image, "image");
    CfarGateOptions options = gate_options(extents, mu, false_alarm_probability);
    options.reference = reference;
    options.guard = guard;
    options.cells = cells;
    options.execution = execution(threads, progress);
    autofocus::CfarGate gate;
    {
        const py::gil_scoped_release release;
        gate = autofocus::cfar_gate(in.view, options);
    }
    return py::make_tuple(gate.strong_points, to_numpy(gate.cells));
}

py::array mean_filter(const py::object& image, const py::object& out, int threads, const py::object& progress) {
    const auto in = input<cfloat, 2>(image, "image");
    const auto filtered = output<cfloat, 2>(out, in.view.extents(), &in.owner);
    const Execution run = execution(threads, progress);
    {
        const py::gil_scoped_release release;
        autofocus::mean_filter(in.view, filtered.view, run);
    }
    return filtered.owner;
}

py::array_t<double> gate_energies(const py::object& image, std::ptrdiff_t length, int threads, const py::object& progress) {
    const auto in = input<cfloat, 2>(image, "image");
    const Execution run = execution(threads, progress);
    Array<double, 2> energies;
    {
        const py::gil_scoped_release release;
        energies = autofocus::gate_energies(in.view, length, run);
    }
    return to_numpy(std::move(energies));
}

py::tuple choose_gates(const py::object& energies, int k, double eta) {
    const auto in = real_input<1>(energies, "energies");
    const autofocus::GateChoice choice = autofocus::choose_gates(in.view, k, eta);
    return py::make_tuple(to_numpy(std::vector<std::int64_t>(choice.gates.begin(), choice.gates.end())), choice.mean_strong,
                          choice.mean_rest);
}

template <class Run>
PythonResult run_on(const py::object& image, const py::object& out, const Run& run) {
    const auto source = input<cfloat, 2>(image, "image");
    const auto corrected = output<cfloat, 2>(out, source.view.extents(), out.is(image) ? nullptr : &source.owner);
    PythonResult answer;
    {
        const py::gil_scoped_release release;
        answer.result = run(source.view, corrected.view);
    }
    answer.image = out.is_none() && answer.result.input_returned() ? image : py::object(corrected.owner);
    return answer;
}

PythonResult adaptive_pga(const py::object& image, const StripmapGeometry* geometry, double eta, int k, int sub_aperture,
                          const std::string& weak_scene, double bandwidth_ratio, const std::string& estimator,
                          const std::vector<int>& extents, double mu, double false_alarm_probability, bool do_no_harm,
                          const py::object& out, int threads, const py::object& progress) {
    autofocus::AdaptiveOptions options;
    options.eta = eta;
    options.k = k;
    options.sub_aperture = sub_aperture;
    options.weak_scene = weak_scene_of(weak_scene);
    options.bandwidth_ratio = bandwidth_ratio;
    options.estimator = estimator_of(estimator);
    options.gate = gate_options(extents, mu, false_alarm_probability);
    options.do_no_harm = do_no_harm;
    options.execution = execution(threads, progress);
    return run_on(image, out, [&](const ImageView& from, const MutableImageView& to) {
        return geometry != nullptr ? autofocus::adaptive_pga(from, *geometry, to, options) : autofocus::adaptive_pga(from, to, options);
    });
}

PythonResult conventional_pga(const py::object& image, const StripmapGeometry* geometry, int k, int sub_aperture, int iterations,
                              double narrowing, bool do_no_harm, const py::object& out, int threads, const py::object& progress) {
    autofocus::ConventionalOptions options;
    options.k = k;
    options.sub_aperture = sub_aperture;
    options.iterations = iterations;
    options.narrowing = narrowing;
    options.do_no_harm = do_no_harm;
    options.execution = execution(threads, progress);
    return run_on(image, out, [&](const ImageView& from, const MutableImageView& to) {
        return geometry != nullptr ? autofocus::conventional_pga(from, *geometry, to, options)
                                   : autofocus::conventional_pga(from, to, options);
    });
}

void bind_steps(py::module_& m) {
    PYBIND11_NUMPY_DTYPE(GateCell, azimuth, range, extent, value, clutter, threshold, detected);
    m.attr("cell_dtype") = py::dtype::of<GateCell>();
    const CfarGateOptions gate;
    const autofocus::AdaptiveOptions adaptive;

    m.def("cfar_gate", &cfar_gate, py::arg("image"), py::kw_only(), py::arg("extents") = gate.extents, py::arg("mu") = gate.mu,
          py::arg("false_alarm_probability") = gate.false_alarm_probability, py::arg("reference") = gate.reference,
          py::arg("guard") = gate.guard, py::arg("cells") = gate.cells, py::arg("threads") = 0, py::arg("progress") = py::none(),
          R"(Whether a scene has strong points: the five strongest of the five strongest samples of every range gate, coalesced, by cell
averaging along azimuth [Luo2025, section 2.2.1].

Parameters
----------
image : complex64 [n_azimuth, n_range]
extents : sequence of int
    Azimuth pixels over which intensity is averaged before it is tested, 1 or even; [1] is the paper's test. A defocused point stands out in
    the longer ones.
mu : float
    Above 0: this factor, on amplitudes of single pixels, as the paper's figures have it, whatever the extents.
false_alarm_probability : float
    With mu = 0: chance that plain speckle passes for strong points, of the whole scene.
reference, guard : int
    Reference cells, both sides together; cells left out on each side.
cells : int
    Strongest of the scene that are tested, for every extent.
threads, progress
    As everywhere.

Returns
-------
tuple of bool and structured array
    Whether there are strong points; azimuth, range, extent, value, clutter, threshold, detected of every cell tested.

Raises
------
ShapeError, ValueError, TypeError, NumericalError)");

    m.def(
        "gates_to_denoise",
        [](std::ptrdiff_t n_range, std::ptrdiff_t centre) {
            const autofocus::GateSpan span = autofocus::gates_to_denoise(n_range, centre);
            return std::make_pair(span.first, span.count);
        },
        py::arg("n_range"), py::arg("centre"), R"(The sixteenth of the range gates about `centre` [Luo2025, section 2.2.2].

Parameters
----------
n_range, centre : int

Returns
-------
tuple of int
    First gate and number of gates, at least three where there are so many.

Raises
------
ValueError)");

    m.def("mean_filter", &mean_filter, py::arg("image"), py::kw_only(), py::arg("out") = py::none(), py::arg("threads") = 0,
          py::arg("progress") = py::none(), R"(Mean of the 3 x 3 complex pixels about every pixel [Luo2025, section 2.2.2].

Its response along azimuth, (1 + 2 cos w) / 3, is negative beyond a third of the sampling rate; adaptive_pga takes that sign out again.

Parameters
----------
image : complex64 [n_azimuth, n_range]
out : complex64 [n_azimuth, n_range], optional
threads, progress
    As everywhere.

Returns
-------
complex64 [n_azimuth, n_range]
    The pixels at the border as they were.

Raises
------
ShapeError, ValueError, TypeError)");

    m.def(
        "sub_apertures",
        [](std::ptrdiff_t n_azimuth, std::ptrdiff_t length) {
            std::vector<std::pair<std::int64_t, std::int64_t>> out;
            for (const SubAperture& s : autofocus::sub_apertures(n_azimuth, length)) out.emplace_back(s.first, s.count);
            return out;
        },
        py::arg("n_azimuth"), py::arg("length"), R"(Azimuth sub-apertures, each overlapping the next by half [Luo2025, eq. 8].

Parameters
----------
n_azimuth : int
length : int
    Azimuth lines, even.

Returns
-------
list of tuple of int
    First line and number of lines; together all lines. The last is shorter by less than half where the length doesn't fit.

Raises
------
ValueError)");

    m.def("gate_energies", &gate_energies, py::arg("image"), py::arg("length"), py::kw_only(), py::arg("threads") = 0,
          py::arg("progress") = py::none(), R"(Energy of every range gate in every sub-aperture [Luo2025, eq. 9-10].

Parameters
----------
image : complex64 [n_azimuth, n_range]
length : int
    Of the sub-apertures, azimuth lines, even.
threads, progress
    As everywhere.

Returns
-------
float64 [n_sub_aperture, n_range]

Raises
------
ShapeError, ValueError, TypeError, NumericalError)");

    m.def("choose_gates", &choose_gates, py::arg("energies"), py::arg("k") = adaptive.k, py::arg("eta") = adaptive.eta,
          R"(The k strongest range gates, k halved until their mean energy exceeds eta times that of the others [Luo2025, eq. 11-13].

Parameters
----------
energies : array_like [n_range]
    Finite, not negative.
k : int
    Gates to start with; halved as well where no others are left to compare with.
eta : float

Returns
-------
tuple of int64 [k], float, float
    Gates, the strongest first, none where k reached 0; m1 and m2.

Raises
------
ShapeError, ValueError, TypeError, NumericalError)");
}

}  // namespace

void bind_adaptive(py::module_ m) {
    bind_steps(m);
    const autofocus::AdaptiveOptions adaptive;
    const autofocus::ConventionalOptions conventional;

    m.def("adaptive_pga", &adaptive_pga, py::arg("image"), py::arg("geometry") = py::none(), py::kw_only(), py::arg("eta") = adaptive.eta,
          py::arg("k") = adaptive.k, py::arg("sub_aperture") = adaptive.sub_aperture, py::arg("weak_scene") = "denoise",
          py::arg("bandwidth_ratio") = adaptive.bandwidth_ratio, py::arg("estimator") = "ml", py::arg("extents") = adaptive.gate.extents,
          py::arg("mu") = adaptive.gate.mu, py::arg("false_alarm_probability") = adaptive.gate.false_alarm_probability,
          py::arg("do_no_harm") = true, py::arg("out") = py::none(), py::arg("threads") = 0, py::arg("progress") = py::none(),
          R"(Phase gradient autofocus that first looks whether there are strong points, and how many [Luo2025].

Parameters
----------
image : complex64 [n_azimuth, n_range]
    A spotlight image as for `pga`, or, with a geometry, a compressed strip as for `spga_linear`.
geometry : StripmapGeometry, optional
eta : float
    The chosen gates' mean energy must exceed eta times that of the others.
k : int
    Range gates of every sub-aperture to start with; halved until they pass.
sub_aperture : int
    Azimuth lines, even; 0: 512, or the synthetic aperture of a strip.
weak_scene : {"denoise", "skip"}
    Without strong points: estimate from the mean-filtered sixteenth of the range gates, or hand the input back.
bandwidth_ratio : float
    Spotlight: range sampling rate over carrier frequency; the range migration that belongs to the error is taken off with it, as by
    `pga_2d`. 0: off the azimuth spectrum alone.
estimator : {"ml", "gradient"}
    Maximum likelihood, or the paper's phase gradient.
extents, mu, false_alarm_probability
    Of the test for strong points; see `sarfocus.adaptive.cfar_gate`.
do_no_harm : bool
    Hand the input back where the score is not better.
out : complex64 [n_azimuth, n_range], optional
    Where the corrected image goes.
threads, progress
    As everywhere.

Returns
-------
Result
    phase_error and phase_std as `pga`, or with a geometry as `spga_linear`; diagnostics["adaptive"] tells what was decided.

Raises
------
ShapeError, ValueError, TypeError, NumericalError, MemoryError)");

    m.def("conventional_pga", &conventional_pga, py::arg("image"), py::arg("geometry") = py::none(), py::kw_only(),
          py::arg("k") = conventional.k, py::arg("sub_aperture") = conventional.sub_aperture,
          py::arg("iterations") = conventional.iterations, py::arg("narrowing") = conventional.narrowing, py::arg("do_no_harm") = true,
          py::arg("out") = py::none(), py::arg("threads") = 0, py::arg("progress") = py::none(),
          R"(What adaptive PGA is measured against: the k strongest range gates whatever the scene, and the phase gradient [Luo2025].

Parameters
----------
image : complex64 [n_azimuth, n_range]
geometry : StripmapGeometry, optional
k, sub_aperture
    As for `adaptive_pga`; k is never halved.
iterations : int
    Of choosing points, windowing and estimating.
narrowing : float
    Factor of the window from one iteration to the next.
do_no_harm : bool
    Hand the input back where the score is not better.
out : complex64 [n_azimuth, n_range], optional
    Where the corrected image goes.
threads, progress
    As everywhere.

Returns
-------
Result
    As `adaptive_pga`.

Raises
------
ShapeError, ValueError, TypeError, NumericalError, MemoryError)");
}

}  // namespace sarfocus::python
