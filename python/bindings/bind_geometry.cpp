#include <algorithm>
#include <array>
#include <vector>

#include <pybind11/stl.h>

#include <sarfocus/geometry/image_grid.hpp>
#include <sarfocus/geometry/stripmap_geometry.hpp>
#include <sarfocus/geometry/trajectory.hpp>

#include "bindings.hpp"
#include "convert.hpp"

namespace py = pybind11;

namespace sarfocus::python {
namespace {

using geometry::ImageGrid;
using geometry::StripmapGeometry;
using Shape = std::array<std::ptrdiff_t, 2>;

Vector3 vector3(const py::object& object, const char* argument) {
    const auto values = real_input<1>(object, argument);
    if (values.view.extent(0) != 3) throw ShapeError(argument, "three coordinates (x, y, z) in m", shape_text(values.view.extents()));
    return {values.view(0), values.view(1), values.view(2)};
}

ImageGrid from_points(const py::object& xyz) {
    if (py::isinstance<py::array>(xyz) && py::reinterpret_borrow<py::array>(xyz).ndim() == 2) {
        const auto list = real_input<2>(xyz, "xyz");
        return ImageGrid::from_points(
            {list.view.data(), {list.view.extent(0), 1, list.view.extent(1)}, {list.view.stride(0), 0, list.view.stride(1)}});
    }
    return ImageGrid::from_points(real_input<3>(xyz, "xyz").view);
}

StripmapGeometry stripmap_geometry(double wavelength, double prf, double velocity, const py::object& slant_range, double doppler_bandwidth,
                                   double doppler_centroid) {
    StripmapGeometry out;
    out.wavelength = wavelength;
    out.prf = prf;
    out.velocity = velocity;
    const py::object listed = py::module_::import("numpy").attr("atleast_1d")(slant_range);
    const auto ranges = real_input<1>(listed, "slant_range");
    for (std::ptrdiff_t i = 0; i < ranges.view.extent(0); ++i) out.slant_range.push_back(ranges.view(i));
    out.doppler_bandwidth = doppler_bandwidth;
    out.doppler_centroid = doppler_centroid;
    out.validate();
    return out;
}

py::array interpolate_track(const py::object& track_time, const py::object& track_position, const py::object& at, const py::object& out) {
    const auto time = real_input<1>(track_time, "track_time");
    const auto position = real_input<2>(track_position, "track_position");
    const auto moments = real_input<1>(at, "at");
    const auto made = output<double, 2>(out, {moments.view.extent(0), 3}, &position.owner);
    const py::gil_scoped_release release;
    geometry::interpolate_track({time.view, position.view}, moments.view, made.view);
    return made.owner;
}

py::array path_weights(const py::object& positions, double minimum_step, const py::object& out) {
    const auto path = real_input<2>(positions, "positions");
    const auto made = output<double, 1>(out, {path.view.extent(0)}, &path.owner);
    const py::gil_scoped_release release;
    geometry::path_weights(path.view, minimum_step, made.view);
    return made.owner;
}

py::array_t<double> positions(const ImageGrid& grid) {
    const auto shape = grid.shape();
    py::array_t<double> out({shape[0], shape[1], static_cast<std::ptrdiff_t>(3)});
    for (std::ptrdiff_t i = 0; i < shape[0]; ++i) grid.row_positions(i, out.mutable_data(i, 0, 0));
    return out;
}

py::array_t<double> vectors(const ImageGrid& grid) {
    py::array_t<double> out({3, 3});
    for (std::size_t i = 0; i < 3; ++i) std::copy_n(grid.vectors()[i].data(), 3, out.mutable_data(static_cast<py::ssize_t>(i), 0));
    return out;
}

}  // namespace

void bind_geometry(py::module_ m) {
    py::class_<StripmapGeometry>(m, "StripmapGeometry", R"(A straight, constant-speed stripmap collection as azimuth processing sees it.

Parameters
----------
wavelength : float
    m.
prf : float
    Hz, azimuth sampling rate.
velocity : float
    m/s, effective velocity.
slant_range : array_like [n_range]
    m, of every range gate.
doppler_bandwidth : float
    Hz, at most the prf.
doppler_centroid : float
    Hz.

Raises
------
ValueError, ShapeError
    A field that is not finite, not positive or does not fit the others.)")
        .def(py::init(&stripmap_geometry), py::kw_only(), py::arg("wavelength"), py::arg("prf"), py::arg("velocity"),
             py::arg("slant_range"), py::arg("doppler_bandwidth"), py::arg("doppler_centroid") = 0.0)
        .def_readonly("wavelength", &StripmapGeometry::wavelength)
        .def_readonly("prf", &StripmapGeometry::prf)
        .def_readonly("velocity", &StripmapGeometry::velocity)
        .def_property_readonly("slant_range", [](const StripmapGeometry& g) { return to_numpy(g.slant_range); })
        .def_readonly("doppler_bandwidth", &StripmapGeometry::doppler_bandwidth)
        .def_readonly("doppler_centroid", &StripmapGeometry::doppler_centroid)
        .def(
            "fm_rate", [](const StripmapGeometry& g, std::size_t i) { return g.slant_range.at(i), g.fm_rate(i); }, py::arg("range_gate"),
            "K = 2 v^2 / (lambda R), Hz/s, > 0 [Xie2023, eq. 1].")
        .def(
            "doppler_rate", [](const StripmapGeometry& g, std::size_t i) { return g.slant_range.at(i), g.doppler_rate(i); },
            py::arg("range_gate"), "-K, Hz/s.")
        .def(
            "aperture_samples", [](const StripmapGeometry& g, std::size_t i) { return g.slant_range.at(i), g.aperture_samples(i); },
            py::arg("range_gate"), "Length of the synthetic aperture, azimuth samples.");

    py::class_<ImageGrid>(m, "ImageGrid", "Where the pixels of an image lie in space: [n_azimuth, n_range] positions in m.")
        .def_static(
            "plane",
            [](const py::object& origin, const py::object& azimuth_step, const py::object& range_step, Shape shape) {
                return ImageGrid::plane(vector3(origin, "origin"), vector3(azimuth_step, "azimuth_step"), vector3(range_step, "range_step"),
                                        shape);
            },
            py::arg("origin"), py::arg("azimuth_step"), py::arg("range_step"), py::arg("shape"),
            "pixel (i, j) = origin + i * azimuth_step + j * range_step; vectors in m, shape (n_azimuth, n_range).")
        .def_static(
            "polar",
            [](const py::object& centre, const py::object& range_direction, const py::object& azimuth_direction, double range_start,
               double range_spacing, double angle_start, double angle_spacing, Shape shape) {
                return ImageGrid::polar(vector3(centre, "centre"), vector3(range_direction, "range_direction"),
                                        vector3(azimuth_direction, "azimuth_direction"), range_start, range_spacing, angle_start,
                                        angle_spacing, shape);
            },
            py::arg("centre"), py::arg("range_direction"), py::arg("azimuth_direction"), py::kw_only(), py::arg("range_start"),
            py::arg("range_spacing"), py::arg("angle_start"), py::arg("angle_spacing"), py::arg("shape"),
            "pixel (i, j) = centre + r (cos(a) range_direction + sin(a) azimuth_direction), r = range_start + j range_spacing (m), "
            "a = angle_start + i angle_spacing (rad).")
        .def_static("from_points", &from_points, py::arg("xyz"), "Any positions: [n_azimuth, n_range, 3] or [n, 3] (then n_range = 1), m.")
        .def_property_readonly("shape", [](const ImageGrid& g) { return py::make_tuple(g.shape()[0], g.shape()[1]); })
        .def_property_readonly("kind",
                               [](const ImageGrid& g) {
                                   switch (g.kind()) {
                                       case ImageGrid::Kind::plane:
                                           return "plane";
                                       case ImageGrid::Kind::polar:
                                           return "polar";
                                       case ImageGrid::Kind::points:
                                           break;
                                   }
                                   return "points";
                               })
        .def("position", &ImageGrid::position, py::arg("azimuth"), py::arg("range"), "(x, y, z) in m of a pixel, fractions allowed.")
        .def_property_readonly(
            "vectors", &vectors,
            "float64 [3, 3], m; plane: origin, azimuth_step, range_step; polar: centre, range_direction, azimuth_direction.")
        .def_property_readonly(
            "polar_axes", [](const ImageGrid& g) { return py::array_t<double>(4, g.polar_axes().data()); },
            "float64 [4]; polar: range_start, range_spacing (m), angle_start, angle_spacing (rad); zero for other grids.")
        .def("positions", &positions, "All positions, float64 [n_azimuth, n_range, 3], m.")
        .def("subgrid", &ImageGrid::subgrid, py::arg("begin"), py::arg("count"),
             "The part that starts at pixel `begin` and has shape `count`.");

    m.def("interpolate_track", &interpolate_track, py::arg("track_time"), py::arg("track_position"), py::arg("at"), py::kw_only(),
          py::arg("out") = py::none(), R"(Positions of a recorded track at other times, linear between its samples.

Parameters
----------
track_time : array_like [n]
    s, increasing.
track_position : array_like [n, 3]
    m.
at : array_like [m]
    s, within the track, in any order.
out : float64 [m, 3], optional
    Where the positions go.

Returns
-------
float64 [m, 3]
    m.

Raises
------
ShapeError, ValueError, TypeError, NumericalError)");
    m.def("path_weights", &path_weights, py::arg("positions"), py::kw_only(), py::arg("minimum_step") = 0.0, py::arg("out") = py::none(),
          R"(Weight of every pulse by the length of path it stands for.

Half the distance between its two neighbours (at the ends, the distance to the one neighbour), zero where the platform rests, and with
mean 1 over the others. Multiply the pulses by it before backprojection where the platform's speed changes much.

Parameters
----------
positions : array_like [n_pulse, 3]
    m.
minimum_step : float
    m from pulse to pulse at or below which the platform rests: above the jitter of the positions.
out : float64 [n_pulse], optional
    Where the weights go.

Returns
-------
float64 [n_pulse]

Raises
------
ShapeError, ValueError, TypeError, NumericalError)");
}

}  // namespace sarfocus::python
