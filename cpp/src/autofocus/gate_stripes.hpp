#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include <sarfocus/core/array.hpp>

#include "method_table.hpp"
#include "strong_points.hpp"

namespace sarfocus::autofocus::detail {

/// Range gates in alternate stripes, half of them to estimate from and half to judge by.
struct GateStripes {
    std::array<std::vector<std::ptrdiff_t>, 2> gates;  ///< of either set, ascending
    std::array<std::vector<bool>, 2> inner;            ///< whether a gate lies far enough from the other set to judge by
    std::ptrdiff_t stripes = 0;                        ///< in use
    std::ptrdiff_t of_stripes = 0;                     ///< that the image has
};

/// Stripes of 24 resolution cells or a little more, two at least. Of an image with more than 512 gates, neighbouring pairs of stripes with
/// the largest sums of squared intensity, together 512 or a quarter of the gates. Empty sets where the image has fewer than 16 resolution
/// cells.
[[nodiscard]] GateStripes stripes_of(const ImageView& image, const CellSize& cell, const Execution& execution);

/// Chosen gates of an image in memory of their own, with the geometry of just these.
class Part {
public:
    Part() = default;
    Part(const Subject& whole, const std::vector<std::ptrdiff_t>& gates, const Execution& execution);

    [[nodiscard]] Subject subject() const { return {pixels_.view(), strip_ ? &geometry_ : nullptr}; }
    /// The same pixels, to be written over.
    [[nodiscard]] MutableImageView pixels() { return pixels_.view(); }
    /// What they were at first. gates: as given to the constructor.
    void load(const ImageView& whole, const std::vector<std::ptrdiff_t>& gates, const Execution& execution);

private:
    Array<cfloat, 2> pixels_;
    geometry::StripmapGeometry geometry_;
    bool strip_ = false;
};

}  // namespace sarfocus::autofocus::detail
