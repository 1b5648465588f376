#include <sarfocus/autofocus/cross_track.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>

#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>

#include <sarfocus/core/checks.hpp>
#include <sarfocus/core/constants.hpp>
#include <sarfocus/core/error.hpp>
#include <sarfocus/focus/azimuth.hpp>

#include "strip_lines.hpp"

namespace sarfocus::autofocus {
namespace {

using detail::at;
using Phases = ArrayView<const double, 2>;
using Rows = Eigen::Matrix<double, Eigen::Dynamic, 2>;
using Eigen::Index;

constexpr double unobservable = 1e-9;  // eigenvalue, where what the data tell has about 1

// delta_R = -d . (sin(theta), -cos(theta)).
std::array<double, 2> look(double slant_range, double height) {
    const double cosine = height / slant_range;
    return {std::sqrt((1.0 - cosine) * (1.0 + cosine)), -cosine};
}

void require_look(const ArrayView<const double, 1>& slant_range, double height, double wavelength) {
    require_not_empty(slant_range, "slant_range");
    require_finite(slant_range, "slant_range");
    require_positive(height, "height");
    require_positive(wavelength, "wavelength");
    for (std::ptrdiff_t b = 0; b < slant_range.extent(0); ++b)
        if (!(slant_range(b) >= height))
            throw ValueError("slant_range", "at least the height, " + number_text(height), number_text(slant_range(b)));
}

void require_displacement(const ArrayView<const double, 2>& displacement, std::ptrdiff_t n_azimuth) {
    if (displacement.extent(0) != n_azimuth || displacement.extent(1) != 2)
        throw ShapeError("displacement", "(" + std::to_string(n_azimuth) + ", 2), towards the scene and up",
                         shape_text(displacement.extents()));
    require_finite(displacement, "displacement");
}

// Weights of all samples, 0 where a block is not to be used.
Array<double, 2> weights_of(const Phases& phase, const Phases& phase_std, double model_std) {
    Array<double, 2> out(phase.extents());
    if (!phase_std.empty()) require_same_shape(phase_std, "phase_std", phase, "block_phase");
    for (std::ptrdiff_t b = 0; b < phase.extent(0); ++b)
        for (std::ptrdiff_t k = 0; k < phase.extent(1); ++k) {
            const double sigma = phase_std.empty() ? 1.0 : std::hypot(phase_std(b, k), model_std);
            if (!phase_std.empty() && (phase_std(b, k) < 0.0 || sigma <= 0.0))
                throw ValueError("phase_std", "above 0, or nan where a block is not to be used", number_text(phase_std(b, k)));
            out(b, k) = std::isfinite(sigma) ? 1.0 / (sigma * sigma) : 0.0;
        }
    return out;
}

class Inversion {
public:
    Inversion(const Phases& phase, const Array<double, 2>& weights, const ArrayView<const double, 1>& slant_range, double height,
              const CrossTrackOptions& options)
        : phase_(phase), weights_(weights), options_(options), rows_(Rows::Zero(phase.extent(0), 2)) {
        used_ = {options.unknowns != CrossTrackUnknowns::height, options.unknowns != CrossTrackUnknowns::horizontal};
        for (Index b = 0; b < rows_.rows(); ++b)
            for (const Index u : {0, 1})
                if (used_[at(u)]) rows_(b, u) = look(slant_range(b), height)[at(u)];
        line_ = Eigen::VectorXd::Zero(2 * rows_.rows());
    }

    [[nodiscard]] double condition() const {
        return condition_of([](Index) { return true; });
    }

    [[nodiscard]] bool found(Index k) const {
        return condition_of([&](Index b) { return weights_(b, k) > 0.0; }) <= options_.maximum_condition;
    }

