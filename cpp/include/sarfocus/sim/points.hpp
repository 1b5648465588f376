#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>

#include <sarfocus/core/array_view.hpp>
#include <sarfocus/core/execution.hpp>
#include <sarfocus/core/export.hpp>
#include <sarfocus/geometry/phase_centres.hpp>
#include <sarfocus/signal/window.hpp>

namespace sarfocus::sim {

/// Point scatterers; views, owned by the caller.
struct PointTargets {
    ArrayView<const double, 2> positions;      ///< [n_target, 3], m, in the frame of the phase centres
    ArrayView<const cdouble, 1> reflectivity;  ///< [n_target]

    /// Throws ShapeError, NumericalError.
    SARFOCUS_API void validate() const;
};

/// The range axis and the pulse of simulated echoes.
struct PointEchoModel {
    ArrayView<const double, 1> range_start;  ///< [1] or [n_pulse], m, range of sample 0
    double range_spacing = 0.0;              ///< m, at most c / (2 bandwidth)
    double wavelength = 0.0;                 ///< m
    double bandwidth = 0.0;                  ///< Hz, of the transmitted pulse
    signal::Window window;                   ///< over that band
    /// Samples farther than this from a scatterer, m, get nothing from it: infinite is exact.
    double support = std::numeric_limits<double>::infinity();
    double noise_power = 0.0;  ///< mean square of complex white Gaussian noise added to every sample
    std::uint64_t seed = 0;    ///< of the noise
};

struct PointOptions {
    Execution execution;
};

/// Range-compressed echoes of point scatterers, as backprojection takes them: a scatterer at range R (half the path transmitter - scatterer
/// - receiver; the antennas stand still during a pulse) contributes reflectivity * exp(-4j pi R / wavelength) * h(2 bandwidth (r - R) / c)
/// to the sample at range r, h the signal::WindowResponse of the window. No antenna pattern and no spreading loss. A trajectory error is
/// simulated with the true phase centres and processed with the assumed ones.
///
/// out: [n_pulse, n_range], any strides, overwritten. Sums and phases in double precision; error 1e-9 of the largest reflectivity and the
/// rounding to single precision. Bits, noise included, do not depend on threads; the noise is the same on every platform. Throws
/// ValueError, ShapeError, NumericalError (NaN or infinity), Cancelled.
SARFOCUS_API void points(const geometry::PhaseCentres& centres, const PointTargets& targets, const PointEchoModel& model,
                         const MutableImageView& out, const PointOptions& options = {});

/// The frequencies of frequency-domain phase history, and the range it is referred to.
struct PointHistoryModel {
    ArrayView<const double, 1> reference_range;  ///< [1] or [n_pulse], m
    double frequency_start = 0.0;                ///< Hz
    double frequency_spacing = 0.0;              ///< Hz
    double noise_power = 0.0;                    ///< mean square of complex white Gaussian noise added to every sample
    std::uint64_t seed = 0;                      ///< of the noise
};

/// Frequency-domain phase history of point scatterers (stepped or dechirped spotlight data): out(p, m) = sum of
/// reflectivity * exp(-4j pi f_m (R - reference_range(p)) / c), f_m = frequency_start + m * frequency_spacing, R as for `points`.
///
/// out: [n_pulse, n_frequency], any strides, overwritten. Phases are reduced to one turn in double precision; the sums run in single
/// precision over blocks of scatterers and in double over the blocks. Error relative to the exact sum, root mean square: below 5e-7 (-126
/// dB). Bits do not depend on threads. Throws as `points` does.
SARFOCUS_API void points_frequency(const geometry::PhaseCentres& centres, const PointTargets& targets, const PointHistoryModel& model,
                                   const MutableImageView& out, const PointOptions& options = {});

}  // namespace sarfocus::sim
