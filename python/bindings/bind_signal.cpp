#include <array>
#include <cstddef>
#include <string>
#include <utility>

#include <pybind11/stl.h>

#include <sarfocus/signal/analytic.hpp>
#include <sarfocus/signal/chirp.hpp>
#include <sarfocus/signal/interpolation.hpp>
#include <sarfocus/signal/window.hpp>

#include "bindings.hpp"
#include "convert.hpp"
#include "window_argument.hpp"

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

py::array_t<double> window(const py::object& name, std::ptrdiff_t n, const std::string& form) {
    if (form != "symmetric" && form != "periodic") throw ValueError("form", "\"symmetric\" or \"periodic\"", "\"" + form + "\"");
    return to_numpy(
        signal::window_samples(window_of(name), n, form == "periodic" ? signal::WindowForm::periodic : signal::WindowForm::symmetric));
}

py::array_t<cfloat> chirp(double bandwidth, double duration, double sampling_rate, const std::string& direction) {
    if (direction != "up" && direction != "down") throw ValueError("direction", "\"up\" or \"down\"", "\"" + direction + "\"");
    const auto sweep = direction == "up" ? signal::ChirpDirection::up : signal::ChirpDirection::down;
    return to_numpy(signal::Chirp{bandwidth, duration, sampling_rate, sweep}.samples());
}

py::array analytic_signal(const py::object& samples, const py::object& out, int threads, const py::object& progress) {
    const auto real = real_input<2>(samples, "samples");
    const auto result = output<cfloat, 2>(out, real.view.extents(), &real.owner);
    const signal::AnalyticOptions options{execution(threads, progress)};
    {
        const py::gil_scoped_release release;
        signal::analytic_signal(real.view, result.view, options);
    }
    return result.owner;
}

py::array demodulate(const py::object& samples, double range_start, double range_spacing, double wavelength, const py::object& out,
                     int threads, const py::object& progress) {
    const auto real = real_input<2>(samples, "samples");
    const auto result = output<cfloat, 2>(out, real.view.extents(), &real.owner);
    const signal::AnalyticOptions options{execution(threads, progress)};
    {
        const py::gil_scoped_release release;
        signal::demodulate(real.view, range_start, range_spacing, wavelength, result.view, options);
    }
    return result.owner;
}

void bind_analytic(py::module_& m) {
    m.def("analytic_signal", &analytic_signal, py::arg("samples"), py::kw_only(), py::arg("out") = py::none(), py::arg("threads") = 0,
          py::arg("progress") = py::none(), R"(Analytic signal of real-valued fast-time samples: only the positive frequencies, doubled.

Parameters
----------
samples : array_like [n_pulse, n_fast_time], real
out : complex64 [n_pulse, n_fast_time], optional
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
    m.def("demodulate", &demodulate, py::arg("samples"), py::kw_only(), py::arg("range_start"), py::arg("range_spacing"),
          py::arg("wavelength"), py::arg("out") = py::none(), py::arg("threads") = 0, py::arg("progress") = py::none(),
          R"(Baseband echoes of a radar that samples its impulse without a carrier, the carrier phase kept.

analytic_signal(samples) * exp(-4j pi r / wavelength), r = range_start + i * range_spacing: a scatterer at R becomes
exp(-4j pi R / wavelength) times the pulse response centred at R, as backproject takes it. Subtract what is the same in all pulses
(direct coupling) beforehand.

Parameters
----------
samples : array_like [n_pulse, n_fast_time], real
range_start, range_spacing : float
    m.
wavelength : float
    m, of the middle of the band.
out, threads, progress
    As for `analytic_signal`.

Returns
-------
complex64 [n_pulse, n_fast_time]

Raises
------
ShapeError, ValueError, TypeError, NumericalError)");
}

}  // namespace

void bind_signal(py::module_ m) {
    bind_analytic(m);
    m.def("window", &window, py::arg("name"), py::arg("n"), py::kw_only(), py::arg("form") = "symmetric",
          R"(Weights of a window, 1 in the middle.

Parameters
----------
name : str or tuple or None
    "rectangular" (or None), "hann", "hamming", ("taylor", nbar, sidelobe level in dB > 0), ("kaiser", beta); "taylor" alone is
    ("taylor", 4, 35.0), "kaiser" alone ("kaiser", 6.0).
n : int
    Samples.
form : {"symmetric", "periodic"}
    periodic: the first n weights of the symmetric window of n + 1.

Returns
-------
float64 [n]

Raises
------
ValueError, TypeError)");
    m.def("chirp", &chirp, py::kw_only(), py::arg("bandwidth"), py::arg("duration"), py::arg("sampling_rate"), py::arg("direction") = "up",
          R"(Samples of a linear FM pulse of constant amplitude, complex baseband.

exp(+-1j pi bandwidth / duration t**2), + for "up"; the middle of the pulse, t = 0, is at index (n - 1) / 2.

Parameters
----------
bandwidth : float
    Hz, at most the sampling rate.
duration : float
    s.
sampling_rate : float
    Hz.
direction : {"up", "down"}

Returns
-------
complex64 [duration * sampling_rate, rounded]

Raises
------
ValueError, MemoryError)");
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
