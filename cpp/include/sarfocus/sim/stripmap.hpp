#pragma once

#include <cstddef>
#include <cstdint>

#include <sarfocus/core/array_view.hpp>
#include <sarfocus/core/execution.hpp>
#include <sarfocus/core/export.hpp>
#include <sarfocus/geometry/stripmap_geometry.hpp>
#include <sarfocus/signal/window.hpp>

namespace sarfocus::sim {

/// Point targets of a strip; views, owned by the caller.
struct StripmapTargets {
    ArrayView<const double, 2> pixels;         ///< [n_target, 2]: azimuth sample (fractions allowed), range gate
    ArrayView<const cdouble, 1> reflectivity;  ///< [n_target], the value of the compressed image at its peak

    /// Throws ShapeError, NumericalError.
    SARFOCUS_API void validate() const;
};

/// What is the same in every model of a strip.
struct StripmapEffects {
    ArrayView<const double, 1> phase_error;  ///< [n_azimuth], rad, or empty: the strip is multiplied by exp(+j phase_error)
    double noise_power = 0.0;                ///< mean square of complex white Gaussian noise added to every sample, after the phase error
    std::uint64_t seed = 0;                  ///< of noise and clutter
};

enum class StripmapModel { band_limited, chirp };

struct StripmapOptions {
    StripmapModel model = StripmapModel::band_limited;
    double clutter_power = 0.0;  ///< mean square of Gaussian clutter in a pixel of the compressed image
    StripmapEffects effects;
    Execution execution;
};

/// A range-compressed, migration-corrected azimuth strip before azimuth compression, in each range gate independently of the others; target
/// n at azimuth sample i_n, t_n = i_n / prf.
///
/// band_limited: the azimuth spectrum of a target is flat over fdc - B/2 <= f < fdc + B/2 (B the Doppler bandwidth) and zero outside,
/// with the phase pi (f - fdc)^2 / K - 2 pi f t_n. Multiplying it by exp(-j pi (f - fdc)^2 / K) compresses it to the exact periodic sinc,
/// its peak the reflectivity. The strip is periodic: the aperture of a target near an end goes on at the other. chirp: the signal in time,
/// exp(-j pi K (t - t_n)^2 + 2j pi fdc (t - t_n)) for |t - t_n| <= Ts/2, Ts = B / K, cut off at the ends of the strip; scaled by
/// reflectivity * exp(j pi/4) / sqrt(B Ts), so that by stationary phase the compressed peak is the reflectivity. Clutter: Gaussian,
/// independent in every range gate, band-limited (and periodic) as the band_limited targets.
///
/// geometry: one slant_range for each column; targets may be empty; their range gates must be whole numbers. out: [n_azimuth, n_range], any
/// strides, overwritten. Bits do not depend on threads; the random numbers are the same on every platform. Throws ValueError, ShapeError,
/// NumericalError, Cancelled.
SARFOCUS_API void stripmap(const geometry::StripmapGeometry& geometry, const StripmapTargets& targets, const MutableImageView& out,
                           const StripmapOptions& options = {});

struct StripmapEchoOptions {
    double range_bandwidth = 0.0;  ///< Hz; at most c / (2 spacing of the slant ranges)
    signal::Window window;         ///< over the range band
    StripmapEffects effects;
    Execution execution;
};

/// The range-compressed echo of the strip with its range migration: a target closest at range R0 (the slant range of its gate, fractions
/// allowed) at azimuth time t_n has the range R(t) = sqrt(R0^2 + v^2 (t - t_n)^2) and contributes reflectivity * exp(-4j pi R(t) /
/// wavelength) * h(2 range_bandwidth (r - R(t)) / c), h the signal::WindowResponse of the window, at every pulse at which its Doppler
/// frequency -2 v^2 (t - t_n) / (wavelength R(t)) lies within half the Doppler bandwidth of the centroid. Not periodic. Unlike in
/// `stripmap`, pixels are those of closest approach (zero Doppler), and the reflectivity is that of every echo, not of the compressed peak.
///
/// The slant ranges must be evenly spaced and ascending. out: [n_azimuth, n_range], any strides, overwritten. Bits and errors as for
/// `stripmap`.
SARFOCUS_API void stripmap_echo(const geometry::StripmapGeometry& geometry, const StripmapTargets& targets, const MutableImageView& out,
                                const StripmapEchoOptions& options);

}  // namespace sarfocus::sim
