// From a path through the nodes to a range for every pulse, by the phase.
#pragma once

#include <cstddef>
#include <vector>

#include <sarfocus/core/array_view.hpp>

#include "ridge_search.hpp"

namespace sarfocus::autofocus::detail {

struct RefinedRidge {
    std::vector<double> bin;  ///< [n_pulse], fraction of a bin; nan where the ridge isn't seen
    double power = 0.0;
    double coherence = 0.0;
    double envelope_std = 0.0;  ///< bins
};

/// samples: [n_pulse, n_bin]; resolution: bins.
[[nodiscard]] RefinedRidge refine(const ImageView& samples, const RidgeGrid& grid, const RidgeTrace& trace, double resolution);

}  // namespace sarfocus::autofocus::detail
