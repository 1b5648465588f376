#pragma once

#include <sarfocus/autofocus/result.hpp>
#include <sarfocus/core/array_view.hpp>
#include <sarfocus/core/execution.hpp>
#include <sarfocus/core/export.hpp>
#include <sarfocus/geometry/stripmap_geometry.hpp>

/// Autofocus by the sharpness of the image itself: no strong point is looked for, one phase is found for every azimuth frequency
/// (spotlight) or slow-time sample (strips) with which a measure of the whole image is best.
///
/// With x the image and X its pulses (transform, or azimuth decompression), the sum of F(|x|^2) over the image grows when the phase of
/// pulse k becomes arg of the sum over gates of X_kn conj(D(w x)_kn), w = F', D the transform: for F convex in x by majorisation, by
/// ascent else. F(I) = I ln I for entropy [Kragh 2006, monotonic iterative algorithm for minimum-entropy autofocus], I^2 for contrast;
/// the energy, sum of I, does not change. A step that makes the measure worse is halved until it does not.
namespace sarfocus::autofocus {

struct SharpnessOptions {
    int smooth_rounds = 12;  ///< at most, for every order of the smooth phases that come first
    int free_rounds = 60;    ///< at most, with a phase for every pulse
    /// Order of the polynomial searched first, one coefficient after another, over +-`search` rad; then cosines, twice as many each time.
    int polynomial = 6;
    double search = 40.0;     ///< rad, peak of each polynomial term
    double tolerance = 2e-5;  ///< nat of the measure; rounds end when one gains less
    bool do_no_harm = true;   ///< hand the input back where the score is not better; false: always apply
    Execution execution;

    SARFOCUS_API void validate() const;
};

/// Least entropy -sum P ln P, P = |x|^2 / sum |x|^2. image, corrected, phase_error: as for `pga`. Estimated on the strongest range gates
/// (512, or the eighth of them).
///
/// A sparse scene is sharpest with a phase that is wrong: noise is turned in line with the points, two points become one. So each half
/// of the scene (range stripes) is judged with the phase of the other half, both estimated from the start; with nearly all information in
/// one half the points must be steadier than noise can be made, as for `pga`. And the entropy of the whole image must fall.
///
/// phase_std: half the difference between the phases of the two halves, smoothed along the aperture; nan where it was not judged, or where
/// one half has next to no information. Throws as pga does.
[[nodiscard]] SARFOCUS_API Result minimum_entropy(const ImageView& image, MutableImageView corrected, const SharpnessOptions& options = {});
/// Of a strip: phase_error over slow time, on azimuth_decompress(image), as for spga. image: [n_azimuth, n_range].
[[nodiscard]] SARFOCUS_API Result minimum_entropy(const ImageView& image, const geometry::StripmapGeometry& geometry,
                                                  MutableImageView corrected, const SharpnessOptions& options = {});

/// Largest sum |x|^4 / (sum |x|^2)^2, and so the largest contrast; in everything else as minimum_entropy.
[[nodiscard]] SARFOCUS_API Result maximum_contrast(const ImageView& image, MutableImageView corrected,
                                                   const SharpnessOptions& options = {});
[[nodiscard]] SARFOCUS_API Result maximum_contrast(const ImageView& image, const geometry::StripmapGeometry& geometry,
                                                   MutableImageView corrected, const SharpnessOptions& options = {});

}  // namespace sarfocus::autofocus
