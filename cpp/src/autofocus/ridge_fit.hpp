// Least squares over the path and the scatterers, in the plane of track and look.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include <sarfocus/autofocus/ridge_path.hpp>
#include <sarfocus/core/array_view.hpp>

namespace sarfocus::autofocus::detail {

using RidgeRanges = ArrayView<const double, 2>;

/// Uniform cubic B-spline over the pulses.
class PulseSpline {
public:
    PulseSpline(std::ptrdiff_t n_pulse, int knots);

    [[nodiscard]] Eigen::Index size() const { return size_; }
    [[nodiscard]] double width() const { return width_; }  ///< pulses between knots
    /// Index of the first of four coefficients, and their weights.
    [[nodiscard]] Eigen::Index first(std::ptrdiff_t pulse) const;
    [[nodiscard]] std::array<double, 4> weights(std::ptrdiff_t pulse) const;
    [[nodiscard]] double value(const Eigen::VectorXd& coefficients, std::ptrdiff_t pulse) const;

private:
    Eigen::Index size_;
    double width_;
};

/// The start, laid out along the track.
struct StartLine {
    std::vector<double> along;   ///< m, [n_pulse]
    std::vector<double> across;  ///< m, along `look`
    double mean = 0.0;           ///< of `along`
    double square = 0.0;         ///< sum of (along - mean)^2
    double length = 0.0;         ///< m
};

class RidgeFit {
public:
    RidgeFit(const RidgeRanges& range, const StartLine& line, std::vector<std::ptrdiff_t> used, const RidgePathOptions& options);

    /// True where the objective has settled.
    bool run();

    struct Place {
        double along = 0.0;
        double across = 0.0;
        double offset = 0.0;
    };

    [[nodiscard]] double along(std::ptrdiff_t pulse) const { return spline_.value(unknown_.head(spline_.size()), pulse); }
    [[nodiscard]] double across(std::ptrdiff_t pulse) const;
    [[nodiscard]] Place place(std::size_t k) const;  ///< of ridge used()[k]
    [[nodiscard]] const std::vector<std::ptrdiff_t>& used() const { return used_; }
    /// m, the range of the model less that measured; nan where not seen.
    [[nodiscard]] double residual(std::size_t k, std::ptrdiff_t pulse) const { return residual_at(unknown_, k, pulse); }
    [[nodiscard]] int iterations() const { return iterations_; }
    [[nodiscard]] double objective() const { return objective(unknown_); }

    /// Standard deviations: of the displacement along and across for every pulse, the common stretch apart, and of the stretch.
    struct Spread {
        std::vector<double> along;
        std::vector<double> across;
        double length = 0.0;
    };
    [[nodiscard]] Spread spread() const;

private:
    struct Normal {
        Eigen::MatrixXd matrix;
        Eigen::VectorXd right;
    };

    [[nodiscard]] Eigen::Index point_at(std::size_t k) const;
    [[nodiscard]] double residual_at(const Eigen::VectorXd& unknown, std::size_t k, std::ptrdiff_t pulse) const;
    [[nodiscard]] double objective(const Eigen::VectorXd& unknown) const;
    [[nodiscard]] Normal normal() const;
    void place_on_the_line(std::size_t k);
    void prepare_priors();
    void prior(const Eigen::VectorXd& row, double deviation);

    RidgeRanges range_;
    const StartLine& line_;
    std::vector<std::ptrdiff_t> used_;
    const RidgePathOptions& options_;
    PulseSpline spline_;
    Eigen::Index n_unknown_;
    Eigen::VectorXd unknown_;
    Eigen::MatrixXd prior_;    // its normal matrix: all priors are linear, with value zero
    Eigen::VectorXd stretch_;  // row that gives the relative change of length
    int iterations_ = 0;
};

}  // namespace sarfocus::autofocus::detail
