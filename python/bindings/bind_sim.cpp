#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <pybind11/stl.h>

#include <sarfocus/core/checks.hpp>
#include <sarfocus/sim/hrws.hpp>
#include <sarfocus/sim/motion.hpp>
#include <sarfocus/sim/points.hpp>
#include <sarfocus/sim/stripmap.hpp>

#include "bindings.hpp"
#include "convert.hpp"
#include "radar_arguments.hpp"
#include "window_argument.hpp"

namespace py = pybind11;

namespace sarfocus::python {
namespace {

// Any array-like of numbers is taken, as complex128.
Input<cdouble, 1> complex_input(const py::object& object, const char* argument) {
    try {
        return input<cdouble, 1>(py::module_::import("numpy").attr("atleast_1d")(object).attr("astype")(py::dtype::of<cdouble>()),
                                 argument);
    } catch (py::error_already_set& error) {
        if (!error.matches(PyExc_TypeError) && !error.matches(PyExc_ValueError)) throw;
        throw py::type_error(std::string(argument) + ": expected an array of complex numbers, got " +
                             py::str(py::type::of(object).attr("__name__")).cast<std::string>());
    }
}

void require_output_memory(const py::object& out, std::ptrdiff_t rows, std::ptrdiff_t columns, const char* purpose) {
    if (out.is_none()) require_memory(sizeof(cfloat) * static_cast<std::uint64_t>(rows) * static_cast<std::uint64_t>(columns), purpose);
}

void require_count(std::ptrdiff_t n, const char* argument) {
    if (n < 1) throw ValueError(argument, "a number of samples > 0", std::to_string(n));
}

py::array points(const py::object& positions, const py::object& targets, const py::object& reflectivity, std::ptrdiff_t n_range,
                 const py::object& range_start, double range_spacing, double wavelength, double bandwidth, const py::object& window,
                 std::optional<double> support, double noise_power, std::uint64_t seed, const py::object& out, int threads,
                 const py::object& progress) {
    require_count(n_range, "n_range");
    const Positions centres = positions_of(positions);
    const auto xyz = real_input<2>(targets, "targets");
    const auto amplitudes = complex_input(reflectivity, "reflectivity");
    const auto start = range_start_of(range_start);
    const std::ptrdiff_t n_pulse = centres.transmit.view.extent(0);
    require_output_memory(out, n_pulse, n_range, "points");
    const auto data = output<cfloat, 2>(out, {n_pulse, n_range});
    sim::PointEchoModel model;
    model.range_start = start.view;
    model.range_spacing = range_spacing;
    model.wavelength = wavelength;
    model.bandwidth = bandwidth;
    model.window = window_of(window);
    model.support = support.value_or(std::numeric_limits<double>::infinity());
    model.noise_power = noise_power;
    model.seed = seed;
    const sim::PointOptions options{execution(threads, progress)};
    {
        const py::gil_scoped_release release;
        sim::points(centres.view(), {xyz.view, amplitudes.view}, model, data.view, options);
    }
    return data.owner;
}

py::array points_frequency(const py::object& positions, const py::object& targets, const py::object& reflectivity,
                           std::ptrdiff_t n_frequency, double frequency_start, double frequency_spacing, const py::object& reference_range,
                           double noise_power, std::uint64_t seed, const py::object& out, int threads, const py::object& progress) {
    require_count(n_frequency, "n_frequency");
    const Positions centres = positions_of(positions);
    const auto xyz = real_input<2>(targets, "targets");
    const auto amplitudes = complex_input(reflectivity, "reflectivity");
    const auto reference = real_input<1>(py::module_::import("numpy").attr("atleast_1d")(reference_range), "reference_range");
    const std::ptrdiff_t n_pulse = centres.transmit.view.extent(0);
    require_output_memory(out, n_pulse, n_frequency, "points_frequency");
    const auto data = output<cfloat, 2>(out, {n_pulse, n_frequency});
    sim::PointHistoryModel model;
    model.reference_range = reference.view;
    model.frequency_start = frequency_start;
    model.frequency_spacing = frequency_spacing;
    model.noise_power = noise_power;
    model.seed = seed;
    const sim::PointOptions options{execution(threads, progress)};
    {
        const py::gil_scoped_release release;
        sim::points_frequency(centres.view(), {xyz.view, amplitudes.view}, model, data.view, options);
    }
    return data.owner;
}

void bind_points(py::module_& m) {
    m.def("points", &points, py::arg("positions"), py::arg("targets"), py::arg("reflectivity"), py::kw_only(), py::arg("n_range"),
          py::arg("range_start"), py::arg("range_spacing"), py::arg("wavelength"), py::arg("bandwidth"), py::arg("window") = py::none(),
          py::arg("support") = py::none(), py::arg("noise_power") = 0.0, py::arg("seed") = 0, py::arg("out") = py::none(),
          py::arg("threads") = 0, py::arg("progress") = py::none(),
          R"(Range-compressed echoes of point scatterers, as backproject takes them.

A scatterer at range R contributes reflectivity * exp(-4j pi R / wavelength) times the pulse response centred at R. To simulate a
trajectory error, simulate with the true positions and process with the assumed ones.

Parameters
----------
positions : array_like [n_pulse, 3], or a pair (tx, rx) of such
    Antenna phase centres, m.
targets : array_like [n_target, 3]
    m, in the same frame.
reflectivity : array_like [n_target], complex
n_range : int
    Samples of a pulse.
range_start : float or array_like [n_pulse]
    Range of sample 0, m.
range_spacing : float
    m, at most c / (2 bandwidth).
wavelength : float
    m.
bandwidth : float
    Hz: the pulse response is sin(pi x) / (pi x), x = 2 bandwidth (r - R) / c, or what the window makes of it.
window : str or tuple, optional
    Over the band, as for `signal.window`.
support : float, optional
    Samples farther than this from a scatterer, m, get nothing from it; all do where None.
noise_power : float
    Mean square of complex white Gaussian noise.
seed : int
    Of the noise: the same numbers on every platform.
out : complex64 [n_pulse, n_range], optional
threads : int
    0: all. The result does not depend on it.
progress : callable (phase, done, total), optional
    Return False to stop.

Returns
-------
complex64 [n_pulse, n_range]

Raises
------
ShapeError, ValueError, TypeError, NumericalError, MemoryError)");
    m.def("points_frequency", &points_frequency, py::arg("positions"), py::arg("targets"), py::arg("reflectivity"), py::kw_only(),
          py::arg("n_frequency"), py::arg("frequency_start"), py::arg("frequency_spacing"), py::arg("reference_range"),
          py::arg("noise_power") = 0.0, py::arg("seed") = 0, py::arg("out") = py::none(), py::arg("threads") = 0,
          py::arg("progress") = py::none(), R"(Frequency-domain phase history of point scatterers, as compress_frequency takes it.

Sample [p, m] is the sum of reflectivity * exp(-4j pi f_m (R - reference_range[p]) / c), f_m = frequency_start + m * frequency_spacing.
Error relative to the exact sum: below 5e-7, root mean square.

Parameters
----------
positions : array_like [n_pulse, 3], or a pair (tx, rx) of such
    Antenna phase centres, m.
targets : array_like [n_target, 3]
    m, in the same frame.
reflectivity : array_like [n_target], complex
n_frequency : int
frequency_start, frequency_spacing : float
    Hz.
reference_range : float or array_like [n_pulse]
    m.
noise_power, seed, out, threads, progress
    As for `points`; out is complex64 [n_pulse, n_frequency].

Returns
-------
complex64 [n_pulse, n_frequency]

Raises
------
ShapeError, ValueError, TypeError, NumericalError, MemoryError)");
}

py::array hrws_data(const py::object& positions, const py::object& channels, const py::object& targets, const py::object& reflectivity,
                    std::ptrdiff_t n_range, const py::object& range_start, double range_spacing, double wavelength, double bandwidth,
                    double prf, std::ptrdiff_t transmitter, const std::string& model, const py::object& motion, const py::object& imbalance,
                    std::optional<double> doppler_bandwidth, double doppler_centroid, const py::object& window,
                    std::optional<double> support, double noise_power, std::uint64_t seed, const py::object& out, int threads,
                    const py::object& progress) {
    require_count(n_range, "n_range");
    if (model != "bistatic" && model != "equivalent") throw ValueError("model", R"("bistatic" or "equivalent")", "\"" + model + "\"");
    const auto platform = real_input<2>(positions, "positions");
    const auto antennas = real_input<2>(channels, "channels");
    const auto xyz = real_input<2>(targets, "targets");
    const auto amplitudes = complex_input(reflectivity, "reflectivity");
    const auto start = range_start_of(range_start);
    const auto displacement = motion.is_none() ? Input<double, 2>() : real_input<2>(motion, "motion");
    const auto factors = imbalance.is_none() ? Input<cdouble, 1>() : complex_input(imbalance, "imbalance");
    const std::ptrdiff_t n_pulse = platform.view.extent(0);
    const std::ptrdiff_t n_channel = antennas.view.extent(0);
    require_output_memory(out, n_channel * n_pulse, n_range, "hrws");
    const auto data = output<cfloat, 3>(out, {n_channel, n_pulse, n_range});
    const sim::HrwsRadar radar{platform.view,     antennas.view, transmitter, model == "equivalent",
                               displacement.view, factors.view,  prf,         doppler_bandwidth.value_or(0.0),
                               doppler_centroid};
    sim::PointEchoModel echo;
    echo.range_start = start.view;
    echo.range_spacing = range_spacing;
    echo.wavelength = wavelength;
    echo.bandwidth = bandwidth;
    echo.window = window_of(window);
    echo.support = support.value_or(std::numeric_limits<double>::infinity());
    echo.noise_power = noise_power;
    echo.seed = seed;
    const sim::PointOptions options{execution(threads, progress)};
    {
        const py::gil_scoped_release release;
        sim::hrws(radar, {xyz.view, amplitudes.view}, echo, data.view, options);
    }
    return data.owner;
}

void bind_hrws_data(py::module_& m) {
    m.def("hrws_data", &hrws_data, py::arg("positions"), py::arg("channels"), py::arg("targets"), py::arg("reflectivity"), py::kw_only(),
          py::arg("n_range"), py::arg("range_start"), py::arg("range_spacing"), py::arg("wavelength"), py::arg("bandwidth"), py::arg("prf"),
          py::arg("transmitter") = 0, py::arg("model") = "bistatic", py::arg("motion") = py::none(), py::arg("imbalance") = py::none(),
          py::arg("doppler_bandwidth") = py::none(), py::arg("doppler_centroid") = 0.0, py::arg("window") = py::none(),
          py::arg("support") = py::none(), py::arg("noise_power") = 0.0, py::arg("seed") = 0, py::arg("out") = py::none(),
          py::arg("threads") = 0, py::arg("progress") = py::none(), R"(The samples of `hrws` alone.

Parameters as for `hrws`.

Returns
-------
complex64 [n_channel, n_pulse, n_range])");
}

// targets= of a strip; an empty list stands for none.
Input<double, 2> pixel_input(const py::object& targets) {
    const auto numpy = py::module_::import("numpy");
    const bool none = numpy.attr("size")(targets).cast<std::ptrdiff_t>() == 0;
    return real_input<2>(none ? py::object(numpy.attr("empty")(py::make_tuple(0, 2))) : targets, "targets");
}

struct PhaseErrorInput {
    std::optional<Input<double, 1>> given;
    [[nodiscard]] ArrayView<const double, 1> view() const { return given ? given->view : ArrayView<const double, 1>(); }
};

PhaseErrorInput phase_error_input(const py::object& phase_error, std::ptrdiff_t n_azimuth) {
    if (phase_error.is_none()) return {};
    PhaseErrorInput out{real_input<1>(phase_error, "phase_error")};
    if (out.view().extent(0) != n_azimuth)
        throw ShapeError("phase_error", "(" + std::to_string(n_azimuth) + ",), one for each pulse", shape_text(out.view().extents()));
    return out;
}

py::array stripmap(const geometry::StripmapGeometry& geometry, const py::object& targets, const py::object& reflectivity,
                   std::ptrdiff_t n_azimuth, const std::string& model, double clutter_power, const py::object& phase_error,
                   double noise_power, std::uint64_t seed, const py::object& out, int threads, const py::object& progress) {
    require_count(n_azimuth, "n_azimuth");
    if (model != "band_limited" && model != "chirp") throw ValueError("model", "\"band_limited\" or \"chirp\"", "\"" + model + "\"");
    const auto pixels = pixel_input(targets);
    const auto amplitudes = complex_input(reflectivity, "reflectivity");
    const auto error = phase_error_input(phase_error, n_azimuth);
    const auto n_range = static_cast<std::ptrdiff_t>(geometry.slant_range.size());
    require_output_memory(out, n_azimuth, n_range, "stripmap");
    const auto data = output<cfloat, 2>(out, {n_azimuth, n_range});
    sim::StripmapOptions options;
    options.model = model == "chirp" ? sim::StripmapModel::chirp : sim::StripmapModel::band_limited;
    options.clutter_power = clutter_power;
    options.effects = {error.view(), noise_power, seed};
    options.execution = execution(threads, progress);
    {
        const py::gil_scoped_release release;
        sim::stripmap(geometry, {pixels.view, amplitudes.view}, data.view, options);
    }
    return data.owner;
}

py::array stripmap_echo(const geometry::StripmapGeometry& geometry, const py::object& targets, const py::object& reflectivity,
                        std::ptrdiff_t n_azimuth, double range_bandwidth, const py::object& window, const py::object& phase_error,
                        double noise_power, std::uint64_t seed, const py::object& out, int threads, const py::object& progress) {
    require_count(n_azimuth, "n_azimuth");
    const auto pixels = pixel_input(targets);
    const auto amplitudes = complex_input(reflectivity, "reflectivity");
    const auto error = phase_error_input(phase_error, n_azimuth);
    const auto n_range = static_cast<std::ptrdiff_t>(geometry.slant_range.size());
    require_output_memory(out, n_azimuth, n_range, "stripmap_echo");
    const auto data = output<cfloat, 2>(out, {n_azimuth, n_range});
    sim::StripmapEchoOptions options;
    options.range_bandwidth = range_bandwidth;
    options.window = window_of(window);
    options.effects = {error.view(), noise_power, seed};
    options.execution = execution(threads, progress);
    {
        const py::gil_scoped_release release;
        sim::stripmap_echo(geometry, {pixels.view, amplitudes.view}, data.view, options);
    }
    return data.owner;
}

py::array motion_error(std::ptrdiff_t n_pulse, double prf, double drift, double acceleration, double random_rms, double random_bandwidth,
                       const std::vector<std::pair<double, double>>& vibrations, std::uint64_t seed, std::optional<std::uint32_t> axes) {
    require_count(n_pulse, "n_pulse");
    if (axes && *axes < 1) throw ValueError("axes", "None or a number of axes > 0", std::to_string(*axes));
    sim::MotionModel model;
    model.sampling_rate = prf;
    model.drift = drift;
    model.acceleration = acceleration;
    model.random_rms = random_rms;
    model.random_bandwidth = random_bandwidth;
    model.seed = seed;
    for (const auto& [amplitude, frequency] : vibrations) model.vibrations.push_back({amplitude, frequency});
    const auto count = static_cast<std::ptrdiff_t>(axes.value_or(1));
    require_memory(sizeof(double) * static_cast<std::uint64_t>(n_pulse) * static_cast<std::uint64_t>(count), "motion_error");
    Array<double, 2> error({n_pulse, count});
    {
        const py::gil_scoped_release release;
        for (std::ptrdiff_t axis = 0; axis < count; ++axis)
            sim::motion_error(error.view().column(axis), model, static_cast<std::uint32_t>(axis));
    }
    const py::array made = to_numpy(std::move(error));
    return axes ? made : made.attr("reshape")(n_pulse).cast<py::array>();
}

void bind_stripmap(py::module_& m) {
    m.def("stripmap", &stripmap, py::arg("geometry"), py::arg("targets"), py::arg("reflectivity"), py::kw_only(), py::arg("n_azimuth"),
          py::arg("model") = "band_limited", py::arg("clutter_power") = 0.0, py::arg("phase_error") = py::none(),
          py::arg("noise_power") = 0.0, py::arg("seed") = 0, py::arg("out") = py::none(), py::arg("threads") = 0,
          py::arg("progress") = py::none(),
          R"(A range-compressed, migration-corrected azimuth strip, as azimuth_compress takes it.

Parameters
----------
geometry : StripmapGeometry
    With one slant_range for each range gate.
targets : array_like [n_target, 2]
    Azimuth sample (fractions allowed) and range gate (a whole number) of each target; may be empty.
reflectivity : array_like [n_target], complex
    The value of the compressed image at the peak of the target.
n_azimuth : int
    Pulses.
model : {"band_limited", "chirp"}
    band_limited: a flat spectrum over the Doppler bandwidth with the quadratic phase, which compresses to the exact periodic sinc; the
    strip is periodic. chirp: exp(-1j pi K (t - t0)**2) about the Doppler centroid, cut off at the ends of the aperture.
clutter_power : float
    Mean square of Gaussian clutter, band-limited to the Doppler bandwidth, in a pixel of the compressed image.
phase_error : array_like [n_azimuth], optional
    rad; the strip is multiplied by exp(+1j phase_error).
noise_power : float
    Mean square of complex white Gaussian noise in a sample of the strip.
seed : int
    Of clutter and noise: the same numbers on every platform.
out : complex64 [n_azimuth, n_range], optional
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
    m.def("stripmap_echo", &stripmap_echo, py::arg("geometry"), py::arg("targets"), py::arg("reflectivity"), py::kw_only(),
          py::arg("n_azimuth"), py::arg("range_bandwidth"), py::arg("window") = py::none(), py::arg("phase_error") = py::none(),
          py::arg("noise_power") = 0.0, py::arg("seed") = 0, py::arg("out") = py::none(), py::arg("threads") = 0,
          py::arg("progress") = py::none(),
          R"(The range-compressed echo of a strip with its range migration.

A target closest at range R0 at azimuth time t0 has the range R(t) = sqrt(R0**2 + v**2 (t - t0)**2) and contributes
reflectivity * exp(-4j pi R(t) / wavelength) times the pulse response centred at R(t) while its Doppler frequency is within half the Doppler
bandwidth of the centroid. Not periodic.

Parameters
----------
geometry : StripmapGeometry
    Its slant ranges evenly spaced, ascending.
targets : array_like [n_target, 2]
    Azimuth sample and range gate of closest approach, fractions allowed; may be empty.
reflectivity : array_like [n_target], complex
    Of every echo.
n_azimuth : int
    Pulses.
range_bandwidth : float
    Hz, at most c / (2 spacing of the slant ranges).
window : str or tuple, optional
    Over the range band, as for `signal.window`.
phase_error, noise_power, seed, out, threads, progress
    As for `stripmap`.

Returns
-------
complex64 [n_azimuth, n_range]

Raises
------
ShapeError, ValueError, TypeError, NumericalError, MemoryError)");
    m.def("motion_error", &motion_error, py::arg("n_pulse"), py::kw_only(), py::arg("prf"), py::arg("drift") = 0.0,
          py::arg("acceleration") = 0.0, py::arg("random_rms") = 0.0, py::arg("random_bandwidth") = 1.0,
          py::arg("vibrations") = std::vector<std::pair<double, double>>(), py::arg("seed") = 0, py::arg("axes") = py::none(),
          R"(A motion or phase error: drift, slow random part and lines of vibration.

drift t + acceleration t**2 / 2 + Gaussian part of frequencies up to random_bandwidth + sum of amplitude cos(2 pi frequency t + drawn
phase), t = (i - (n_pulse - 1) / 2) / prf. A displacement d of the antenna away from the scene is the phase error -4 pi d / wavelength.

Parameters
----------
n_pulse : int
prf : float
    Hz.
drift, acceleration : float
    Per s and s**2, in the unit of the error (m, or rad for a phase).
random_rms : float
    Root mean square of the random part over many seeds.
random_bandwidth : float
    Hz, at most prf / 2; its spectrum is flat from zero to there.
vibrations : sequence of (amplitude, frequency)
    Frequency in Hz.
seed : int
    The same random numbers on every platform.
axes : int, optional
    Number of axes, their random parts and phases independent of each other.

Returns
-------
float64 [n_pulse], or [n_pulse, axes] where `axes` is given

Raises
------
ValueError, TypeError, MemoryError)");
}

}  // namespace

void bind_sim(py::module_ m) {
    bind_points(m);
    bind_hrws_data(m);
    bind_stripmap(m);
}

}  // namespace sarfocus::python
