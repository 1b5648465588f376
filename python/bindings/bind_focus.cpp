#include <array>
#include <string>
#include <utility>

#include <sarfocus/core/checks.hpp>
#include <sarfocus/focus/backproject.hpp>

#include "bindings.hpp"
#include "convert.hpp"
#include "radar_arguments.hpp"

namespace py = pybind11;

namespace sarfocus::python {
namespace {

using geometry::ImageGrid;

py::array backproject(const py::object& data, const py::object& positions, const ImageGrid& grid, const py::object& range_start,
                      double range_spacing, double wavelength, const std::string& method, const py::object& out, int threads,
                      const py::object& progress) {
    if (method != "exact") throw ValueError("method", "\"exact\"", "\"" + method + "\"");
    const auto samples = input<cfloat, 2>(data, "data");
    const Positions centres = positions_of(positions);
    const auto start = range_start_of(range_start);
    const auto image = output<cfloat, 2>(out, grid.shape(), &samples.owner);
    focus::BackprojectOptions options;
    options.execution = execution(threads, progress);
    {
        const py::gil_scoped_release release;
        focus::backproject({samples.view, start.view, range_spacing, wavelength}, centres.view(), grid, image.view, options);
    }
    return image.owner;
}

py::array backproject_histories(const py::object& data, const py::object& positions, const py::object& points,
                                const py::object& range_start, double range_spacing, double wavelength, const py::object& out, int threads,
                                const py::object& progress) {
    const auto samples = input<cfloat, 2>(data, "data");
    const Positions centres = positions_of(positions);
    const auto start = range_start_of(range_start);
    const auto targets = real_input<2>(points, "points");
    const auto histories = output<cfloat, 2>(out, {targets.view.extent(0), samples.view.extent(0)}, &samples.owner);
    focus::BackprojectOptions options;
    options.execution = execution(threads, progress);
    {
        const py::gil_scoped_release release;
        focus::backproject_histories({samples.view, start.view, range_spacing, wavelength}, centres.view(), targets.view, histories.view,
                                     options);
    }
    return histories.owner;
}

py::array project(const py::object& scene, const ImageGrid& grid, const py::object& positions, std::ptrdiff_t n_range,
                  const py::object& range_start, double range_spacing, double wavelength, const py::object& out, int threads,
                  const py::object& progress) {
    const auto pixels = input<cfloat, 2>(scene, "scene");
    const Positions centres = positions_of(positions);
    const auto start = range_start_of(range_start);
    if (n_range < 1) throw ValueError("n_range", "a number of samples > 0", std::to_string(n_range));
    const auto data = output<cfloat, 2>(out, {centres.transmit.view.extent(0), n_range}, &pixels.owner);
    focus::BackprojectOptions options;
    options.execution = execution(threads, progress);
    {
        const py::gil_scoped_release release;
        focus::project(pixels.view, grid, centres.view(), {data.view, start.view, range_spacing, wavelength}, data.view, options);
    }
    return data.owner;
}

}  // namespace

void bind_focus(py::module_ m) {
    m.def("backproject", &backproject, py::arg("data"), py::arg("positions"), py::arg("grid"), py::kw_only(), py::arg("range_start"),
          py::arg("range_spacing"), py::arg("wavelength"), py::arg("method") = "exact", py::arg("out") = py::none(), py::arg("threads") = 0,
          py::arg("progress") = py::none(), R"(Form an image by backprojection: any grid, any path, mono- or bistatic.

Parameters
----------
data : complex64 [n_pulse, n_range]
    Range-compressed echoes, carrier phase kept: a scatterer at range R contributes exp(-4j pi R / wavelength) times the pulse
    response centred at R. Sampled at or above the Nyquist rate; any strides.
positions : array_like [n_pulse, 3], or a pair (tx, rx) of such
    Antenna phase centres, m, in the frame of the grid.
grid : ImageGrid
    Where the pixels lie.
range_start : float or array_like [n_pulse]
    Range of sample 0, m.
range_spacing : float
    m.
wavelength : float
    m.
method : {"exact"}
    Sum over every pulse for every pixel. The interpolation between range samples errs by -68 dB for critically sampled data.
out : complex64 [grid.shape], optional
    Where the image goes; any strides.
threads : int
    0: all. The result does not depend on it.
progress : callable (phase, done, total), optional
    Return False to stop.

Returns
-------
complex64 [n_azimuth, n_range]

Raises
------
ShapeError, ValueError, TypeError, NumericalError, MemoryError)");
    m.def("backproject_histories", &backproject_histories, py::arg("data"), py::arg("positions"), py::arg("points"), py::kw_only(),
          py::arg("range_start"), py::arg("range_spacing"), py::arg("wavelength"), py::arg("out") = py::none(), py::arg("threads") = 0,
          py::arg("progress") = py::none(), R"(The terms of the backprojection sum of single points: their dechirped histories.

Parameters as for `backproject`, with points array_like [n_point, 3], m, in place of the grid.

Returns
-------
complex64 [n_point, n_pulse]
    Zero where a pulse did not record the point.)");
    m.def("project", &project, py::arg("scene"), py::arg("grid"), py::arg("positions"), py::kw_only(), py::arg("n_range"),
          py::arg("range_start"), py::arg("range_spacing"), py::arg("wavelength"), py::arg("out") = py::none(), py::arg("threads") = 0,
          py::arg("progress") = py::none(), R"(The adjoint of `backproject`: the echo of a scene, up to the pulse's spectrum.

Parameters
----------
scene : complex64 [grid.shape]
    Complex reflectivity of every pixel.
grid, positions, range_start, range_spacing, wavelength
    As for `backproject`.
n_range : int
    Range samples of a pulse.

Returns
-------
complex64 [n_pulse, n_range])");
}

}  // namespace sarfocus::python
