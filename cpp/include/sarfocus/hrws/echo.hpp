#pragma once

#include <cstddef>
#include <vector>

#include <sarfocus/core/array_view.hpp>
#include <sarfocus/core/export.hpp>
#include <sarfocus/core/vector3.hpp>
#include <sarfocus/focus/backproject.hpp>

namespace sarfocus::hrws {

/// Range-compressed echoes of a radar with several receiving channels along the track, carrier phase kept; views, owned by the caller.
struct Echo {
    ArrayView<const cfloat, 3> data;           ///< [n_channel, n_pulse, n_range]
    ArrayView<const double, 3> phase_centres;  ///< [n_channel, n_pulse, 3], m, as measured: midway between transmitter and receiver
    ArrayView<const double, 1> range_start;    ///< [1] or [n_pulse], m, range of sample 0
    double range_spacing = 0.0;                ///< m
    double wavelength = 0.0;                   ///< m
    double prf = 0.0;                          ///< Hz, of the transmitted pulses
    double velocity = 0.0;                     ///< m/s, of the phase centres along the track
    ArrayView<const double, 2> baselines;  ///< [n_channel, 3], m, from transmitter to receiver; empty: none, ranges from the phase centres

    [[nodiscard]] std::ptrdiff_t n_channel() const { return data.extent(0); }
    [[nodiscard]] std::ptrdiff_t n_pulse() const { return data.extent(1); }
    [[nodiscard]] focus::RangeProfiles profiles(std::ptrdiff_t channel) const {
        return {data.row(channel), range_start, range_spacing, wavelength};
    }

    /// Shapes, signs, NaN, channels of zeros, a velocity that the phase centres do not have. Throws ShapeError, ValueError, NumericalError.
    SARFOCUS_API void validate(int threads = 0) const;
};

/// Where along the track the channels sample: the straight line through the phase centres, least squares over pulses.
struct Sampling {
    Vector3 origin{};             ///< m, of the channels' mean at pulse 0
    Vector3 direction{};          ///< unit vector of flight
    double step = 0.0;            ///< m, velocity / prf
    std::vector<double> offsets;  ///< [n_channel], m, of each channel along the track from their mean, mean over pulses
    double offset_spread = 0.0;   ///< m, largest deviation of a pulse from those: the reconstruction takes them as constant
};

/// Geometry only; the echo must be valid.
[[nodiscard]] SARFOCUS_API Sampling sampling(const Echo& echo);

}  // namespace sarfocus::hrws
