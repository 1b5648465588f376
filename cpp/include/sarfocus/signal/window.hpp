#pragma once

#include <cstddef>
#include <vector>

#include <sarfocus/core/export.hpp>

namespace sarfocus::signal {

enum class WindowKind { rectangular, hann, hamming, taylor, kaiser };

/// symmetric: n samples, the last the mirror image of the first (weights of measured samples). periodic: one period of n samples of a
/// periodic sequence (weights of DFT bins), the first n of the symmetric window of n + 1.
enum class WindowForm { symmetric, periodic };

/// A weighting and its parameters.
struct Window {
    WindowKind kind = WindowKind::rectangular;
    int nbar = 4;                  ///< taylor: nearly constant sidelobes beside the main lobe, >= 1
    double sidelobe_level = 35.0;  ///< taylor: their level below the main lobe, dB, > 0
    double beta = 6.0;             ///< kaiser: shape, >= 0

    /// Throws ValueError naming the field.
    SARFOCUS_API void validate() const;
};

/// Weights [n], 1 in the middle. Taylor: [Carrara, Goodman, Majewski, Spotlight Synthetic Aperture Radar, 1995, appendix D.2]. Throws
/// ValueError.
[[nodiscard]] SARFOCUS_API std::vector<double> window_samples(const Window& window, std::ptrdiff_t n,
                                                              WindowForm form = WindowForm::symmetric);

/// The pulse whose spectrum is the continuous window over a band of width 1 about zero: real, even, 1 at zero. The rectangular window
/// gives sin(pi x) / (pi x). In closed form, to rounding (1e-9 of the peak next to the zeros of sin(pi x)).
class SARFOCUS_API WindowResponse {
public:
    /// Throws ValueError.
    explicit WindowResponse(const Window& window = {});

    /// x: distance from the peak in units of 1 / bandwidth.
    [[nodiscard]] double operator()(double x) const;

private:
    [[nodiscard]] double kaiser(double x) const;

    WindowKind kind_;
    double beta_;
    std::vector<double> terms_;  // F_m of the weighting 1 + 2 sum F_m cos(2 pi m nu), m = 1, 2, …
};

}  // namespace sarfocus::signal
