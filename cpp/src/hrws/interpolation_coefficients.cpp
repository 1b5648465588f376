#include <cmath>
#include <string>

#include <Eigen/Cholesky>

#include <sarfocus/core/checks.hpp>
#include <sarfocus/core/constants.hpp>
#include <sarfocus/core/error.hpp>
#include <sarfocus/hrws/weights.hpp>

#include "band_equations.hpp"

namespace sarfocus::hrws {
namespace {

using detail::Matrix;
using detail::Vector;
using Eigen::Index;

double sinc(double x) {
    return x == 0.0 ? 1.0 : std::sin(pi * x) / (pi * x);
}

// Times of an evenly spaced sample and of the samples about it, in pulses.
struct Times {
    std::vector<double> channel;  // [n_channel]
    std::ptrdiff_t half_width;

    [[nodiscard]] double even(std::ptrdiff_t i) const {
        const auto n = static_cast<double>(channel.size());
        return (static_cast<double>(i) - 0.5 * (n - 1.0)) / n;
    }
};

// [Yen1956] of the coefficients of sample l of channel n at time t, real for a band about zero.
double yen(const Times& times, double t, std::ptrdiff_t l, std::size_t n) {
    double product = sinc(t - times.channel[n] - static_cast<double>(l));
    for (std::size_t m = 0; m < times.channel.size(); ++m)
        if (m != n) product *= std::sin(pi * (t - times.channel[m])) / std::sin(pi * (times.channel[n] - times.channel[m]));
    const bool odd = l % 2 != 0 && times.channel.size() % 2 == 0;
    return odd ? -product : product;
}

// Autocorrelation over `time` pulses of the spectrum assumed: that of the bandwidth is a sinc, of the margins Simpson's rule.
double autocorrelation(double time, std::ptrdiff_t n_channel, double prf, const BandOptions& options) {
    constexpr int steps = 1024;  // a margin holds at most one cosine for each pulse of lag and prf: 129 of them in the longest
    const double band = options.doppler_bandwidth == 0.0 ? static_cast<double>(n_channel) * prf : options.doppler_bandwidth;
    const double margin = 0.5 * (options.processed(n_channel, prf) - band);
    const double inside = band / prf * sinc(band / prf * time);
    if (!(margin > 0.0)) return inside;
    double sum = 0.0;
    for (int s = 0; s <= steps; ++s) {
        const double f = 0.5 * band + margin * s / steps;
        const double level = s == steps ? 0.0 : s == 0 ? 1.0 : options.spectrum(f, n_channel, prf);
        sum += (s == 0 || s == steps ? 1.0 : s % 2 == 1 ? 4.0 : 2.0) * level * std::cos(two_pi * f / prf * time);
    }
    return inside + 2.0 * sum * margin / (3.0 * steps * prf);
}

void least_squares(const Times& times, double prf, const BandOptions& options, Array<cdouble, 3>& psi) {
    const auto n = static_cast<std::ptrdiff_t>(times.channel.size());
    const std::ptrdiff_t width = 2 * times.half_width + 1;
    const auto at = [&](std::ptrdiff_t j) {
        const std::ptrdiff_t lag = j / n - times.half_width;
        return times.channel[static_cast<std::size_t>(j % n)] + static_cast<double>(lag);
    };
    // By the lag in pulses and the two channels.
    Array<double, 3> table({2 * width - 1, n, n});
    for (std::ptrdiff_t l = 0; l < table.extent(0); ++l)
        for (std::ptrdiff_t a = 0; a < n; ++a)
            for (std::ptrdiff_t b = 0; b < n; ++b)
                table(l, a, b) = autocorrelation(static_cast<double>(l - width + 1) + times.channel[static_cast<std::size_t>(a)] -
                                                     times.channel[static_cast<std::size_t>(b)],
                                                 n, prf, options);
    Eigen::MatrixXd normal(width * n, width * n);
    for (std::ptrdiff_t a = 0; a < width * n; ++a)
        for (std::ptrdiff_t b = 0; b <= a; ++b) normal(a, b) = normal(b, a) = table(a / n - b / n + width - 1, a % n, b % n);
    normal.diagonal().array() += options.noise;
    const Eigen::LDLT<Eigen::MatrixXd> factors(normal);
    for (std::ptrdiff_t i = 0; i < n; ++i) {
        Eigen::VectorXd right(width * n);
        for (std::ptrdiff_t a = 0; a < width * n; ++a) right(a) = autocorrelation(times.even(i) - at(a), n, prf, options);
        const Eigen::VectorXd values = factors.solve(right);
        for (std::ptrdiff_t a = 0; a < width * n; ++a) psi(i, a / n, a % n) = values(a);
    }
}

}  // namespace

Array<cdouble, 3> interpolation_coefficients(const std::vector<double>& offsets, double prf, double velocity, std::ptrdiff_t half_width,
                                             const BandOptions& options) {
    (void)channel_weights(offsets, prf, velocity, options);  // for the checks
    if (half_width < 1 || half_width > 64) throw ValueError("half_width", "1 to 64 pulses", std::to_string(half_width));
    const auto n = static_cast<std::ptrdiff_t>(offsets.size());
    Times times{{}, half_width};
    for (const double offset : offsets) times.channel.push_back(offset * prf / velocity);

    Array<cdouble, 3> psi({n, 2 * half_width + 1, n});
    if (options.interpolation == Interpolation::mmse)
        least_squares(times, prf, options, psi);
    else
        for (std::ptrdiff_t i = 0; i < n; ++i)
            for (std::ptrdiff_t l = -half_width; l <= half_width; ++l)
                for (std::ptrdiff_t c = 0; c < n; ++c)
                    psi(i, l + half_width, c) = yen(times, times.even(i), l, static_cast<std::size_t>(c));
    // A band about the centroid: the samples turned to zero and back.
    for (std::ptrdiff_t i = 0; i < n; ++i)
        for (std::ptrdiff_t l = -half_width; l <= half_width; ++l)
            for (std::ptrdiff_t c = 0; c < n; ++c) {
                const double lag = times.even(i) - times.channel[static_cast<std::size_t>(c)] - static_cast<double>(l);
                psi(i, l + half_width, c) *= std::polar(1.0, two_pi * options.doppler_centroid / prf * lag);
            }
    return psi;
}

}  // namespace sarfocus::hrws
