#pragma once

#include <vector>

#include <sarfocus/core/array.hpp>
#include <sarfocus/core/array_view.hpp>
#include <sarfocus/core/execution.hpp>
#include <sarfocus/core/export.hpp>
#include <sarfocus/geometry/stripmap_geometry.hpp>

/// Errors of the antenna's track across the flight direction, from phase errors in several range blocks and back [methods 5].
///
/// The ground is flat, the antenna `height` above it, the look broadside: at slant range R the look angle from the vertical is theta,
/// cos(theta) = height / R. displacement(k, 0): by how much the antenna really was nearer to the scene than the image was formed for, along
/// the ground, m; displacement(k, 1): by how much it was higher, m. Range and phase error of everything at R then change by
///     delta_R = -displacement(k, 0) sin(theta) + displacement(k, 1) cos(theta),    phi = -4 pi delta_R / wavelength.
/// A target at Doppler frequency f off broadside sees cos(squint), squint = asin(wavelength f / (2 velocity)), of it; that factor is taken
/// for one.
namespace sarfocus::autofocus {

enum class CrossTrackUnknowns {
    height,      ///< the vertical component; the horizontal one is zero
    horizontal,  ///< the horizontal component; the vertical one is zero
    cross_track  ///< both
};

struct CrossTrackOptions {
    CrossTrackUnknowns unknowns = CrossTrackUnknowns::cross_track;
    /// Blocks that lie at so nearly the same look angle that `condition` exceeds this are refused: a phase error of a hundredth of a radian
    /// would pass for one of a whole.
    double maximum_condition = 100.0;
    /// rad, added in squares to phase_std: what one range for a whole block and flat ground leave unexplained, of that size for errors of
    /// some radians over four blocks. Without it a block that is believed exact overrules all others.
    double model_std = 0.1;

    SARFOCUS_API void validate() const;
};

struct CrossTrackError {
    Array<double, 2> displacement;  ///< m [n_azimuth, 2]: towards the scene, up
    Array<double, 2>
        displacement_std;  ///< m [n_azimuth, 2], from phase_std and model_std; nan where too few blocks reach, or without a phase_std
    /// RMS, rad [n_block], of what the displacement leaves of the phase of every block, its constant and line aside: much above the phase's
    /// deviation where the ground is not flat, the height is wrong or a phase has slipped. nan for a block without samples in use.
    std::vector<double> residual_rms;
    /// How much worse the worst known direction in the plane (or the one component) is known than a displacement along the line of sight of
    /// all blocks would be: sqrt(n_block) / smallest singular value of the rows (sin(theta_b), -cos(theta_b)).
    double condition = 1.0;
};

/// Weighted least squares for the displacement at every slow-time sample together with a constant and a line of every block, which the
/// phases are known up to. What no phase tells is a constant and a line of either component: they are taken out, over the samples found
/// (so must be those of a true track before it is compared).
///
/// block_phase: [n_block, n_azimuth], rad, unwrapped along slow time. phase_std: the same shape, rad; nan or infinite where a block is not
/// to be used; or empty: all samples alike. slant_range: [n_block], m, that the phase of a block belongs to. height, wavelength: m. Samples
/// that fewer blocks than unknowns (or blocks of nearly the same look angle) reach get the displacement interpolated linearly between those
/// found; before the first and behind the last it stays the same.
///
/// displacement_std takes the constants and lines for known: that of a strip many samples long. Throws ShapeError, ValueError (a slant
/// range below the height), NumericalError (look angles too close, no sample that enough blocks reach, NaN).
[[nodiscard]] SARFOCUS_API CrossTrackError cross_track_error(const ArrayView<const double, 2>& block_phase,
                                                             const ArrayView<const double, 2>& phase_std,
                                                             const ArrayView<const double, 1>& slant_range, double height,
                                                             double wavelength, const CrossTrackOptions& options = {});

/// The phase error that a displacement makes at every slant range. displacement: [n_azimuth, 2], m; slant_range: [n_range], m; phase:
/// [n_range, n_azimuth], rad, written. Throws ShapeError, ValueError, NumericalError (NaN), Cancelled.
SARFOCUS_API void cross_track_phase(const ArrayView<const double, 2>& displacement, const ArrayView<const double, 1>& slant_range,
                                    double height, double wavelength, const ArrayView<double, 2>& phase, const Execution& execution = {});

/// Takes the phase error of a displacement off a compressed strip, each range gate by that of its own look angle: focus::azimuth_correct.
/// displacement: [n_azimuth, 2], m. image, corrected: [n_azimuth, n_range], as for azimuth_correct; may be the same view. Throws as
/// azimuth_correct and cross_track_phase do.
SARFOCUS_API void correct_cross_track(const ImageView& image, const geometry::StripmapGeometry& geometry,
                                      const ArrayView<const double, 2>& displacement, double height, const MutableImageView& corrected,
                                      const Execution& execution = {});

}  // namespace sarfocus::autofocus
