#include <sarfocus/detect/local_maxima.hpp>

#include <algorithm>
#include <cmath>
#include <string>
#include <unordered_map>
#include <utility>

#include <sarfocus/core/checks.hpp>
#include <sarfocus/core/error.hpp>

#include "power.hpp"

namespace sarfocus::detect {
namespace {

using detail::PowerRows;
using HalfWidth = std::array<std::ptrdiff_t, 2>;

constexpr std::ptrdiff_t block = 64;

void require_half_width(const HalfWidth& half_width) {
    if (half_width[0] < 0 || half_width[1] < 0) throw ValueError("half_width", "0 or more pixels", shape_text(half_width));
}

/// Stronger than all neighbours before it in index order and as strong as all behind it.
bool is_maximum(const PowerRows& rows, std::ptrdiff_t i, std::ptrdiff_t j, const HalfWidth& half_width) {
    const double value = rows.row(i)[j];
    const std::ptrdiff_t first = std::max<std::ptrdiff_t>(0, j - half_width[1]);
    const std::ptrdiff_t last = std::min(rows.values.extent(1) - 1, j + half_width[1]);
    for (std::ptrdiff_t r = std::max(rows.begin, i - half_width[0]); r <= std::min(rows.end - 1, i + half_width[0]); ++r) {
        const double* row = rows.row(r);
        for (std::ptrdiff_t c = first; c <= last; ++c) {
            const bool before = r < i || (r == i && c < j);
            if (before ? row[c] >= value : row[c] > value) return false;
        }
    }
    return true;
}

std::vector<Point> joined(const std::vector<std::vector<Point>>& parts) {
    std::vector<Point> out;
    for (const auto& part : parts) out.insert(out.end(), part.begin(), part.end());
    return out;
}

template <class Sample>
std::vector<Point> find_maxima(const ArrayView<const Sample, 2>& view, const LocalMaximaOptions& options,
                               const ArrayView<const bool, 2>& mask) {
    detail::require_samples(view, options.execution);
    require_half_width(options.half_width);
    if (!(std::isfinite(options.minimum) && options.minimum >= 0.0))
        throw ValueError("minimum", "a finite number >= 0", number_text(options.minimum));
    if (options.count < 0) throw ValueError("count", "0 (all) or a positive number", std::to_string(options.count));
    const bool masked = mask.data() != nullptr;
    if (masked) require_same_shape(mask, "mask", view, "the image");
    const std::ptrdiff_t reach = std::min(options.half_width[0], view.extent(0));
    const std::ptrdiff_t blocks = (view.extent(0) + block - 1) / block;
    std::vector<std::vector<Point>> found(static_cast<std::size_t>(blocks));
    parallel_for(options.execution, "local maxima", blocks, [&](std::ptrdiff_t b) {
        const std::ptrdiff_t begin = b * block;
        const std::ptrdiff_t end = std::min(view.extent(0), begin + block);
        const PowerRows rows(view, begin - reach, end + reach);
        for (std::ptrdiff_t i = begin; i < end; ++i)
            for (std::ptrdiff_t j = 0; j < view.extent(1); ++j) {
                const double value = rows.row(i)[j];
                if (value > options.minimum && (!masked || mask(i, j)) && is_maximum(rows, i, j, options.half_width))
                    found[static_cast<std::size_t>(b)].push_back({i, j, value});
            }
    });
    std::vector<Point> out = joined(found);
    std::sort(out.begin(), out.end(), stronger);
    if (options.count > 0 && static_cast<std::size_t>(options.count) < out.size()) out.resize(static_cast<std::size_t>(options.count));
    return out;
}

using Tile = std::pair<std::ptrdiff_t, std::ptrdiff_t>;

struct TileHash {
    std::size_t operator()(const Tile& tile) const {
        // Neighbouring tiles must not collide: a large odd multiplier keeps the rows apart.
        return static_cast<std::size_t>(tile.first) * 0x9E3779B97F4A7C15ULL + static_cast<std::size_t>(tile.second);
    }
};

}  // namespace

std::vector<Point> local_maxima(const ImageView& image, const LocalMaximaOptions& options, const ArrayView<const bool, 2>& mask) {
    return find_maxima(image, options, mask);
}
std::vector<Point> local_maxima(const IntensityView& intensity, const LocalMaximaOptions& options, const ArrayView<const bool, 2>& mask) {
    return find_maxima(intensity, options, mask);
}

std::vector<Point> strongest_samples(const ImageView& image, std::ptrdiff_t count, const Execution& execution) {
    if (count < 1) throw ValueError("count", "a positive number", std::to_string(count));
    detail::require_samples(image, execution);
    const std::ptrdiff_t blocks = (image.extent(1) + block - 1) / block;
    std::vector<std::vector<Point>> found(static_cast<std::size_t>(image.extent(1)));
    parallel_for(execution, "strongest samples", blocks, [&](std::ptrdiff_t b) {
        const std::ptrdiff_t begin = b * block;
        const ImageView gates = image.slice(1, begin, std::min(block, image.extent(1) - begin));
        detail::walk(gates, 0, gates.extent(0), [&](std::ptrdiff_t i, std::ptrdiff_t j) {
            const Point point{i, begin + j, detail::power(gates(i, j))};
            auto& best = found[static_cast<std::size_t>(point.range)];
            const bool full = best.size() == static_cast<std::size_t>(count);
            if (point.intensity == 0.0 || (full && !stronger(point, best.back()))) return;
            if (full) best.pop_back();
            best.insert(std::upper_bound(best.begin(), best.end(), point, stronger), point);
        });
    });
    return joined(found);
}

std::vector<Point> coalesce(std::vector<Point> points, HalfWidth half_width) {
    require_half_width(half_width);
    std::sort(points.begin(), points.end(), stronger);
    // Kept points by tiles of the size of the neighbourhood: whatever lies within reach is in one of nine.
    std::unordered_map<Tile, std::vector<Point>, TileHash> kept;
    const auto tile_of = [](std::ptrdiff_t position, std::ptrdiff_t reach) {
        const std::ptrdiff_t size = reach + 1;
        return position >= 0 ? position / size : -((-position + size - 1) / size);
    };
    const auto taken = [&](const Point& point, std::ptrdiff_t row, std::ptrdiff_t column) {
        for (std::ptrdiff_t r = row - 1; r <= row + 1; ++r)
            for (std::ptrdiff_t c = column - 1; c <= column + 1; ++c) {
                const auto tile = kept.find({r, c});
                if (tile == kept.end()) continue;
                for (const Point& other : tile->second)
                    if (std::abs(other.azimuth - point.azimuth) <= half_width[0] && std::abs(other.range - point.range) <= half_width[1])
                        return true;
            }
        return false;
    };
    std::vector<Point> out;
    for (const Point& point : points) {
        const std::ptrdiff_t row = tile_of(point.azimuth, half_width[0]);
        const std::ptrdiff_t column = tile_of(point.range, half_width[1]);
        if (taken(point, row, column)) continue;
        kept[{row, column}].push_back(point);
        out.push_back(point);
    }
    return out;
}

}  // namespace sarfocus::detect
