#pragma once

#include <cstddef>
#include <vector>

#include <sarfocus/core/export.hpp>

namespace sarfocus::geometry {

/// A straight, constant-speed stripmap collection as seen by azimuth processing.
struct StripmapGeometry {
    double wavelength = 0.0;          ///< m
    double prf = 0.0;                 ///< Hz, azimuth sampling rate
    double velocity = 0.0;            ///< m/s, effective velocity
    std::vector<double> slant_range;  ///< m, of every range gate, [n_range]
    double doppler_bandwidth = 0.0;   ///< Hz, processed
    double doppler_centroid = 0.0;    ///< Hz

    /// Throws ValueError naming the field.
    SARFOCUS_API void validate() const;

    /// K = 2 v^2 / (lambda R), Hz/s, > 0; the signed Doppler rate is -K [Xie2023, eq. 1].
    [[nodiscard]] SARFOCUS_API double fm_rate(std::size_t range_gate) const;
    /// -K, Hz/s.
    [[nodiscard]] SARFOCUS_API double doppler_rate(std::size_t range_gate) const;
    /// Ts = doppler_bandwidth / K, s.
    [[nodiscard]] SARFOCUS_API double aperture_time(std::size_t range_gate) const;
    /// Ts * prf, in azimuth samples.
    [[nodiscard]] SARFOCUS_API double aperture_samples(std::size_t range_gate) const;
};

}  // namespace sarfocus::geometry
