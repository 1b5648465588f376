#include "trajectory_model.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <utility>

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/LU>

namespace sarfocus::autofocus::detail {
namespace {

using Eigen::Index;

// Values of the four cubic B-splines that reach a place `share` of the way from one knot to the next.
std::array<double, 4> cubic(double share) {
    const double s2 = share * share;
    const double s3 = s2 * share;
    return {(1.0 - 3.0 * share + 3.0 * s2 - s3) / 6.0, (4.0 - 6.0 * s2 + 3.0 * s3) / 6.0, (1.0 + 3.0 * share + 3.0 * s2 - 3.0 * s3) / 6.0,
            s3 / 6.0};
}

struct Knot {
    std::size_t first;
    std::array<double, 4> value;
};

Knot knot_at(std::size_t pulse, int knots) {
    const auto spacing = static_cast<std::size_t>(knots);
    return {pulse / spacing, cubic(static_cast<double>(pulse % spacing) / static_cast<double>(knots))};
}

std::size_t knot_count(std::size_t n_pulse, int knots) {
    return (n_pulse - 1) / static_cast<std::size_t>(knots) + 4;
}

}  // namespace

// Of Re sum conj(B_m) b_km exp(j psi_km) over the displacement of one pulse.
struct MotionModel::Slope {
    Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
    Eigen::Matrix3d curvature = Eigen::Matrix3d::Zero();  // minus the second derivative
    Eigen::Matrix3d bound = Eigen::Matrix3d::Zero();      // never less than that
};

MotionModel::MotionModel(std::vector<Vector3> centres, std::size_t n_channel, std::vector<Vector3> axes, double wavelength, int knots,
                         double search)
    : centres_(std::move(centres)),
      n_channel_(n_channel),
      axes_(std::move(axes)),
      wavenumber_(4.0 * std::numbers::pi / wavelength),
      knots_(knots),
      search_(search),
      step_(wavelength / 24.0) {}

Vector3 MotionModel::displacement(const Coefficients& motion, std::size_t pulse) const {
    Vector3 out{};
    for (std::size_t a = 0; a < axes_.size(); ++a) out = out + motion[pulse * axes_.size() + a] * axes_[a];
    return out;
}

cdouble MotionModel::sum(const MotionPoint& point, const Coefficients& motion) const {
    cdouble out{};
    for (std::size_t k = 0; k < n_pulse(); ++k) {
        const Vector3 towards = displacement(motion, k) - point.position;
        for (std::size_t i = k * n_channel_; i < (k + 1) * n_channel_; ++i)
            out += point.terms[i] * std::polar(1.0, wavenumber_ * (norm(centres_[i] + towards) - point.range[i]));
    }
    return out;
}

double MotionModel::objective(const MotionPoints& points, const Coefficients& motion) const {
    double out = 0.0;
    for (const MotionPoint* p : points) out += std::norm(sum(*p, motion));
    return out;
}

double MotionModel::value(const MotionPoints& points, const std::vector<cdouble>& sums, std::size_t pulse, const double* motion) const {
    Vector3 moved{};
    for (std::size_t a = 0; a < axes_.size(); ++a) moved = moved + motion[a] * axes_[a];
    double out = 0.0;
    for (std::size_t m = 0; m < points.size(); ++m) {
        const MotionPoint& p = *points[m];
        for (std::size_t i = pulse * n_channel_; i < (pulse + 1) * n_channel_; ++i) {
            const double phase = wavenumber_ * (norm(centres_[i] + moved - p.position) - p.range[i]);
            const cdouble term = std::conj(sums[m]) * p.terms[i];
            out += term.real() * std::cos(phase) - term.imag() * std::sin(phase);
        }
    }
    return out;
}

MotionModel::Slope MotionModel::slope(const MotionPoints& points, const std::vector<cdouble>& sums, std::size_t pulse,
                                      const double* motion) const {
    Vector3 moved{};
    for (std::size_t a = 0; a < axes_.size(); ++a) moved = moved + motion[a] * axes_[a];
    Slope out;
    for (std::size_t m = 0; m < points.size(); ++m) {
        const MotionPoint& p = *points[m];
        for (std::size_t i = pulse * n_channel_; i < (pulse + 1) * n_channel_; ++i) {
            const Vector3 sight = centres_[i] + moved - p.position;
            const double range = norm(sight);
            Eigen::Vector3d rate = Eigen::Vector3d::Zero();
            for (std::size_t a = 0; a < axes_.size(); ++a) rate(static_cast<Index>(a)) = wavenumber_ * dot(sight, axes_[a]) / range;
            const cdouble term = std::conj(sums[m]) * p.terms[i] * std::polar(1.0, wavenumber_ * (range - p.range[i]));
            const Eigen::Matrix3d square = rate * rate.transpose();
            out.gradient -= term.imag() * rate;
            out.curvature += term.real() * square;
            out.bound += std::abs(term) * square;
        }
    }
    return out;
}

// Steps over the search, axis by axis. The channels of a pulse lie so close together that the range of the first changes like all.
void MotionModel::look_around(const MotionPoints& points, const std::vector<cdouble>& sums, std::size_t pulse, double* motion) const {
    const Vector3& centre = centres_[pulse * n_channel_];
    std::vector<cdouble> terms(points.size());
    std::vector<double> range(points.size());
    for (std::size_t m = 0; m < points.size(); ++m) {
        const MotionPoint& p = *points[m];
        range[m] = norm(centre - p.position);
        for (std::size_t i = pulse * n_channel_; i < (pulse + 1) * n_channel_; ++i)
            terms[m] += std::conj(sums[m]) * p.terms[i] * std::polar(1.0, wavenumber_ * (norm(centres_[i] - p.position) - p.range[i]));
    }
    const auto level = [&](const double* at) {
        Vector3 moved = centre;
        for (std::size_t a = 0; a < axes_.size(); ++a) moved = moved + at[a] * axes_[a];
        double out = 0.0;
        for (std::size_t m = 0; m < points.size(); ++m) {
            const double phase = wavenumber_ * (norm(moved - points[m]->position) - range[m]);
            out += terms[m].real() * std::cos(phase) - terms[m].imag() * std::sin(phase);
        }
        return out;
    };
    const auto reach = static_cast<int>(std::ceil(search_ / step_));
    double best = level(motion);
    for (std::size_t a = 0; a < axes_.size(); ++a) {
        Small trial{};
        std::copy_n(motion, axes_.size(), trial.begin());
        for (int s = -reach; s <= reach; ++s) {
            trial[a] = search_ * s / reach;
            const double now = level(trial.data());
            if (now > best) {
                best = now;
                motion[a] = trial[a];
            }
        }
    }
}

void MotionModel::climb(const MotionPoints& points, const std::vector<cdouble>& sums, std::size_t pulse, double* motion, bool scan) const {
    constexpr int newton_steps = 6;
    constexpr int halvings = 8;
    const std::size_t n = axes_.size();
    double best = value(points, sums, pulse, motion);
    if (scan) {
        Small trial{};
        std::copy_n(motion, n, trial.begin());
        look_around(points, sums, pulse, trial.data());
        const double now = value(points, sums, pulse, trial.data());
        if (now > best) {
            best = now;
            std::copy_n(trial.begin(), n, motion);
        }
    }
    const auto size = static_cast<Index>(n);
    for (int step = 0; step < newton_steps; ++step) {
        const Slope here = slope(points, sums, pulse, motion);
        const double ridge = 1e-9 * here.bound.trace();
        if (!(ridge > 0.0)) return;
        Eigen::MatrixXd matrix = here.curvature.topLeftCorner(size, size);
        Eigen::LLT<Eigen::MatrixXd> solver(matrix);
        if (solver.info() != Eigen::Success || matrix.diagonal().minCoeff() < ridge) {
            matrix = here.bound.topLeftCorner(size, size);
            matrix.diagonal().array() += ridge;
            solver.compute(matrix);
        }
        Eigen::VectorXd move = solver.solve(here.gradient.head(size));
        bool moved = false;
        for (int h = 0; h < halvings && !moved; ++h, move *= 0.5) {
            Small trial{};
            for (std::size_t a = 0; a < n; ++a) trial[a] = motion[a] + move(static_cast<Index>(a));
            const double now = value(points, sums, pulse, trial.data());
            if (now > best) {
                best = now;
                std::copy_n(trial.begin(), n, motion);
                moved = true;
            }
        }
        if (!moved || move.norm() * wavenumber_ < 1e-9) return;
    }
}

// One step of all pulses together: the sum's minoriser of second order, whose maximum is a linear system for the coefficients' change.
void MotionModel::climb_spline(const MotionPoints& points, const std::vector<cdouble>& sums, Coefficients& motion, int knots) const {
    constexpr int halvings = 10;
    const std::size_t n = axes_.size();
    const auto size = static_cast<Index>(knot_count(n_pulse(), knots) * n);
    Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(size, size);
    Eigen::VectorXd right = Eigen::VectorXd::Zero(size);
    double before = 0.0;
    for (std::size_t k = 0; k < n_pulse(); ++k) {
        before += value(points, sums, k, motion.data() + k * n);
        const Slope here = slope(points, sums, k, motion.data() + k * n);
        const Knot at = knot_at(k, knots);
        for (std::size_t p = 0; p < 4; ++p)
            for (std::size_t a = 0; a < n; ++a) {
                const auto row = static_cast<Index>((at.first + p) * n + a);
                right(row) += at.value[p] * here.gradient(static_cast<Index>(a));
                for (std::size_t q = 0; q < 4; ++q)
                    for (std::size_t b = 0; b < n; ++b)
                        matrix(row, static_cast<Index>((at.first + q) * n + b)) +=
                            at.value[p] * at.value[q] * here.bound(static_cast<Index>(a), static_cast<Index>(b));
            }
    }
    const double scale = matrix.diagonal().maxCoeff();
    if (!(scale > 0.0)) return;
    matrix.diagonal().array() += 1e-6 * scale;
    Eigen::VectorXd change = matrix.ldlt().solve(right);
    for (int h = 0; h < halvings; ++h, change *= 0.5) {
        Coefficients trial = motion;
        double now = 0.0;
        for (std::size_t k = 0; k < n_pulse(); ++k) {
            const Knot at = knot_at(k, knots);
            for (std::size_t p = 0; p < 4; ++p)
                for (std::size_t a = 0; a < n; ++a) trial[k * n + a] += at.value[p] * change(static_cast<Index>((at.first + p) * n + a));
            now += value(points, sums, k, trial.data() + k * n);
        }
        if (now > before) {
            motion = std::move(trial);
            return;
        }
    }
}

Coefficients MotionModel::unwrapped(const MotionPoints& points) const {
    const std::size_t n = axes_.size();
    const std::size_t knots = knot_count(n_pulse(), knots_);
    const auto size = static_cast<Index>(knots * n + points.size());
    Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(size, size);
    Eigen::VectorXd right = Eigen::VectorXd::Zero(size);
    Coefficients out = zero();
    for (std::size_t m = 0; m < points.size(); ++m) {
        const MotionPoint& p = *points[m];
        double phase = 0.0;
        cdouble last{};
        for (std::size_t k = 0; k < n_pulse(); ++k) {
            cdouble term{};
            for (std::size_t i = k * n_channel_; i < (k + 1) * n_channel_; ++i)
                term += p.terms[i] * std::polar(1.0, wavenumber_ * (norm(centres_[i] - p.position) - p.range[i]));
            if (!(std::abs(term) > 0.0)) continue;
            phase += std::abs(last) > 0.0 ? std::arg(term * std::conj(last)) : std::arg(term);
            last = term;
            const Vector3 sight = centres_[k * n_channel_] - p.position;
            const Knot at = knot_at(k, knots_);
            std::vector<std::pair<Index, double>> row{{static_cast<Index>(knots * n + m), 1.0}};
            for (std::size_t q = 0; q < 4; ++q)
                for (std::size_t a = 0; a < n; ++a)
                    row.emplace_back(static_cast<Index>((at.first + q) * n + a),
                                     at.value[q] * wavenumber_ * dot(sight, axes_[a]) / norm(sight));
            for (const auto& [i, x] : row) {
                right(i) -= std::abs(term) * x * phase;
                for (const auto& [j, y] : row) matrix(i, j) += std::abs(term) * x * y;
            }
        }
    }
    matrix.diagonal().array() += 1e-9 * matrix.diagonal().maxCoeff();
    const Eigen::VectorXd found = matrix.ldlt().solve(right);
    for (std::size_t k = 0; k < n_pulse(); ++k) {
        const Knot at = knot_at(k, knots_);
        for (std::size_t q = 0; q < 4; ++q)
            for (std::size_t a = 0; a < n; ++a) out[k * n + a] += at.value[q] * found(static_cast<Index>((at.first + q) * n + a));
    }
    return out;
}

MotionModel::Alternation MotionModel::alternate(const MotionPoints& points, Coefficients& motion, int iterations, double tolerance,
                                                bool scan, const std::vector<cdouble>& start) const {
    Alternation out;
    // Of a spline first what is slow: knots four and two times as far apart, where that still leaves a few.
    std::vector<int> spacings{knots_};
    if (!free() && scan)
        for (int wider = 2; wider <= 4; wider *= 2)
            if (2 * static_cast<std::size_t>(wider) * static_cast<std::size_t>(knots_) <= n_pulse())
                spacings.insert(spacings.begin(), wider * knots_);
    std::vector<cdouble> sums(points.size());
    std::size_t level = 0;
    for (int i = 0; i <= iterations; ++i) {
        double now = 0.0;
        for (std::size_t m = 0; m < points.size(); ++m) {
            sums[m] = sum(*points[m], motion);
            now += std::norm(sums[m]);
        }
        const bool settled = !out.steps.empty() && now - out.objective <= tolerance * now;
        out.objective = now;
        out.steps.push_back(now);
        if (settled && ++level >= spacings.size()) {
            out.converged = true;
            return out;
        }
        if (i == iterations) return out;
        if (i == 0 && !start.empty()) {  // not a step of the alternation
            sums = start;
            out.objective = 0.0;
            out.steps.clear();
        }
        if (free())
            for (std::size_t k = 0; k < n_pulse(); ++k) climb(points, sums, k, motion.data() + k * n_axis(), scan);
        else
            climb_spline(points, sums, motion, spacings[level]);
    }
    return out;
}

Coefficients MotionModel::deviation(const MotionPoints& points, const Coefficients& motion) const {
    const std::size_t n = n_axis();
    const auto size = static_cast<Index>(n);
    // A residual phase of variance v at full weight: v = sum w theta^2 / sum w, freed from what the fit took away.
    double weight = 0.0;
    double square = 0.0;
    double count = 0.0;
    std::vector<cdouble> sums;
    for (const MotionPoint* p : points) sums.push_back(sum(*p, motion));
    std::vector<Eigen::Matrix3d> information(n_pulse(), Eigen::Matrix3d::Zero());
    for (std::size_t m = 0; m < points.size(); ++m) {
        const MotionPoint& p = *points[m];
        double mean = 0.0;
        for (const cdouble& t : p.terms) mean += std::abs(t) / static_cast<double>(p.terms.size());
        for (std::size_t k = 0; k < n_pulse(); ++k) {
            const Vector3 towards = displacement(motion, k) - p.position;
            for (std::size_t i = k * n_channel_; i < (k + 1) * n_channel_; ++i) {
                const Vector3 sight = centres_[i] + towards;
                const double range = norm(sight);
                const double angle = std::arg(std::conj(sums[m]) * p.terms[i] * std::polar(1.0, wavenumber_ * (range - p.range[i])));
                const double w = std::abs(p.terms[i]) / mean;
                weight += w;
                square += w * angle * angle;
                count += 1.0;
                Eigen::Vector3d rate = Eigen::Vector3d::Zero();
                for (std::size_t a = 0; a < n; ++a) rate(static_cast<Index>(a)) = wavenumber_ * dot(sight, axes_[a]) / range;
                information[k] += w * rate * rate.transpose();
            }
        }
    }
    Coefficients out(n_pulse() * n);
    const double unknowns = free() ? static_cast<double>(n_pulse() * n) : static_cast<double>(knot_count(n_pulse(), knots_) * n);
    const double variance = square / std::max(weight, 1e-300) * count / std::max(count - unknowns, 1.0);
    if (free()) {
        for (std::size_t k = 0; k < n_pulse(); ++k) {
            const Eigen::MatrixXd block = information[k].topLeftCorner(size, size);
            const Eigen::MatrixXd covariance = block.inverse();
            for (std::size_t a = 0; a < n; ++a)
                out[k * n + a] = std::sqrt(variance * std::max(covariance(static_cast<Index>(a), static_cast<Index>(a)), 0.0));
        }
        return out;
    }
    const auto total = static_cast<Index>(knot_count(n_pulse(), knots_) * n);
    Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(total, total);
    for (std::size_t k = 0; k < n_pulse(); ++k) {
        const Knot at = knot_at(k, knots_);
        for (std::size_t p = 0; p < 4; ++p)
            for (std::size_t q = 0; q < 4; ++q)
                matrix.block(static_cast<Index>((at.first + p) * n), static_cast<Index>((at.first + q) * n), size, size) +=
                    at.value[p] * at.value[q] * information[k].topLeftCorner(size, size);
    }
    matrix.diagonal().array() += 1e-6 * matrix.diagonal().maxCoeff();
    const Eigen::MatrixXd covariance = matrix.ldlt().solve(Eigen::MatrixXd::Identity(total, total));
    for (std::size_t k = 0; k < n_pulse(); ++k) {
        const Knot at = knot_at(k, knots_);
        for (std::size_t a = 0; a < n; ++a) {
            double sum = 0.0;
            for (std::size_t p = 0; p < 4; ++p)
                for (std::size_t q = 0; q < 4; ++q)
                    sum += at.value[p] * at.value[q] *
                           covariance(static_cast<Index>((at.first + p) * n + a), static_cast<Index>((at.first + q) * n + a));
            out[k * n + a] = std::sqrt(variance * std::max(sum, 0.0));
        }
    }
    return out;
}

}  // namespace sarfocus::autofocus::detail
