#include <array>
#include <optional>
#include <string>
#include <utility>

#include <pybind11/stl.h>

#include <sarfocus/core/checks.hpp>
#include <sarfocus/focus/backproject.hpp>
#include <sarfocus/focus/doppler_centroid.hpp>
#include <sarfocus/focus/factorized.hpp>
#include <sarfocus/focus/range_doppler.hpp>

#include "bindings.hpp"
#include "convert.hpp"
#include "radar_arguments.hpp"
#include "window_argument.hpp"

namespace py = pybind11;

namespace sarfocus::python {
namespace {

using geometry::ImageGrid;

py::array backproject(const py::object& data, const py::object& positions, const ImageGrid& grid, const py::object& range_start,
                      double range_spacing, double wavelength, const std::string& method, double target_error_db, const py::object& out,
                      int threads, const py::object& progress) {
    if (method != "exact" && method != "ffbp") throw ValueError("method", "\"exact\" or \"ffbp\"", "\"" + method + "\"");
    const auto samples = input<cfloat, 2>(data, "data");
    const Positions centres = positions_of(positions);
    const auto start = range_start_of(range_start);
    const auto image = output<cfloat, 2>(out, grid.shape(), &samples.owner);
    const focus::RangeProfiles profiles{samples.view, start.view, range_spacing, wavelength};
    const Execution how = execution(threads, progress);
    {
        const py::gil_scoped_release release;
        if (method == "exact")
            focus::backproject(profiles, centres.view(), grid, image.view, {how});
        else
            focus::backproject_factorized(profiles, centres.view(), grid, image.view, {target_error_db, how});
    }
    return image.owner;
}

focus::FactorizedReport plan_factorized(const py::object& positions, const ImageGrid& grid, std::ptrdiff_t n_range,
                                        const py::object& range_start, double range_spacing, double wavelength, double target_error_db) {
    const Positions centres = positions_of(positions);
    const auto start = range_start_of(range_start);
    const focus::RangeProfiles profiles{{nullptr, {centres.view().n_pulse(), n_range}}, start.view, range_spacing, wavelength};
    const py::gil_scoped_release release;
    return focus::plan_factorized(profiles, centres.view(), grid, {target_error_db, {}});
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
                  const py::object& range_start, double range_spacing, double wavelength,
                  const std::optional<std::pair<Vector3, std::pair<double, double>>>& aspect, const py::object& out, int threads,
                  const py::object& progress) {
    focus::Aspect beam;
    if (aspect) beam = {aspect->first, aspect->second.first, aspect->second.second};
    const auto pixels = input<cfloat, 2>(scene, "scene");
    const Positions centres = positions_of(positions);
    const auto start = range_start_of(range_start);
    if (n_range < 1) throw ValueError("n_range", "a number of samples > 0", std::to_string(n_range));
    const auto data = output<cfloat, 2>(out, {centres.transmit.view.extent(0), n_range}, &pixels.owner);
    focus::BackprojectOptions options;
    options.execution = execution(threads, progress);
    {
        const py::gil_scoped_release release;
        focus::project(pixels.view, grid, centres.view(), {data.view, start.view, range_spacing, wavelength}, data.view, options, beam);
    }
    return data.owner;
}

py::array form_stripmap(const py::object& echo, const geometry::StripmapGeometry& geometry, const py::object& chirp, double range_start,
                        double range_sampling, double replica_origin, const py::object& window, const py::object& out, int threads,
                        const py::object& progress) {
    const auto samples = input<cfloat, 2>(echo, "echo");
    const auto pulse = chirp.is_none() ? Input<cfloat, 1>() : input<cfloat, 1>(chirp, "chirp");
    if (!chirp.is_none()) require_not_empty(pulse.view, "chirp");
    const auto image =
        output<cfloat, 2>(out, {samples.view.extent(0), static_cast<std::ptrdiff_t>(geometry.slant_range.size())}, &samples.owner);
    focus::RangeDopplerOptions options;
    options.chirp = pulse.view;
    options.replica_origin = replica_origin;
    options.window = window_of(window);
    options.execution = execution(threads, progress);
    {
        const py::gil_scoped_release release;
        focus::form_stripmap(samples.view, geometry, {range_start, range_sampling}, image.view, options);
    }
    return image.owner;
}

double estimate_doppler_centroid(const py::object& data, double prf, int threads, const py::object& progress) {
    const auto samples = input<cfloat, 2>(data, "data");
    focus::DopplerCentroidOptions options;
    options.execution = execution(threads, progress);
    const py::gil_scoped_release release;
    return focus::estimate_doppler_centroid(samples.view, prf, options);
}

void bind_stripmap(py::module_& m) {
    m.def("form_stripmap", &form_stripmap, py::arg("echo"), py::arg("geometry"), py::arg("chirp") = py::none(), py::kw_only(),
          py::arg("range_start"), py::arg("range_sampling"), py::arg("replica_origin") = 0.0, py::arg("window") = py::none(),
          py::arg("out") = py::none(), py::arg("threads") = 0, py::arg("progress") = py::none(),
          R"(Form a stripmap image by the range-Doppler algorithm; phases are preserved.

Range compression where a chirp is given, secondary range compression, correction of range migration, azimuth compression. Pixel (i, j) is
the target whose closest range is slant_range[j] and whose Doppler frequency is the centroid at pulse i: the image of azimuth_compress, and
azimuth_decompress takes it back to slow time for autofocus. A point of reflectivity a has the phase of
a * exp(-4j pi R / wavelength - 1j pi / 4) at its peak. The image is limited to the Doppler bandwidth about the centroid; along azimuth the
transform is circular: append an aperture's length of empty pulses where targets beyond the ends must stay out.

Parameters
----------
echo : complex64 [n_pulse, n_fast_time]
    Raw where a chirp is given, else range-compressed with the carrier phase kept; any strides.
geometry : StripmapGeometry
    slant_range: those of the image, ascending, within what was recorded; they need not be those of the samples. doppler_centroid: with its
    multiple of the prf. To take it from the data, make the geometry with estimate_doppler_centroid(echo, prf) + m * prf.
chirp : complex64 [n_replica], optional
    The pulse as sent, the replica of range_compress.
range_start : float
    m, slant range of fast-time sample 0, as for range_compress.
range_sampling : float
    Hz, sampling rate; the samples are c / (2 range_sampling) apart in range.
replica_origin : float
    Of the chirp, as for range_compress.
window : str or tuple, optional
    Over the chirp, as for range_compress.
out : complex64 [n_pulse, n_range], optional
    Where the image goes; any strides, may not overlap `echo`.
threads : int
    0: all. The result does not depend on it.
progress : callable (phase, done, total), optional
    Return False to stop.

Returns
-------
complex64 [n_pulse, n_range]

Raises
------
ValueError
    Also where the algorithm does not bear the geometry: a Doppler band beyond 2 velocity / wavelength, ranges that were not recorded,
    secondary range compression that varies too much over the swath.
ShapeError, TypeError, NumericalError, MemoryError

Notes
-----
Along the hyperbola an echo is seen at a slightly other time than along the parabola of azimuth_decompress; range_doppler.hpp says by how
much: (Ts / 2) theta^2 / 2 at the ends of an aperture Ts seen under the half angle theta, more with a squint. Where that matters, multiply
the echo by exp(-1j phase_error) and form the image again.)");
    m.def("estimate_doppler_centroid", &estimate_doppler_centroid, py::arg("data"), py::arg("prf"), py::kw_only(), py::arg("threads") = 0,
          py::arg("progress") = py::none(), R"(Doppler centroid of echoes by the correlation of successive pulses.

prf / (2 pi) times the argument of the sum of data[i + 1] * conj(data[i]); strong echoes weigh with their energy. The multiple of the prf to
add is not in it.

Parameters
----------
data : complex64 [n_pulse, n_range]
    Raw or range-compressed; any strides.
prf : float
    Hz.
threads : int
    0: all. The result does not depend on it.
progress : callable (phase, done, total), optional
    Return False to stop.

Returns
-------
float
    Hz, in (-prf / 2, prf / 2].

Raises
------
ShapeError, ValueError, TypeError, NumericalError)");
}

}  // namespace

void bind_focus(py::module_ m) {
    bind_stripmap(m);
    m.def("backproject", &backproject, py::arg("data"), py::arg("positions"), py::arg("grid"), py::kw_only(), py::arg("range_start"),
          py::arg("range_spacing"), py::arg("wavelength"), py::arg("method") = "exact", py::arg("target_error_db") = -60.0,
          py::arg("out") = py::none(), py::arg("threads") = 0, py::arg("progress") = py::none(),
          R"(Form an image by backprojection: any grid, any path, mono- or bistatic.

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
method : {"exact", "ffbp"}
    exact: the sum over every pulse for every pixel. Interpolation between range samples errs by -73 dB where the echo fills 1 / 1.2 of
    the band sampled, -68 dB for 0.9, -55 dB for 0.95, and fades towards both ends of the record. Noise up to the Nyquist frequency errs
    by -30 dB; a record that ends abruptly by -40 dB, -51 dB farther than 16 samples from its ends.
    ffbp: factorised, for plane and polar grids; much faster where pixels and pulses are many, to the error asked for. Small jobs, and
    geometries in which that error can't be kept, are summed exactly; `plan_factorized` tells.
target_error_db : float
    Of ffbp: RMS error over RMS of the exact image, -90 ... -20 dB.
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
    py::class_<focus::FactorizedStage>(m, "FactorizedStage",
                                       "One step of factorised backprojection: tiles and their virtual phase centres.")
        .def_readonly("rows", &focus::FactorizedStage::rows, "Pixels of a tile.")
        .def_readonly("columns", &focus::FactorizedStage::columns)
        .def_readonly("centres", &focus::FactorizedStage::centres, "Virtual phase centres that stand for all pulses.")
        .def_readonly("taps", &focus::FactorizedStage::taps, "Of the kernel along the track.")
        .def_readonly("oversampling", &focus::FactorizedStage::oversampling, "Of the centres, over what a tile needs.");
    py::class_<focus::FactorizedReport>(m, "FactorizedReport", "What factorised backprojection does and needs.")
        .def_readonly("factorized", &focus::FactorizedReport::factorized)
        .def_readonly("reason", &focus::FactorizedReport::reason, "Why the exact sum is taken, where it is.")
        .def_readonly("predicted_error_db", &focus::FactorizedReport::predicted_error_db)
        .def_property_readonly("stages",
                               [](const focus::FactorizedReport& report) {
                                   py::list out;
                                   for (const focus::FactorizedStage& stage : report.stages) out.append(stage);
                                   return out;
                               })
        .def_readonly("pieces", &focus::FactorizedReport::pieces, "Into which the path is cut, because it turns.")
        .def_readonly("work", &focus::FactorizedReport::work, "Estimated, over that of the exact sum.")
        .def_readonly("memory", &focus::FactorizedReport::memory, "Bytes beyond input and output.");
    m.def("plan_factorized", &plan_factorized, py::arg("positions"), py::arg("grid"), py::kw_only(), py::arg("n_range"),
          py::arg("range_start"), py::arg("range_spacing"), py::arg("wavelength"), py::arg("target_error_db") = -60.0,
          R"(What `backproject(..., method="ffbp")` would do and need: stages, predicted error, memory.

Parameters as for `backproject`, with the number of range samples n_range in place of the data.

Returns
-------
FactorizedReport

Raises
------
ShapeError, ValueError, NumericalError)");
    m.def("backproject_histories", &backproject_histories, py::arg("data"), py::arg("positions"), py::arg("points"), py::kw_only(),
          py::arg("range_start"), py::arg("range_spacing"), py::arg("wavelength"), py::arg("out") = py::none(), py::arg("threads") = 0,
          py::arg("progress") = py::none(), R"(The terms of the backprojection sum of single points: their dechirped histories.

Parameters as for `backproject`, with points array_like [n_point, 3], m, in place of the grid.

Returns
-------
complex64 [n_point, n_pulse]
    Zero where a pulse did not record the point.)");
    m.def("project", &project, py::arg("scene"), py::arg("grid"), py::arg("positions"), py::kw_only(), py::arg("n_range"),
          py::arg("range_start"), py::arg("range_spacing"), py::arg("wavelength"), py::arg("aspect") = py::none(),
          py::arg("out") = py::none(), py::arg("threads") = 0, py::arg("progress") = py::none(),
          R"(The adjoint of `backproject`: the echo of a scene, up to the pulse's spectrum.

Parameters
----------
scene : complex64 [grid.shape]
    Complex reflectivity of every pixel.
grid, positions, range_start, range_spacing, wavelength
    As for `backproject`.
n_range : int
    Range samples of a pulse.
aspect : ((float, float, float), (float, float)), optional
    Of the beam: a unit vector along the track, and from which to which sine of the angle from broadside a pulse illuminates pixels.

Returns
-------
complex64 [n_pulse, n_range])");
}

}  // namespace sarfocus::python
