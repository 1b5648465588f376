#pragma once

#include <vector>

#include <sarfocus/autofocus/result.hpp>
#include <sarfocus/autofocus/strip.hpp>
#include <sarfocus/core/execution.hpp>

namespace sarfocus::autofocus::detail {

/// Whether the points agree on a phase, before the image is looked at.
struct StripEvidence {
    std::vector<double> held_out_gain;  ///< nat [n_point], of log peak with the phase of other points; nan where they do not reach it
    double mean_gain = 0.0;
    double noise = 0.0;        ///< standard error of the mean gain
    int judged = 0;            ///< points that others reach
    double own_gain_db = 0.0;  ///< of the points' peaks with the phase of all
    bool agrees = false;
    std::string reason;
};

/// The points are dealt out into groups; every group's peaks are judged with the phase of all others, estimated anew. Where hardly any
/// point is reached by others, each must be steadier than speckle instead, and its peak rise.
[[nodiscard]] StripEvidence weigh_points(const Apertures& apertures, const std::vector<Seam>& seams, const StripPhase& phase,
                                         const Execution& execution);

}  // namespace sarfocus::autofocus::detail
