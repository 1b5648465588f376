#include <array>
#include <cstddef>

#include <pybind11/stl.h>

#include <sarfocus/signal/interpolation.hpp>

#include "bindings.hpp"
#include "convert.hpp"

namespace py = pybind11;

namespace sarfocus::python {
namespace {

template <class Sample>
py::array upsample_as(const py::object& chip, std::ptrdiff_t factor, const std::array<double, 2>& band_centre) {
    const auto samples = input<Sample, 2>(chip, "chip");
    Array<cdouble, 2> fine;
    {
        const py::gil_scoped_release release;
        fine = signal::upsample(samples.view, factor, band_centre);
    }
    return to_numpy(std::move(fine));
}

py::array upsample(const py::object& chip, std::ptrdiff_t factor, const std::array<double, 2>& band_centre) {
    const bool wide = py::isinstance<py::array>(chip) && py::reinterpret_borrow<py::array>(chip).dtype().equal(py::dtype::of<cdouble>());
    return wide ? upsample_as<cdouble>(chip, factor, band_centre) : upsample_as<cfloat>(chip, factor, band_centre);
}

}  // namespace

void bind_signal(py::module_ m) {
    m.def("upsample", &upsample, py::arg("chip"), py::arg("factor"), py::kw_only(),
          py::arg("band_centre") = std::array<double, 2>{0.0, 0.0},
          R"(A small image on a grid `factor` times finer both ways, by zero padding of its spectrum.

Parameters
----------
chip : complex64 or complex128 [n_azimuth, n_range]
    Continued periodically: leave a margin about what is measured. Any strides.
factor : int
    >= 1.
band_centre : (float, float)
    Centre of the band along azimuth and range, cycles per sample (Doppler centroid / prf): the zeros go half a sampling rate away from it.

Returns
-------
complex128 [n_azimuth * factor, n_range * factor]
    Pixel (factor i, factor j) is chip[i, j].

Raises
------
ShapeError, ValueError, TypeError, NumericalError, MemoryError)");
}

}  // namespace sarfocus::python
