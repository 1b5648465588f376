#pragma once

#include <cstddef>

#include <sarfocus/core/vector3.hpp>

#include "focus/virtual_track.hpp"

namespace sarfocus::focus::detail {

/// Up to `capacity` pulses beside their places on the virtual track, one array for each coordinate.
class PulseBlock {
public:
    static constexpr std::ptrdiff_t capacity = 64;

    /// A pulse becomes number k of the block; `place` and `rate` are those of the track.
    void set(std::ptrdiff_t k, const Antennas& pulse, const Antennas& place, const Antennas& rate);

    /// Ranges of a point to the first n pulses.
    void ranges(const Vector3& p, std::ptrdiff_t n, bool monostatic, double* range) const;

    /// The places on the track from which the range of pixels round `p`, in the plane of two orthonormal axes, changes in the same
    /// direction as from the pulses, and the ratio of the changes less one: range_pulse(x) - range_pulse(p) = (1 + scale) (range(x) -
    /// range(p)) to first order, range being that from `shift` metres behind the pulse's place on the track.
    void match(const Vector3& p, const Vector3& first_axis, const Vector3& second_axis, std::ptrdiff_t n, double* shift,
               double* scale) const;

private:
    struct Coordinates {
        alignas(64) double x[capacity];
        alignas(64) double y[capacity];
        alignas(64) double z[capacity];
    };
    static void put(Coordinates& to, std::ptrdiff_t k, const Vector3& p);

    Coordinates tx_;
    Coordinates rx_;
    Coordinates track_tx_;
    Coordinates track_rx_;
    Coordinates rate_tx_;
    Coordinates rate_rx_;
};

/// Ranges of a point to n antennas given by their coordinates: half of both where rx is given.
void ranges_to(const Vector3& p, const double* const tx[3], const double* const rx[3], std::ptrdiff_t n, double* range);

}  // namespace sarfocus::focus::detail
