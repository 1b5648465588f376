// Short coherent sums over range and its rate, and the best path through them.
#pragma once

#include <cstddef>
#include <vector>

#include <sarfocus/core/array.hpp>
#include <sarfocus/core/array_view.hpp>
#include <sarfocus/core/execution.hpp>

namespace sarfocus::autofocus::detail {

/// What the sums are taken over: nodes every `hop` pulses, bins of range, rates of -rates … rates bins from node to node.
struct RidgeGrid {
    std::ptrdiff_t n_node = 0;
    std::ptrdiff_t n_bin = 0;
    int hop = 1;          ///< pulses
    int half_window = 2;  ///< pulses
    int rates = 0;
    double step = 0.0;  ///< m, of a bin
    double wavelength = 0.0;
};

struct RidgeNode {
    std::ptrdiff_t node = 0;
    std::ptrdiff_t bin = 0;
    int rate = 0;  ///< bins from node to node
};

struct RidgeTrace {
    double score = 0.0;
    std::vector<RidgeNode> nodes;  ///< consecutive
};

/// Weights of a Hann window, 2 half_width + 1, none zero, the middle one 1.
[[nodiscard]] std::vector<double> hann_weights(int half_width);

/// |sum|^2 over the sum of the squared weights, so that noise has one level throughout: [n_node, 2 rates + 1, n_bin].
[[nodiscard]] Array<float, 3> slope_power(const ImageView& samples, const RidgeGrid& grid, const Execution& execution);

/// The path of the greatest sum of `score` [n_node, n_rate, n_bin]; empty where none is positive.
[[nodiscard]] RidgeTrace best_trace(const ArrayView<const float, 3>& score);

/// Lowers the score about a path so far that none leads there again.
void blank(const RidgeTrace& trace, std::ptrdiff_t bins, int rates, const ArrayView<float, 3>& score);

}  // namespace sarfocus::autofocus::detail
