#pragma once

#include <cstddef>
#include <limits>
#include <vector>

#include <sarfocus/core/array.hpp>
#include <sarfocus/core/array_view.hpp>
#include <sarfocus/core/export.hpp>

namespace sarfocus::hrws {

enum class Interpolation {
    yen,  ///< generalised sampling: exact for any signal in a band of n_channel * prf
    mmse  ///< least mean square error in white noise, for a spectrum that is flat over the bandwidth and fades away over the margins
};

/// What is known of the azimuth spectrum, and how the channels are combined.
struct BandOptions {
    Interpolation interpolation = Interpolation::mmse;
    double doppler_bandwidth = 0.0;  ///< Hz, of the signal, at most n_channel * prf; 0: that
    double doppler_centroid = 0.0;   ///< Hz
    /// Hz, at most half of what the bandwidth leaves of n_channel * prf: so far beyond either end of the bandwidth the image is processed
    /// and ambiguities are suppressed, less and less: the assumed spectrum is `spectrum`, so that weights change smoothly. A pulse acts
    /// over the square root of the Doppler rate; weights that jump break the stationary phase of `folded` (-42 dB of a point against -78
    /// dB) and, closer to the end of the signal than that, leave something of its ambiguities. NaN: 10 % of the bandwidth, or what is left.
    double margin = std::numeric_limits<double>::quiet_NaN();
    double noise = 1e-3;                ///< mmse: power of the noise over that of the signal, in a band of one prf
    double condition_limit = 1e3;       ///< NumericalError above it, of the bands within the bandwidth
    std::ptrdiff_t n_frequency = 1024;  ///< entries of the table of weights over the processed band

    /// Throws ValueError.
    SARFOCUS_API void validate(std::ptrdiff_t n_channel, double prf) const;
    /// Hz, the bandwidth and its margins.
    [[nodiscard]] SARFOCUS_API double processed(std::ptrdiff_t n_channel, double prf) const;
    /// The spectrum that mmse assumes, f Hz from the centroid: 1 within the bandwidth, over the margins a Gaussian down to 1e-6, then 0.
    [[nodiscard]] SARFOCUS_API double spectrum(double f, std::ptrdiff_t n_channel, double prf) const;
};

struct ChannelWeights {
    double frequency_start = 0.0;    ///< Hz, where entry 0 begins
    double frequency_step = 0.0;     ///< Hz
    Array<cdouble, 2> weights;       ///< [n_frequency, n_channel]
    double condition_number = 0.0;   ///< the largest of the band equations
    double noise_amplification = 0;  ///< power of white noise in the image over that with evenly spaced channels, mean over the band
};

/// Weights w_n(f) of the channels that leave one band of an azimuth spectrum sampled at `prf` by channels displaced by offsets[n] (m): with
/// f_m = f + m prf all frequencies aliased onto f that the spectrum holds, sum over n of w_n exp(2j pi (f_m - f) offsets[n] / velocity) =
/// N [m = 0]. In the notation of generalised sampling w_n = N c_n(f) exp(2j pi f offsets[n] / velocity) [methods, 5; Zhou2022, eq. 1]:
/// evenly spaced channels have w_n = 1. yen: as many bands as channels, centred on the centroid. mmse: w = N S_0 (V^H S V + noise)^-1
/// V_0^H, S the assumed spectrum at the f_m, V their rows.
///
/// Throws ValueError, ShapeError, NumericalError (channels that sample the same places, a condition number above the limit).
[[nodiscard]] SARFOCUS_API ChannelWeights channel_weights(const std::vector<double>& offsets, double prf, double velocity,
                                                          const BandOptions& options = {});

/// Coefficients of the interpolation to even spacing [Zhou2022, eq. 1 and 16]: signal at time (k + (i - (N - 1) / 2) / N) / prf = sum over
/// l, |l| <= half_width, and n of psi(i, l + half_width, n) times sample k + l of channel n, taken at (k + l) / prf + offsets[n] /
/// velocity. yen: [Yen1956] cut off at half_width, its error falls off as slowly as 1 / half_width; mmse: least squares with the samples
/// there are. psi: [n_channel, 2 half_width + 1, n_channel]. Throws as `channel_weights` does.
[[nodiscard]] SARFOCUS_API Array<cdouble, 3> interpolation_coefficients(const std::vector<double>& offsets, double prf, double velocity,
                                                                        std::ptrdiff_t half_width, const BandOptions& options = {});

}  // namespace sarfocus::hrws
