#pragma once

#include <sarfocus/core/array_view.hpp>
#include <sarfocus/core/export.hpp>

namespace sarfocus::geometry {

/// Where the platform was, as recorded by a clock of its own; views, owned by the caller.
struct Track {
    ArrayView<const double, 1> time;      ///< [n], s, increasing, n >= 2
    ArrayView<const double, 2> position;  ///< [n, 3], m

    /// Throws ShapeError, ValueError (time that does not increase), NumericalError (NaN or infinity).
    SARFOCUS_API void validate() const;
};

/// Positions at other times, linear between the samples of the track; never beyond its ends.
/// at: [m], s, in any order; out: [m, 3], m, overwritten. Throws as `Track::validate` does, ValueError for a time outside the track.
SARFOCUS_API void interpolate_track(const Track& track, const ArrayView<const double, 1>& at, const ArrayView<double, 2>& out);

/// Weight of every pulse by the length of path it stands for: half the distance between its two neighbours, at the ends the distance to
/// the one neighbour. Zero where that is at most `minimum_step`, because the platform rests there; the others have mean 1. Data multiplied
/// by it sum up over the path in place of time, so that slow stretches and rests count no more than their length.
///
/// positions: [n, 3], m, n >= 2; minimum_step: m, >= 0, above the jitter of the positions; out: [n], overwritten. Throws ShapeError,
/// ValueError (no pulse moves by more than `minimum_step`), NumericalError.
SARFOCUS_API void path_weights(const ArrayView<const double, 2>& positions, double minimum_step, const ArrayView<double, 1>& out);

}  // namespace sarfocus::geometry
