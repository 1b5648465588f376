#include "ridge_fit.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <Eigen/Cholesky>

namespace sarfocus::autofocus::detail {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double cauchy = 3.0;            // standard deviations
constexpr double pinned = 0.01;           // range_std times this: what is held
constexpr double steepest = 0.9;          // of the range, of the way along the track, where the start says more
constexpr double least_damping = 1e-12;   // below it a step is a Gauss-Newton step
constexpr double largest_damping = 1e12;  // above it no step gains

std::size_t at(std::ptrdiff_t i) {
    return static_cast<std::size_t>(i);
}

}  // namespace

PulseSpline::PulseSpline(std::ptrdiff_t n_pulse, int knots) {
    const std::ptrdiff_t intervals = std::max<std::ptrdiff_t>(1, (n_pulse - 2 + knots) / knots);
    size_ = intervals + 3;
    width_ = static_cast<double>(n_pulse - 1) / static_cast<double>(intervals);
}

Index PulseSpline::first(std::ptrdiff_t pulse) const {
    return std::min(static_cast<Index>(static_cast<double>(pulse) / width_), size_ - 4);
}

std::array<double, 4> PulseSpline::weights(std::ptrdiff_t pulse) const {
    const double t = static_cast<double>(pulse) / width_ - static_cast<double>(first(pulse));
    const double s = 1.0 - t;
    return {s * s * s / 6.0, (3.0 * t * t * t - 6.0 * t * t + 4.0) / 6.0, (3.0 * s * s * s - 6.0 * s * s + 4.0) / 6.0, t * t * t / 6.0};
}

double PulseSpline::value(const VectorXd& coefficients, std::ptrdiff_t pulse) const {
    const std::array<double, 4> w = weights(pulse);
    double sum = 0.0;
    for (Index i = 0; i < 4; ++i) sum += w[at(i)] * coefficients(first(pulse) + i);
    return sum;
}

RidgeFit::RidgeFit(const RidgeRanges& range, const StartLine& line, std::vector<std::ptrdiff_t> used, const RidgePathOptions& options)
    : range_(range),
      line_(line),
      used_(std::move(used)),
      options_(options),
      spline_(range.extent(1), options.knots),
      n_unknown_((options.across ? 2 : 1) * spline_.size() + 3 * std::ssize(used_)),
      unknown_(VectorXd::Zero(n_unknown_)) {
    for (std::size_t k = 0; k < used_.size(); ++k) place_on_the_line(k);
    prepare_priors();
}

Index RidgeFit::point_at(std::size_t k) const {
    return (options_.across ? 2 : 1) * spline_.size() + 3 * static_cast<Index>(k);
}

// On the start, range^2 - along^2 is linear in the place along the track and in the square of the distance from its beginning.
void RidgeFit::place_on_the_line(std::size_t k) {
    double n = 0.0;
    double s1 = 0.0;
    double s2 = 0.0;
    double q = 0.0;
    double sq = 0.0;
    double sum_range = 0.0;
    for (std::ptrdiff_t p = 0; p < range_.extent(1); ++p) {
        const double r = range_(used_[k], p);
        if (std::isnan(r)) continue;
        const double s = line_.along[at(p)] - line_.mean;
        const double value = r * r - s * s;
        n += 1.0;
        s1 += s;
        s2 += s * s;
        q += value;
        sq += s * value;
        sum_range += r;
    }
    const double mean_range = sum_range / n;
    double along = -0.5 * (sq - s1 * q / n) / std::max(s2 - s1 * s1 / n, std::numeric_limits<double>::min());
    double square = (q + 2.0 * along * s1) / n - along * along;
    const double least = (1.0 - steepest * steepest) * mean_range * mean_range;
    if (!(square > least)) {
        along = s1 / n + std::copysign(steepest * mean_range, along - s1 / n);
        square = least;
    }
    unknown_(point_at(k)) = line_.mean + along;
    unknown_(point_at(k) + 1) = std::sqrt(square);
}

