#pragma once

#include <string>
#include <vector>

#include <sarfocus/autofocus/result.hpp>
#include <sarfocus/autofocus/sharpness.hpp>

#include "pulse_set.hpp"

namespace sarfocus::autofocus::detail {

enum class Measure {
    entropy,  ///< less of it
    contrast  ///< log sharpness
};

/// A measure of the image with a phase taken out, larger the better, nat, and what it tells each pulse.
struct Sharpness {
    double value = 0.0;
    double slope_scale = 0.0;   ///< d value / d phase(k) = slope_scale * imag(pull(k))
    std::vector<cdouble> pull;  ///< sum over gates of pulse(k) exp(-j phase(k)) conj(D(w x)(k)); its argument is the fixed-point step
};

/// Sums over gates in a fixed order: the same bits for any number of threads.
[[nodiscard]] Sharpness sharpness_of(const PulseSet& pulses, const std::vector<double>& phase, Measure measure, bool with_pull,
                                     const Execution& execution);

struct Ascent {
    std::vector<double> phase;  ///< [n_pulse], rad, gauge removed
    std::vector<Round> rounds;
    double value = 0.0;
    bool settled = false;
};

/// From no phase to the sharpest: polynomial coefficients searched one by one, cosines, a phase for every pulse. The measure gets no worse
/// from one stage and round to the next.
[[nodiscard]] Ascent ascend(const PulseSet& pulses, Measure measure, const SharpnessOptions& options);

}  // namespace sarfocus::autofocus::detail
