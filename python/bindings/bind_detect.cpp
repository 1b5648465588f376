#include <algorithm>
#include <array>
#include <string>
#include <vector>

#include <pybind11/stl.h>

#include <sarfocus/detect/cfar.hpp>
#include <sarfocus/detect/local_maxima.hpp>
#include <sarfocus/detect/selection.hpp>

#include "bindings.hpp"
#include "convert.hpp"

namespace py = pybind11;

namespace sarfocus::python {
namespace {

using detect::CfarCell;
using detect::CfarMethod;
using detect::CfarOptions;
using detect::Point;
using detect::RangeGate;
using HalfWidth = std::array<std::ptrdiff_t, 2>;

template <class Choice>
Choice choice(const std::string& name, const char* argument, const std::vector<std::pair<const char*, Choice>>& choices) {
    std::string expected;
    for (const auto& [text, value] : choices) {
        if (name == text) return value;
        expected += (expected.empty() ? "'" : " or '") + std::string(text) + "'";
    }
    throw ValueError(argument, expected, "'" + name + "'");
}

/// Calls use(view) with the complex samples, or the intensities, that `image` holds; the GIL is free meanwhile.
template <class Use>
void with_samples(const py::object& image, const Use& use) {
    const bool real = py::isinstance<py::array>(image) && py::reinterpret_borrow<py::array>(image).dtype().kind() == 'f';
    if (real) {
        const auto in = input<float, 2>(image, "image");
        const py::gil_scoped_release release;
        use(in.view);
    } else {
        const auto in = input<cfloat, 2>(image, "image");
        const py::gil_scoped_release release;
        use(in.view);
    }
}

std::vector<Point> point_list(const py::object& points) {
    const auto in = input<Point, 1>(points, "points");
    std::vector<Point> out;
    for (std::ptrdiff_t i = 0; i < in.view.extent(0); ++i) out.push_back(in.view(i));
    return out;
}

CfarOptions cfar_options(const std::string& method, double false_alarm_probability, HalfWidth reference, HalfWidth guard, double rank,
                         int threads, const py::object& progress) {
    CfarOptions out;
    out.method = choice<CfarMethod>(method, "method",
                                    {{"cell_averaging", CfarMethod::cell_averaging},
                                     {"greatest_of", CfarMethod::greatest_of},
                                     {"ordered_statistic", CfarMethod::ordered_statistic}});
    out.false_alarm_probability = false_alarm_probability;
    out.reference = reference;
    out.guard = guard;
    out.rank = rank;
    out.execution = execution(threads, progress);
    return out;
}

HalfWidth shape_of(const py::object& image) {
    if (!py::isinstance<py::array>(image)) throw py::type_error("image: expected a NumPy array of dtype complex64 or float32");
    const auto array = py::reinterpret_borrow<py::array>(image);
    if (array.ndim() != 2) throw_dimensions("image", 2, array);
    return {array.shape(0), array.shape(1)};
}

template <bool two_dimensional>
py::array cfar(const py::object& image, const CfarOptions& options, const py::object& out) {
    const auto shape = shape_of(image);
    const auto source = py::reinterpret_borrow<py::array>(image);
    const auto mask = output<bool, 2>(out, shape, &source);
    with_samples(image, [&](const auto& view) { two_dimensional ? cfar_2d(view, mask.view, options) : cfar_1d(view, mask.view, options); });
    return mask.owner;
}

template <bool two_dimensional>
py::array_t<CfarCell> cfar_at(const py::object& image, const std::vector<HalfWidth>& cells, const CfarOptions& options) {
    const auto in = input<cfloat, 2>(image, "image");
    std::vector<CfarCell> found;
    {
        const py::gil_scoped_release release;
        found = two_dimensional ? cfar_2d_at(in.view, cells, options) : cfar_1d_at(in.view, cells, options);
    }
    return to_numpy(found);
}

constexpr const char* cfar_doc = R"(

A cell is detected where its intensity exceeds mu times the clutter estimate. mu follows from the false-alarm probability for
independent exponential intensities (single-look speckle) and from the reference cells that exist, fewer at the border of the image.

Parameters
----------
image : complex64 or float32 [n_azimuth, n_range]
    Samples, or intensities >= 0. Any strides. (The functions that test single cells take complex64.)
cells : sequence of (int, int)
    Azimuth and range of the cells to test (only the functions that test single cells).
method : str
    "cell_averaging", "greatest_of" (the larger of the means before and behind in azimuth) or "ordered_statistic".
false_alarm_probability : float
reference, guard : int, or (int, int) in 2-D
    Cells each side: guard cells next to the cell under test, reference cells beyond them; azimuth and range.
rank : float
    "ordered_statistic": the ceil(rank N)-th smallest of N cells.
out : bool [n_azimuth, n_range], optional
    Where to write the mask.
threads : int
    0: all. The result does not depend on it.
progress : callable, optional
    Called with (phase, done, total); returning False stops.

Returns
-------
bool [n_azimuth, n_range]
    True where detected. For single cells: structured array of intensity, clutter, threshold (all intensities) and detected.

Raises
------
ValueError, ShapeError
    Options, shapes, a cell outside the image.
NumericalError
    NaN, infinity or negative intensities.)";

void bind_cfar(py::module_& m) {
    const CfarOptions d;
    const std::string doc_1d = std::string("Constant false-alarm rate detection along azimuth [Luo2025, section 2.2.1].") + cfar_doc;
    const std::string doc_2d = std::string("Constant false-alarm rate detection in two dimensions [Xie2023, section 3.1].") + cfar_doc;
    const std::string doc_1d_at = std::string("The tests of cfar_1d for a few cells.") + cfar_doc;
    const std::string doc_2d_at = std::string("The tests of cfar_2d for a few cells.") + cfar_doc;
    m.def(
        "cfar_1d",
        [](const py::object& image, const std::string& method, double p, std::ptrdiff_t reference, std::ptrdiff_t guard, double rank,
           const py::object& out, int threads, const py::object& progress) {
            return cfar<false>(image, cfar_options(method, p, {reference, 0}, {guard, 0}, rank, threads, progress), out);
        },
        py::arg("image"), py::kw_only(), py::arg("method") = "cell_averaging",
        py::arg("false_alarm_probability") = d.false_alarm_probability, py::arg("reference") = d.reference[0],
        py::arg("guard") = d.guard[0], py::arg("rank") = d.rank, py::arg("out") = py::none(), py::arg("threads") = 0,
        py::arg("progress") = py::none(), doc_1d.c_str());
    m.def(
        "cfar_2d",
        [](const py::object& image, const std::string& method, double p, HalfWidth reference, HalfWidth guard, double rank,
           const py::object& out, int threads, const py::object& progress) {
            return cfar<true>(image, cfar_options(method, p, reference, guard, rank, threads, progress), out);
        },
        py::arg("image"), py::kw_only(), py::arg("method") = "cell_averaging",
        py::arg("false_alarm_probability") = d.false_alarm_probability,
        py::arg("reference") = py::make_tuple(d.reference[0], d.reference[1]), py::arg("guard") = py::make_tuple(d.guard[0], d.guard[1]),
        py::arg("rank") = d.rank, py::arg("out") = py::none(), py::arg("threads") = 0, py::arg("progress") = py::none(), doc_2d.c_str());
    m.def(
        "cfar_1d_at",
        [](const py::object& image, const std::vector<HalfWidth>& cells, const std::string& method, double p, std::ptrdiff_t reference,
           std::ptrdiff_t guard, double rank, int threads, const py::object& progress) {
            return cfar_at<false>(image, cells, cfar_options(method, p, {reference, 0}, {guard, 0}, rank, threads, progress));
        },
        py::arg("image"), py::arg("cells"), py::kw_only(), py::arg("method") = "cell_averaging",
        py::arg("false_alarm_probability") = d.false_alarm_probability, py::arg("reference") = d.reference[0],
        py::arg("guard") = d.guard[0], py::arg("rank") = d.rank, py::arg("threads") = 0, py::arg("progress") = py::none(),
        doc_1d_at.c_str());
    m.def(
        "cfar_2d_at",
        [](const py::object& image, const std::vector<HalfWidth>& cells, const std::string& method, double p, HalfWidth reference,
           HalfWidth guard, double rank, int threads, const py::object& progress) {
            return cfar_at<true>(image, cells, cfar_options(method, p, reference, guard, rank, threads, progress));
        },
        py::arg("image"), py::arg("cells"), py::kw_only(), py::arg("method") = "cell_averaging",
        py::arg("false_alarm_probability") = d.false_alarm_probability,
        py::arg("reference") = py::make_tuple(d.reference[0], d.reference[1]), py::arg("guard") = py::make_tuple(d.guard[0], d.guard[1]),
        py::arg("rank") = d.rank, py::arg("threads") = 0, py::arg("progress") = py::none(), doc_2d_at.c_str());
    m.def("cell_averaging_factor", &detect::cell_averaging_factor, py::arg("cells"), py::arg("false_alarm_probability"),
          "mu = N (Pfa^(-1/N) - 1) for the mean of N cells [Luo2025, section 2.2.1].");
    m.def("greatest_of_factor", &detect::greatest_of_factor, py::arg("before"), py::arg("behind"), py::arg("false_alarm_probability"),
          "mu for the larger of two means over `before` and `behind` cells [Hansen1973, extended to unequal numbers].");
    m.def("ordered_statistic_factor", &detect::ordered_statistic_factor, py::arg("cells"), py::arg("k"), py::arg("false_alarm_probability"),
          "mu for the k-th smallest of N cells [Rohling1983].");
}

py::array_t<Point> local_maxima(const py::object& image, const py::object& mask, HalfWidth half_width, double minimum, std::ptrdiff_t count,
                                int threads, const py::object& progress) {
    detect::LocalMaximaOptions options;
    options.half_width = half_width;
    options.minimum = minimum;
    options.count = count;
    options.execution = execution(threads, progress);
    Input<bool, 2> chosen;
    if (!mask.is_none()) chosen = input<bool, 2>(mask, "mask");
    std::vector<Point> found;
    with_samples(image, [&](const auto& view) { found = detect::local_maxima(view, options, chosen.view); });
    return to_numpy(found);
}

py::array_t<Point> strongest_samples(const py::object& image, std::ptrdiff_t count, int threads, const py::object& progress) {
    const auto in = input<cfloat, 2>(image, "image");
    const Execution run = execution(threads, progress);
    std::vector<Point> found;
    {
        const py::gil_scoped_release release;
        found = detect::strongest_samples(in.view, count, run);
    }
    return to_numpy(found);
}

py::array_t<RangeGate> strongest_gates(const py::object& image, std::ptrdiff_t count, const std::string& score, int threads,
                                       const py::object& progress) {
    const auto in = input<cfloat, 2>(image, "image");
    detect::GateOptions options;
    options.count = count;
    options.score = choice<detect::GateScore>(score, "score",
                                              {{"energy", detect::GateScore::energy}, {"peak_to_mean", detect::GateScore::peak_to_mean}});
    options.execution = execution(threads, progress);
    std::vector<RangeGate> found;
    {
        const py::gil_scoped_release release;
        found = detect::strongest_gates(in.view, options);
    }
    return to_numpy(found);
}

py::array_t<Point> spread_evenly(const py::object& points, std::ptrdiff_t n_azimuth, std::ptrdiff_t limit, std::ptrdiff_t sections,
                                 const std::string& order) {
    detect::SpreadOptions options;
    options.limit = limit;
    options.sections = sections;
    options.order = choice<detect::PointOrder>(order, "order",
                                               {{"intensity", detect::PointOrder::intensity}, {"contrast", detect::PointOrder::contrast}});
    return to_numpy(detect::spread_evenly(point_list(points), n_azimuth, options));
}

void bind_points(py::module_& m) {
    m.attr("point_dtype") = py::dtype::of<Point>();
    m.def("local_maxima", &local_maxima, py::arg("image"), py::kw_only(), py::arg("mask") = py::none(),
          py::arg("half_width") = py::make_tuple(1, 1), py::arg("minimum") = 0.0, py::arg("count") = 0, py::arg("threads") = 0,
          py::arg("progress") = py::none(), R"(Pixels as strong as every other of their neighbourhood, the strongest first.

Parameters
----------
image : complex64 or float32 [n_azimuth, n_range]
    Samples, or intensities >= 0. Any strides.
mask : bool [n_azimuth, n_range], optional
    False where nothing is to be found, e.g. the result of cfar_2d.
half_width : (int, int)
    The neighbourhood reaches so far in azimuth and range. Of equal neighbours the first in index order counts.
minimum : float
    Intensities up to this are no maxima.
count : int
    The strongest so many; 0: all.
threads : int
    0: all. The result does not depend on it.
progress : callable, optional
    Called with (phase, done, total); returning False stops.

Returns
-------
point_dtype [n]
    azimuth, range, intensity; contrast is nan.

Raises
------
ValueError, ShapeError
    Options, shapes.
NumericalError
    NaN, infinity or negative intensities.)");
    m.def("strongest_samples", &strongest_samples, py::arg("image"), py::arg("count") = 5, py::kw_only(), py::arg("threads") = 0,
          py::arg("progress") = py::none(), R"(The `count` largest samples of every range gate [Luo2025, section 2.2.1].

Parameters
----------
image : complex64 [n_azimuth, n_range]
    Any strides.
count : int
    So many of every gate; zeros never.
threads : int
    0: all. The result does not depend on it.
progress : callable, optional
    Called with (phase, done, total); returning False stops.

Returns
-------
point_dtype [n]
    Gate after gate, the strongest of each first.

Raises
------
ValueError, ShapeError, NumericalError
    count below 1, an empty image, NaN or infinity.)");
    m.def(
        "coalesce",
        [](const py::object& points, HalfWidth half_width) { return to_numpy(detect::coalesce(point_list(points), half_width)); },
        py::arg("points"), py::arg("half_width") = py::make_tuple(4, 4),
        R"(Let a scatterer and its side lobes count once [Luo2025, section 2.2.1].

From the strongest point downwards, every point within `half_width` (azimuth and range, both) of one already kept goes.

Parameters
----------
points : point_dtype [n]
half_width : (int, int)
    Pixels in azimuth and range.

Returns
-------
point_dtype [m]
    The strongest first.

Raises
------
ValueError
    A negative half width.)");
    m.def(
        "contrast",
        [](const py::object& signal) {
            const auto in = input<cfloat, 1>(signal, "signal");
            const py::gil_scoped_release release;
            return detect::contrast(in.view);
        },
        py::arg("signal"), R"(Unevenness Q of the amplitude of a decompressed point [Xie2023, eq. 5].

Parameters
----------
signal : complex64 [n]
    The point's signal over its aperture.

Returns
-------
float
    1 - mean(|S|)^2 / mean(|S|^2): 0 for constant amplitude, 0.215 for speckle, towards 1 the more uneven.

Raises
------
ShapeError, NumericalError
    No samples; NaN, infinity or only zeros.)");
    m.def(
        "filter_contrast",
        [](const py::object& points, double maximum) { return to_numpy(detect::filter_contrast(point_list(points), maximum)); },
        py::arg("points"), py::arg("maximum"), R"(The points with contrast <= maximum, in their order [Xie2023, section 3.1].

Parameters
----------
points : point_dtype [n]
    Those whose contrast is nan go.
maximum : float

Returns
-------
point_dtype [m]

Raises
------
ValueError
    maximum is not finite.)");
    m.def("strongest_gates", &strongest_gates, py::arg("image"), py::kw_only(), py::arg("count") = 0, py::arg("score") = "energy",
          py::arg("threads") = 0, py::arg("progress") = py::none(), R"(Range gates by how strong they are, the highest score first.

Parameters
----------
image : complex64 [n_azimuth, n_range]
    Any strides.
count : int
    The best so many; 0: all.
score : str
    "energy", the sum of the intensity over azimuth [Luo2025, eq. 9-11], or "peak_to_mean", how much one scatterer stands out.
threads : int
    0: all. The result does not depend on it.
progress : callable, optional
    Called with (phase, done, total); returning False stops.

Returns
-------
structured array [n]
    range, score. Of equal scores the nearer gate comes first.

Raises
------
ValueError, ShapeError, NumericalError
    Options, an empty image, NaN or infinity.)");
    m.def("spread_evenly", &spread_evenly, py::arg("points"), py::arg("n_azimuth"), py::kw_only(), py::arg("limit") = 0,
          py::arg("sections") = 32, py::arg("order") = "intensity",
          R"(Choose points that are spread evenly along azimuth [Xie2023, section 3.1].

The best point of every section, then the second best of every section, and so on up to the limit; of a round that no longer fits, its
best points.

Parameters
----------
points : point_dtype [n]
n_azimuth : int
    Azimuth samples of the image.
limit : int
    At most so many; 0: point_limit(n_azimuth).
sections : int
    Equal parts of the azimuth extent.
order : str
    "intensity", the stronger the better, or "contrast", the smaller the better.

Returns
-------
point_dtype [m]
    By azimuth, then range.

Raises
------
ValueError
    Options, or a point outside the image.)");
    m.def("point_limit", &detect::point_limit, py::arg("n_azimuth"), py::arg("iterations") = 6,
          R"(Number of points with which the iteration-free method costs as much as iterated stripmap PGA [Xie2023, eq. 25].

Parameters
----------
n_azimuth : int
    Azimuth samples of the image.
iterations : int
    Of the stripmap PGA it is compared with.

Returns
-------
int
    floor(sqrt(2) iterations^(3/4) sqrt(n log2 n)), at least 1.

Raises
------
ValueError
    An argument below 1.)");
}

}  // namespace

void bind_detect(py::module_ m) {
    PYBIND11_NUMPY_DTYPE(Point, azimuth, range, intensity, contrast);
    PYBIND11_NUMPY_DTYPE(CfarCell, intensity, clutter, threshold, detected);
    PYBIND11_NUMPY_DTYPE(RangeGate, range, score);
    bind_cfar(m);
    bind_points(m);
}

}  // namespace sarfocus::python
