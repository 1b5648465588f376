#pragma once

#include <vector>

#include <sarfocus/autofocus/spga.hpp>
#include <sarfocus/autofocus/strip.hpp>

#include "strip_score.hpp"

namespace sarfocus::autofocus::detail {

/// What one block of range gates gives.
struct RangeBlock {
    Apertures apertures;
    Stitching stitching;
    StripPhase phase;
    std::vector<double> shift;  // azimuth pixels by which each point is moved
    StripEvidence evidence;
    double centre = 0.0;  // range gate, mean of the points' weighted by what they tell

    [[nodiscard]] bool empty() const { return apertures.size() == 0; }
};

/// Leaves the blocks whose points gain by the phase of the others; where none do, all that have points.
void keep_reliable(std::vector<RangeBlock>& blocks);

/// Brings the phases of neighbouring blocks, each known up to a constant and a line, onto one gauge. From the best known block outwards,
/// every segment loses the constant and line by which it differs from its neighbour over the samples that both reach. Where no aperture of
/// a block reaches (or one alone, or a segment of fewer than four points, where two other blocks know better; phase_std becomes nan), its
/// phase runs beside that of the nearest block that reaches there. Last, one line for all as the gauge asks. Throws ValueError where a tie
/// point matches no point.
void lay_together(std::vector<RangeBlock>& blocks, const SpgaLinearOptions& options);

}  // namespace sarfocus::autofocus::detail
