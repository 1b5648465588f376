#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include <sarfocus/autofocus/result.hpp>
#include <sarfocus/core/array.hpp>
#include <sarfocus/core/array_view.hpp>
#include <sarfocus/core/execution.hpp>
#include <sarfocus/core/export.hpp>
#include <sarfocus/detect/cfar.hpp>
#include <sarfocus/geometry/stripmap_geometry.hpp>

/// The steps of stripmap autofocus, one function each [Xie2023, table 1]; `spga_linear` runs them one after the other.
///
/// Slow time is counted in azimuth samples k of the strip; a phase error multiplies the decompressed strip by exp(j phi(k)). Every step
/// gives the same bits for any number of threads.
namespace sarfocus::autofocus {

/// A strong point of a defocused strip, as detected.
struct StripPoint {
    std::int64_t azimuth = 0;                                    ///< pixel where it is brightest
    std::int64_t range = 0;                                      ///< gate
    std::int64_t extent = 1;                                     ///< pixels of azimuth over which its energy was collected
    double energy = 0.0;                                         ///< sum of intensity over the extent, less the clutter's share
    double statistic = 0.0;                                      ///< nat, log likelihood ratio of that energy against clutter alone
    double contrast = std::numeric_limits<double>::quiet_NaN();  ///< Q_k [Xie2023, eq. 5]; nan before it is computed
};

struct StripSelectOptions {
    /// Lengths in azimuth pixels over which energy is collected: a defocused point is weak in any single pixel and strong in their sum.
    std::vector<int> extents = {1, 4, 16, 64, 256};
    /// The 2-D test of every candidate; its cells are as long as the candidate's extent. One longer than a pixel must also stand out of the
    /// brighter side in azimuth and in range (greatest_of): borders of bright fields are no points.
    detect::CfarOptions cfar = {.reference = {6, 6}, .guard = {2, 2}, .execution = {}};
    double maximum_contrast = 0.25;  ///< Q_k above which a candidate goes: 0 for an ideal point, 0.215 for speckle, more for what is uneven
    int points = 0;                  ///< at most so many; 0: the smaller of K_up [Xie2023, eq. 25] and `points_per_aperture`
    int points_per_aperture = 24;    ///< the phase of more of them is known well enough
    /// A candidate so far below the strongest within half an aperture and 16 gates is its side lobe; 10 dB more in the gate itself,
    /// anywhere.
    double dynamic_range_db = 30.0;
    int window = 0;  ///< half width of the piece of image cut for Q_k, pixels; 0: as `extract`
    Execution execution;

    SARFOCUS_API void validate() const;
};

/// Candidates from 2-D CFAR, filtered by the contrast of their decompressed signal, spread evenly along azimuth [Xie2023, section 3.1].
/// image: [n_azimuth, n_range] compressed strip. Ordered by azimuth, then range. Throws ShapeError, ValueError, NumericalError.
[[nodiscard]] SARFOCUS_API std::vector<StripPoint> select_strip_points(const ImageView& image, const geometry::StripmapGeometry& geometry,
                                                                       const StripSelectOptions& options = {});

/// Half width, azimuth pixels, of the pieces that hold what the points spread over: a twelfth of the aperture (at least 32), doubled up to
/// three times, as long as a piece is shorter than half an aperture, while half of the points have less than 94 % of the energy in it that
/// they have in twice the width. The clutter's share is taken off. Throws as `select_strip_points`.
[[nodiscard]] SARFOCUS_API int containing_window(const ImageView& image, const geometry::StripmapGeometry& geometry,
                                                 const std::vector<StripPoint>& points);

struct StripExtractOptions {
    /// Half width of the piece of image cut round a point, pixels: what a defocused point spreads over, no more, to keep clutter out.
    /// 0: `containing_window`.
    int window = 0;
    /// Share of half the Doppler band over which the spectrum is tapered at either end. It rounds the ends of the decompressed signal,
    /// whose Fresnel ripple would otherwise be taken for phase error where a point is displaced.
    double taper = 0.3;
    Execution execution;

    SARFOCUS_API void validate() const;
};

/// The dechirped signals of strong points over their apertures.
struct Apertures {
    Array<cfloat, 2> lines;  ///< [n_point, n_sample]; a point's is A exp(j (phi(k) + a + b k)); zeros where there is none
    Array<float, 2> weight;  ///< [n_point, n_sample] an ideal point over clutter there, about 1 in the middle; noise goes as 1 / weight
    std::vector<std::ptrdiff_t> start;  ///< [n_point] slow time of sample 0
    std::vector<std::ptrdiff_t> count;  ///< [n_point] samples in use
    std::vector<double> fm_rate;        ///< [n_point] K / prf^2, cycles per sample squared
    std::vector<StripPoint> points;     ///< in order of azimuth
    std::ptrdiff_t n_azimuth = 0;
    double window = 0.0;  ///< half width of the pieces cut, pixels
    double taper = 0.0;

    [[nodiscard]] std::ptrdiff_t size() const { return static_cast<std::ptrdiff_t>(points.size()); }
    /// Azimuth pixels by which a linear phase of `slope` rad a sample displaces point n: slope / (2 pi K / prf^2) [Xie2023, eq. 4].
    [[nodiscard]] SARFOCUS_API double shift(std::ptrdiff_t n, double slope) const;
    /// Samples of line n whose noise is as good as one independent sample, from the width of the window.
    [[nodiscard]] SARFOCUS_API double samples_per_look(std::ptrdiff_t n) const;
};

/// Intercept, decompress, dechirp, window [Xie2023, section 3.2]: the piece of image round every point is decompressed by the conjugate of
/// the compression filter [methods 1] and divided by the signal of an ideal point in its middle. Apertures that reach beyond the strip are
/// cut off at its ends. Points in any order. Throws ShapeError, ValueError, NumericalError.
[[nodiscard]] SARFOCUS_API Apertures extract_apertures(const ImageView& image, const geometry::StripmapGeometry& geometry,
                                                       const std::vector<StripPoint>& points, const StripExtractOptions& options = {});

/// Q_k [Xie2023, eq. 5] of line n, over the samples whose weight is at least a half; 1 where the line is zero.
[[nodiscard]] SARFOCUS_API double aperture_contrast(const Apertures& apertures, std::ptrdiff_t n);

struct SlopeMatchOptions {
    int pairs_per_point = 16;       ///< overlaps behind every point, spread over all that it has
    double minimum_overlap = 0.15;  ///< of the shorter aperture
    Execution execution;