void RidgeFit::prior(const VectorXd& row, double deviation) {
    prior_.noalias() += row * row.transpose() / (deviation * deviation);
}

void RidgeFit::prepare_priors() {
    const Index n = spline_.size();
    const std::ptrdiff_t n_pulse = range_.extent(1);
    prior_ = MatrixXd::Zero(n_unknown_, n_unknown_);
    const double mean_step = line_.length / static_cast<double>(n_pulse - 1);
    constexpr double steps_per_change = 20.0;
    const double curvature = options_.step_change > 0.0 ? options_.step_change : mean_step / steps_per_change;
    VectorXd mean = VectorXd::Zero(n_unknown_);
    stretch_ = VectorXd::Zero(n_unknown_);
    for (std::ptrdiff_t p = 0; p < n_pulse; ++p) {
        const std::array<double, 4> w = spline_.weights(p);
        for (Index i = 0; i < 4; ++i) {
            mean(spline_.first(p) + i) += w[at(i)] / static_cast<double>(n_pulse);
            stretch_(spline_.first(p) + i) += w[at(i)] * (line_.along[at(p)] - line_.mean) / line_.square;
        }
    }
    const auto bend = [&](Index from) {
        for (Index i = from + 1; i + 1 < from + n; ++i) {
            VectorXd row = VectorXd::Zero(n_unknown_);
            row.segment(i - 1, 3) << 1.0, -2.0, 1.0;
            prior(row, curvature * spline_.width() * spline_.width());
        }
    };
    const double held = pinned * options_.range_std;
    bend(0);
    prior(mean, held);
    prior(stretch_, options_.length_std);
    if (options_.across) {
        bend(n);
        const auto shifted = [&](const VectorXd& row) {
            VectorXd out = VectorXd::Zero(n_unknown_);
            out.segment(n, n) = row.head(n);
            return out;
        };
        prior(shifted(mean), held);
        prior(shifted(stretch_), held / line_.length);
        for (Index i = n; i < 2 * n; ++i) prior_(i, i) += 1.0 / (options_.across_std * options_.across_std);
    }
    for (std::size_t k = 0; k < used_.size(); ++k)
        prior_(point_at(k) + 2, point_at(k) + 2) += 1.0 / (options_.offset_std * options_.offset_std);
}

double RidgeFit::across(std::ptrdiff_t pulse) const {
    return options_.across ? spline_.value(unknown_.segment(spline_.size(), spline_.size()), pulse) : 0.0;
}

RidgeFit::Place RidgeFit::place(std::size_t k) const {
    return {unknown_(point_at(k)), unknown_(point_at(k) + 1), unknown_(point_at(k) + 2)};
}

double RidgeFit::residual_at(const VectorXd& unknown, std::size_t k, std::ptrdiff_t pulse) const {
    const double measured = range_(used_[k], pulse);
    if (std::isnan(measured)) return measured;
    const Index p = point_at(k);
    const Index n = spline_.size();
    const double s = line_.along[at(pulse)] + spline_.value(unknown.head(n), pulse);
    const double h = line_.across[at(pulse)] + (options_.across ? spline_.value(unknown.segment(n, n), pulse) : 0.0);
    return std::hypot(s - unknown(p), h - unknown(p + 1)) + unknown(p + 2) - measured;
}

double RidgeFit::objective(const VectorXd& unknown) const {
    double sum = 0.0;
    for (std::size_t k = 0; k < used_.size(); ++k)
        for (std::ptrdiff_t pulse = 0; pulse < range_.extent(1); ++pulse) {
            const double e = residual_at(unknown, k, pulse) / (cauchy * options_.range_std);
            if (!std::isnan(e)) sum += cauchy * cauchy * std::log1p(e * e);
        }
    return sum / options_.correlation + unknown.dot(prior_ * unknown);
}

