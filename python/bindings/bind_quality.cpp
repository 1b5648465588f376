#include <string>

#include <sarfocus/quality/image_measures.hpp>

#include "bindings.hpp"
#include "convert.hpp"

namespace py = pybind11;

namespace sarfocus::python {
namespace {

using Measure = double (*)(const ImageView&, const Execution&);

void bind_measure(py::module_& m, const char* name, Measure measure, const std::string& summary, const std::string& returns) {
    const std::string doc = summary + R"(

Parameters
----------
image : complex64 [n_azimuth, n_range]
    Any strides.
threads : int
    0: all. The result does not depend on it.
progress : callable, optional
    Called with (phase, done, total); returning False stops.

Returns
-------
float
    )" + returns + R"(

Raises
------
NumericalError
    NaN or infinity, or no sample different from zero.)";
    m.def(
        name,
        [measure](const py::object& image, int threads, const py::object& progress) {
            const auto in = input<cfloat, 2>(image, "image");
            const Execution run = execution(threads, progress);
            const py::gil_scoped_release release;
            return measure(in.view, run);
        },
        py::arg("image"), py::kw_only(), py::arg("threads") = 0, py::arg("progress") = py::none(), doc.c_str());
}

double psnr(const py::object& image, const py::object& reference, int threads, const py::object& progress) {
    const auto in = input<cfloat, 2>(image, "image");
    const auto truth = input<cfloat, 2>(reference, "reference");
    const Execution run = execution(threads, progress);
    const py::gil_scoped_release release;
    return quality::psnr(in.view, truth.view, run);
}

void bind_measures(py::module_& m) {
    bind_measure(m, "entropy", &quality::entropy, "Entropy of the normalised intensity, natural logarithm [Xie2023, eq. 23].",
                 "Nats; 0 for a single bright pixel, ln(size) for a flat image. Smaller is sharper.");
    bind_measure(m, "entropy_log10", &quality::entropy_log10,
                 "Entropy of the normalised intensity, decimal logarithm [Luo2025, eq. 19-20, read as normalised].",
                 "entropy(image) / ln(10).");
    bind_measure(m, "contrast", &quality::contrast, "Standard deviation of the intensity over its mean, over all pixels.",
                 "0 for a flat image, 1 for fully developed speckle. Larger is sharper.");
    bind_measure(m, "sharpness", &quality::sharpness, "Sum of the squared intensity over the square of the summed intensity.",
                 "1 / size for a flat image, 1 for a single bright pixel.");
    m.def("psnr", &psnr, py::arg("image"), py::arg("reference"), py::kw_only(), py::arg("threads") = 0, py::arg("progress") = py::none(),
          R"(Peak signal-to-noise ratio of the amplitudes; the peak is the largest amplitude of the reference.

Parameters
----------
image, reference : complex64 [n_azimuth, n_range]
    Any strides. Phase does not count.
threads : int
    0: all. The result does not depend on it.
progress : callable, optional
    Called with (phase, done, total); returning False stops.

Returns
-------
float
    10 log10(peak^2 / mean squared difference of the amplitudes), dB; infinite where they are equal.

Raises
------
ShapeError
    The shapes differ.
NumericalError
    NaN or infinity, or a reference of zeros.)");
}

}  // namespace

void bind_quality(py::module_ m) {
    bind_measures(m);
}

}  // namespace sarfocus::python