    // The covariance of the displacement at sample k, rad^2.
    [[nodiscard]] Eigen::Matrix2d covariance(Index k) const {
        Eigen::Matrix2d normal = Eigen::Matrix2d::Zero();
        for (const Index u : {0, 1})
            if (!used_[at(u)]) normal(u, u) = 1.0;
        for (Index b = 0; b < rows_.rows(); ++b) normal += weights_(b, k) * rows_.row(b).transpose() * rows_.row(b);
        return normal.inverse();
    }

    // The constants and lines of the blocks: least squares with the displacement of every sample eliminated. Those which the data don't
    // tell are zero: the phases are taken as given.
    void fit_lines(const std::vector<Index>& samples) {
        const Index n = rows_.rows();
        Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(2 * n, 2 * n);
        Eigen::VectorXd right = Eigen::VectorXd::Zero(2 * n);
        Eigen::VectorXd total = Eigen::VectorXd::Zero(n);
        for (const Index k : samples) {
            const Eigen::VectorXd w = column(weights_.view(), k);
            const Eigen::MatrixXd weighted = w.asDiagonal() * rows_;
            Eigen::MatrixXd left = -weighted * covariance(k) * weighted.transpose();
            left.diagonal() += w;
            const Eigen::VectorXd y = left * column(phase_, k);
            const double x = position(k);
            normal.topLeftCorner(n, n) += left;
            normal.topRightCorner(n, n) += x * left;
            normal.bottomRightCorner(n, n) += x * x * left;
            right.head(n) += y;
            right.tail(n) += x * y;
            total += w;
        }
        normal.bottomLeftCorner(n, n) = normal.topRightCorner(n, n).transpose();
        const Eigen::VectorXd block_scale = total.unaryExpr([](double t) { return t > 0.0 ? 1.0 / std::sqrt(t) : 0.0; });
        Eigen::VectorXd scale(2 * n);
        scale << block_scale, block_scale;
        const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(scale.asDiagonal() * normal * scale.asDiagonal());
        const Eigen::VectorXd inverse = solver.eigenvalues().unaryExpr([](double e) { return e > unobservable ? 1.0 / e : 0.0; });
        line_ = scale.asDiagonal() * solver.eigenvectors() * inverse.asDiagonal() * solver.eigenvectors().transpose() * scale.asDiagonal() *
                right;
    }

    // rad
    [[nodiscard]] Eigen::Vector2d displacement(Index k) const {
        return covariance(k) * rows_.transpose() * column(weights_.view(), k).asDiagonal() * without_line(k);
    }

    [[nodiscard]] Eigen::VectorXd residual(Index k, const Eigen::Vector2d& displacement) const {
        return without_line(k) - rows_ * displacement;
    }

private:
    static Eigen::VectorXd column(const Phases& values, Index k) {
        Eigen::VectorXd out(values.extent(0));
        for (Index b = 0; b < out.size(); ++b) out(b) = values(b, k);
        return out;
    }

    [[nodiscard]] double position(Index k) const {
        const auto n = static_cast<double>(phase_.extent(1));
        return (2.0 * static_cast<double>(k) + 1.0 - n) / n;
    }

    [[nodiscard]] Eigen::VectorXd without_line(Index k) const {
        const Index n = rows_.rows();
        return column(phase_, k) - line_.head(n) - position(k) * line_.tail(n);
    }

    template <class Use>
    [[nodiscard]] double condition_of(const Use& use) const {
        double s = 0.0;
        double c = 0.0;
        double sc = 0.0;
        double count = 0.0;
        for (Index b = 0; b < rows_.rows(); ++b) {
            if (!use(b)) continue;
            s += rows_(b, 0) * rows_(b, 0);
            c += rows_(b, 1) * rows_(b, 1);
            sc += rows_(b, 0) * rows_(b, 1);
            count += 1.0;
        }
        // The smaller eigenvalue of [s sc; sc c], or the one entry.
        const double smallest = used_[0] && used_[1] ? 2.0 * (s * c - sc * sc) / (s + c + std::hypot(s - c, 2.0 * sc)) : s + c;
        return smallest > 0.0 ? std::sqrt(count / smallest) : std::numeric_limits<double>::infinity();
    }

