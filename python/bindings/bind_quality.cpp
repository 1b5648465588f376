#include <array>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include <pybind11/stl.h>

#include <sarfocus/geometry/stripmap_geometry.hpp>
#include <sarfocus/quality/ambiguity.hpp>
#include <sarfocus/quality/image_measures.hpp>
#include <sarfocus/quality/point_response.hpp>

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

/// A tuple holds one value for azimuth and one for range, anything else serves both.
std::pair<py::object, py::object> per_axis(const py::object& value, const char* argument) {
    if (!py::isinstance<py::tuple>(value)) return {value, value};
    const auto pair = py::reinterpret_borrow<py::tuple>(value);
    if (pair.size() != 2) throw ValueError(argument, "one value, or a tuple (azimuth, range)", "a tuple of " + std::to_string(pair.size()));
    return {pair[0], pair[1]};
}

double number_or(const py::object& value, double if_none, const char* argument) {
    if (value.is_none()) return if_none;
    try {
        return value.cast<double>();
    } catch (const py::cast_error&) {
        throw py::type_error(std::string(argument) + ": expected a number or None, got " +
                             py::str(py::type::of(value).attr("__name__")).cast<std::string>());
    }
}

void set_axis(quality::AxisOptions& axis, const py::object& oversampling, const py::object& window, const py::object& band_centre) {
    axis.oversampling = number_or(oversampling, axis.oversampling, "oversampling");
    axis.band_centre = number_or(band_centre, axis.band_centre, "band_centre");
    if (window.is_none()) return;
    const auto weights = real_input<1>(window, "window");
    if (weights.view.empty()) throw ShapeError("window", "at least one weight", "none");
    for (std::ptrdiff_t i = 0; i < weights.view.extent(0); ++i) axis.window.push_back(weights.view(i));
}

quality::PointResponse point_response(const py::object& image, std::array<double, 2> position, std::ptrdiff_t upsample,
                                      std::ptrdiff_t search, std::ptrdiff_t lobes, std::ptrdiff_t chip, double irw_tolerance,
                                      double sidelobe_tolerance, const py::object& oversampling, const py::object& window,
                                      const py::object& band_centre) {
    const auto in = input<cfloat, 2>(image, "image");
    quality::PointResponseOptions options;
    options.upsample = upsample;
    options.search = search;
    options.lobes = lobes;
    options.chip = chip;
    options.irw_tolerance = irw_tolerance;
    options.sidelobe_tolerance = sidelobe_tolerance;
    const auto cells = per_axis(oversampling, "oversampling");
    const auto tapers = per_axis(window, "window");
    const auto centres = per_axis(band_centre, "band_centre");
    set_axis(options.azimuth, cells.first, tapers.first, centres.first);
    set_axis(options.range, cells.second, tapers.second, centres.second);
    const py::gil_scoped_release release;
    return quality::point_response(in.view, position, options);
}

py::array_t<double> cut_position(const quality::AxisResponse& axis) {
    std::vector<double> out(axis.cut.size());
    for (std::size_t i = 0; i < out.size(); ++i) out[i] = axis.cut_start + static_cast<double>(i) * axis.cut_step;
    return to_numpy(out);
}

std::string axis_repr(const quality::AxisResponse& axis) {
    return "AxisResponse(position=" + number_text(axis.position) + ", irw=" + number_text(axis.irw) +
           ", pslr_db=" + number_text(axis.pslr_db) + ", islr_db=" + number_text(axis.islr_db) + ", verdict='" +
           verdict_text(axis.verdict) + "')";
}

