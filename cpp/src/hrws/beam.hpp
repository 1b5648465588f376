#pragma once

#include <algorithm>

#include <sarfocus/focus/backproject.hpp>
#include <sarfocus/hrws/echo.hpp>
#include <sarfocus/hrws/weights.hpp>

namespace sarfocus::hrws::detail {

/// The directions in which the Doppler frequency lies within the bandwidth of the signal; `beyond`: Hz more at either end.
inline focus::Aspect beam_of(const Echo& echo, const BandOptions& band, double beyond = 0.0) {
    const double bandwidth = band.doppler_bandwidth > 0.0 ? band.doppler_bandwidth : static_cast<double>(echo.n_channel()) * echo.prf;
    const double half = 0.5 * bandwidth + beyond;
    const double sine_of_hertz = echo.wavelength / (2.0 * echo.velocity);
    return {sampling(echo).direction, std::max(sine_of_hertz * (band.doppler_centroid - half), -1.0),
            std::min(sine_of_hertz * (band.doppler_centroid + half), 1.0)};
}

}  // namespace sarfocus::hrws::detail
