#include <string>

#include <sarfocus/autofocus/sharpness.hpp>

#include "bindings.hpp"
#include "convert.hpp"
#include "python_result.hpp"

namespace py = pybind11;

namespace sarfocus::python {
namespace {

enum class Method { minimum_entropy, maximum_contrast };

template <Method method, class... Arguments>
autofocus::Result run(const Arguments&... arguments) {
    if constexpr (method == Method::minimum_entropy)
        return autofocus::minimum_entropy(arguments...);
    else
        return autofocus::maximum_contrast(arguments...);
}

template <Method method>
PythonResult sharpen(const py::object& image, const py::object& geometry, int smooth_rounds, int free_rounds, int polynomial, double search,
                     double tolerance, bool do_no_harm, const py::object& out, int threads, const py::object& progress) {
    const auto source = input<cfloat, 2>(image, "image");
    if (!geometry.is_none() && !py::isinstance<geometry::StripmapGeometry>(geometry))
        throw py::type_error("geometry: expected a StripmapGeometry or None, got " +
                             py::str(py::type::of(geometry).attr("__name__")).cast<std::string>());
    const auto* strip = geometry.is_none() ? nullptr : geometry.cast<const geometry::StripmapGeometry*>();
    const auto corrected = output<cfloat, 2>(out, source.view.extents(), &source.owner);
    autofocus::SharpnessOptions options;
    options.smooth_rounds = smooth_rounds;
    options.free_rounds = free_rounds;
    options.polynomial = polynomial;
    options.search = search;
    options.tolerance = tolerance;
    options.do_no_harm = do_no_harm;
    options.execution = execution(threads, progress);
    PythonResult answer;
    {
        const py::gil_scoped_release release;
        answer.result = strip != nullptr ? run<method>(source.view, *strip, corrected.view, options)
                                         : run<method>(source.view, corrected.view, options);
    }
    answer.image = out.is_none() && answer.result.input_returned() ? image : py::object(corrected.owner);
    return answer;
}

template <Method method>
void define(py::module_ m, const char* name, const std::string& first_lines) {
    const autofocus::SharpnessOptions defaults;
    const std::string text = first_lines + R"(

No strong point is looked for: one phase for every azimuth frequency (spotlight) or slow-time sample (with a geometry), polynomial
coefficients first, then cosines, then free. Each half of the scene is judged with the phase of the other half, because a sparse scene is
sharpest with a phase that is wrong.

Parameters
----------
image : complex64 [n_azimuth, n_range]
    Focused up to a phase error that all range gates share; any strides.
geometry : StripmapGeometry, optional
    Of a strip; without it the error is over the azimuth spectrum.
smooth_rounds, free_rounds : int
    At most so many for every order of the smooth phases, and with a phase for every pulse.
polynomial : int
    Highest order of the polynomial searched first, 1 (none) to 12.
search : float
    rad, how large its terms may be.
tolerance : float
    nat of the measure; rounds end when one gains less.
do_no_harm : bool
    Hand the input back where the score is not better.
out : complex64 [n_azimuth, n_range], optional
    Where the corrected image goes.
threads, progress
    As everywhere.

Returns
-------
Result
    phase_error and phase_std over fftshift(fft(image, axis=0), axes=0), or over slow time, on azimuth_decompress(image, geometry).
    phase_std, from the difference between the halves, is nan where it was not judged or one half has next to no information.

Raises
------
ShapeError, ValueError, TypeError, NumericalError, MemoryError)";
    m.def(name, &sharpen<method>, py::arg("image"), py::arg("geometry") = py::none(), py::kw_only(),
          py::arg("smooth_rounds") = defaults.smooth_rounds, py::arg("free_rounds") = defaults.free_rounds,
          py::arg("polynomial") = defaults.polynomial, py::arg("search") = defaults.search, py::arg("tolerance") = defaults.tolerance,
          py::arg("do_no_harm") = true, py::arg("out") = py::none(), py::arg("threads") = 0, py::arg("progress") = py::none(),
          text.c_str());
}

}  // namespace

void bind_sharpness(py::module_ m) {
    define<Method::minimum_entropy>(m, "minimum_entropy", "Autofocus by the least entropy of the image.");
    define<Method::maximum_contrast>(m, "maximum_contrast", "Autofocus by the largest contrast of the image, sum |x|^4 / (sum |x|^2)^2.");
}

}  // namespace sarfocus::python
