#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include <sarfocus/core/array_view.hpp>
#include <sarfocus/core/export.hpp>
#include <sarfocus/core/vector3.hpp>

namespace sarfocus::geometry {

/// Where the pixels of an image lie in space: [n_azimuth, n_range] positions in metres.
class SARFOCUS_API ImageGrid {
public:
    enum class Kind { plane, polar, points };

    /// pixel (i, j) = origin + i * azimuth_step + j * range_step; all vectors in m.
    /// Throws ValueError where a step is zero or the two are parallel, ShapeError where the shape is empty.
    static ImageGrid plane(const Vector3& origin, const Vector3& azimuth_step, const Vector3& range_step,
                           std::array<std::ptrdiff_t, 2> shape);

    /// pixel (i, j) = centre + r * (cos(a) * range_direction + sin(a) * azimuth_direction),
    /// r = range_start + j * range_spacing (m), a = angle_start + i * angle_spacing (rad). The directions are made orthonormal.
    static ImageGrid polar(const Vector3& centre, const Vector3& range_direction, const Vector3& azimuth_direction, double range_start,
                           double range_spacing, double angle_start, double angle_spacing, std::array<std::ptrdiff_t, 2> shape);

    /// Any positions, [n_azimuth, n_range, 3] m (a terrain model, a list of points with n_range = 1). Copied.
    static ImageGrid from_points(const ArrayView<const double, 3>& xyz);

    [[nodiscard]] Kind kind() const { return kind_; }
    [[nodiscard]] std::array<std::ptrdiff_t, 2> shape() const { return shape_; }
    [[nodiscard]] std::ptrdiff_t size() const { return shape_[0] * shape_[1]; }

    /// Position of pixel (i, j); fractional indices interpolate plane and polar grids exactly (for `points` they are rounded).
    [[nodiscard]] Vector3 position(double i, double j) const;
    /// The same of a pixel of the grid, 0 <= i < n_azimuth, 0 <= j < n_range, without checks: the fast way to many positions.
    [[nodiscard]] Vector3 pixel_position(std::ptrdiff_t i, std::ptrdiff_t j) const {
        if (kind_ != Kind::points) return position(static_cast<double>(i), static_cast<double>(j));
        const double* p = points_.data() + 3 * (i * shape_[1] + j);
        return {p[0], p[1], p[2]};
    }

    /// Positions of row i, columns [0, n_range), into xyz[3 * j + axis].
    void row_positions(std::ptrdiff_t i, double* xyz) const;

    /// The same grid restricted to rows and columns [begin, begin + count).
    [[nodiscard]] ImageGrid subgrid(std::array<std::ptrdiff_t, 2> begin, std::array<std::ptrdiff_t, 2> count) const;

    /// Plane: origin, azimuth_step, range_step. Polar: centre, range_direction, azimuth_direction.
    [[nodiscard]] const std::array<Vector3, 3>& vectors() const { return vectors_; }
    /// Polar: range_start, range_spacing, angle_start, angle_spacing.
    [[nodiscard]] const std::array<double, 4>& polar_axes() const { return axes_; }

private:
    ImageGrid(Kind kind, std::array<std::ptrdiff_t, 2> shape);

    Kind kind_;
    std::array<std::ptrdiff_t, 2> shape_;
    std::array<Vector3, 3> vectors_{};
    std::array<double, 4> axes_{};
    std::vector<double> points_;
};

}  // namespace sarfocus::geometry
