#include <cstddef>
#include <optional>

#include <pybind11/stl.h>

#include <sarfocus/core/checks.hpp>
#include <sarfocus/focus/azimuth.hpp>
#include <sarfocus/focus/range_compress.hpp>
#include <sarfocus/geometry/stripmap_geometry.hpp>

#include "bindings.hpp"
#include "convert.hpp"
#include "window_argument.hpp"

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

py::array range_compress(const py::object& raw, const py::object& replica, double replica_origin, const py::object& window,
                         const py::object& out, int threads, const py::object& progress) {
    const auto samples = input<cfloat, 2>(raw, "raw");
    const auto pulse = input<cfloat, 1>(replica, "replica");
    const auto result = output<cfloat, 2>(out, samples.view.extents(), &samples.owner);
    focus::RangeCompressOptions options;
    options.replica_origin = replica_origin;
    options.window = window_of(window);
    options.execution = execution(threads, progress);
    {
        const py::gil_scoped_release release;
        focus::range_compress(samples.view, pulse.view, result.view, options);
    }
    return result.owner;
}

struct RangeCompressed {
    py::array data;
    py::array range_start;
    double range_spacing;
    double wavelength;
};

RangeCompressed compress_frequency(const py::object& phase_history, double frequency_start, double frequency_spacing,
                                   const py::object& reference_range, double oversampling, std::ptrdiff_t guard,
                                   std::optional<double> centre_frequency, const py::object& window, const py::object& out, int threads,
                                   const py::object& progress) {
    const auto samples = input<cfloat, 2>(phase_history, "phase_history");
    const std::ptrdiff_t n_pulse = samples.view.extent(0);
    const auto numpy = py::module_::import("numpy");
    const py::object listed =
        numpy.attr("ndim")(reference_range).cast<int>() == 0 ? numpy.attr("full")(n_pulse, reference_range) : reference_range;
    const auto reference = real_input<1>(listed, "reference_range");
    if (centre_frequency) require_positive(*centre_frequency, "centre_frequency");
    focus::FrequencyCompressOptions options;
    options.oversampling = oversampling;
    options.guard = guard;
    options.centre_frequency = centre_frequency.value_or(0.0);
    options.window = window_of(window);
    options.execution = execution(threads, progress);
    require_not_empty(samples.view, "phase_history");
    const auto axis = focus::compressed_range(samples.view.extent(1), frequency_start, frequency_spacing, options);
    if (out.is_none())
        require_memory(sizeof(cfloat) * static_cast<std::uint64_t>(n_pulse) * static_cast<std::uint64_t>(axis.n_range),
                       "compress_frequency");
    const auto result = output<cfloat, 2>(out, {n_pulse, axis.n_range}, &samples.owner);
    const auto start = output<double, 1>(py::none(), {n_pulse});
    {
        const py::gil_scoped_release release;
        focus::compress_frequency(samples.view, frequency_start, frequency_spacing, reference.view, result.view, start.view, options);
    }
    return {result.owner, start.owner, axis.range_spacing, axis.wavelength};
}

void bind_range_compress(py::module_& m) {
    m.def("range_compress", &range_compress, py::arg("raw"), py::arg("replica"), py::kw_only(), py::arg("replica_origin") = 0.0,
          py::arg("window") = py::none(), py::arg("out") = py::none(), py::arg("threads") = 0, py::arg("progress") = py::none(),
          R"(Matched filter along fast time; the carrier phase is kept.

An echo a * replica becomes a * (pulse response), 1 at its peak. Sample i of the result is at range range_start + i * range_spacing where
sample i of `raw` was recorded that range's delay, 2 range / c, after time zero of the pulse: the axis stays the same.

Parameters
----------
raw : complex64 [n_pulse, n_fast_time]
    Any strides.
replica : complex64 [n_replica]
    The pulse as sent, see `chirp`.
replica_origin : float
    Index of the replica that leaves at time zero: 0 where echoes are timed from the leading edge of the pulse, (n_replica - 1) / 2
    where from its middle.
window : str or tuple, optional
    Over the replica, as for `window`.
out : complex64 [n_pulse, n_fast_time], optional
    Any strides, may not overlap `raw`.
threads : int
    0: all. The result does not depend on it.
progress : callable (phase, done, total), optional
    Return False to stop.

Returns
-------
complex64 [n_pulse, n_fast_time]

Raises
------
ShapeError, ValueError, TypeError, NumericalError)");
    py::class_<RangeCompressed>(m, "RangeCompressed", "Range-compressed echoes and their range axis: what backproject takes.")
        .def_readonly("data", &RangeCompressed::data, "complex64 [n_pulse, n_range]; sample i is at range_start + i * range_spacing.")
        .def_readonly("range_start", &RangeCompressed::range_start, "float64 [n_pulse], m.")
        .def_readonly("range_spacing", &RangeCompressed::range_spacing, "m.")
        .def_readonly("wavelength", &RangeCompressed::wavelength, "m, of the carrier whose phase is in the data.");
    m.def("compress_frequency", &compress_frequency, py::arg("phase_history"), py::kw_only(), py::arg("frequency_start"),
          py::arg("frequency_spacing"), py::arg("reference_range"), py::arg("oversampling") = 1.5, py::arg("guard") = 16,
          py::arg("centre_frequency") = py::none(), py::arg("window") = py::none(), py::arg("out") = py::none(), py::arg("threads") = 0,
          py::arg("progress") = py::none(), R"(Range compression of frequency-domain phase history (stepped or dechirped spotlight data).

phase_history[p, m] is the sum of a exp(-4j pi f_m (R - reference_range[p]) / c) over the scatterers. A scatterer at R becomes
a exp(-4j pi R / wavelength) times a pulse centred at R, 1 at its peak. The whole unambiguous interval c / (2 frequency_spacing) about
reference_range is covered.

Parameters
----------
phase_history : complex64 [n_pulse, n_frequency]
    Any strides.
frequency_start, frequency_spacing : float
    Hz.
reference_range : float or array_like [n_pulse]
    m, the range to which the data are motion-compensated.
oversampling : float
    Samples for each resolution cell, >= 1; rounded up to a fast transform length.
guard : int
    Samples beyond either end of the unambiguous interval, its periodic continuation, for interpolation.
centre_frequency : float, optional
    Hz, of the carrier whose phase stays in the data; the middle of the band where None.
window : str or tuple, optional
    Over the frequencies, as for `window`.
out : complex64 [n_pulse, n_range], optional
threads : int
    0: all. The result does not depend on it.
progress : callable (phase, done, total), optional
    Return False to stop.

Returns
-------
RangeCompressed
    data, range_start, range_spacing, wavelength.

Raises
------
ShapeError, ValueError, TypeError, NumericalError, MemoryError)");
}

}  // namespace

void bind_compress(py::module_ m) {
    bind_range_compress(m);
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
