#pragma once

#include <cstddef>
#include <vector>

namespace sarfocus::focus::detail {

/// Interpolation of what oscillates by at most pi * band a sample, band < 1: the weights of `taps` samples round the place that err least
/// in the mean over that band (normal equations of exp(j w x), |w| <= pi * band), from a table of 512 fractions, linear between them.
class BandKernel {
public:
    static constexpr std::ptrdiff_t most_taps = 16;

    /// taps: even, 4 … 16.
    BandKernel(std::ptrdiff_t taps, double band);

    [[nodiscard]] std::ptrdiff_t taps() const { return taps_; }
    [[nodiscard]] std::ptrdiff_t before() const { return taps_ / 2 - 1; }  ///< samples in front of the one at or left of the place

    /// out: [most_taps], zeros behind the taps. 0 <= fraction < 1, of the place behind the sample left of it.
    void weights(double fraction, float* out) const {
        const double entry = fraction * fractions;
        const auto index = static_cast<std::ptrdiff_t>(entry);
        const auto part = static_cast<float>(entry - static_cast<double>(index));
        const float* low = table_.data() + index * most_taps;
        for (std::ptrdiff_t t = 0; t < most_taps; ++t) out[t] = low[t] + part * (low[t + most_taps] - low[t]);
    }

    /// [fractions + 1, most_taps].
    static constexpr std::ptrdiff_t fractions = 512;
    [[nodiscard]] const float* table() const { return table_.data(); }

    /// Amplitude of the error of a component of amplitude 1, RMS over the fractions.
    struct Error {
        double largest;  ///< over the band
        double mean;     ///< RMS over the band
    };
    static Error error(std::ptrdiff_t taps, double band);

private:
    std::ptrdiff_t taps_;
    std::vector<float> table_;
};

/// Weights that turn samples into a cubic round each of them: sum_d x^d sum_t weight(d, t) s[t], |x| <= 0.55, t from -5 to 5.
class BandCubic {
public:
    static constexpr std::ptrdiff_t taps = 11;
    static constexpr std::ptrdiff_t side = taps / 2;

    explicit BandCubic(double band);
    [[nodiscard]] const float* weights(std::ptrdiff_t degree) const { return weights_ + degree * taps; }

    /// Amplitude of the error of a component of amplitude 1: RMS over the band and |x| <= 1/2.
    [[nodiscard]] double error() const { return error_; }

private:
    float weights_[4 * taps] = {};
    double error_ = 0.0;
};

}  // namespace sarfocus::focus::detail
