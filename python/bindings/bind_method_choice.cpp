#include <string>
#include <vector>

#include <pybind11/stl.h>

#include <sarfocus/autofocus/autofocus.hpp>

#include "bindings.hpp"
#include "convert.hpp"
#include "python_result.hpp"

namespace py = pybind11;

namespace sarfocus::python {
namespace {

PythonResult autofocus_image(const py::object& image, const geometry::StripmapGeometry* geometry, const std::string& method,
                             const std::vector<std::string>& methods, const py::object& out, int threads, const py::object& progress) {
    const auto source = input<cfloat, 2>(image, "image");
    autofocus::AutofocusOptions options;
    options.method = method;
    options.methods = methods;
    options.execution = execution(threads, progress);
    const auto corrected = output<cfloat, 2>(out, source.view.extents(), out.is(image) ? nullptr : &source.owner);
    PythonResult answer;
    {
        const py::gil_scoped_release release;
        answer.result = geometry != nullptr ? autofocus::autofocus(source.view, *geometry, corrected.view, options)
                                            : autofocus::autofocus(source.view, corrected.view, options);
    }
    answer.image = out.is_none() && answer.result.input_returned() ? image : py::object(corrected.owner);
    return answer;
}

}  // namespace

void bind_method_choice(py::module_ m) {
    m.def("autofocus", &autofocus_image, py::arg("image"), py::arg("geometry") = py::none(), py::kw_only(), py::arg("method") = "auto",
          py::arg("methods") = std::vector<std::string>{}, py::arg("out") = py::none(), py::arg("threads") = 0,
          py::arg("progress") = py::none(), R"(Autofocus by the method that does best on strong points which had no say in its phase.

Parameters
----------
image : complex64 [n_azimuth, n_range]
    A spotlight image, or with a geometry a compressed strip; any strides.
geometry : StripmapGeometry, optional
    Of a strip.
method : str
    "auto", or one of `method_names`: it then decides by itself.
methods : sequence of str
    Those that "auto" may choose from; empty: all.
out : complex64 [n_azimuth, n_range], optional
    Where the corrected image goes; may be `image` itself.
threads, progress
    As everywhere.

Returns
-------
Result
    That of the method chosen; diagnostics["method"] names it, diagnostics["trials"] says how every method did and why it was chosen or
    not. The input itself where none improves it beyond doubt.

Raises
------
ShapeError, ValueError, TypeError, NumericalError, MemoryError)");

    m.def(
        "method_names", [](bool strip) { return autofocus::method_names(strip ? autofocus::Scene::strip : autofocus::Scene::spotlight); },
        py::kw_only(), py::arg("strip"), R"(Names of the methods that `autofocus` can run, the most trusted first.

Parameters
----------
strip : bool
    Whether the image comes with a stripmap geometry.

Returns
-------
list of str)");
}

}  // namespace sarfocus::python