void bind_point_response(py::module_& m) {
    using quality::AxisResponse;
    using quality::PointResponse;
    py::class_<AxisResponse>(m, "AxisResponse", "Response to a point target along one axis of the image, through its peak.")
        .def_readonly("position", &AxisResponse::position, "Of the peak, pixels.")
        .def_readonly("irw", &AxisResponse::irw, "-3 dB width, pixels.")
        .def_readonly("irw_cells", &AxisResponse::irw_cells, "-3 dB width, resolution cells; nan where the oversampling was not given.")
        .def_readonly("pslr_db", &AxisResponse::pslr_db, "Highest side lobe over the peak.")
        .def_readonly("pslr_left_db", &AxisResponse::pslr_left_db, "Highest side lobe before the peak.")
        .def_readonly("pslr_right_db", &AxisResponse::pslr_right_db, "Highest side lobe behind the peak.")
        .def_readonly("islr_db", &AxisResponse::islr_db, "Energy of the side lobes over energy of the main lobe, null to null.")
        .def_property_readonly(
            "nulls", [](const AxisResponse& a) { return py::make_tuple(a.nulls[0], a.nulls[1]); },
            "Distance of the first null before and behind the peak, pixels.")
        .def_property_readonly(
            "extent", [](const AxisResponse& a) { return py::make_tuple(a.extent[0], a.extent[1]); },
            "How far out the side lobes were measured before and behind the peak, pixels.")
        .def_readonly("theory_irw_cells", &AxisResponse::theory_irw_cells, "Of the stated window, resolution cells.")
        .def_readonly("theory_pslr_db", &AxisResponse::theory_pslr_db, "Of the stated window over the same extent.")
        .def_readonly("theory_islr_db", &AxisResponse::theory_islr_db, "Of the stated window over the same extent.")
        .def_property_readonly(
            "verdict", [](const AxisResponse& a) { return verdict_text(a.verdict); },
            "clipped_by_edge, broadened, asymmetric, high_sidelobes or good: the first that applies.")
        .def_property_readonly(
            "cut", [](const AxisResponse& a) { return to_numpy(a.cut); }, "Amplitude over the peak's, float64 [n].")
        .def_property_readonly("cut_position", &cut_position, "Where the samples of the cut lie, pixels of the image, float64 [n].")
        .def("__repr__", &axis_repr);
    py::class_<PointResponse>(m, "PointResponse", "Response of an image to a point target.")
        .def_property_readonly(
            "position", [](const PointResponse& p) { return py::make_tuple(p.azimuth.position, p.range.position); },
            "Of the peak, (azimuth, range), pixels.")
        .def_readonly("amplitude", &PointResponse::amplitude, "Of the interpolated peak.")
        .def_readonly("phase", &PointResponse::phase, "Of the interpolated peak, rad.")
        .def_readonly("azimuth", &PointResponse::azimuth)
        .def_readonly("range", &PointResponse::range)
        .def_property_readonly(
            "verdict", [](const PointResponse& p) { return verdict_text(p.verdict); },
            "The first of the two axes' verdicts in the order clipped_by_edge, broadened, asymmetric, high_sidelobes, good.")
        .def("__repr__", [](const PointResponse& p) {
            return "PointResponse(verdict='" + std::string(verdict_text(p.verdict)) + "', azimuth=" + axis_repr(p.azimuth) +
                   ", range=" + axis_repr(p.range) + ")";
        });
    const quality::PointResponseOptions defaults;
    m.def("point_response", &point_response, py::arg("image"), py::arg("position"), py::kw_only(), py::arg("upsample") = defaults.upsample,
          py::arg("search") = defaults.search, py::arg("lobes") = defaults.lobes, py::arg("chip") = defaults.chip,
          py::arg("irw_tolerance") = defaults.irw_tolerance, py::arg("sidelobe_tolerance") = defaults.sidelobe_tolerance,
          py::arg("oversampling") = py::none(), py::arg("window") = py::none(), py::arg("band_centre") = py::none(),
          R"(Position, width and side lobes of a point target, beside what theory says.

The chip about the target is interpolated by FFT; PSLR and ISLR count the side lobes from the first null (the first minimum on either
side) over `lobes` resolution cells beyond the theoretical one. A tuple for oversampling, window or band_centre means (azimuth, range),
anything else serves both axes.

Parameters
----------
image : complex64 [n_azimuth, n_range]
    Any strides, at least 8 pixels along each axis.
position : (float, float)
    Azimuth and range of the target, pixels.
upsample : int
    Points of the cuts per pixel, 8 to 1024.
search : int
    The target is the strongest local maximum within so many pixels of `position`.
lobes : int
    Side lobes each side that count.
chip : int
    Largest extent of the chip, pixels. Make it smaller where the Doppler centroid drifts along the image.
irw_tolerance : float
    Relative excess of the width that makes a response "broadened".
sidelobe_tolerance : float
    Excess of PSLR or ISLR in dB that makes it "asymmetric" or "high_sidelobes".
oversampling : float or tuple, optional
    Samples per resolution cell, sampling rate / bandwidth. Without it the cell comes from the nulls and broadening goes unseen.
window : array_like or tuple, optional
    Amplitude taper of the processed band, sampled in the middle of equal parts of it; None: unweighted.
band_centre : float or tuple, optional
    Centre of the band, cycles per sample (Doppler centroid / prf); None: from the gap of the spectrum.

Returns
-------
PointResponse

Raises
------
ValueError, ShapeError
    An option, or a position outside the image.
NumericalError
    NaN or infinity in the chip, zeros or no local maximum at the position, no null beside the peak.)");
}

