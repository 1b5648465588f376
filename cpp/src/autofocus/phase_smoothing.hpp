#pragma once

#include <vector>

namespace sarfocus::autofocus::detail {

/// A phase with the part of its noise taken out that lies beyond what the phase itself holds.
struct SmoothedPhase {
    std::vector<double> phase;
    double variance_share = 1.0;  ///< of the mean squared error before, as estimated
};

/// Keeps the cosines (DCT) of a phase up to a cut-off, that with the least estimate of the mean squared error which needs no truth: a
/// coefficient left out costs a^2 - s^2, one kept s^2 [Stein1981]. A smooth phase loses nearly all of its noise, a white one is left as it
/// is. phase: rad [n]; std: rad [n], its own standard deviation, s^2 their mean square. With a nan among them nothing is taken out.
[[nodiscard]] SmoothedPhase smoothed(const std::vector<double>& phase, const std::vector<double>& std);

}  // namespace sarfocus::autofocus::detail
