#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <pybind11/native_enum.h>
#include <pybind11/stl.h>

#include <sarfocus/hrws/after_reconstruction.hpp>
#include <sarfocus/hrws/si_mec.hpp>

#include "bindings.hpp"
#include "convert.hpp"
#include "hrws_arguments.hpp"
#include "trajectory_arguments.hpp"

namespace py = pybind11;

namespace sarfocus::python {
namespace {

using hrws::SiMecResult;
using hrws::SiMecStatus;

struct PythonSiMec {
    SiMecResult found;
    py::array image;
};

struct PythonPhaseCompensation {
    hrws::PhaseCompensation found;
    py::array image;
};

py::dict timings_of(const std::vector<autofocus::Timing>& timings) {
    py::dict out;
    for (const auto& timing : timings) out[timing.phase.c_str()] = timing.seconds;
    return out;
}

std::unique_ptr<PythonSiMec> si_mec(const PythonEcho& echo, const geometry::ImageGrid& grid,
                                    const std::vector<geometry::ImageGrid>& regions, const std::string& unknowns,
                                    const std::string& reconstruction, const std::string& pixels, const py::object& knots,
                                    const Vector3& up, double search, double agreement, bool do_no_harm, const std::string& interpolation,
                                    double doppler_bandwidth, double doppler_centroid, std::optional<double> margin, double noise,
                                    double condition_limit, std::ptrdiff_t half_width, const py::object& out, int threads,
                                    const py::object& progress) {
    hrws::SiMecOptions options;
    options.motion.unknowns = unknowns_of(unknowns);
    options.motion.pixels = pixels_of(pixels);
    options.motion.knots = knots.is_none() ? 0 : knots.cast<int>();
    options.motion.up = up;
    options.motion.search = search;
    options.motion.do_no_harm = do_no_harm;
    options.agreement = agreement;
    options.reconstruct.reconstruction = reconstruction_of(reconstruction);
    options.reconstruct.band = band_of(interpolation, doppler_bandwidth, doppler_centroid, margin, noise, condition_limit);
    options.reconstruct.half_width = half_width;
    options.execution = execution(threads, progress);
    const auto image = output<cfloat, 2>(out, grid.shape(), &echo.data.owner);
    const hrws::Echo view = echo.view();
    auto result = std::make_unique<PythonSiMec>();
    result->image = image.owner;
    {
        const py::gil_scoped_release release;
        result->found = hrws::si_mec(view, grid, regions, image.view, options);
    }
    return result;
}

template <class Options, class Method>
std::unique_ptr<PythonPhaseCompensation> compensate(const PythonEcho& echo, const geometry::ImageGrid& grid,
                                                    const geometry::ImageGrid& region, Options& options, const Method& method,
                                                    const py::object& out, int threads, const py::object& progress) {
    options.execution = execution(threads, progress);
    const auto image = output<cfloat, 2>(out, grid.shape(), &echo.data.owner);
    const hrws::Echo view = echo.view();
    auto result = std::make_unique<PythonPhaseCompensation>();
    result->image = image.owner;
    {
        const py::gil_scoped_release release;
        result->found = method(view, grid, region, image.view, options);
    }
    return result;
}

std::unique_ptr<PythonPhaseCompensation> bp_fmsa(const PythonEcho& echo, const geometry::ImageGrid& grid, const geometry::ImageGrid& region,
                                                 int iterations, double tolerance, const std::string& interpolation,
                                                 double doppler_bandwidth, double doppler_centroid, std::optional<double> margin,
                                                 double noise, double condition_limit, std::ptrdiff_t half_width, const py::object& out,
                                                 int threads, const py::object& progress) {
    hrws::BpFmsaOptions options;
    options.estimate.iterations = iterations;
    options.estimate.tolerance = tolerance;
    options.band = band_of(interpolation, doppler_bandwidth, doppler_centroid, margin, noise, condition_limit);
    options.half_width = half_width;
    return compensate(echo, grid, region, options, hrws::bp_fmsa, out, threads, progress);
}

std::unique_ptr<PythonPhaseCompensation> pga(const PythonEcho& echo, const geometry::ImageGrid& grid, const geometry::ImageGrid& region,
                                             bool do_no_harm, const std::string& interpolation, double doppler_bandwidth,
                                             double doppler_centroid, std::optional<double> margin, double noise, double condition_limit,
                                             std::ptrdiff_t half_width, const py::object& out, int threads, const py::object& progress) {
    hrws::PgaOptions options;
    options.estimate.do_no_harm = do_no_harm;
    options.band = band_of(interpolation, doppler_bandwidth, doppler_centroid, margin, noise, condition_limit);
    options.half_width = half_width;
    return compensate(echo, grid, region, options, hrws::pga, out, threads, progress);
}

void bind_results(py::module_& m) {
    py::native_enum<SiMecStatus>(m, "SiMecStatus", "enum.Enum", "How a motion compensation by sub-images ended.")
        .value("converged", SiMecStatus::converged)
        .value("max_iterations", SiMecStatus::max_iterations)
        .value("inconsistent", SiMecStatus::inconsistent)
        .value("no_strong_point", SiMecStatus::no_strong_point)
        .value("not_improved", SiMecStatus::not_improved)
        .finalize();

    py::class_<PythonSiMec>(m, "SiMecResult", "Image and motion, and how well the regions agree on it; see si_mec.")
        .def_property_readonly(
            "image", [](const PythonSiMec& r) { return r.image; }, "complex64 [grid.shape]")
        .def_property_readonly(
            "motion", [](const PythonSiMec& r) { return to_numpy(r.found.motion.copy()); },
            "float64 [n_pulse, 3], m, added to the phase centres of every channel; zero unless the status is converged or max_iterations.")
        .def_property_readonly(
            "motion_std", [](const PythonSiMec& r) { return to_numpy(r.found.motion_std.copy()); },
            "float64 [n_pulse, 3], m, from the residual phases.")
        .def_property_readonly(
            "estimate", [](const PythonSiMec& r) { return to_numpy(r.found.estimate.copy()); },
            "float64 [n_pulse, 3], m, the motion estimated, handed out or not.")
        .def_property_readonly(
            "regions",
            [](const PythonSiMec& r) {
                return py::array_t<autofocus::TrajectoryPoint>(static_cast<py::ssize_t>(r.found.regions.size()), r.found.regions.data());
            },
            "structured array, one for each region: position (m), power, coherence_before, coherence, and by the motion that the others "
            "give\n"
            "held_out_before, held_out, spread (m, RMS of the region's ranges from theirs); nan where those don't determine one.")
        .def_property_readonly(
            "coherence_before", [](const PythonSiMec& r) { return r.found.coherence_before; }, "Mean over the regions, without motion.")
        .def_property_readonly(
            "coherence", [](const PythonSiMec& r) { return r.found.coherence; }, "Mean over the regions, with the estimate.")
        .def_property_readonly(
            "coherence_by_chance", [](const PythonSiMec& r) { return r.found.coherence_by_chance; }, "What random phases reach.")
        .def_property_readonly(
            "spread", [](const PythonSiMec& r) { return r.found.spread; }, "m, the largest of the regions; nan where none can be told.")
        .def_property_readonly(
            "contrast", [](const PythonSiMec& r) { return to_numpy(r.found.contrast); },
            "float64, of every region: its power over the median of the echo's over range.")
        .def_property_readonly(
            "line_removed", [](const PythonSiMec& r) { return r.found.line_removed; },
            "Whether constant and line over the pulses were taken out of the motion, as the gauge.")
        .def_property_readonly(
            "objective", [](const PythonSiMec& r) { return to_numpy(r.found.objective); },
            "float64, of the last alternation, step by step.")
        .def_property_readonly(
            "status", [](const PythonSiMec& r) { return r.found.status; }, "SiMecStatus")
        .def_property_readonly(
            "reason", [](const PythonSiMec& r) { return r.found.reason; }, "One sentence.")
        .def_property_readonly(
            "timings", [](const PythonSiMec& r) { return timings_of(r.found.timings); }, "dict, s.")
        .def_property_readonly("threads", [](const PythonSiMec& r) { return r.found.threads; })
        .def("summary", [](const PythonSiMec& r) { return r.found.summary(); }, "A few lines for people.");

    py::class_<PythonPhaseCompensation>(m, "PhaseCompensation", "What one phase for each evenly spaced sample makes; see bp_fmsa and pga.")
        .def_property_readonly(
            "image", [](const PythonPhaseCompensation& r) { return r.image; }, "complex64 [grid.shape]")
        .def_property_readonly(
            "phase_error", [](const PythonPhaseCompensation& r) { return to_numpy(r.found.phase_error); },
            "float64 [n_pulse * n_channel], rad, over the evenly spaced samples; corrected by exp(-1j * phase_error).")
        .def_property_readonly(
            "status", [](const PythonPhaseCompensation& r) { return r.found.status; },
            "Of gpga, which may refuse (the phase is zero then); \"applied\" of bp_fmsa.")
        .def_property_readonly("timings", [](const PythonPhaseCompensation& r) { return timings_of(r.found.timings); }, "dict, s.");
}

void bind_si_mec(py::module_& m) {
    const hrws::SiMecOptions defaults;
    m.def("si_mec", &si_mec, py::arg("echo"), py::arg("grid"), py::arg("regions"), py::arg("unknowns") = "height",
          py::arg("reconstruction") = "folded", py::kw_only(), py::arg("pixels") = "joint", py::arg("knots") = py::none(),
          py::arg("up") = defaults.motion.up, py::arg("search") = defaults.motion.search, py::arg("agreement") = defaults.agreement,
          py::arg("do_no_harm") = true, py::arg("interpolation") = "mmse", py::arg("doppler_bandwidth") = 0.0,
          py::arg("doppler_centroid") = 0.0, py::arg("margin") = py::none(), py::arg("noise") = 1e-3, py::arg("condition_limit") = 1e3,
          py::arg("half_width") = 8, py::arg("out") = py::none(), py::arg("threads") = 0, py::arg("progress") = py::none(),
          R"(Motion compensation of a multichannel strip by sub-images [Zhou2022]: from the echo to the image.

The motion of the platform that makes one strong point in each region brightest is estimated from the terms of all channels, then the image is
reconstructed from phase centres moved by it. Where along the track the scene lies the channels tell, unless noise hides it.

Parameters
----------
echo : Echo
grid : ImageGrid
    Where the pixels of the image lie.
regions : sequence of ImageGrid
    Two or more small chips round strong points, far apart in range; the first index along the track.
unknowns : {"height", "cross_track", "full"}
    Along `up`, in the plane perpendicular to the track, or in space. With a displacement of its own in every pulse these take at least 2, 2
    and 4 regions. With "cross_track" and two regions the motion is solved for: no region can then vouch for the other.
reconstruction : {"folded", "sub_image"}
    As for `reconstruct`.
pixels : {"joint", "brightest"}
    joint: every region's pixel is the one that together with the others can be made most coherent; for a few points that stand out of the
    echo of a pulse. brightest: the brightest pixel of the image as it stands, then of that with the motion found; for tens to thousands of
    points that clutter hides in each pulse, of errors that leave some of them visible.
knots : int, optional
    Pulses between the knots of a cubic spline; by default every pulse is free.
up : (float, float, float)
    The direction of the height.
search : float
    m, either side, of a free displacement; 0: half of what turns the phase by a full turn, then twice that where the regions
    agree better.
agreement : float
    A region contradicts the others where their motion leaves it less coherent than this share of what it is with its own say.
do_no_harm : bool
    A motion of zero where coherence is not above what random phases reach, not better than before, or the regions contradict one another.
interpolation, doppler_bandwidth, doppler_centroid, margin, noise, condition_limit, half_width
    As for `reconstruct`.
out : complex64 [grid.shape], optional
    Where the image goes; any strides.
threads, progress
    As everywhere.

Returns
-------
SiMecResult
    image, motion [n_pulse, 3] m, regions (coherence and spread of each), status, reason, timings.

Raises
------
ShapeError, ValueError, TypeError, NumericalError, MemoryError
    ValueError for too few regions, regions all at one range, or one without any echo.)");
}

void bind_after_reconstruction(py::module_& m) {
    const autofocus::SharpestPhaseOptions sharpest;
    m.def("bp_fmsa", &bp_fmsa, py::arg("echo"), py::arg("grid"), py::arg("region"), py::kw_only(),
          py::arg("iterations") = sharpest.iterations, py::arg("tolerance") = sharpest.tolerance, py::arg("interpolation") = "mmse",
          py::arg("doppler_bandwidth") = 0.0, py::arg("doppler_centroid") = 0.0, py::arg("margin") = py::none(), py::arg("noise") = 1e-3,
          py::arg("condition_limit") = 1e3, py::arg("half_width") = 8, py::arg("out") = py::none(), py::arg("threads") = 0,
          py::arg("progress") = py::none(),
          R"(Reconstruction to even spacing, then one phase for each of its samples by the greatest sharpness of one region.

What Zhou et al. 2022 compare with: it knows neither that phase errors change with range nor that the channels of a pulse share a motion.

Parameters
----------
echo : Echo
    Its range_start a number.
grid : ImageGrid
    Where the pixels of the image lie.
region : ImageGrid
    The chip to judge by.
iterations, tolerance
    As for `sharpest_phase`.
interpolation, doppler_bandwidth, doppler_centroid, margin, noise, condition_limit, half_width
    As for `reconstruct`.
out, threads, progress
    As everywhere.

Returns
-------
PhaseCompensation

Raises
------
ShapeError, ValueError, TypeError, NumericalError, MemoryError)");

    m.def("pga", &pga, py::arg("echo"), py::arg("grid"), py::arg("region"), py::kw_only(), py::arg("do_no_harm") = true,
          py::arg("interpolation") = "mmse", py::arg("doppler_bandwidth") = 0.0, py::arg("doppler_centroid") = 0.0,
          py::arg("margin") = py::none(), py::arg("noise") = 1e-3, py::arg("condition_limit") = 1e3, py::arg("half_width") = 8,
          py::arg("out") = py::none(), py::arg("threads") = 0, py::arg("progress") = py::none(),
          R"(Reconstruction to even spacing, then the phase that `gpga` finds in one region, for the whole scene.

Parameters
----------
echo : Echo
    Its range_start a number.
grid : ImageGrid
    Where the pixels of the image lie.
region : ImageGrid
    The chip to estimate from.
do_no_harm : bool
    A phase of zero where the region does not become better.
interpolation, doppler_bandwidth, doppler_centroid, margin, noise, condition_limit, half_width
    As for `reconstruct`.
out, threads, progress
    As everywhere.

Returns
-------
PhaseCompensation

Raises
------
ShapeError, ValueError, TypeError, NumericalError, MemoryError)");
}

}  // namespace

void bind_hrws_motion(py::module_ m) {
    bind_results(m);
    bind_si_mec(m);
    bind_after_reconstruction(m);
}

}  // namespace sarfocus::python