/// Offsets in samples: those given, or the first ambiguities on both sides for the target's range gate.
std::vector<double> ambiguity_offsets(const py::object& offsets, const geometry::StripmapGeometry* geometry, double range) {
    if (offsets.is_none() == (geometry == nullptr)) throw ValueError("offsets", "either offsets or a geometry", geometry ? "both" : "none");
    if (geometry != nullptr) {
        const auto gate = static_cast<std::ptrdiff_t>(std::lround(range));
        if (gate < 0 || gate >= static_cast<std::ptrdiff_t>(geometry->slant_range.size()))
            throw ValueError("position", "a range gate of the geometry", number_text(range));
        const double first = quality::azimuth_ambiguity_offset(geometry->prf, geometry->wavelength, geometry->velocity,
                                                               geometry->slant_range[static_cast<std::size_t>(gate)]);
        return {-first, first};
    }
    const auto listed = real_input<1>(py::module_::import("numpy").attr("atleast_1d")(offsets), "offsets");
    std::vector<double> out;
    for (std::ptrdiff_t i = 0; i < listed.view.extent(0); ++i) out.push_back(listed.view(i));
    return out;
}

py::tuple azimuth_ambiguity_ratio(const py::object& image, std::array<double, 2> position, const py::object& offsets,
                                  const geometry::StripmapGeometry* geometry, const std::string& measure,
                                  std::array<std::ptrdiff_t, 2> half_width) {
    const auto in = input<cfloat, 2>(image, "image");
    if (!std::isfinite(position[1])) throw ValueError("position", "finite numbers", number_text(position[1]));
    const std::vector<double> places = ambiguity_offsets(offsets, geometry, position[1]);
    quality::AmbiguityOptions options;
    options.half_width = half_width;
    if (measure == "energy")
        options.measure = quality::AmbiguityMeasure::energy;
    else if (measure != "peak")
        throw ValueError("measure", "'peak' or 'energy'", "'" + measure + "'");
    const auto found = quality::azimuth_ambiguity_ratio(in.view, position, places, options);
    return py::make_tuple(found.highest_db, to_numpy(found.ratio_db));
}

void bind_ambiguity(py::module_& m) {
    m.def("azimuth_ambiguity_offset", &quality::azimuth_ambiguity_offset, py::kw_only(), py::arg("prf"), py::arg("wavelength"),
          py::arg("velocity"), py::arg("slant_range"), R"(Azimuth samples between a target and its first azimuth ambiguity.

Parameters
----------
prf, wavelength, velocity, slant_range : float
    Hz, m, m/s, m.

Returns
-------
float
    prf * wavelength * slant_range / (2 velocity) metres, in samples of velocity / prf metres.

Raises
------
ValueError
    An argument that is not finite and positive.)");
    m.def("azimuth_ambiguity_ratio", &azimuth_ambiguity_ratio, py::arg("image"), py::arg("position"), py::arg("offsets") = py::none(),
          py::kw_only(), py::arg("geometry") = py::none(), py::arg("measure") = "peak", py::arg("half_width") = py::make_tuple(8, 8),
          R"(Strength of the azimuth ambiguities of a target, relative to the target.

Parameters
----------
image : complex64 [n_azimuth, n_range]
    Any strides.
position : (float, float)
    Azimuth and range of the target, pixels.
offsets : array_like [n], optional
    Azimuth samples from the target to its ambiguities, either sign.
geometry : StripmapGeometry, optional
    Instead of offsets: the first ambiguity on either side.
measure : str
    "peak", the strongest pixel of each box, or "energy", its sum of the intensity.
half_width : (int, int)
    How far the boxes about the target and its ambiguities reach, pixels.

Returns
-------
highest_db : float
ratio_db : float64 [n]
    Of every ambiguity; nan where its box does not lie inside the image.

Raises
------
ValueError
    Options; the target or all ambiguities outside the image; boxes that overlap.
NumericalError
    NaN or infinity in a box, a target of zeros.)");
}

}  // namespace

void bind_quality(py::module_ m) {
    bind_ambiguity(m);
    bind_measures(m);
    bind_point_response(m);
}

}  // namespace sarfocus::python
