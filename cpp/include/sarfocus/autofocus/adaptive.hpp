#pragma once

#include <cstddef>
#include <vector>

#include <sarfocus/autofocus/phase_estimate.hpp>
#include <sarfocus/autofocus/result.hpp>
#include <sarfocus/core/array.hpp>
#include <sarfocus/core/array_view.hpp>
#include <sarfocus/core/execution.hpp>
#include <sarfocus/core/export.hpp>
#include <sarfocus/geometry/stripmap_geometry.hpp>

/// Scene-adaptive phase gradient autofocus [Luo2025] and its steps, one function each. Every step gives the same bits for any number of
/// threads and any strides.
namespace sarfocus::autofocus {

struct CfarGateOptions {
    /// Azimuth pixels over which intensity is averaged before it is tested: 1 or even. {1} is the paper's test. A defocused point spreads
    /// over its own reference cells, where only its energy stands out: 3 points 25 dB over the clutter with 10 rad of quadratic error are
    /// missed by {1} and found by the default. Longer boxes must stand out of the same boxes in other gates as well, which keeps bright
    /// fields out.
    std::vector<int> extents = {1, 4, 16, 64};
    /// Above 0: this factor, on amplitudes of single pixels, whatever the extents. The figures that the paper gives for mu = 3 to 5 hold
    /// for amplitudes alone: the brightest of a million intensities of plain speckle is 14 times their mean.
    double mu = 0.0;
    /// With mu = 0: chance that plain speckle passes for strong points, of the whole scene. The paper's mu = N (Pfa^(-1/N) - 1), on
    /// intensities, with Pfa this share of it: over all extents and all boxes of an extent, of which the five strongest are tested.
    double false_alarm_probability = 1e-3;
    int reference = 16;  ///< cells, both sides together, as long as the extent [Luo2025]
    int guard = 3;       ///< cells left out on each side: main lobe and first side lobes
    int cells = 5;       ///< strongest of the scene that are tested [Luo2025], for every extent
    Execution execution;

    SARFOCUS_API void validate() const;
};

/// Whether a scene has strong points.
struct CfarGate {
    std::vector<GateCell> cells;  ///< extent after extent, the strongest first
    bool strong_points = false;   ///< any of them was detected
    bool amplitudes = false;      ///< amplitudes were compared, with the paper's mu; else intensities
};

/// The five strongest samples of every range gate, coalesced, the five strongest of those by cell averaging along azimuth [Luo2025,
/// section 2.2.1]. Intensities that neighbouring pixels share (an oversampled image) count as fewer reference cells.
/// image: [n_azimuth, n_range]. Throws ShapeError, ValueError, NumericalError (NaN, infinity).
[[nodiscard]] SARFOCUS_API CfarGate cfar_gate(const ImageView& image, const CfarGateOptions& options = {});

/// The 1/16 of n_range gates about gate `centre` that is denoised where there are no strong points [Luo2025, section 2.2.2]:
/// [centre - n_range / 32, centre + n_range / 32), moved into the image, at least three gates where there are so many.
struct GateSpan {
    std::ptrdiff_t first = 0;
    std::ptrdiff_t count = 0;
};
[[nodiscard]] SARFOCUS_API GateSpan gates_to_denoise(std::ptrdiff_t n_range, std::ptrdiff_t centre);

/// Mean of the 3 x 3 complex pixels about every pixel; those at the border of the image stay as they are [Luo2025, section 2.2.2].
///
/// Along azimuth that multiplies the spectrum by (1 + 2 cos w) / 3, which is negative beyond a third of the sampling rate: a phase
/// estimated there has a step of pi that all lines share. adaptive_pga takes that sign out again. filtered: the shape of image, must not
/// overlap it. Throws ShapeError.
SARFOCUS_API void mean_filter(const ImageView& image, MutableImageView filtered, const Execution& execution = {});

/// Azimuth sub-apertures of `length` lines, each overlapping the next by half; together they cover all lines [Luo2025, eq. 8, which holds
/// with P = length(x_i)]. The last is shorter by less than half where the length does not fit; one alone where the image is no longer than
/// `length`. Only first and count are set. length: even, at least 2. Throws ValueError.
[[nodiscard]] SARFOCUS_API std::vector<SubAperture> sub_apertures(std::ptrdiff_t n_azimuth, std::ptrdiff_t length);

/// Energy of every range gate in every such sub-aperture [n_sub_aperture, n_range] [Luo2025, eq. 9-10].
/// Throws ShapeError, ValueError, NumericalError (NaN, infinity).
[[nodiscard]] SARFOCUS_API Array<double, 2> gate_energies(const ImageView& image, std::ptrdiff_t length, const Execution& execution = {});

/// Range gates that one sub-aperture's phase is estimated from.
struct GateChoice {
    std::vector<std::ptrdiff_t> gates;  ///< the strongest first, of equals the nearer; empty: skipped
    double mean_strong = 0.0;           ///< m1; of the strongest gate alone where it was skipped
    double mean_rest = 0.0;             ///< m2; 0 where there are no other gates
};

/// The k strongest gates, k halved (rounding down) until their mean energy exceeds eta times that of the others [Luo2025, eq. 11-13]; none
/// where k reaches 0. A k that leaves no others to compare with is halved as well. With energies of s samples of speckle and one point of
/// peak-to-clutter ratio p in a gate, m1 / m2 = 1 + p / s: what passes depends on the length of the sub-aperture.
/// energies: [n_range], finite, >= 0. k >= 1, eta > 0. Throws ShapeError, ValueError, NumericalError.
[[nodiscard]] SARFOCUS_API GateChoice choose_gates(const ArrayView<const double, 1>& energies, int k = 128, double eta = 2.7);

enum class WeakScene {
    denoise,  ///< estimate from the mean-filtered 1/16 of the range gates [Luo2025, section 2.2.2]
    skip      ///< hand the input back [Luo2025, section 2.2.1, last sentence]
};

struct AdaptiveOptions {
    int k = 128;       ///< gates to start with; fewer than 32 were too few in the paper
    double eta = 2.7;  ///< 2.6 to 2.8 in the paper
    /// Azimuth lines, even; 0: 512 for a spotlight image [Luo2025, section 2.2.4], the synthetic aperture of the middle gate for a strip.
    int sub_aperture = 0;
    CfarGateOptions gate;
    WeakScene weak_scene = WeakScene::denoise;
    /// Spotlight: range sampling rate over carrier frequency, -0.9 to 0.9. The error then comes off with the range migration that belongs
    /// to it, as pga_2d takes it off (range-Doppler model); 0: off the azimuth spectrum alone, as in the paper.
    double bandwidth_ratio = 0.0;
    Estimator estimator = Estimator::maximum_likelihood;  ///< the gradient is the paper's
    bool do_no_harm = true;                               ///< hand the input back where the score is not better; false: always apply
    Execution execution;

