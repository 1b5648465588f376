// The objective of estimate_trajectory and its alternation, for points whose histories are known.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include <sarfocus/core/array_view.hpp>
#include <sarfocus/core/vector3.hpp>

namespace sarfocus::autofocus::detail {

/// A point and what backprojection adds up there, scaled so that the moduli sum to 1.
struct MotionPoint {
    Vector3 position{};
    std::vector<cdouble> terms;  ///< [n_pulse * n_channel], pulse by pulse
    std::vector<double> range;   ///< m, at which the terms were taken

    [[nodiscard]] bool empty() const { return terms.empty(); }
};

using Coefficients = std::vector<double>;  ///< [n_pulse * n_axis], m along the axes
using MotionPoints = std::vector<const MotionPoint*>;

class MotionModel {
public:
    MotionModel(std::vector<Vector3> centres, std::size_t n_channel, std::vector<Vector3> axes, double wavelength, int knots,
                double search);

    struct Alternation {
        double objective = 0.0;
        bool converged = false;
        std::vector<double> steps;
    };

    /// Improves `motion`; `sums` of the start may be given. `scan`: looks for the displacement of a pulse over the whole search.
    Alternation alternate(const MotionPoints& points, Coefficients& motion, int iterations, double tolerance, bool scan,
                          const std::vector<cdouble>& start = {}) const;

    /// A smooth motion to start from, by least squares of the points' phases, unwrapped from pulse to pulse; each has a constant of its
    /// own.
    [[nodiscard]] Coefficients unwrapped(const MotionPoints& points) const;

    [[nodiscard]] cdouble sum(const MotionPoint& point, const Coefficients& motion) const;
    [[nodiscard]] double objective(const MotionPoints& points, const Coefficients& motion) const;
    /// m, along the axes, for every pulse, from the residual phases.
    [[nodiscard]] Coefficients deviation(const MotionPoints& points, const Coefficients& motion) const;

    [[nodiscard]] std::size_t n_pulse() const { return centres_.size() / n_channel_; }
    [[nodiscard]] std::size_t n_channel() const { return n_channel_; }
    [[nodiscard]] std::size_t n_axis() const { return axes_.size(); }
    [[nodiscard]] const std::vector<Vector3>& axes() const { return axes_; }
    [[nodiscard]] const std::vector<Vector3>& centres() const { return centres_; }
    [[nodiscard]] Vector3 displacement(const Coefficients& motion, std::size_t pulse) const;
    [[nodiscard]] Coefficients zero() const { return Coefficients(n_pulse() * n_axis(), 0.0); }
    [[nodiscard]] bool free() const { return knots_ == 0; }
    [[nodiscard]] double radians_per_metre() const { return wavenumber_; }

private:
    using Small = std::array<double, 3>;
    struct Slope;

    [[nodiscard]] Slope slope(const MotionPoints& points, const std::vector<cdouble>& sums, std::size_t pulse, const double* motion) const;
    [[nodiscard]] double value(const MotionPoints& points, const std::vector<cdouble>& sums, std::size_t pulse, const double* motion) const;
    void look_around(const MotionPoints& points, const std::vector<cdouble>& sums, std::size_t pulse, double* motion) const;
    void climb(const MotionPoints& points, const std::vector<cdouble>& sums, std::size_t pulse, double* motion, bool scan) const;
    void climb_spline(const MotionPoints& points, const std::vector<cdouble>& sums, Coefficients& motion, int knots) const;

    std::vector<Vector3> centres_;
    std::size_t n_channel_;
    std::vector<Vector3> axes_;
    double wavenumber_;  // 4 pi / wavelength
    int knots_;
    double search_;
    double step_;
};

}  // namespace sarfocus::autofocus::detail
