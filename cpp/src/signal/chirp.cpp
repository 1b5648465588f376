#include <sarfocus/signal/chirp.hpp>

#include <algorithm>
#include <cmath>
#include <complex>

#include <sarfocus/core/checks.hpp>
#include <sarfocus/core/constants.hpp>
#include <sarfocus/core/error.hpp>

namespace sarfocus::signal {

void Chirp::validate() const {
    require_positive(bandwidth, "bandwidth");
    require_positive(duration, "duration");
    require_positive(sampling_rate, "sampling_rate");
    if (bandwidth > sampling_rate)
        throw ValueError("bandwidth", "at most the sampling_rate of " + number_text(sampling_rate) + " Hz", number_text(bandwidth));
    if (duration * sampling_rate > 1e9) throw ValueError("duration", "at most 1e9 samples", number_text(duration * sampling_rate));
}

std::ptrdiff_t Chirp::n_sample() const {
    validate();
    return std::max<std::ptrdiff_t>(1, std::lround(duration * sampling_rate));
}

Array<cfloat, 1> Chirp::samples() const {
    const std::ptrdiff_t n = n_sample();
    require_memory(sizeof(cfloat) * static_cast<std::uint64_t>(n), "chirp");
    const double rate = (direction == ChirpDirection::up ? pi : -pi) * bandwidth / duration;
    Array<cfloat, 1> out({n});
    for (std::ptrdiff_t i = 0; i < n; ++i) {
        const double t = (static_cast<double>(i) - 0.5 * static_cast<double>(n - 1)) / sampling_rate;
        out.data()[i] = cfloat(std::polar(1.0, rate * t * t));
    }
    return out;
}

}  // namespace sarfocus::signal
