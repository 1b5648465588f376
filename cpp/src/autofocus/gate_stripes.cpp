#include "gate_stripes.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <sarfocus/core/checks.hpp>

#include "strip_lines.hpp"

namespace sarfocus::autofocus::detail {
namespace {

constexpr double cells_per_stripe = 24.0;  // several times the response of a point with its first side lobes
constexpr double cells_of_margin = 4.0;    // on either side of a border: side lobes in range tell the other set of a point
constexpr double fewest_cells = 16.0;      // below that, margins would leave nothing
constexpr std::ptrdiff_t enough = 512;     // gates to score by, of an image with more

std::vector<double> strengths(const ImageView& image, const std::vector<std::ptrdiff_t>& edges, const Execution& execution) {
    std::vector<double> out(edges.size() - 1, 0.0);
    parallel_for(execution, "choose range gates", static_cast<std::int64_t>(out.size()), [&](std::int64_t s) {
        double sum = 0.0;
        for (std::ptrdiff_t i = 0; i < image.extent(0); ++i)
            for (std::ptrdiff_t j = edges[at(s)]; j < edges[at(s + 1)]; ++j) {
                const double intensity = std::norm(cdouble(image(i, j)));
                sum += intensity * intensity;
            }
        out[at(s)] = sum;
    });
    return out;
}

// Pairs of stripes to score by, ascending.
std::vector<std::ptrdiff_t> chosen_pairs(const ImageView& image, const std::vector<std::ptrdiff_t>& edges, const Execution& execution) {
    const auto count = static_cast<std::ptrdiff_t>(edges.size() - 1) / 2;
    std::vector<std::ptrdiff_t> pairs(at(count));
    std::iota(pairs.begin(), pairs.end(), std::ptrdiff_t{0});
    if (image.extent(1) <= enough) return pairs;
    const std::vector<double> strength = strengths(image, edges, execution);
    const auto of_pair = [&](std::ptrdiff_t p) { return strength[at(2 * p)] + strength[at(2 * p + 1)]; };
    std::stable_sort(pairs.begin(), pairs.end(), [&](std::ptrdiff_t a, std::ptrdiff_t b) { return of_pair(a) > of_pair(b); });
    const std::ptrdiff_t gates = std::max(enough, image.extent(1) / 4);
    pairs.resize(at(std::max<std::ptrdiff_t>(count * gates / image.extent(1), 1)));
    std::sort(pairs.begin(), pairs.end());
    return pairs;
}

}  // namespace

GateStripes stripes_of(const ImageView& image, const CellSize& cell, const Execution& execution) {
    GateStripes out;
    const std::ptrdiff_t n_range = image.extent(1);
    const double cells = static_cast<double>(n_range) / cell.range;
    if (cells < fewest_cells) return out;
    out.of_stripes = 2 * std::max<std::ptrdiff_t>(static_cast<std::ptrdiff_t>(cells / (2.0 * cells_per_stripe)), 1);
    std::vector<std::ptrdiff_t> edges;
    for (std::ptrdiff_t s = 0; s <= out.of_stripes; ++s) edges.push_back(s * n_range / out.of_stripes);
    const auto margin = static_cast<std::ptrdiff_t>(std::ceil(cells_of_margin * cell.range));
    for (const std::ptrdiff_t pair : chosen_pairs(image, edges, execution))
        for (const std::ptrdiff_t s : {2 * pair, 2 * pair + 1}) {
            ++out.stripes;
            for (std::ptrdiff_t j = edges[at(s)]; j < edges[at(s + 1)]; ++j) {
                const bool after_border = s == 0 || j >= edges[at(s)] + margin;
                const bool before_border = s + 1 == out.of_stripes || j < edges[at(s + 1)] - margin;
                out.gates[at(s % 2)].push_back(j);
                out.inner[at(s % 2)].push_back(after_border && before_border);
            }
        }
    return out;
}

Part::Part(const Subject& whole, const std::vector<std::ptrdiff_t>& gates, const Execution& execution) : strip_(whole.geometry != nullptr) {
    const std::array<std::ptrdiff_t, 2> extents{whole.image.extent(0), static_cast<std::ptrdiff_t>(gates.size())};
    require_memory(static_cast<std::uint64_t>(extents[0]) * static_cast<std::uint64_t>(extents[1]) * sizeof(cfloat),
                   "a part of the image, to score methods by");
    pixels_ = Array<cfloat, 2>(extents);
    load(whole.image, gates, execution);
    if (!strip_) return;
    geometry_ = *whole.geometry;
    geometry_.slant_range.clear();
    for (const std::ptrdiff_t g : gates) geometry_.slant_range.push_back(whole.geometry->slant_range[at(g)]);
}

void Part::load(const ImageView& whole, const std::vector<std::ptrdiff_t>& gates, const Execution& execution) {
    constexpr std::ptrdiff_t rows = 64;
    parallel_for(execution, "part", (pixels_.extent(0) + rows - 1) / rows, [&](std::int64_t b) {
        for (std::ptrdiff_t i = b * rows; i < std::min((b + 1) * rows, pixels_.extent(0)); ++i)
            for (std::ptrdiff_t j = 0; j < pixels_.extent(1); ++j) pixels_(i, j) = whole(i, gates[at(j)]);
    });
}

}  // namespace sarfocus::autofocus::detail