    SARFOCUS_API void validate() const;
};

/// Linear-phase matching by the tone that the conjugate product of two apertures is: the peak of its periodogram, refined
/// [methods 3, `slope`]. Throws ValueError.
[[nodiscard]] SARFOCUS_API std::vector<Seam> match_slope(const Apertures& apertures, const SlopeMatchOptions& options = {});

struct SearchMatchOptions {
    int width = 32;                 ///< W, even: positions tried for either point, pixels
    int largest_width = 1024;       ///< W doubles up to here while nothing satisfies eq. 15
    bool interpolation = true;      ///< search again between the pixels, in eighths [Xie2023, section 3.5 (1)]
    bool correction = true;         ///< add the slope that is left, step by step [Xie2023, section 3.5 (2), eq. 22]
    double minimum_overlap = 0.05;  ///< of the shorter aperture
    Execution execution;

    SARFOCUS_API void validate() const;
};

/// |R(i, j)| of two apertures [Xie2023, eq. 16], rad a sample, [width, width]: the slope of the phase of their product when the first point
/// is taken to be i - width / 2 pixels from where it was detected, the second j - width / 2. A valley, not a point [methods 3].
[[nodiscard]] SARFOCUS_API Array<double, 2> search_matrix(const Apertures& apertures, std::ptrdiff_t first, std::ptrdiff_t second,
                                                          int width);

/// Linear-phase matching of neighbours by the W x W traversal of the paper [Xie2023, section 3.3]; a slope is the difference of the two
/// chosen displacements, with what is left added where `correction` is set. Where nothing satisfies eq. 15 at the largest width, the seam
/// has weight 0 and coherence 0. Throws ValueError.
[[nodiscard]] SARFOCUS_API std::vector<Seam> match_search(const Apertures& apertures, const SearchMatchOptions& options = {});

/// The linear phases of all points, and what hangs together.
struct Stitching {
    std::vector<double> slope;  ///< rad a sample [n_point]: b_n; zero on average over every segment
    std::vector<int> segment;   ///< [n_point], 0, 1, … in order of azimuth: points joined by overlaps; -1: fits nothing, not used
    std::vector<Seam> seams;    ///< as given, with residual and weight
    int segments = 0;
};

/// Joint stitching: robust weighted least squares for the linear term of every point over all seams [methods 3]. Throws ValueError.
[[nodiscard]] SARFOCUS_API Stitching stitch(const Apertures& apertures, const std::vector<Seam>& seams);

/// A phase error over slow time.
struct StripPhase {
    std::vector<double> phase;        ///< rad [n_azimuth]; beyond the apertures it goes on as a line
    std::vector<double> phase_std;    ///< rad [n_azimuth], with constant and line of the segment removed; nan where no aperture reaches
    std::vector<double> coverage;     ///< apertures that reach a sample [n_azimuth]
    std::vector<double> slope;        ///< rad a sample [n_point]: linear phase of every point that is left, as stitched and refined
    std::vector<double> signal;       ///< |A_n|^2 [n_point]
    std::vector<double> noise;        ///< noise power of a sample of weight 1 [n_point]
    std::vector<double> information;  ///< share of every point in the phase [n_point]; all add up to one
    std::vector<int> segment;         ///< [n_point], as stitched
    std::vector<double>
        smoothness;     ///< of every segment: RMS of the second difference of the phase that the prior allows, rad per `knot`^2
    double knot = 1.0;  ///< samples between the values that the refinement estimates
};

/// phi' = arg of the sum over points of d(k) conj(d(k - 1)) exp(-j b_n), summed up along slow time [methods 3]: a single pass without
/// refinement. phase_std is that of the random walk.
[[nodiscard]] SARFOCUS_API StripPhase integrate_gradient(const Apertures& apertures, const Stitching& stitching,
                                                         const Execution& execution = {});

struct StripRefineOptions {
    /// Windows of the maximum-likelihood rounds round each point's tone, as shares of the extraction window.
    std::vector<double> windows = {1.0, 0.5};
    int rounds = 6;  ///< of the joint refinement, at most
    /// Join segments between which no aperture overlaps, by nothing but the smoothness of the phase: the answer is then one segment, and
    /// phase_std says how little is known across the gap.
    bool bridge = false;
    double tolerance = 1e-3;  ///< rad RMS change that ends it: far below any bound met in practice
    Execution execution;

    SARFOCUS_API void validate() const;
};

/// Maximum-likelihood phase of stitched apertures [methods 3]: the constants of all points from their products (no gradient is summed up,
/// so nothing drifts), the coherent sum over points, rounds with a narrowing window; then phase, constants and linear terms together, by
/// Gauss-Newton on the likelihood with a smoothness prior whose weight is the most likely one (a smoothing spline). Its posterior gives
/// phase_std. Throws ValueError.
[[nodiscard]] SARFOCUS_API StripPhase refine_strip_phase(const Apertures& apertures, const Stitching& stitching,
                                                         const StripRefineOptions& options = {});

}  // namespace sarfocus::autofocus
