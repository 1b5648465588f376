#include "focus/virtual_track.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Dense>

#include <sarfocus/core/constants.hpp>

namespace sarfocus::focus::detail {
namespace {

constexpr double extension = 1.0 / 3.0;
constexpr double curvature_penalty = 1e-11;
constexpr std::ptrdiff_t least_pulses = 64;
constexpr double most_sagitta = 0.15;  // of the chord: an arc of 67 degrees

// Values or derivatives of T_0 … T_degree at s; beyond [-1, 1] every function goes on straight.
Eigen::RowVectorXd chebyshev(double s, std::ptrdiff_t degree, int order) {
    const double inside = std::clamp(s, -1.0, 1.0);
    Eigen::RowVectorXd value = Eigen::RowVectorXd::Zero(degree + 1);
    Eigen::RowVectorXd first = value;
    Eigen::RowVectorXd second = value;
    value(0) = 1.0;
    if (degree >= 1) {
        value(1) = inside;
        first(1) = 1.0;
    }
    for (std::ptrdiff_t n = 2; n <= degree; ++n) {
        value(n) = 2.0 * inside * value(n - 1) - value(n - 2);
        first(n) = 2.0 * value(n - 1) + 2.0 * inside * first(n - 1) - first(n - 2);
        second(n) = 4.0 * first(n - 1) + 2.0 * inside * second(n - 1) - second(n - 2);
    }
    if (order == 2) return second;
    if (order == 1) return first;
    return value + (s - inside) * first;
}

double sagitta(const geometry::PhaseCentres& centres, std::ptrdiff_t begin, std::ptrdiff_t end, double length) {
    const Vector3 origin = middle_of(centres, begin);
    const Vector3 chord = (1.0 / length) * (middle_of(centres, end - 1) - origin);
    double most = 0.0;
    for (std::ptrdiff_t p = begin; p < end; ++p) {
        const Vector3 way = middle_of(centres, p) - origin;
        const double along = dot(way, chord);
        most = std::max(most, norm(way - along * chord));
        most = std::max(most, std::max(-along, along - length));
    }
    return most;
}

}  // namespace

Vector3 middle_of(const geometry::PhaseCentres& centres, std::ptrdiff_t pulse) {
    return centres.monostatic() ? centres.tx(pulse) : 0.5 * (centres.tx(pulse) + centres.rx(pulse));
}

std::vector<std::ptrdiff_t> pieces_of_path(const geometry::PhaseCentres& centres) {
    std::vector<std::ptrdiff_t> ends{0};
    std::vector<std::ptrdiff_t> open{centres.n_pulse()};
    while (!open.empty()) {
        const std::ptrdiff_t begin = ends.back();
        const std::ptrdiff_t end = open.back();
        if (end - begin < least_pulses) return {};
        const double length = norm(middle_of(centres, end - 1) - middle_of(centres, begin));
        if (length > 0.0 && sagitta(centres, begin, end, length) <= most_sagitta * length) {
            ends.push_back(end);
            open.pop_back();
        } else
            open.push_back(begin + (end - begin) / 2);
    }
    return ends;
}

VirtualTrack::VirtualTrack(const geometry::PhaseCentres& centres, std::ptrdiff_t begin, std::ptrdiff_t count, std::ptrdiff_t degree)
    : origin_(middle_of(centres, begin)) {
    const Vector3 way = middle_of(centres, begin + count - 1) - origin_;
    chord_ = (1.0 / norm(way)) * way;
    for (std::ptrdiff_t p = begin; p < begin + count; ++p) {
        const double t = along(middle_of(centres, p));
        begin_ = p == begin ? t : std::min(begin_, t);
        end_ = p == begin ? t : std::max(end_, t);
    }
    middle_ = 0.5 * (begin_ + end_);
    half_ = (0.5 + extension) * (end_ - begin_);

    const std::ptrdiff_t n = degree + 1;
    Eigen::MatrixXd gram = Eigen::MatrixXd::Zero(n, n);
    Eigen::MatrixXd right = Eigen::MatrixXd::Zero(n, 6);
    for (std::ptrdiff_t p = begin; p < begin + count; ++p) {
        const Eigen::RowVectorXd row = chebyshev((along(middle_of(centres, p)) - middle_) / half_, degree, 0);
        const Vector3 tx = centres.tx(p) - origin_;
        const Vector3 rx = centres.rx(p) - origin_;
        gram += row.transpose() * row / static_cast<double>(count);
        for (std::ptrdiff_t a = 0; a < 3; ++a) {
            right.col(a) += row.transpose() * tx[static_cast<std::size_t>(a)] / static_cast<double>(count);
            right.col(3 + a) += row.transpose() * rx[static_cast<std::size_t>(a)] / static_cast<double>(count);
        }
    }
    const std::ptrdiff_t nodes = 4 * n;
    for (std::ptrdiff_t k = 0; k < nodes; ++k) {
        const Eigen::RowVectorXd row = chebyshev(std::cos(pi * (static_cast<double>(k) + 0.5) / static_cast<double>(nodes)), degree, 2);
        gram += curvature_penalty / static_cast<double>(nodes) * row.transpose() * row;
    }
    const Eigen::MatrixXd solution = gram.ldlt().solve(right);
    for (std::ptrdiff_t k = 0; k < n; ++k) {
        coefficients_.emplace_back();
        for (std::ptrdiff_t a = 0; a < 6; ++a) coefficients_.back()[static_cast<std::size_t>(a)] = solution(k, a);
    }

    double power = 0.0;
    for (std::ptrdiff_t p = begin; p < begin + count; ++p) {
        const Antennas place = at(along(middle_of(centres, p)));
        const double off_tx = norm(centres.tx(p) - place.tx);
        const double off_rx = norm(centres.rx(p) - place.rx);
        power += 0.5 * (off_tx * off_tx + off_rx * off_rx) / static_cast<double>(count);
    }
    deviation_ = std::sqrt(power);
}

Antennas VirtualTrack::evaluate(double t, bool derivative) const {
    const Eigen::RowVectorXd basis =
        chebyshev((t - middle_) / half_, static_cast<std::ptrdiff_t>(coefficients_.size()) - 1, derivative ? 1 : 0);
    std::array<double, 6> sum{};
    for (std::size_t k = 0; k < coefficients_.size(); ++k)
        for (std::size_t a = 0; a < 6; ++a)
            sum[a] += basis(static_cast<std::ptrdiff_t>(k)) * coefficients_[k][a] * (derivative ? 1.0 / half_ : 1.0);
    const Vector3 base = derivative ? Vector3{} : origin_;
    return {base + Vector3{sum[0], sum[1], sum[2]}, base + Vector3{sum[3], sum[4], sum[5]}};
}

}  // namespace sarfocus::focus::detail
