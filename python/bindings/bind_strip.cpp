#include <array>
#include <string>
#include <utility>
#include <vector>

#include <pybind11/stl.h>

#include <sarfocus/autofocus/spga.hpp>
#include <sarfocus/autofocus/strip.hpp>
#include <sarfocus/focus/azimuth.hpp>

#include "bindings.hpp"
#include "convert.hpp"
#include "python_result.hpp"

namespace py = pybind11;

namespace sarfocus::python {
namespace {

using autofocus::Apertures;
using autofocus::Seam;
using autofocus::Stitching;
using autofocus::StripPhase;
using autofocus::StripPoint;
using geometry::StripmapGeometry;

template <class Choice>
Choice choice(const std::string& name, const char* argument, const std::vector<std::pair<const char*, Choice>>& choices) {
    std::string expected;
    for (const auto& [text, value] : choices) {
        if (name == text) return value;
        expected += (expected.empty() ? "\"" : " or \"") + std::string(text) + "\"";
    }
    throw ValueError(argument, expected, "\"" + name + "\"");
}

detect::CfarMethod cfar_method(const std::string& name) {
    return choice<detect::CfarMethod>(name, "cfar",
                                      {{"cell_averaging", detect::CfarMethod::cell_averaging},
                                       {"greatest_of", detect::CfarMethod::greatest_of},
                                       {"ordered_statistic", detect::CfarMethod::ordered_statistic}});
}

template <class T>
std::vector<T> list_of(const py::object& array, const char* argument) {
    const auto in = input<T, 1>(array, argument);
    std::vector<T> out;
    for (std::ptrdiff_t i = 0; i < in.view.extent(0); ++i) out.push_back(in.view(i));
    return out;
}

autofocus::StripSelectOptions select_options(int points, const std::string& cfar, double false_alarm_probability, double maximum_contrast,
                                             int window) {
    autofocus::StripSelectOptions out;
    out.points = points;
    out.cfar.method = cfar_method(cfar);
    out.cfar.false_alarm_probability = false_alarm_probability;
    out.maximum_contrast = maximum_contrast;
    out.window = window;
    return out;
}

py::array_t<StripPoint> select_points(const py::object& image, const StripmapGeometry& geometry, int points, const std::string& cfar,
                                      double false_alarm_probability, double maximum_contrast, int window, int threads,
                                      const py::object& progress) {
    const auto in = input<cfloat, 2>(image, "image");
    autofocus::StripSelectOptions options = select_options(points, cfar, false_alarm_probability, maximum_contrast, window);
    options.execution = execution(threads, progress);
    std::vector<StripPoint> found;
    {
        const py::gil_scoped_release release;
        found = autofocus::select_strip_points(in.view, geometry, options);
    }
    return to_numpy(found);
}

Apertures extract(const py::object& image, const StripmapGeometry& geometry, const py::object& points, int window, double taper,
                  int threads, const py::object& progress) {
    const auto in = input<cfloat, 2>(image, "image");
    const std::vector<StripPoint> chosen = list_of<StripPoint>(points, "points");
    autofocus::StripExtractOptions options;
    options.window = window;
    options.taper = taper;
    options.execution = execution(threads, progress);
    const py::gil_scoped_release release;
    return autofocus::extract_apertures(in.view, geometry, chosen, options);
}

py::array_t<Seam> match_slope(const Apertures& apertures, int pairs_per_point, double minimum_overlap, int threads,
                              const py::object& progress) {
    autofocus::SlopeMatchOptions options;
    options.pairs_per_point = pairs_per_point;
    options.minimum_overlap = minimum_overlap;
    options.execution = execution(threads, progress);
    std::vector<Seam> found;
    {
        const py::gil_scoped_release release;
        found = autofocus::match_slope(apertures, options);
    }
    return to_numpy(found);
}

py::array_t<Seam> match_search(const Apertures& apertures, int width, int largest_width, bool interpolation, bool correction,
                               double minimum_overlap, int threads, const py::object& progress) {
    autofocus::SearchMatchOptions options;
    options.width = width;
    options.largest_width = largest_width;
    options.interpolation = interpolation;
    options.correction = correction;
    options.minimum_overlap = minimum_overlap;
    options.execution = execution(threads, progress);
    std::vector<Seam> found;
    {
        const py::gil_scoped_release release;
        found = autofocus::match_search(apertures, options);
    }
    return to_numpy(found);
}

py::array_t<double> search_matrix(const Apertures& apertures, std::ptrdiff_t first, std::ptrdiff_t second, int width) {
    return to_numpy(autofocus::search_matrix(apertures, first, second, width));
}

Stitching stitch(const Apertures& apertures, const py::object& seams) {
    const std::vector<Seam> given = list_of<Seam>(seams, "seams");
    const py::gil_scoped_release release;
    return autofocus::stitch(apertures, given);
}

StripPhase integrate_gradient(const Apertures& apertures, const Stitching& stitching, int threads, const py::object& progress) {
    const Execution run = execution(threads, progress);
    const py::gil_scoped_release release;
    return autofocus::integrate_gradient(apertures, stitching, run);
}

StripPhase refine(const Apertures& apertures, const Stitching& stitching, const std::vector<double>& windows, int rounds, bool bridge,
                  double tolerance, int threads, const py::object& progress) {
    autofocus::StripRefineOptions options;
    options.windows = windows;
    options.rounds = rounds;
    options.bridge = bridge;
    options.tolerance = tolerance;
    options.execution = execution(threads, progress);
    const py::gil_scoped_release release;
    return autofocus::refine_strip_phase(apertures, stitching, options);
}

py::array azimuth_correct(const py::object& image, const StripmapGeometry& geometry, const py::object& phase, const py::object& centres,
                          const py::object& out, int threads, const py::object& progress) {
    const auto source = input<cfloat, 2>(image, "image");
    const auto ndim = py::module_::import("numpy").attr("ndim")(phase).cast<int>();
    const auto rows =
        ndim == 1 ? real_input<2>(py::module_::import("numpy").attr("asarray")(phase)[py::make_tuple(py::none(), py::ellipsis())], "phase")
                  : real_input<2>(phase, "phase");
    std::vector<double> middle = {0.0};
    if (!centres.is_none()) {
        const auto given = real_input<1>(centres, "centres");
        middle.clear();
        for (std::ptrdiff_t b = 0; b < given.view.extent(0); ++b) middle.push_back(given.view(b));
    }
    const auto corrected = output<cfloat, 2>(out, source.view.extents(), out.is(image) ? nullptr : &source.owner);
    focus::AzimuthCorrectOptions options;
    options.execution = execution(threads, progress);
    {
        const py::gil_scoped_release release;
        focus::azimuth_correct(source.view, geometry, rows.view, middle, corrected.view, options);
    }
    return corrected.owner;
}

template <class Run>
PythonResult run_on(const py::object& image, const py::object& out, const Run& run) {
    const auto source = input<cfloat, 2>(image, "image");
    const auto corrected = output<cfloat, 2>(out, source.view.extents(), out.is(image) ? nullptr : &source.owner);
    PythonResult answer;
    {
        const py::gil_scoped_release release;
        answer.result = run(source.view, corrected.view);
    }
    answer.image = out.is_none() && answer.result.input_returned() ? image : py::object(corrected.owner);
    return answer;
}

PythonResult spga_linear(const py::object& image, const StripmapGeometry& geometry, const std::string& matching, const std::string& gauge,
                         const std::vector<std::pair<double, std::ptrdiff_t>>& tie_points, bool refine, bool bridge, int range_blocks,
                         int points, const std::string& cfar, double false_alarm_probability, double maximum_contrast, int window,
                         double taper, int width, bool do_no_harm, const py::object& out, int threads, const py::object& progress) {
    autofocus::SpgaLinearOptions options;
    options.matching =
        choice<autofocus::Matching>(matching, "matching", {{"slope", autofocus::Matching::slope}, {"search", autofocus::Matching::search}});
    options.gauge = choice<autofocus::Gauge>(gauge, "gauge",
                                             {{"zero_mean_shift", autofocus::Gauge::zero_mean_shift},
                                              {"first_point", autofocus::Gauge::first_point},
                                              {"tie_points", autofocus::Gauge::tie_points}});
    for (const auto& [azimuth, range] : tie_points) options.tie_points.push_back({azimuth, range});
    options.refine = refine;
    options.refinement.bridge = bridge;
    options.range_blocks = range_blocks;
    options.select = select_options(points, cfar, false_alarm_probability, maximum_contrast, 0);
    options.extract.window = window;
    options.extract.taper = taper;
    options.search.width = width;
    options.do_no_harm = do_no_harm;
    options.execution = execution(threads, progress);
    return run_on(image, out,
                  [&](const ImageView& from, const MutableImageView& to) { return autofocus::spga_linear(from, geometry, to, options); });
}

PythonResult spga(const py::object& image, const StripmapGeometry& geometry, int iterations, double narrowing, int points,
                  const std::string& cfar, double false_alarm_probability, double maximum_contrast, int window, bool do_no_harm,
                  const py::object& out, int threads, const py::object& progress) {
    autofocus::SpgaOptions options;
    options.iterations = iterations;
    options.narrowing = narrowing;
    options.select = select_options(points, cfar, false_alarm_probability, maximum_contrast, 0);
    options.extract.window = window;
    options.do_no_harm = do_no_harm;
    options.execution = execution(threads, progress);
    return run_on(image, out,
                  [&](const ImageView& from, const MutableImageView& to) { return autofocus::spga(from, geometry, to, options); });
}

void bind_types(py::module_& m) {
    PYBIND11_NUMPY_DTYPE(StripPoint, azimuth, range, extent, energy, statistic, contrast);
    PYBIND11_NUMPY_DTYPE(Seam, first, second, overlap, slope, slope_std, coherence, residual, weight);
    m.attr("point_dtype") = py::dtype::of<StripPoint>();
    m.attr("seam_dtype") = py::dtype::of<Seam>();

    py::class_<Apertures>(m, "Apertures", "The dechirped signals of strong points over their apertures; see extract.")
        .def("__len__", [](const Apertures& a) { return a.size(); })
        .def_property_readonly(
            "lines", [](const Apertures& a) { return to_numpy(a.lines.copy()); },
            "complex64 [n_point, n_sample]; a point's is A exp(1j * (phase + a + b k)); zeros where there is none.")
        .def_property_readonly(
            "weight", [](const Apertures& a) { return to_numpy(a.weight.copy()); }, "float32 [n_point, n_sample], power of an ideal point.")
        .def_property_readonly(
            "start", [](const Apertures& a) { return to_numpy(std::vector<std::int64_t>(a.start.begin(), a.start.end())); },
            "int64 [n_point], slow time of sample 0.")
        .def_property_readonly(
            "count", [](const Apertures& a) { return to_numpy(std::vector<std::int64_t>(a.count.begin(), a.count.end())); },
            "int64 [n_point], samples in use.")
        .def_property_readonly(
            "fm_rate", [](const Apertures& a) { return to_numpy(a.fm_rate); }, "float64 [n_point], K / prf^2, cycles per sample squared.")
        .def_property_readonly(
            "points", [](const Apertures& a) { return to_numpy(a.points); }, "structured array, in order of azimuth; contrast is Q_k.")
        .def_readonly("window", &Apertures::window, "Half width of the pieces cut, pixels.");

    py::class_<Stitching>(m, "Stitching", "The linear phases of all points; see stitch.")
        .def_property_readonly(
            "slope", [](const Stitching& s) { return to_numpy(s.slope); }, "float64 [n_point], rad a sample.")
        .def_property_readonly(
            "segment", [](const Stitching& s) { return to_numpy(s.segment); }, "int32 [n_point], points joined by overlaps.")
        .def_property_readonly(
            "seams", [](const Stitching& s) { return to_numpy(s.seams); }, "structured array, with residual and weight.")
        .def_readonly("segments", &Stitching::segments);

    py::class_<StripPhase>(m, "StripPhase", "A phase error over slow time; see refine and integrate_gradient.")
        .def_property_readonly(
            "phase", [](const StripPhase& p) { return to_numpy(p.phase); }, "float64 [n_azimuth], rad.")
        .def_property_readonly(
            "phase_std", [](const StripPhase& p) { return to_numpy(p.phase_std); },
            "float64 [n_azimuth], rad, constant and line removed; nan where no aperture reaches.")
        .def_property_readonly(
            "coverage", [](const StripPhase& p) { return to_numpy(p.coverage); }, "float64 [n_azimuth], apertures that reach a sample.")
        .def_property_readonly(
            "slope", [](const StripPhase& p) { return to_numpy(p.slope); }, "float64 [n_point], rad a sample.")
        .def_property_readonly(
            "signal", [](const StripPhase& p) { return to_numpy(p.signal); }, "float64 [n_point], |A_n|^2.")
        .def_property_readonly(
            "noise", [](const StripPhase& p) { return to_numpy(p.noise); }, "float64 [n_point], of a sample of weight 1.")
        .def_property_readonly(
            "information", [](const StripPhase& p) { return to_numpy(p.information); }, "float64 [n_point], shares.")
        .def_property_readonly(
            "smoothness", [](const StripPhase& p) { return to_numpy(p.smoothness); },
            "float64 [n_segment], RMS second difference that the prior allows, rad per knot squared.")
        .def_readonly("knot", &StripPhase::knot, "Samples between the values that the refinement estimates.");
}

void bind_steps(py::module_& m) {
    const autofocus::StripSelectOptions select;
    const autofocus::StripExtractOptions extraction;
    const autofocus::SlopeMatchOptions slope;
    const autofocus::SearchMatchOptions search;
    const autofocus::StripRefineOptions refinement;

    m.def("select_points", &select_points, py::arg("image"), py::arg("geometry"), py::kw_only(), py::arg("points") = select.points,
          py::arg("cfar") = "cell_averaging", py::arg("false_alarm_probability") = select.cfar.false_alarm_probability,
          py::arg("maximum_contrast") = select.maximum_contrast, py::arg("window") = select.window, py::arg("threads") = 0,
          py::arg("progress") = py::none(), R"(Strong points of a defocused strip, spread evenly along azimuth [Xie2023, section 3.1].

Candidates are boxes of 1, 4, 16, 64 and 256 azimuth pixels whose energy stands out of the clutter in a 2-D CFAR test; those whose
decompressed signal is uneven (contrast Q_k, eq. 5) go.

Parameters
----------
image : complex64 [n_azimuth, n_range]
    Compressed strip.
geometry : StripmapGeometry
points : int
    At most so many; 0: as many as are worth it (K_up of eq. 25, 24 an aperture).
cfar : {"cell_averaging", "greatest_of", "ordered_statistic"}
false_alarm_probability : float
maximum_contrast : float
    Q_k above which a candidate goes: 0 for an ideal point, 0.215 for speckle.
window : int
    Half width of the piece of image cut for Q_k, pixels; 0: what holds the points, at least a twelfth of the aperture.
threads, progress
    As everywhere.

Returns
-------
structured array
    azimuth, range, extent (pixels), energy, statistic (nat, against clutter alone), contrast (Q_k).

Raises
------
ShapeError, ValueError, TypeError, NumericalError)");
    m.def("extract", &extract, py::arg("image"), py::arg("geometry"), py::arg("points"), py::kw_only(),
          py::arg("window") = extraction.window, py::arg("taper") = extraction.taper, py::arg("threads") = 0,
          py::arg("progress") = py::none(), R"(Intercept, decompress, dechirp, window [Xie2023, section 3.2].

Parameters
----------
image : complex64 [n_azimuth, n_range]
geometry : StripmapGeometry
points : structured array (point_dtype)
window : int
    Half width of the piece cut round every point, pixels; 0: what holds the points, at least a twelfth of the aperture.
taper : float
    Share of half the Doppler band over which the spectrum is rounded off at either end.
threads, progress
    As everywhere.

Returns
-------
Apertures

Raises
------
ShapeError, ValueError, TypeError, NumericalError)");
    m.def("match_slope", &match_slope, py::arg("apertures"), py::kw_only(), py::arg("pairs_per_point") = slope.pairs_per_point,
          py::arg("minimum_overlap") = slope.minimum_overlap, py::arg("threads") = 0, py::arg("progress") = py::none(),
          R"(Relative linear phases of overlapping apertures, from the tone that their conjugate product is.

Parameters
----------
apertures : Apertures
pairs_per_point : int
    Overlaps behind every point, spread over all that it has.
minimum_overlap : float
    Of the shorter aperture.
threads, progress
    As everywhere.

Returns
-------
structured array (seam_dtype)
    first, second (points), overlap (samples), slope, slope_std (rad a sample), coherence, residual, weight.

Raises
------
ValueError)");
    m.def("match_search", &match_search, py::arg("apertures"), py::kw_only(), py::arg("width") = search.width,
          py::arg("largest_width") = search.largest_width, py::arg("interpolation") = search.interpolation,
          py::arg("correction") = search.correction, py::arg("minimum_overlap") = search.minimum_overlap, py::arg("threads") = 0,
          py::arg("progress") = py::none(), R"(Relative linear phases of neighbours by the W x W traversal [Xie2023, section 3.3].

Parameters
----------
apertures : Apertures
width : int
    W, pixels, even; it doubles up to `largest_width` while nothing satisfies eq. 15.
largest_width : int
interpolation, correction : bool
    The two corrections of section 3.5: positions between the pixels; the slope that is left, added.
minimum_overlap : float
    Of the shorter aperture.
threads, progress
    As everywhere.

Returns
-------
structured array (seam_dtype)

Raises
------
ValueError)");
    m.def("search_matrix", &search_matrix, py::arg("apertures"), py::arg("first"), py::arg("second"), py::arg("width") = search.width,
          R"(abs(R) of two apertures [Xie2023, eq. 16], rad a sample.

Parameters
----------
apertures : Apertures
first, second : int
    Points whose apertures overlap.
width : int
    W, pixels, even.

Returns
-------
float64 [width, width]

Raises
------
ValueError)");
    m.def("stitch", &stitch, py::arg("apertures"), py::arg("seams"),
          R"(Linear phase of every point from all seams: robust weighted least squares.

Parameters
----------
apertures : Apertures
seams : structured array (seam_dtype)

Returns
-------
Stitching

Raises
------
ValueError, TypeError)");
    m.def("integrate_gradient", &integrate_gradient, py::arg("apertures"), py::arg("stitching"), py::kw_only(), py::arg("threads") = 0,
          py::arg("progress") = py::none(), R"(Phase error summed up from the phase steps of the stitched apertures.

Parameters
----------
apertures : Apertures
stitching : Stitching
threads, progress
    As everywhere.

Returns
-------
StripPhase

Raises
------
ShapeError)");
    m.def("refine", &refine, py::arg("apertures"), py::arg("stitching"), py::kw_only(), py::arg("windows") = refinement.windows,
          py::arg("rounds") = refinement.rounds, py::arg("bridge") = refinement.bridge, py::arg("tolerance") = refinement.tolerance,
          py::arg("threads") = 0, py::arg("progress") = py::none(), R"(Maximum-likelihood phase error of stitched apertures.

Constants of all points from their products, coherent sum, rounds with a narrowing window, then phase, constants and linear terms
together with a smoothness prior whose weight is the most likely one.

Parameters
----------
apertures : Apertures
stitching : Stitching
windows : sequence of float
    Shares of the extraction window.
rounds : int
    Of the joint refinement, at most.
bridge : bool
    Join segments between which no aperture overlaps by nothing but the smoothness of the phase.
tolerance : float
    rad RMS change that ends it.
threads, progress
    As everywhere.

Returns
-------
StripPhase

Raises
------
ShapeError, ValueError)");
    m.def("azimuth_correct", &azimuth_correct, py::arg("image"), py::arg("geometry"), py::arg("phase"), py::kw_only(),
          py::arg("centres") = py::none(), py::arg("out") = py::none(), py::arg("threads") = 0, py::arg("progress") = py::none(),
          R"(Takes a phase error over slow time off a compressed strip: decompress, times exp(-1j * phase), compress.

Parameters
----------
image : complex64 [n_azimuth, n_range]
geometry : StripmapGeometry
phase : array_like [n_azimuth] or [n_block, n_azimuth]
    rad; blocks are interpolated linearly along range.
centres : array_like [n_block], optional
    Range gate in the middle of each block.
out : complex64 [n_azimuth, n_range], optional
    May be the image itself.
threads, progress
    As everywhere.

Returns
-------
complex64 [n_azimuth, n_range]

Raises
------
ShapeError, ValueError, TypeError, NumericalError)");
}

void bind_methods(py::module_& m) {
    const autofocus::SpgaLinearOptions linear;
    const autofocus::SpgaOptions classic;
    m.def("spga_linear", &spga_linear, py::arg("image"), py::arg("geometry"), py::kw_only(), py::arg("matching") = "slope",
          py::arg("gauge") = "zero_mean_shift", py::arg("tie_points") = std::vector<std::pair<double, std::ptrdiff_t>>(),
          py::arg("refine") = true, py::arg("bridge") = false, py::arg("range_blocks") = linear.range_blocks,
          py::arg("points") = linear.select.points, py::arg("cfar") = "cell_averaging",
          py::arg("false_alarm_probability") = linear.select.cfar.false_alarm_probability,
          py::arg("maximum_contrast") = linear.select.maximum_contrast, py::arg("window") = linear.extract.window,
          py::arg("taper") = linear.extract.taper, py::arg("width") = linear.search.width, py::arg("do_no_harm") = true,
          py::arg("out") = py::none(), py::arg("threads") = 0, py::arg("progress") = py::none(),
          R"(Iteration-free stripmap autofocus that keeps the linear phase [Xie2023], in one pass.

Parameters
----------
image : complex64 [n_azimuth, n_range]
    A compressed strip, as azimuth_compress or form_stripmap makes it; any strides.
geometry : StripmapGeometry
    Small squint: abs(wavelength * doppler_centroid / (2 * velocity)) <= 0.1.
matching : {"slope", "search"}
    The tone of every overlapping pair, or the paper's traversal of neighbours.
gauge : {"zero_mean_shift", "first_point", "tie_points"}
    What the one linear phase that the data leave open is taken for.
tie_points : sequence of (float, int)
    Azimuth pixel and range gate where points belong, with gauge "tie_points"; one in every segment.
refine : bool
    Maximum-likelihood refinement; False: the phase steps of the stitched apertures are summed up.
bridge : bool
    Join segments between which no aperture overlaps by nothing but the smoothness of the phase; needs refine.
range_blocks : int
    Blocks of range gates with a phase of their own, interpolated between.
points, cfar, false_alarm_probability, maximum_contrast
    As for strip.select_points.
window, taper
    As for strip.extract.
width : int
    As for strip.match_search.
do_no_harm : bool
    Hand the input back where the score is not better.
out : complex64 [n_azimuth, n_range], optional
    Where the corrected image goes; may be the image itself.
threads, progress
    As everywhere.

Returns
-------
Result
    phase_error and phase_std are over the slow time of azimuth_decompress(image). diagnostics["strip"] holds seams, segments, coverage,
    Q_k and the gain of every point with the phase of the others.

Raises
------
ShapeError, ValueError, TypeError, NumericalError, MemoryError)");
    m.def("spga", &spga, py::arg("image"), py::arg("geometry"), py::kw_only(), py::arg("iterations") = classic.iterations,
          py::arg("narrowing") = classic.narrowing, py::arg("points") = classic.select.points, py::arg("cfar") = "cell_averaging",
          py::arg("false_alarm_probability") = classic.select.cfar.false_alarm_probability,
          py::arg("maximum_contrast") = classic.select.maximum_contrast, py::arg("window") = classic.extract.window,
          py::arg("do_no_harm") = true, py::arg("out") = py::none(), py::arg("threads") = 0, py::arg("progress") = py::none(),
          R"(Stripmap phase gradient autofocus, the classic iterative method: the baseline.

It loses the linear phase of every aperture: targets stay displaced and passes are needed.

Parameters
----------
image : complex64 [n_azimuth, n_range]
geometry : StripmapGeometry
iterations : int
    Passes over the image.
narrowing : float
    Factor of the window from one pass to the next.
points, cfar, false_alarm_probability, maximum_contrast, window
    As for spga_linear.
do_no_harm : bool
    Hand the input back where the entropy does not fall.
out, threads, progress
    As for spga_linear.

Returns
-------
Result

Raises
------
ShapeError, ValueError, TypeError, NumericalError, MemoryError)");
}

}  // namespace

void bind_strip(py::module_ m) {
    bind_types(m);
    bind_steps(m);
    bind_methods(m);
}

}  // namespace sarfocus::python
