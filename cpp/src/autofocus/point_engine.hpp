#pragma once

#include <optional>
#include <vector>

#include <sarfocus/autofocus/options.hpp>
#include <sarfocus/autofocus/result.hpp>

#include "picture.hpp"
#include "point_source.hpp"

namespace sarfocus::autofocus::detail {

/// What a method does its own way.
struct PointPlan {
    std::optional<PartColumns> coarse;  ///< where the points of coarse rounds come from; none: the strongest maxima of the image
    int coarse_iterations = 30;         ///< of the alternation, at most: a start for the fine rounds, not a result
    int fine_iterations = 50;
    int fine_rounds_of_halves = 1000;  ///< at most so many where one half of the scene is to judge the other
    bool coarse_only = false;          ///< the windowed lines of the last coarse round are the result: the classic method
    /// Do the coarse rounds with the strongest maxima too, and go on from the phase with which the pixels it came from are sharper.
    bool compare_starts = false;
    PictureRequest picture;
    int passes = 1;  ///< at most: coarse and fine rounds again, as long as the phase does not stand still and the pixels get sharper
};

/// Estimates the phase of a source's pulses from its strong points and decides whether it helps. Fills everything of the result but the
/// caller's image; estimate and phase_std are over the source's pulses. A large source has no more fine points than columns, or 512 (half
/// as many in a half), and every fine phase is smoothed by how well it is known. It is tried in a quick way first: no more than 64 coarse
/// points (32 of a half), few iterations, rounds until they change little; what that does not improve is tried again as any source is.
[[nodiscard]] Result estimate_from_points(PointSource& source, const PointOptions& options, const PointPlan& plan = {});

}  // namespace sarfocus::autofocus::detail
