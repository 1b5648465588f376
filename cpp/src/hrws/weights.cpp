#include <sarfocus/hrws/weights.hpp>

#include <algorithm>
#include <cmath>
#include <string>

#include <Eigen/Dense>

#include <sarfocus/core/checks.hpp>
#include <sarfocus/core/constants.hpp>
#include <sarfocus/core/error.hpp>

#include "band_equations.hpp"

namespace sarfocus::hrws {
namespace {

using detail::Matrix;
using detail::Vector;
using Eigen::Index;

// The bands aliased onto one frequency, [n_band, n_channel], of modulus 1, the spectrum assumed in each, and which is wanted.
struct Bands {
    Matrix equations;
    Eigen::VectorXd spectrum;
    Index wanted = 0;
};

Bands bands_at(double f, const std::vector<double>& offsets, double prf, double velocity, const BandOptions& options) {
    const int n = static_cast<int>(offsets.size());
    std::vector<int> multiples;
    std::vector<double> spectrum;
    Bands out;
    for (int m = -n; m <= n; ++m) {
        const double at = f + m * prf;
        const double level = options.interpolation == Interpolation::mmse ? options.spectrum(at, n, prf)
                             : at >= -0.5 * n * prf && at < 0.5 * n * prf ? 1.0
                                                                          : 0.0;
        if (m == 0) out.wanted = static_cast<Index>(multiples.size());
        if (m != 0 && level == 0.0) continue;
        multiples.push_back(m);
        spectrum.push_back(level);
    }
    out.spectrum = Eigen::Map<const Eigen::VectorXd>(spectrum.data(), static_cast<Index>(spectrum.size()));
    out.equations.resize(static_cast<Index>(multiples.size()), n);
    for (Index row = 0; row < out.equations.rows(); ++row)
        for (Index c = 0; c < n; ++c)
            out.equations(row, c) =
                std::polar(1.0, two_pi * multiples[static_cast<std::size_t>(row)] * prf * offsets[static_cast<std::size_t>(c)] / velocity);
    return out;
}

// Of the bands within the bandwidth.
double condition(const Bands& bands) {
    Matrix rows(0, bands.equations.cols());
    for (Index row = 0; row < bands.equations.rows(); ++row)
        if (bands.spectrum(row) == 1.0) {
            rows.conservativeResize(rows.rows() + 1, Eigen::NoChange);
            rows.bottomRows(1) = bands.equations.row(row);
        }
    if (rows.rows() < 2) return 1.0;
    const Eigen::VectorXd values = rows.jacobiSvd().singularValues();
    return values(0) / values(values.size() - 1);
}

Vector solve(const Bands& bands, const BandOptions& options) {
    const auto n = static_cast<double>(bands.equations.cols());
    if (options.interpolation == Interpolation::yen) {
        Vector right = Vector::Zero(bands.equations.rows());
        right(bands.wanted) = n;
        return bands.equations.fullPivLu().solve(right);
    }
    Matrix normal = bands.equations.adjoint() * bands.spectrum.asDiagonal() * bands.equations;
    normal.diagonal().array() += options.noise;
    const Vector right = n * bands.spectrum(bands.wanted) * bands.equations.row(bands.wanted).adjoint();
    return normal.ldlt().solve(right);
}

}  // namespace

namespace detail {

std::string coinciding_channels(const std::vector<double>& offsets, double step) {
    for (std::size_t i = 0; i < offsets.size(); ++i)
        for (std::size_t j = i + 1; j < offsets.size(); ++j) {
            const double apart = offsets[j] - offsets[i];
            if (std::abs(std::remainder(apart, step)) < 1e-2 * step)
                return "channels " + std::to_string(i) + " and " + std::to_string(j) + " sample the same places along the track (" +
                       number_text(apart) + " m apart, the pulses " + number_text(step) + " m)";
        }
    return {};
}

void require_condition(double found, const std::vector<double>& offsets, double prf, double velocity, const BandOptions& options) {
    if (found <= options.condition_limit) return;
    const std::string reason = coinciding_channels(offsets, velocity / prf);
    throw NumericalError("phase_centres: the band equations have the condition number " +
                         (std::isfinite(found) ? number_text(found) : "infinity") +
                         ", above condition_limit = " + number_text(options.condition_limit) + (reason.empty() ? "" : ": " + reason));
}

}  // namespace detail

void BandOptions::validate(std::ptrdiff_t n_channel, double prf) const {
    require_positive(prf, "prf");
    const double most = static_cast<double>(n_channel) * prf;
    if (!(doppler_bandwidth >= 0.0 && doppler_bandwidth <= most * (1.0 + 1e-9)))
        throw ValueError("doppler_bandwidth", "0 to the prf of all channels, " + number_text(most) + " Hz", number_text(doppler_bandwidth));
    require_finite_value(doppler_centroid, "doppler_centroid");
    const double left = 0.5 * (most - (doppler_bandwidth == 0.0 ? most : std::min(doppler_bandwidth, most)));
    if (margin < 0.0 || margin > left) throw ValueError("margin", "0 to " + number_text(left) + " Hz", number_text(margin));
    if (!(noise > 0.0 && std::isfinite(noise))) throw ValueError("noise", "a finite ratio > 0", number_text(noise));
    if (!(condition_limit >= 1.0)) throw ValueError("condition_limit", "a number >= 1", number_text(condition_limit));
    if (n_frequency < 8 || n_frequency > 1 << 20) throw ValueError("n_frequency", "8 to 1048576", std::to_string(n_frequency));
}

double BandOptions::processed(std::ptrdiff_t n_channel, double prf) const {
    const double most = static_cast<double>(n_channel) * prf;
    const double band = doppler_bandwidth == 0.0 ? most : doppler_bandwidth;
    return std::min(most, band + 2.0 * (std::isnan(margin) ? 0.1 * band : margin));
}

double BandOptions::spectrum(double f, std::ptrdiff_t n_channel, double prf) const {
    const double most = static_cast<double>(n_channel) * prf;
    const double inside = 0.5 * (doppler_bandwidth == 0.0 ? most : doppler_bandwidth);
    const double outside = 0.5 * processed(n_channel, prf);
    if (f >= -inside && f < inside) return 1.0;
    if (std::abs(f) >= outside) return 0.0;
    const double share = (std::abs(f) - inside) / (outside - inside);
    return std::exp(std::log(1e-6) * share * share);
}

ChannelWeights channel_weights(const std::vector<double>& offsets, double prf, double velocity, const BandOptions& options) {
    if (offsets.empty()) throw ShapeError("offsets", "at least one channel", "none");
    const auto n = static_cast<std::ptrdiff_t>(offsets.size());
    require_positive(velocity, "velocity");
    options.validate(n, prf);

    const double band = options.processed(n, prf);
    ChannelWeights out;
    out.frequency_step = band / static_cast<double>(options.n_frequency);
    out.frequency_start = options.doppler_centroid - 0.5 * band;
    out.weights = Array<cdouble, 2>({options.n_frequency, n});
    for (std::ptrdiff_t i = 0; i < options.n_frequency; ++i) {
        const double f = (static_cast<double>(i) + 0.5) * out.frequency_step - 0.5 * band;
        const Bands bands = bands_at(f, offsets, prf, velocity, options);
        out.condition_number = std::max(out.condition_number, condition(bands));
        const Vector w = solve(bands, options);
        for (std::ptrdiff_t c = 0; c < n; ++c) out.weights(i, c) = w(static_cast<Index>(c));
        out.noise_amplification += w.squaredNorm() / static_cast<double>(n * options.n_frequency);
    }
    detail::require_condition(out.condition_number, offsets, prf, velocity, options);
    return out;
}

}  // namespace sarfocus::hrws
