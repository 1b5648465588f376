#pragma once

#include <vector>

#include <sarfocus/autofocus/result.hpp>
#include <sarfocus/autofocus/strip.hpp>
#include <sarfocus/core/array_view.hpp>
#include <sarfocus/core/execution.hpp>
#include <sarfocus/core/export.hpp>
#include <sarfocus/geometry/stripmap_geometry.hpp>

namespace sarfocus::autofocus {

enum class Matching {
    slope,  ///< the tone of every overlapping pair
    search  ///< the paper's traversal of neighbours
};

/// What is taken for the one linear phase that the data leave open [methods 0].
enum class Gauge {
    zero_mean_shift,  ///< the points are not moved on average, all alike but for those that tell next to nothing
    first_point,      ///< the first point in azimuth is not moved
    tie_points        ///< points at known positions come to lie there
};

struct TiePoint {
    double azimuth = 0.0;      ///< pixel where it belongs, fractional
    std::ptrdiff_t range = 0;  ///< gate
};

struct SpgaLinearOptions {
    Matching matching = Matching::slope;
    Gauge gauge = Gauge::zero_mean_shift;
    std::vector<TiePoint> tie_points;  ///< with Gauge::tie_points: at least one in every segment
    /// Maximum-likelihood refinement. False: phi' of the stitched apertures is summed up, once, as in the paper.
    bool refine = true;
    StripSelectOptions select;
    StripExtractOptions extract;
    SlopeMatchOptions slope;
    SearchMatchOptions search;
    StripRefineOptions refinement;
    /// Blocks of range gates with a phase of their own each, interpolated linearly between the mean gates of their points; 1: one phase for
    /// all gates. A block without points, or (do_no_harm) whose points gain nothing by a phase, has none; where no aperture of a block
    /// reaches (or one alone, or a segment of fewer than four points, where two other blocks know better), its phase runs beside that of
    /// the nearest that does. Neighbours are laid together by the constant and line that fit their difference, so that `gauge` leaves one
    /// line for all: tie points may lie in any block. See cross_track.hpp.
    int range_blocks = 1;
    bool do_no_harm = true;  ///< hand the input back where the score is not better; false: always apply
    Execution execution;     ///< of everything; those of the steps are not looked at

    SARFOCUS_API void validate() const;
};

/// Iteration-free stripmap autofocus that keeps the linear phase [Xie2023; methods 3]: select, extract, match, stitch, refine, gauge,
/// correct. One pass: the image is transformed once.
///
/// image: [n_azimuth, n_range] complex64, a compressed strip as azimuth_compress or form_stripmap makes it, with a phase error over slow
/// time that all range gates (of a block) share. corrected: the same shape, written; may be `image` itself, must not overlap it otherwise.
/// phase_error is over the slow time of azimuth_decompress(image): corrected = compress(decompress(image) * exp(-j phase_error)).
///
/// Status: gaps where the apertures fall into several segments, whose relative position then is not known, leave azimuth lines between them
/// out, or end more than half an aperture before the strip does; phase_std is nan where none reaches. Decision (do_no_harm): the phase from
/// the other points must raise a point's peak, on average over the points that others reach, by more than three times what chance gives;
/// the entropy of the whole image must fall; no more than a tenth of the points may lose 3 dB. Points that no other reaches must be steady
/// in themselves. Throws ShapeError, ValueError (geometry beyond small squint; tie points that match no point), NumericalError (NaN, all
/// zero), MemoryEstimateError, Cancelled.
SARFOCUS_API Result spga_linear(const ImageView& image, const geometry::StripmapGeometry& geometry, MutableImageView corrected,
                                const SpgaLinearOptions& options = {});

struct SpgaOptions {
    int iterations = 6;      ///< passes over the image [Xie2023]; each selects, estimates and corrects anew
    double narrowing = 0.7;  ///< factor of the window from one pass to the next, down to a quarter of the first
    StripSelectOptions select;
    StripExtractOptions extract;
    bool do_no_harm = true;
    Execution execution;

    SARFOCUS_API void validate() const;
};

/// Stripmap phase gradient autofocus [Xie2023, section 2; Luo2025, section 2.1], the baseline: of every aperture the phase gradient, less
/// its mean, averaged where apertures overlap and summed up. The mean that is taken off is the linear phase: targets stay displaced,
/// apertures do not fit together, and passes are needed. Memory, errors and result as for spga_linear; no seams, and phase_std is that of
/// the gradients of the last pass.
SARFOCUS_API Result spga(const ImageView& image, const geometry::StripmapGeometry& geometry, MutableImageView corrected,
                         const SpgaOptions& options = {});

}  // namespace sarfocus::autofocus