    SARFOCUS_API void validate() const;
};

/// Phase gradient autofocus that first looks whether there are strong points, and how many [Luo2025], of a spotlight image.
///
/// No strong point: the phase comes from the mean-filtered part of the scene. Else every sub-aperture gives the strongest sample of each
/// of its chosen gates for the coarse rounds, those together the gates that the fine rounds look for points in. Where the energy rule
/// skips every sub-aperture though a cell was detected, the gates of the detected cells are taken, in every sub-aperture. Beyond the
/// paper, where the input would come back, the conventional windowed rounds with the k strongest gates are tried as well (texture without
/// points tells them something), the estimate is one for the whole aperture (a spotlight point's history spans it all), by maximum
/// likelihood, and the input comes back where the score is not better.
///
/// image, corrected, phase_error, errors: as pga. Peak memory beside them: a quarter of the image at most, or 512 gates, three times.
SARFOCUS_API Result adaptive_pga(const ImageView& image, MutableImageView corrected, const AdaptiveOptions& options = {});

/// The same for a strip, whose phase error is over slow time: the points of all sub-apertures, the steadiest spread evenly, go the way of
/// spga_linear. image, corrected, phase_error, errors: as spga_linear.
SARFOCUS_API Result adaptive_pga(const ImageView& image, const geometry::StripmapGeometry& geometry, MutableImageView corrected,
                                 const AdaptiveOptions& options = {});

struct ConventionalOptions {
    int k = 128;             ///< gates of every sub-aperture, always
    int sub_aperture = 0;    ///< as AdaptiveOptions
    int iterations = 6;      ///< of choosing points, windowing and estimating
    double narrowing = 0.6;  ///< factor of the window from one iteration to the next
    bool do_no_harm = true;
    Execution execution;

    SARFOCUS_API void validate() const;
};

/// What adaptive PGA is measured against [Luo2025, section 2.1]: the strongest sample of the k strongest gates of every sub-aperture,
/// whatever the scene, and the phase gradient, in iterations with a narrowing window. Image, errors and result as adaptive_pga. Of a
/// spotlight image the strongest max(512, n_range / 2) of these samples, so that memory stays below that of the image.
SARFOCUS_API Result conventional_pga(const ImageView& image, MutableImageView corrected, const ConventionalOptions& options = {});
SARFOCUS_API Result conventional_pga(const ImageView& image, const geometry::StripmapGeometry& geometry, MutableImageView corrected,
                                     const ConventionalOptions& options = {});

}  // namespace sarfocus::autofocus
