#pragma once

#include <cstdint>
#include <vector>

#include <sarfocus/core/array_view.hpp>
#include <sarfocus/core/export.hpp>

namespace sarfocus::sim {

/// A line in the spectrum of a vibrating platform.
struct Vibration {
    double amplitude = 0.0;  ///< in the unit of the error
    double frequency = 0.0;  ///< Hz, at most half the sampling rate
};

/// A motion error along one axis; the unit (m, or rad for a phase error) is that of the amplitudes.
struct MotionModel {
    double sampling_rate = 0.0;         ///< Hz, the prf
    double drift = 0.0;                 ///< unit / s
    double acceleration = 0.0;          ///< unit / s^2
    double random_rms = 0.0;            ///< root mean square, over many seeds, of the slow random part
    double random_bandwidth = 1.0;      ///< Hz, of the random part: flat from zero to there, at most half the sampling rate
    std::vector<Vibration> vibrations;  ///< their phases are drawn
    std::uint64_t seed = 0;

    /// Throws ValueError naming the field.
    SARFOCUS_API void validate() const;
};

/// error(i) = drift t + acceleration t^2 / 2 + random part + sum of amplitude cos(2 pi frequency t + drawn phase), t = (i - (n - 1) / 2) /
/// sampling_rate. The random part is Gaussian, made of the frequencies m sampling_rate / (2 n) up to the bandwidth, at least one of them:
/// it does not repeat within the n samples. Axes of the same seed are independent of each other. The random numbers are the same on every
/// platform. error: [n], overwritten. A displacement d of the antenna away from the scene is the phase error -4 pi d / wavelength. Throws
/// ValueError, ShapeError.
SARFOCUS_API void motion_error(const ArrayView<double, 1>& error, const MotionModel& model, std::uint32_t axis = 0);

}  // namespace sarfocus::sim
