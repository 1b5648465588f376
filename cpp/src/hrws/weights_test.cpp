#include <sarfocus/hrws/weights.hpp>

#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <sarfocus/core/constants.hpp>
#include <sarfocus/core/error.hpp>

namespace sarfocus::hrws {
namespace {

constexpr double prf = 700.0;
constexpr double velocity = 1900.0;
const std::vector<double> paper{-0.75, -0.25, 0.25, 0.75};  // m, equivalent centres of receivers 1 m apart

std::vector<double> even(int n) {
    std::vector<double> out;
    for (int i = 0; i < n; ++i) out.push_back((i - 0.5 * (n - 1)) / n * velocity / prf);
    return out;
}

TEST(ChannelWeights, EvenlySpacedChannelsAreAllOne) {
    BandOptions options;
    options.interpolation = Interpolation::yen;
    const ChannelWeights found = channel_weights(even(3), prf, velocity, options);
    for (const cdouble& w : found.weights) EXPECT_LT(std::abs(w - 1.0), 1e-12);
    EXPECT_NEAR(found.condition_number, 1.0, 1e-12);
    EXPECT_NEAR(found.noise_amplification, 1.0, 1e-12);
}

TEST(ChannelWeights, SuppressEveryBandThatIsThere) {
    for (const Interpolation interpolation : {Interpolation::yen, Interpolation::mmse})
        for (const double centroid : {0.0, 430.0}) {
            BandOptions options;
            options.interpolation = interpolation;
            options.doppler_bandwidth = 1900.0;
            options.doppler_centroid = centroid;
            options.noise = 1e-9;
            options.margin = 0.0;
            const ChannelWeights found = channel_weights(paper, prf, velocity, options);
            for (std::ptrdiff_t i = 0; i < found.weights.extent(0); ++i) {
                const double f = found.frequency_start + (static_cast<double>(i) + 0.5) * found.frequency_step;
                for (int m = -4; m <= 4; ++m) {
                    if (std::abs(f + m * prf - centroid) >= 950.0) continue;
                    cdouble sum{};
                    for (std::size_t n = 0; n < paper.size(); ++n)
                        sum += found.weights(i, static_cast<std::ptrdiff_t>(n)) * std::polar(1.0, two_pi * m * prf * paper[n] / velocity);
                    // Yen: rounding; least squares: the noise of 1e-9 over the smallest eigenvalue, above 0.1.
                    EXPECT_LT(std::abs(sum - (m == 0 ? 4.0 : 0.0)), 1e-7) << f << " Hz, band " << m;
                }
            }
        }
}

TEST(ChannelWeights, RefuseChannelsThatCoincideAndName) {
    const double step = velocity / prf;
    try {
        (void)channel_weights({0.0, 0.5, step + 0.5, 1.5}, prf, velocity);
        FAIL() << "nothing thrown";
    } catch (const NumericalError& error) {
        EXPECT_NE(std::string(error.what()).find("channels 1 and 2 sample the same places"), std::string::npos) << error.what();
    }
    // Two of four may coincide where three bands are all there is.
    BandOptions narrow;
    narrow.doppler_bandwidth = 2.0 * prf;
    narrow.margin = 0.0;
    EXPECT_NO_THROW((void)channel_weights({0.0, 0.5, step + 0.5, 1.5}, prf, velocity, narrow));
}

TEST(ChannelWeights, RefuseWhatMakesNoSense) {
    BandOptions options;
    options.doppler_bandwidth = 4.0 * prf + 1.0;
    EXPECT_THROW((void)channel_weights(paper, prf, velocity, options), ValueError);
    options = {};
    options.noise = 0.0;
    EXPECT_THROW((void)channel_weights(paper, prf, velocity, options), ValueError);
    options = {};
    options.margin = 10.0;  // the whole band is taken
    EXPECT_THROW((void)channel_weights(paper, prf, velocity, options), ValueError);
    EXPECT_THROW((void)channel_weights({}, prf, velocity), ShapeError);
    EXPECT_THROW((void)channel_weights(paper, prf, std::numeric_limits<double>::quiet_NaN()), ValueError);
}

// A tone of the band, sampled by the channels, interpolated to an even sample.
double tone_error(const std::vector<double>& offsets, double frequency, std::ptrdiff_t half_width, const BandOptions& options) {
    const auto psi = interpolation_coefficients(offsets, prf, velocity, half_width, options);
    const auto n = static_cast<std::ptrdiff_t>(offsets.size());
    double worst = 0.0;
    for (std::ptrdiff_t i = 0; i < n; ++i) {
        cdouble sum{};
        for (std::ptrdiff_t l = -half_width; l <= half_width; ++l)
            for (std::ptrdiff_t c = 0; c < n; ++c)
                sum +=
                    psi(i, l + half_width, c) *
                    std::polar(1.0, two_pi * frequency * (static_cast<double>(l) / prf + offsets[static_cast<std::size_t>(c)] / velocity));
        const double time = (static_cast<double>(i) - 0.5 * static_cast<double>(n - 1)) / static_cast<double>(n) / prf;
        worst = std::max(worst, std::abs(sum - std::polar(1.0, two_pi * frequency * time)));
    }
    return worst;
}

TEST(InterpolationCoefficients, MakeEvenSamplesOfTones) {
    BandOptions options;
    options.doppler_bandwidth = 1900.0;
    options.noise = 1e-6;
    for (const double centroid : {0.0, -310.0}) {
        options.doppler_centroid = centroid;
        for (const double f : {-940.0, -351.0, 0.0, 12.0, 700.0, 949.0}) {
            options.interpolation = Interpolation::mmse;
            // The noise assumed bounds the mean square error: 1e-6 times a few, -53 dB at the worst frequency.
            EXPECT_LT(tone_error(paper, f + centroid, 8, options), 2e-3) << f;
            // Cut off, Yen's series errs by about 1 / half_width, least in the middle of the bands.
            options.interpolation = Interpolation::yen;
            EXPECT_LT(tone_error(paper, f + centroid, 64, options), 6.0 / 64.0) << f;
        }
    }
}

TEST(InterpolationCoefficients, LeaveEvenSamplesAlone) {
    BandOptions options;
    options.interpolation = Interpolation::yen;
    const auto psi = interpolation_coefficients(even(4), prf, velocity, 3, options);
    for (std::ptrdiff_t i = 0; i < 4; ++i)
        for (std::ptrdiff_t l = 0; l < 7; ++l)
            for (std::ptrdiff_t n = 0; n < 4; ++n) EXPECT_LT(std::abs(psi(i, l, n) - (l == 3 && n == i ? 1.0 : 0.0)), 1e-9);
}

}  // namespace
}  // namespace sarfocus::hrws
