#pragma once

#include <cstddef>

#include <sarfocus/core/array_view.hpp>
#include <sarfocus/core/execution.hpp>
#include <sarfocus/core/export.hpp>
#include <sarfocus/sim/points.hpp>

namespace sarfocus::sim {

/// A multichannel radar; views, owned by the caller.
struct HrwsRadar {
    ArrayView<const double, 2> positions;   ///< [n_pulse, 3], m, of the platform, n_pulse >= 2
    ArrayView<const double, 2> channels;    ///< [n_channel, 3], m, receiving antennas relative to the platform
    std::ptrdiff_t transmitter = 0;         ///< index of the channel that also transmits
    bool equivalent = false;                ///< ranges from midway between transmitter and receiver in place of the two legs
    ArrayView<const double, 2> motion;      ///< [n_pulse, 3], m, displaces all antennas; or empty
    ArrayView<const cdouble, 1> imbalance;  ///< [n_channel], factor of every channel; or empty
    double prf = 0.0;                       ///< Hz
    double doppler_bandwidth = 0.0;         ///< Hz, illuminated, about the centroid; 0: all
    double doppler_centroid = 0.0;          ///< Hz

    /// Throws ShapeError, ValueError, NumericalError.
    SARFOCUS_API void validate() const;
};

/// Range-compressed echoes of point scatterers in every channel. Each is what `points` gives for the antennas of the channel, times its
/// imbalance; a scatterer is illuminated, in all channels alike, by the pulses at which its Doppler frequency as seen by the platform
/// without motion error, the middle of the channels' equivalent centres, is within half the Doppler bandwidth of the centroid. The noise of
/// the channels is independent. Echoes of extended scenes: focus::project, channel by channel.
///
/// out: [n_channel, n_pulse, n_range], any strides, overwritten. Throws as `points` does.
SARFOCUS_API void hrws(const HrwsRadar& radar, const PointTargets& targets, const PointEchoModel& model, const ArrayView<cfloat, 3>& out,
                       const PointOptions& options = {});

}  // namespace sarfocus::sim
