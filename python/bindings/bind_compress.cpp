#include <sarfocus/focus/azimuth.hpp>
#include <sarfocus/geometry/stripmap_geometry.hpp>

#include "bindings.hpp"
#include "convert.hpp"

namespace py = pybind11;

namespace sarfocus::python {
namespace {

using geometry::StripmapGeometry;
using AzimuthTransform = void (*)(const ImageView&, const StripmapGeometry&, const MutableImageView&, const focus::AzimuthOptions&);

py::array azimuth_transform(AzimuthTransform transform, const Input<cfloat, 2>& samples, const StripmapGeometry& geometry,
                            const py::object& out, int threads, const py::object& progress) {
    const auto result = output<cfloat, 2>(out, samples.view.extents(), &samples.owner);
    focus::AzimuthOptions options;
    options.execution = execution(threads, progress);
    {
        const py::gil_scoped_release release;
        transform(samples.view, geometry, result.view, options);
    }
    return result.owner;
}

py::array azimuth_compress(const py::object& raw, const StripmapGeometry& geometry, const py::object& out, int threads,
                           const py::object& progress) {
    return azimuth_transform(&focus::azimuth_compress, input<cfloat, 2>(raw, "raw"), geometry, out, threads, progress);
}

py::array azimuth_decompress(const py::object& image, const StripmapGeometry& geometry, const py::object& out, int threads,
                             const py::object& progress) {
    return azimuth_transform(&focus::azimuth_decompress, input<cfloat, 2>(image, "image"), geometry, out, threads, progress);
}

}  // namespace

void bind_compress(py::module_ m) {
    m.def("azimuth_compress", &azimuth_compress, py::arg("raw"), py::arg("geometry"), py::kw_only(), py::arg("out") = py::none(),
          py::arg("threads") = 0, py::arg("progress") = py::none(), R"(Compress a strip along azimuth; the inverse of azimuth_decompress.

The azimuth spectrum of every range gate is multiplied by exp(-1j pi (f - fdc)^2 / K), K = 2 v^2 / (wavelength R) [Xie2023, eq. 1],
f in [fdc - prf/2, fdc + prf/2), fdc the Doppler centroid: a target is imaged at the time at which its Doppler frequency is fdc.
Circular along azimuth and unitary.

Parameters
----------
raw : complex64 [n_azimuth, n_range]
    Range-compressed, migration-corrected data over slow time; any strides.
geometry : StripmapGeometry
    With one slant_range for each range gate.
out : complex64 [n_azimuth, n_range], optional
    Where the image goes; any strides, may not overlap `raw`.
threads : int
    0: all. The result does not depend on it.
progress : callable (phase, done, total), optional
    Return False to stop.

Returns
-------
complex64 [n_azimuth, n_range]

Raises
------
ShapeError, ValueError, TypeError, NumericalError)");
    m.def("azimuth_decompress", &azimuth_decompress, py::arg("image"), py::arg("geometry"), py::kw_only(), py::arg("out") = py::none(),
          py::arg("threads") = 0, py::arg("progress") = py::none(),
          R"(Spread an image over slow time again; the inverse of azimuth_compress.

The azimuth spectrum of every range gate is multiplied by exp(+1j pi (f - fdc)^2 / K).

Parameters
----------
image : complex64 [n_azimuth, n_range]
    Any strides.
geometry, out, threads, progress
    As for azimuth_compress.

Returns
-------
complex64 [n_azimuth, n_range]

Raises
------
ShapeError, ValueError, TypeError, NumericalError)");
}

}  // namespace sarfocus::python
