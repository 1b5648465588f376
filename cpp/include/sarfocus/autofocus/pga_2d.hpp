#pragma once

#include <limits>
#include <vector>

#include <sarfocus/autofocus/options.hpp>
#include <sarfocus/autofocus/result.hpp>
#include <sarfocus/core/array_view.hpp>
#include <sarfocus/core/execution.hpp>
#include <sarfocus/core/export.hpp>

/// Two-dimensional phase gradient autofocus of spotlight images, for errors so large that they move points through range gates.
///
/// An error of delta_R in the path multiplies the echo at baseband range frequency f_r by exp(-4j pi (f_c + f_r) delta_R / c)
/// [methods 0], which is exp(j (1 + y) phi) with phi = -4 pi delta_R / wavelength, y = f_r / f_c. Range increases with the gate, so over
/// fft(image, axis 1), of exponent -j, y = bandwidth_ratio * m / n_range for bin m, -n_range / 2 <= m < n_range / 2, and phi(u) rad of
/// phase come with a displacement of -bandwidth_ratio * phi / (2 pi) gates. For an image whose range falls with the gate the ratio is
/// negative. Images of the polar format algorithm were resampled along rays: there the term is exp(j (1 + y) phi(u / (1 + y))), u the
/// azimuth frequency, zero in the middle of the shifted spectrum. [Mao and Zhu, IEEE TAES 2013 and 2015; compared with in Luo2025.]
namespace sarfocus::autofocus {

enum class MigrationModel {
    range_doppler,  ///< (1 + y) phi(u)
    polar_format    ///< (1 + y) phi(u / (1 + y))
};

struct Pga2dOptions {
    /// Range sampling rate over carrier frequency, -0.9 to 0.9; nan: found from the image, as the ratio between -0.5 and 0.5 with which
    /// the strongest range stripes are sharpest; 0 where one half of them is no sharper with the other half's ratio than without.
    double bandwidth_ratio = std::numeric_limits<double>::quiet_NaN();
    MigrationModel model = MigrationModel::range_doppler;
    int passes = 3;       ///< at most: estimate, correct in two dimensions, estimate what is left
    PointOptions points;  ///< of every estimate; do_no_harm and execution for the whole

    SARFOCUS_API void validate() const;
};

/// Estimates phi as `pga` does, in a range band so narrow that no point moves by more than half a cell, corrects in two dimensions,
/// estimates what is left at full resolution, and so on. Both halves of the scene (range stripes) do all of it by themselves, and each is
/// judged with the phase of the other.
///
/// Constant and line of phi are gauge, as everywhere: what a line moves through range in the range-Doppler model stays.
/// image, corrected, phase_error: as for `pga`; phase_error is phi, applied by correct_two_dimensional. The correction is circular along
/// both axes. Throws as pga does.
SARFOCUS_API Result pga_2d(const ImageView& image, MutableImageView corrected, const Pga2dOptions& options = {});

/// corrected = the image whose two-dimensional spectrum is multiplied by exp(-j (1 + y) phi), or the other model's term. phase:
/// [n_azimuth], rad, over fftshift(fft(image, axis 0)). corrected: the shape of image; may be `image` itself. Throws ShapeError,
/// ValueError, NumericalError (NaN), Cancelled.
SARFOCUS_API void correct_two_dimensional(const ImageView& image, const std::vector<double>& phase, double bandwidth_ratio,
                                          MigrationModel model, MutableImageView corrected, const Execution& execution = {});

/// Range gates over which the error spreads a point, peak to peak.
[[nodiscard]] SARFOCUS_API double range_migration(const std::vector<double>& phase, double bandwidth_ratio, MigrationModel model);

}  // namespace sarfocus::autofocus
