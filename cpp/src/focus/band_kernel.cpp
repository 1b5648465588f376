#include "focus/band_kernel.hpp"

#include <algorithm>
#include <cmath>
#include <complex>

#include <Eigen/Dense>

#include <sarfocus/core/constants.hpp>

namespace sarfocus::focus::detail {
namespace {

constexpr double ridge = 1e-13;  // of a diagonal of 1: far below single precision

double sinc(double x) {
    return x == 0.0 ? 1.0 : std::sin(pi * x) / (pi * x);
}

class Normal {
public:
    Normal(std::ptrdiff_t taps, double band) : taps_(taps), before_(taps / 2 - 1), band_(band) {
        Eigen::MatrixXd gram(taps, taps);
        for (std::ptrdiff_t r = 0; r < taps; ++r)
            for (std::ptrdiff_t c = 0; c < taps; ++c) gram(r, c) = sinc(static_cast<double>(r - c) * band) + (r == c ? ridge : 0.0);
        factor_.compute(gram);
    }

    [[nodiscard]] double place(std::ptrdiff_t t) const { return static_cast<double>(t - before_); }

    [[nodiscard]] Eigen::VectorXd weights(double fraction) const {
        Eigen::VectorXd right(taps_);
        for (std::ptrdiff_t t = 0; t < taps_; ++t) right(t) = sinc((fraction - place(t)) * band_);
        return factor_.solve(right);
    }

private:
    std::ptrdiff_t taps_;
    std::ptrdiff_t before_;
    double band_;
    Eigen::LDLT<Eigen::MatrixXd> factor_;
};

}  // namespace

BandKernel::BandKernel(std::ptrdiff_t taps, double band) : taps_(taps), table_(static_cast<std::size_t>((fractions + 1) * most_taps)) {
    const Normal normal(taps, band);
    for (std::ptrdiff_t f = 0; f <= fractions; ++f) {
        const Eigen::VectorXd h = normal.weights(static_cast<double>(f) / static_cast<double>(fractions));
        for (std::ptrdiff_t t = 0; t < taps; ++t) table_[static_cast<std::size_t>(f * most_taps + t)] = static_cast<float>(h(t));
    }
}

BandKernel::Error BandKernel::error(std::ptrdiff_t taps, double band) {
    const Normal normal(taps, band);
    constexpr int n_fraction = 16;
    constexpr int n_frequency = 24;
    double power[n_frequency + 1] = {};
    for (int f = 0; f < n_fraction; ++f) {
        const double fraction = (f + 0.5) / n_fraction;
        const Eigen::VectorXd h = normal.weights(fraction);
        for (int k = 0; k <= n_frequency; ++k) {
            const double w = pi * band * k / n_frequency;
            std::complex<double> difference = -std::polar(1.0, w * fraction);
            for (std::ptrdiff_t t = 0; t < taps; ++t) difference += h(t) * std::polar(1.0, w * normal.place(t));
            power[k] += std::norm(difference) / n_fraction;
        }
    }
    double mean = 0.0;
    for (int k = 0; k < n_frequency; ++k) mean += 0.5 * (power[k] + power[k + 1]) / n_frequency;
    return {std::sqrt(*std::max_element(power, power + n_frequency + 1)), std::sqrt(mean)};
}

BandCubic::BandCubic(double band) {
    constexpr double reach = 0.55;
    constexpr std::ptrdiff_t n = 4 * taps;
    constexpr int n_x = 24;
    Eigen::MatrixXd gram = Eigen::MatrixXd::Zero(n, n);
    Eigen::VectorXd right = Eigen::VectorXd::Zero(n);
    for (int k = 0; k < n_x; ++k) {
        const double x = reach * (2.0 * (k + 0.5) / n_x - 1.0);
        const double power[4] = {1.0, x, x * x, x * x * x};
        for (std::ptrdiff_t a = 0; a < n; ++a) {
            right(a) += power[a / taps] * sinc((x - static_cast<double>(a % taps - side)) * band) / n_x;
            for (std::ptrdiff_t b = 0; b < n; ++b)
                gram(a, b) += power[a / taps] * power[b / taps] * sinc(static_cast<double>(a % taps - b % taps) * band) / n_x;
        }
    }
    gram.diagonal().array() += ridge;
    const Eigen::VectorXd solution = gram.ldlt().solve(right);
    for (std::ptrdiff_t a = 0; a < n; ++a) weights_[a] = static_cast<float>(solution(a));

    double power = 0.0;
    for (int f = 0; f < n_x; ++f) {
        const double w = pi * band * (f + 0.5) / n_x;
        for (int k = 0; k < n_x; ++k) {
            const double x = (k + 0.5) / n_x - 0.5;
            std::complex<double> difference = -std::polar(1.0, w * x);
            double monomial = 1.0;
            for (std::ptrdiff_t a = 0; a < n; ++a) {
                if (a > 0 && a % taps == 0) monomial *= x;
                difference += solution(a) * monomial * std::polar(1.0, w * static_cast<double>(a % taps - side));
            }
            power += std::norm(difference) / (n_x * n_x);
        }
    }
    error_ = std::sqrt(power);
}

}  // namespace sarfocus::focus::detail
