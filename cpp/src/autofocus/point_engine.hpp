#pragma once

#include <functional>
#include <vector>

#include <sarfocus/autofocus/options.hpp>
#include <sarfocus/autofocus/result.hpp>

#include "point_source.hpp"
#include "strong_points.hpp"

namespace sarfocus::autofocus::detail {

/// Points for a coarse round from the image as it is focused so far; `wanted` excludes pixels, an empty view none.
using PointChooser =
    std::function<std::vector<Pixel>(const ImageView& image, const CellSize& cell, const ArrayView<const bool, 2>& wanted)>;

/// What a method does its own way.
struct PointPlan {
    PointChooser coarse;         ///< empty: the strongest maxima of the image
    int coarse_iterations = 30;  ///< of the alternation, at most: a start for the fine rounds, not a result
    int fine_iterations = 50;
    int fine_rounds_of_halves = 1000;  ///< at most so many where one half of the scene is to judge the other
    bool coarse_only = false;          ///< the windowed lines of the last coarse round are the result: the classic method
    /// Do the coarse rounds with the strongest maxima too, and go on from the phase with which the pixels it came from are sharper.
    bool compare_starts = false;
    int passes = 1;  ///< at most: coarse and fine rounds again, as long as the phase does not stand still and the pixels get sharper
};

/// Estimates the phase of a source's pulses from its strong points and decides whether it helps. Fills everything of the result but the
/// caller's image; estimate and phase_std are over the source's pulses.
[[nodiscard]] Result estimate_from_points(PointSource& source, const PointOptions& options, const PointPlan& plan = {});

}  // namespace sarfocus::autofocus::detail
