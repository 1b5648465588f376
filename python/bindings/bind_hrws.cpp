#include <memory>
#include <optional>
#include <string>
#include <utility>

#include <pybind11/stl.h>

#include <sarfocus/core/error.hpp>
#include <sarfocus/hrws/reconstruct.hpp>

#include "bindings.hpp"
#include "convert.hpp"
#include "hrws_arguments.hpp"
#include "radar_arguments.hpp"

namespace py = pybind11;

namespace sarfocus::python {
namespace {

using hrws::ChannelWeights;
using hrws::Sampling;

std::unique_ptr<PythonEcho> make_echo(const py::object& data, const py::object& phase_centres, const py::object& range_start,
                                      double range_spacing, double wavelength, double prf, double velocity, const py::object& baselines) {
    auto echo = std::make_unique<PythonEcho>();
    echo->data = input<cfloat, 3>(data, "data");
    echo->phase_centres = real_input<3>(phase_centres, "phase_centres");
    echo->range_start = range_start_of(range_start);
    if (!baselines.is_none()) echo->baselines = real_input<2>(baselines, "baselines");
    echo->range_spacing = range_spacing;
    echo->wavelength = wavelength;
    echo->prf = prf;
    echo->velocity = velocity;
    const hrws::Echo view = echo->view();
    {
        const py::gil_scoped_release release;
        view.validate();
    }
    return echo;
}

py::array reconstruct(const PythonEcho& echo, const geometry::ImageGrid& grid, const py::object& motion, const std::string& reconstruction,
                      const std::string& interpolation, double doppler_bandwidth, double doppler_centroid, std::optional<double> margin,
                      double noise, double condition_limit, std::ptrdiff_t half_width, const py::object& out, int threads,
                      const py::object& progress) {
    const auto displacement = motion_of(motion);
    hrws::ReconstructOptions options;
    options.reconstruction = reconstruction_of(reconstruction);
    options.band = band_of(interpolation, doppler_bandwidth, doppler_centroid, margin, noise, condition_limit);
    options.half_width = half_width;
    options.execution = execution(threads, progress);
    const auto image = output<cfloat, 2>(out, grid.shape(), &echo.data.owner);
    const hrws::Echo view = echo.view();
    {
        const py::gil_scoped_release release;
        hrws::reconstruct(view, grid, displacement.view, image.view, options);
    }
    return image.owner;
}

ChannelWeights channel_weights(const PythonEcho& echo, const std::string& interpolation, double doppler_bandwidth, double doppler_centroid,
                               std::optional<double> margin, double noise, double condition_limit) {
    const auto band = band_of(interpolation, doppler_bandwidth, doppler_centroid, margin, noise, condition_limit);
    const hrws::Echo view = echo.view();
    const py::gil_scoped_release release;
    return hrws::channel_weights(hrws::sampling(view).offsets, view.prf, view.velocity, band);
}

py::array frequency_of(const ChannelWeights& found) {
    std::vector<double> out;
    for (std::ptrdiff_t i = 0; i < found.weights.extent(0); ++i)
        out.push_back(found.frequency_start + (static_cast<double>(i) + 0.5) * found.frequency_step);
    return to_numpy(out);
}

void bind_echo(py::module_& m) {
    py::class_<PythonEcho>(m, "Echo", R"(Range-compressed echoes of a radar with several receiving channels along the track.

Parameters
----------
data : complex64 [n_channel, n_pulse, n_range]
    Carrier phase kept: a scatterer at range R contributes exp(-4j pi R / wavelength) times the pulse response centred at R. Any strides; not
    copied.
phase_centres : array_like [n_channel, n_pulse, 3]
    m, equivalent phase centres as measured: midway between transmitter and receiver.
range_start : float or array_like [n_pulse]
    m, range of sample 0.
range_spacing : float
    m.
wavelength : float
    m.
prf : float
    Hz, of the transmitted pulses.
velocity : float
    m/s, of the phase centres along the track; they must move at it to 2 %.
baselines : array_like [n_channel, 3], optional
    m, from transmitter to receiver. With them ranges are those of the two legs; without them those of the phase centres, which are too short
    by baseline**2 / (8 R).

Raises
------
ShapeError, ValueError, TypeError, NumericalError
    ValueError also for a channel of zeros: a missing channel is left out of data and phase_centres.)")
        .def(py::init(&make_echo), py::arg("data"), py::arg("phase_centres"), py::arg("range_start"), py::arg("range_spacing"),
             py::arg("wavelength"), py::arg("prf"), py::arg("velocity"), py::arg("baselines") = py::none())
        .def_property_readonly("data", [](const PythonEcho& e) { return e.data.owner; })
        .def_property_readonly("phase_centres", [](const PythonEcho& e) { return e.phase_centres.owner; })
        .def_property_readonly("range_start", [](const PythonEcho& e) { return e.range_start.owner; })
        .def_readonly("range_spacing", &PythonEcho::range_spacing)
        .def_readonly("wavelength", &PythonEcho::wavelength)
        .def_readonly("prf", &PythonEcho::prf)
        .def_readonly("velocity", &PythonEcho::velocity)
        .def_property_readonly("baselines", [](const PythonEcho& e) {
            return e.baselines.view.empty() ? py::object(py::none()) : py::object(e.baselines.owner);
        });
}

void bind_sampling(py::module_& m) {
    py::class_<Sampling>(m, "Sampling", "Where along the track the channels sample: the straight line through the phase centres.")
        .def_property_readonly(
            "origin", [](const Sampling& s) { return s.origin; }, "m, of the channels' mean at pulse 0, on the line")
        .def_property_readonly(
            "direction", [](const Sampling& s) { return s.direction; }, "unit vector of flight")
        .def_readonly("step", &Sampling::step, "m, velocity / prf")
        .def_property_readonly(
            "offsets", [](const Sampling& s) { return to_numpy(s.offsets); },
            "float64 [n_channel], m, of each channel along the track from their mean, mean over pulses")
        .def_readonly("offset_spread", &Sampling::offset_spread, "m, largest deviation of a pulse from the offsets");
    m.def(
        "sampling", [](const PythonEcho& echo) { return hrws::sampling(echo.view()); }, py::arg("echo"),
        R"(Where along the track the channels of an echo sample.

Parameters
----------
echo : Echo

Returns
-------
Sampling)");
}

void bind_weights(py::module_& m) {
    py::class_<ChannelWeights>(m, "ChannelWeights", "Weights of the channels over the local Doppler frequency.")
        .def_property_readonly("frequency", &frequency_of, "float64 [n_frequency], Hz, middle of every entry")
        .def_property_readonly(
            "weights", [](const ChannelWeights& w) { return to_numpy(w.weights.copy()); }, "complex128 [n_frequency, n_channel]")
        .def_readonly("condition_number", &ChannelWeights::condition_number, "the largest of the band equations")
        .def_readonly("noise_amplification", &ChannelWeights::noise_amplification,
                      "power of white noise in the image over that with evenly spaced channels, mean over the band");
    m.def("channel_weights", &channel_weights, py::arg("echo"), py::kw_only(), py::arg("interpolation") = "mmse",
          py::arg("doppler_bandwidth") = 0.0, py::arg("doppler_centroid") = 0.0, py::arg("margin") = py::none(), py::arg("noise") = 1e-3,
          py::arg("condition_limit") = 1e3, R"(The weights of `reconstruct` and how well conditioned they are.

Parameters
----------
echo : Echo
interpolation, doppler_bandwidth, doppler_centroid, margin, noise, condition_limit
    As for `reconstruct`.

Returns
-------
ChannelWeights

Raises
------
ValueError, NumericalError)");
}

void bind_reconstruct(py::module_& m) {
    m.def("reconstruct", &reconstruct, py::arg("echo"), py::arg("grid"), py::arg("motion") = py::none(), py::kw_only(),
          py::arg("reconstruction") = "folded", py::arg("interpolation") = "mmse", py::arg("doppler_bandwidth") = 0.0,
          py::arg("doppler_centroid") = 0.0, py::arg("margin") = py::none(), py::arg("noise") = 1e-3, py::arg("condition_limit") = 1e3,
          py::arg("half_width") = 8, py::arg("out") = py::none(), py::arg("threads") = 0, py::arg("progress") = py::none(),
          R"(Image without azimuth ambiguities from channels whose pulse rate alone is too low for their Doppler bandwidth.

Parameters
----------
echo : Echo
grid : ImageGrid
    Where the pixels lie.
motion : array_like [n_pulse, 3], optional
    m, added to the phase centres of every channel.
reconstruction : {"folded", "sub_image"}
    folded: backprojection of every channel, its terms weighted by the local Doppler frequency of pixel and pulse. sub_image: the sub-images
    of Zhou et al. 2022 term by term, some fifty to a hundred times as slow.
interpolation : {"mmse", "yen"}
    mmse: weights of least mean square error in white noise, for a spectrum flat over that band. yen: generalised sampling, exact
    for any signal within n_channel * prf but of more noise, and cut off at `half_width` as sub_image.
doppler_bandwidth : float
    Hz, of the signal, at most n_channel * prf; 0: that. State it: the narrower the band, the fewer the ambiguities to suppress.
doppler_centroid : float
    Hz.
margin : float, optional
    Hz beyond either end of the bandwidth, over which the image is processed too and ambiguities are suppressed less and less, so that the
    weights change smoothly; better twice the square root of the Doppler rate 2 velocity**2 / (wavelength R) or more. None: 10 % of the
    bandwidth, or what is left of n_channel * prf.
noise : float
    mmse: power of the noise over that of the signal, in a band of one prf.
condition_limit : float
    Refuse band equations of a condition number above it.
half_width : int
    sub_image: pulses on either side that an evenly spaced sample is made of.
out : complex64 [grid.shape], optional
    Where the image goes; any strides.
threads : int
    0: all. The result does not depend on it.
progress : callable (phase, done, total), optional
    Return False to stop.

Returns
-------
complex64 [n_azimuth, n_range]
    For evenly spaced channels that of `backproject`, summed over the channels, within the Doppler bandwidth.

Raises
------
ShapeError, ValueError, TypeError, NumericalError, MemoryError
    NumericalError where channels sample the same places along the track: `channel_weights` tells the condition number.)");
}

}  // namespace

void bind_hrws(py::module_ m) {
    bind_echo(m);
    bind_sampling(m);
    bind_weights(m);
    bind_reconstruct(m);
}

}  // namespace sarfocus::python
