#pragma once

#include <cstddef>

#include <sarfocus/core/array_view.hpp>
#include <sarfocus/core/execution.hpp>
#include <sarfocus/core/export.hpp>

namespace sarfocus::quality {

// Measures of a whole image [n_azimuth, n_range]. Intensities |I|^2 and their sums are float64, summed row by row in a fixed order: the
// same bits for any number of threads and any strides. All throw ShapeError for an empty image and NumericalError for NaN, infinity, or
// an image without a sample different from zero.

/// E = -sum P ln P with P = |I|^2 / sum |I|^2, in nats [Xie2023, eq. 23]. 0 for a single bright pixel, ln(size) for a flat image.
[[nodiscard]] SARFOCUS_API double entropy(const ImageView& image, const Execution& execution = {});

/// What an entropy is made of, so that an image may be measured piece by piece while it goes by.
struct EntropySums {
    double power = 0.0;     ///< sum of I = |x|^2
    double weighted = 0.0;  ///< sum of I ln I

    EntropySums& operator+=(const EntropySums& other) {
        power += other.power;
        weighted += other.weighted;
        return *this;
    }
    /// ln(power) - weighted / power, nats; at least 0. NaN where power is zero or not finite.
    [[nodiscard]] SARFOCUS_API double entropy() const;
};

/// Of samples [n] next to one another in memory; NaN and infinity show in `power`. Single precision over short
/// runs: both sums are good to 5e-7 of the sum of the sizes of their terms.
[[nodiscard]] SARFOCUS_API EntropySums entropy_sums(const cfloat* samples, std::ptrdiff_t n);

/// -sum P log10 P, P as in `entropy` [Luo2025, eq. 19-20]. The printed equation repeats every factor; taken at its word it would not be
/// normalised and would change with the scale of the image. Read like this it gives the paper's figures (6.74 for 2k x 4k of plain sand:
/// fully developed speckle has log10(2^23) - (1 - 0.5772) / ln 10 = 6.740).
[[nodiscard]] SARFOCUS_API double entropy_log10(const ImageView& image, const Execution& execution = {});

/// Standard deviation of the intensity over its mean, both over all pixels (population, not sample): 0 for a flat image, 1 for fully
/// developed speckle, larger the sharper the image.
[[nodiscard]] SARFOCUS_API double contrast(const ImageView& image, const Execution& execution = {});

/// sum |I|^4 / (sum |I|^2)^2: 1 / size for a flat image, 1 for a single bright pixel.
[[nodiscard]] SARFOCUS_API double sharpness(const ImageView& image, const Execution& execution = {});

/// 10 log10(peak^2 / MSE), dB: peak the largest amplitude of the reference, MSE the mean of (|image| - |reference|)^2. Phase does not
/// count. Infinite where the amplitudes are equal. [Luo2025, section 3.2] takes the peak of the processed image instead, with which a
/// brighter image scores better for nothing. Throws ShapeError where the shapes differ, NumericalError where the reference is zero.
[[nodiscard]] SARFOCUS_API double psnr(const ImageView& image, const ImageView& reference, const Execution& execution = {});

}  // namespace sarfocus::quality
