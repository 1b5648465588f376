// Tells the pixels apart that a pulse cannot see, a stretch of a row at a time.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>

#include <sarfocus/core/vector3.hpp>
#include <sarfocus/geometry/image_grid.hpp>

namespace sarfocus::focus::detail {

/// Columns [begin, begin + count) of a row of a grid. On a plane grid they lie on a straight line, whose sines are bounded; on others
/// nothing is said to be out of sight.
class AspectSpan {
public:
    AspectSpan(const geometry::ImageGrid& grid, std::ptrdiff_t row, std::ptrdiff_t begin, std::ptrdiff_t count, const Vector3& axis)
        : axis_(axis), straight_(grid.kind() == geometry::ImageGrid::Kind::plane) {
        if (!straight_) return;
        const Vector3 first = grid.position(static_cast<double>(row), static_cast<double>(begin));
        const Vector3 last = grid.position(static_cast<double>(row), static_cast<double>(begin + count - 1));
        middle_ = 0.5 * (first + last);
        half_ = 0.5 * norm(last - first);
        along_ = 0.5 * std::abs(dot(last - first, axis));
    }

    /// Whether all pixels lie outside the sines from start to stop, as seen from midway between the antennas.
    [[nodiscard]] bool outside(const Vector3& antenna, double start, double stop) const {
        constexpr double slack = 1e-5;  // of sines in float32
        if (!straight_) return false;
        const Vector3 sight = middle_ - antenna;
        const double range = norm(sight);
        if (!(range > half_)) return false;
        const double place = dot(sight, axis_);
        const double low = place - along_;
        const double high = place + along_;
        return high / (high > 0.0 ? range - half_ : range + half_) < start - slack ||
               low / (low > 0.0 ? range + half_ : range - half_) > stop + slack;
    }

private:
    Vector3 axis_;
    bool straight_;
    Vector3 middle_{};
    double half_ = 0.0;
    double along_ = 0.0;
};

}  // namespace sarfocus::focus::detail