    const Phases& phase_;
    const Array<double, 2>& weights_;
    const CrossTrackOptions& options_;
    Rows rows_;  // look of every block, columns of what is not unknown zero
    std::array<bool, 2> used_{};
    Eigen::VectorXd line_;  // constants, then lines over position(k)
};

// Between samples found linear; at the ends held.
void interpolate(const std::vector<Index>& found, const ArrayView<double, 2>& values) {
    for (std::ptrdiff_t u = 0; u < 2; ++u) {
        for (Index k = 0; k < found.front(); ++k) values(k, u) = values(found.front(), u);
        for (Index k = found.back() + 1; k < values.extent(0); ++k) values(k, u) = values(found.back(), u);
        for (std::size_t i = 0; i + 1 < found.size(); ++i)
            for (Index k = found[i] + 1; k < found[i + 1]; ++k) {
                const double share = static_cast<double>(k - found[i]) / static_cast<double>(found[i + 1] - found[i]);
                values(k, u) = (1.0 - share) * values(found[i], u) + share * values(found[i + 1], u);
            }
    }
}

// Constant and line of the samples found, taken out of all.
void remove_lines(const std::vector<Index>& found, const ArrayView<double, 2>& values) {
    double mean = 0.0;
    for (const Index k : found) mean += static_cast<double>(k) / static_cast<double>(found.size());
    for (std::ptrdiff_t u = 0; u < 2; ++u) {
        double constant = 0.0;
        double moment = 0.0;
        double spread = 0.0;
        for (const Index k : found) {
            const double x = static_cast<double>(k) - mean;
            constant += values(k, u) / static_cast<double>(found.size());
            moment += x * values(k, u);
            spread += x * x;
        }
        const double slope = spread > 0.0 ? moment / spread : 0.0;
        for (Index k = 0; k < values.extent(0); ++k) values(k, u) -= constant + slope * (static_cast<double>(k) - mean);
    }
}

std::string condition_text(double condition) {
    return std::isfinite(condition) ? "condition " + number_text(condition) : "one look angle for all";
}

}  // namespace

void CrossTrackOptions::validate() const {
    if (!(maximum_condition >= 1.0)) throw ValueError("maximum_condition", "at least 1", number_text(maximum_condition));
    if (!(model_std >= 0.0 && std::isfinite(model_std))) throw ValueError("model_std", "at least 0", number_text(model_std));
}

CrossTrackError cross_track_error(const Phases& block_phase, const Phases& phase_std, const ArrayView<const double, 1>& slant_range,
                                  double height, double wavelength, const CrossTrackOptions& options) {
    options.validate();
    require_not_empty(block_phase, "block_phase");
    require_finite(block_phase, "block_phase");
    if (slant_range.extent(0) != block_phase.extent(0))
        throw ShapeError("slant_range", "(" + std::to_string(block_phase.extent(0)) + ",), one for each row of block_phase",
                         shape_text(slant_range.extents()));
    require_look(slant_range, height, wavelength);
    const Array<double, 2> weights = weights_of(block_phase, phase_std, options.model_std);
    Inversion inversion(block_phase, weights, slant_range, height, options);
    CrossTrackError out;
    out.condition = inversion.condition();
    if (!(out.condition <= options.maximum_condition))
        throw NumericalError("slant_range: expected blocks at look angles that tell the unknowns apart, condition " +
                             number_text(options.maximum_condition) + " at most, got " + condition_text(out.condition) +
                             (options.unknowns == CrossTrackUnknowns::cross_track ? "; take one unknown, or blocks farther apart" : ""));

    const std::ptrdiff_t n = block_phase.extent(1);
    std::vector<Index> found;
    for (Index k = 0; k < n; ++k)
        if (inversion.found(k)) found.push_back(k);
    if (found.empty()) throw NumericalError("phase_std: expected samples that enough blocks reach, got none");
    inversion.fit_lines(found);

    out.displacement = Array<double, 2>({n, 2});
    out.displacement_std = Array<double, 2>({n, 2});
    std::fill(out.displacement_std.begin(), out.displacement_std.end(), std::numeric_limits<double>::quiet_NaN());
    const auto blocks = at(block_phase.extent(0));
    std::vector<double> squares(blocks, 0.0);
    std::vector<double> count(blocks, 0.0);
    const double metres = wavelength / (2.0 * two_pi);  // per radian
    for (const Index k : found) {
        const Eigen::Vector2d displacement = inversion.displacement(k);
        const Eigen::VectorXd residual = inversion.residual(k, displacement);
        const Eigen::Matrix2d covariance = inversion.covariance(k);
        for (const Index u : {0, 1}) {
            const bool unknown =
                options.unknowns == CrossTrackUnknowns::cross_track || (u == 0) == (options.unknowns == CrossTrackUnknowns::horizontal);
            out.displacement(k, u) = metres * displacement(u);
            if (!phase_std.empty()) out.displacement_std(k, u) = unknown ? metres * std::sqrt(covariance(u, u)) : 0.0;
        }
        for (std::size_t b = 0; b < blocks; ++b) {
            if (!(weights(static_cast<Index>(b), k) > 0.0)) continue;
            squares[b] += residual(static_cast<Index>(b)) * residual(static_cast<Index>(b));
            count[b] += 1.0;
        }
    }
    for (std::size_t b = 0; b < blocks; ++b) out.residual_rms.push_back(std::sqrt(squares[b] / count[b]));
    interpolate(found, out.displacement.view());
    remove_lines(found, out.displacement.view());
    return out;
}

void cross_track_phase(const ArrayView<const double, 2>& displacement, const ArrayView<const double, 1>& slant_range, double height,
                       double wavelength, const ArrayView<double, 2>& phase, const Execution& execution) {
    require_look(slant_range, height, wavelength);
    require_displacement(displacement, displacement.extent(0));
    if (phase.extent(0) != slant_range.extent(0) || phase.extent(1) != displacement.extent(0))
        throw ShapeError("phase", shape_text(std::array<std::ptrdiff_t, 2>{slant_range.extent(0), displacement.extent(0)}),
                         shape_text(phase.extents()));
    const double radians = 2.0 * two_pi / wavelength;  // per metre
    parallel_for(execution, "cross_track_phase", slant_range.extent(0), [&](std::int64_t g) {
        const std::array<double, 2> direction = look(slant_range(g), height);
        for (std::ptrdiff_t k = 0; k < displacement.extent(0); ++k)
            phase(g, k) = radians * (direction[0] * displacement(k, 0) + direction[1] * displacement(k, 1));
    });
}

void correct_cross_track(const ImageView& image, const geometry::StripmapGeometry& geometry, const ArrayView<const double, 2>& displacement,
                         double height, const MutableImageView& corrected, const Execution& execution) {
    geometry.validate();
    const auto n_range = static_cast<std::ptrdiff_t>(geometry.slant_range.size());
    const ArrayView<const double, 1> slant_range(geometry.slant_range.data(), {n_range});
    require_look(slant_range, height, geometry.wavelength);
    require_displacement(displacement, image.extent(0));
    Array<double, 2> phase({2, displacement.extent(0)});
    Array<double, 2> scale({2, n_range});
    const double radians = 2.0 * two_pi / geometry.wavelength;
    for (std::ptrdiff_t u = 0; u < 2; ++u) {
        for (std::ptrdiff_t k = 0; k < phase.extent(1); ++k) phase(u, k) = radians * displacement(k, u);
        for (std::ptrdiff_t g = 0; g < n_range; ++g) scale(u, g) = look(slant_range(g), height)[at(u)];
    }
    focus::AzimuthCorrectOptions options;
    options.execution = execution;
    focus::azimuth_correct(image, geometry, phase.view(), scale.view(), corrected, options);
}

}  // namespace sarfocus::autofocus
