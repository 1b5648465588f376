#include <sarfocus/geometry/image_grid.hpp>

#include <algorithm>
#include <cmath>

#include <sarfocus/core/checks.hpp>
#include <sarfocus/core/error.hpp>

namespace sarfocus::geometry {
namespace {

void require_finite_vector(const Vector3& v, const char* argument) {
    for (const double x : v) require_finite_value(x, argument);
}

void require_shape(std::array<std::ptrdiff_t, 2> shape) {
    if (shape[0] < 1 || shape[1] < 1) throw ShapeError("shape", "at least one pixel each way", shape_text(shape));
}

}  // namespace

ImageGrid::ImageGrid(Kind kind, std::array<std::ptrdiff_t, 2> shape) : kind_(kind), shape_(shape) {}

ImageGrid ImageGrid::plane(const Vector3& origin, const Vector3& azimuth_step, const Vector3& range_step,
                           std::array<std::ptrdiff_t, 2> shape) {
    require_shape(shape);
    require_finite_vector(origin, "origin");
    require_finite_vector(azimuth_step, "azimuth_step");
    require_finite_vector(range_step, "range_step");
    const double area = norm(cross(azimuth_step, range_step));
    if (!(area > 1e-9 * norm(azimuth_step) * norm(range_step)))
        throw ValueError("azimuth_step, range_step", "two vectors that are neither zero nor parallel",
                         "a parallelogram of area " + number_text(area));
    ImageGrid grid(Kind::plane, shape);
    grid.vectors_ = {origin, azimuth_step, range_step};
    return grid;
}

ImageGrid ImageGrid::polar(const Vector3& centre, const Vector3& range_direction, const Vector3& azimuth_direction, double range_start,
                           double range_spacing, double angle_start, double angle_spacing, std::array<std::ptrdiff_t, 2> shape) {
    require_shape(shape);
    require_finite_vector(centre, "centre");
    require_finite_vector(range_direction, "range_direction");
    require_finite_vector(azimuth_direction, "azimuth_direction");
    require_positive(range_start, "range_start");
    require_positive(range_spacing, "range_spacing");
    require_finite_value(angle_start, "angle_start");
    require_finite_value(angle_spacing, "angle_spacing");
    if (angle_spacing == 0.0) throw ValueError("angle_spacing", "an angle other than zero", "0");
    const double length = norm(range_direction);
    if (!(norm(cross(range_direction, azimuth_direction)) > 1e-9 * length * norm(azimuth_direction)))
        throw ValueError("range_direction, azimuth_direction", "two vectors that are neither zero nor parallel", "dependent ones");
    const Vector3 u = (1.0 / length) * range_direction;
    const Vector3 rejected = azimuth_direction - dot(azimuth_direction, u) * u;
    ImageGrid grid(Kind::polar, shape);
    grid.vectors_ = {centre, u, (1.0 / norm(rejected)) * rejected};
    grid.axes_ = {range_start, range_spacing, angle_start, angle_spacing};
    return grid;
}

ImageGrid ImageGrid::from_points(const ArrayView<const double, 3>& xyz) {
    if (xyz.extent(2) != 3) throw ShapeError("xyz", "(n_azimuth, n_range, 3)", shape_text(xyz.extents()));
    require_shape({xyz.extent(0), xyz.extent(1)});
    ImageGrid grid(Kind::points, {xyz.extent(0), xyz.extent(1)});
    grid.points_.resize(static_cast<std::size_t>(xyz.size()));
    std::size_t k = 0;
    for (std::ptrdiff_t i = 0; i < xyz.extent(0); ++i)
        for (std::ptrdiff_t j = 0; j < xyz.extent(1); ++j)
            for (std::ptrdiff_t d = 0; d < 3; ++d) {
                const double value = xyz(i, j, d);
                if (!std::isfinite(value))
                    throw NumericalError("xyz: expected finite coordinates, got " + number_text(value) + " at [" + std::to_string(i) +
                                         ", " + std::to_string(j) + ", " + std::to_string(d) + "]");
                grid.points_[k++] = value;
            }
    return grid;
}

Vector3 ImageGrid::position(double i, double j) const {
    switch (kind_) {
        case Kind::plane:
            return vectors_[0] + i * vectors_[1] + j * vectors_[2];
        case Kind::polar: {
            const double r = axes_[0] + j * axes_[1];
            const double a = axes_[2] + i * axes_[3];
            return vectors_[0] + (r * std::cos(a)) * vectors_[1] + (r * std::sin(a)) * vectors_[2];
        }
        case Kind::points:
            break;
    }
    const auto row = std::clamp<std::ptrdiff_t>(std::lround(i), 0, shape_[0] - 1);
    const auto column = std::clamp<std::ptrdiff_t>(std::lround(j), 0, shape_[1] - 1);
    const double* p = points_.data() + 3 * (row * shape_[1] + column);
    return {p[0], p[1], p[2]};
}

void ImageGrid::row_positions(std::ptrdiff_t i, double* xyz) const {
    if (kind_ == Kind::points) {
        std::copy_n(points_.data() + 3 * i * shape_[1], 3 * shape_[1], xyz);
        return;
    }
    for (std::ptrdiff_t j = 0; j < shape_[1]; ++j) {
        const Vector3 p = position(static_cast<double>(i), static_cast<double>(j));
        std::copy(p.begin(), p.end(), xyz + 3 * j);
    }
}

ImageGrid ImageGrid::subgrid(std::array<std::ptrdiff_t, 2> begin, std::array<std::ptrdiff_t, 2> count) const {
    for (std::size_t d = 0; d < 2; ++d)
        if (begin[d] < 0 || count[d] < 1 || begin[d] + count[d] > shape_[d])
            throw ShapeError("subgrid", "a part of " + shape_text(shape_), "begin " + shape_text(begin) + ", count " + shape_text(count));
    ImageGrid grid(kind_, count);
    grid.vectors_ = vectors_;
    grid.axes_ = axes_;
    const auto i = static_cast<double>(begin[0]);
    const auto j = static_cast<double>(begin[1]);
    if (kind_ == Kind::plane) grid.vectors_[0] = position(i, j);
    if (kind_ == Kind::polar) {
        grid.axes_[0] += j * axes_[1];
        grid.axes_[2] += i * axes_[3];
    }
    if (kind_ == Kind::points) {
        grid.points_.resize(static_cast<std::size_t>(3 * count[0] * count[1]));
        for (std::ptrdiff_t row = 0; row < count[0]; ++row)
            std::copy_n(points_.data() + 3 * ((begin[0] + row) * shape_[1] + begin[1]), 3 * count[1],
                        grid.points_.data() + 3 * row * count[1]);
    }
    return grid;
}

}  // namespace sarfocus::geometry
