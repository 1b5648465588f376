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

using Index = Eigen::Index;
using detail::Matrix;
using detail::Vector;

constexpr double negligible = 1e-12;  // of the assumed spectrum

// The bands aliased onto one frequency: their equations, the spectrum assumed in each, and which of them is wanted.
struct Bands {
    Matrix equations;           // [n_band, n_channel], of modulus 1
    std::vector<double> level;  // assumed spectrum
    Index wanted = 0;
};

Bands bands_at(double f, const std::vector<double>& offsets, double prf, double velocity, const BandOptions& options) {
    const auto n = static_cast<std::ptrdiff_t>(offsets.size());
    std::vector<int> multiples;
    Bands out;
    for (int m = -static_cast<int>(n); m <= static_cast<int>(n); ++m) {
        const double shifted = f + m * prf;
        const double level =
            options.interpolation == Interpolation::yen
                ? (shifted >= -0.5 * static_cast<double>(n) * prf && shifted < 0.5 * static_cast<double>(n) * prf ? 1.0 : 0.0)
                : options.spectrum(shifted, n, prf);
        if (level < negligible) continue;
        if (m == 0) out.wanted = static_cast<Index>(multiples.size());
        multiples.push_back(m);
        out.level.push_back(level);
    }
    out.equations.resize(static_cast<Index>(multiples.size()), static_cast<Index>(n));
    for (std::size_t row = 0; row < multiples.size(); ++row)
        for (std::size_t c = 0; c < offsets.size(); ++c)
            out.equations(static_cast<Index>(row), static_cast<Index>(c)) =
                std::polar(1.0, two_pi * multiples[row] * prf * offsets[c] / velocity);
    return out;
}

// Of the equations of the bands within the bandwidth.
double condition(const Bands& bands) {
    std::vector<Index> rows;
    for (std::size_t i = 0; i < bands.level.size(); ++i)
        if (bands.level[i] >= 0.5) rows.push_back(static_cast<Index>(i));
    const Matrix within = bands.equations(rows, Eigen::all);
    const Eigen::VectorXd values = within.jacobiSvd().singularValues();
    return values(0) / values(values.size() - 1);
}

Vector solve(const Bands& bands, const BandOptions& options) {
    const Index n = bands.equations.cols();
    if (options.interpolation == Interpolation::yen) {
        Vector right = Vector::Zero(bands.equations.rows());
        right(bands.wanted) = static_cast<double>(n);
        return bands.equations.fullPivLu().solve(right);
    }
    Matrix normal = Matrix::Identity(n, n) * options.noise;
    for (Index row = 0; row < bands.equations.rows(); ++row)
        normal += bands.level[static_cast<std::size_t>(row)] * bands.equations.row(row).adjoint() * bands.equations.row(row);
    const double level = bands.level[static_cast<std::size_t>(bands.wanted)];
    const Vector right = static_cast<double>(n) * level * bands.equations.row(bands.wanted).adjoint();
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
    if (transition < 0.0 || transition > most - bandwidth(n_channel, prf))
        throw ValueError("transition", "0 to " + number_text(most - bandwidth(n_channel, prf)) + " Hz", number_text(transition));
    if (!(noise > 0.0 && std::isfinite(noise))) throw ValueError("noise", "a finite ratio > 0", number_text(noise));
    if (!(condition_limit >= 1.0)) throw ValueError("condition_limit", "a number >= 1", number_text(condition_limit));
    if (n_frequency < 8 || n_frequency > 1 << 20) throw ValueError("n_frequency", "8 to 1048576", std::to_string(n_frequency));
}

double BandOptions::bandwidth(std::ptrdiff_t n_channel, double prf) const {
    const double most = static_cast<double>(n_channel) * prf;
    return doppler_bandwidth == 0.0 ? most : std::min(doppler_bandwidth, most);
}

double BandOptions::fall(std::ptrdiff_t n_channel, double prf) const {
    const double band = bandwidth(n_channel, prf);
    return std::isnan(transition) ? std::min(0.1 * band, static_cast<double>(n_channel) * prf - band) : transition;
}

double BandOptions::spectrum(double f, std::ptrdiff_t n_channel, double prf) const {
    const double beyond = std::abs(f) - 0.5 * bandwidth(n_channel, prf);
    if (beyond <= 0.0) return 1.0;
    const double width = fall(n_channel, prf);
    if (beyond >= width) return 0.0;
    const double root = std::cos(0.5 * pi * beyond / width);
    return root * root;
}

ChannelWeights channel_weights(const std::vector<double>& offsets, double prf, double velocity, const BandOptions& options) {
    if (offsets.empty()) throw ShapeError("offsets", "at least one channel", "none");
    const auto n = static_cast<std::ptrdiff_t>(offsets.size());
    require_positive(velocity, "velocity");
    options.validate(n, prf);

    const double band = options.bandwidth(n, prf);
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