RidgeFit::Normal RidgeFit::normal() const {
    Normal out{prior_, prior_ * unknown_};
    const Index n = spline_.size();
    std::array<std::pair<Index, double>, 11> row{};
    const double weight = 1.0 / (options_.range_std * options_.range_std * options_.correlation);
    for (std::size_t k = 0; k < used_.size(); ++k) {
        const Index p = point_at(k);
        for (std::ptrdiff_t pulse = 0; pulse < range_.extent(1); ++pulse) {
            const double e = residual_at(unknown_, k, pulse);
            if (std::isnan(e)) continue;
            const double s = line_.along[at(pulse)] + along(pulse) - unknown_(p);
            const double h = line_.across[at(pulse)] + across(pulse) - unknown_(p + 1);
            const double distance = std::max(std::hypot(s, h), std::numeric_limits<double>::min());
            const std::array<double, 4> w = spline_.weights(pulse);
            std::size_t count = 0;
            for (Index i = 0; i < 4; ++i) row[count++] = {spline_.first(pulse) + i, w[at(i)] * s / distance};
            if (options_.across)
                for (Index i = 0; i < 4; ++i) row[count++] = {n + spline_.first(pulse) + i, w[at(i)] * h / distance};
            row[count++] = {p, -s / distance};
            row[count++] = {p + 1, -h / distance};
            row[count++] = {p + 2, 1.0};
            const double ratio = e / (cauchy * options_.range_std);
            const double robust = weight / (1.0 + ratio * ratio);
            for (std::size_t i = 0; i < count; ++i) {
                const auto [column, value] = row[i];
                out.right(column) += robust * value * e;
                for (std::size_t j = 0; j < count; ++j) out.matrix(column, row[j].first) += robust * value * row[j].second;
            }
        }
    }
    return out;
}

bool RidgeFit::run() {
    double before = objective(unknown_);
    double damping = 1e-3;
    for (iterations_ = 0; iterations_ < options_.iterations; ++iterations_) {
        const Normal equations = normal();
        for (;;) {
            MatrixXd damped = equations.matrix;
            damped.diagonal() *= 1.0 + damping;
            const VectorXd tried = unknown_ - damped.ldlt().solve(equations.right);
            const double now = objective(tried);
            if (now <= before) {
                unknown_ = tried;
                const double gain = before - now;
                before = now;
                damping = std::max(0.2 * damping, least_damping);
                if (gain <= options_.tolerance * before) return true;
                break;
            }
            damping *= 4.0;
            if (!(damping < largest_damping)) return true;
        }
    }
    return false;
}

RidgeFit::Spread RidgeFit::spread() const {
    double squares = 0.0;
    double count = 0.0;
    for (std::size_t k = 0; k < used_.size(); ++k)
        for (std::ptrdiff_t pulse = 0; pulse < range_.extent(1); ++pulse) {
            const double e = residual(k, pulse) / options_.range_std;
            if (std::isnan(e)) continue;
            squares += e * e / (1.0 + e * e / (cauchy * cauchy));
            count += 1.0;
        }
    const double scale = std::max(1.0, squares / std::max(count, 1.0));  // residuals larger than expected widen all
    const MatrixXd covariance = normal().matrix.ldlt().solve(MatrixXd::Identity(n_unknown_, n_unknown_)) * scale;
    const VectorXd with_stretch = covariance * stretch_;
    Spread out;
    out.length = std::sqrt(std::max(0.0, stretch_.dot(with_stretch)));
    const Index n = spline_.size();
    const auto deviation = [&](std::ptrdiff_t pulse, Index from, double lever) {
        const std::array<double, 4> w = spline_.weights(pulse);
        const Index first = from + spline_.first(pulse);
        VectorXd row = -lever * stretch_;
        for (Index i = 0; i < 4; ++i) row(first + i) += w[at(i)];
        return std::sqrt(std::max(0.0, row.dot(covariance * row)));
    };
    for (std::ptrdiff_t pulse = 0; pulse < range_.extent(1); ++pulse) {
        out.along.push_back(deviation(pulse, 0, line_.along[at(pulse)] - line_.mean));
        out.across.push_back(options_.across ? deviation(pulse, n, 0.0) : 0.0);
    }
    return out;
}

}  // namespace sarfocus::autofocus::detail
