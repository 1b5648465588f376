#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include <sarfocus/core/array.hpp>
#include <sarfocus/core/execution.hpp>
#include <sarfocus/core/export.hpp>
#include <sarfocus/focus/backproject.hpp>

namespace sarfocus::autofocus {

struct RidgeOptions {
    double resolution = 0.0;  ///< m, of range: speed of light / (2 bandwidth); required
    int most = 8;             ///< ridges followed, the strongest first
    int half_window = 10;  ///< pulses either side of the coherent sum (Hann); over so many the range must change evenly to a quarter wave
    double largest_rate = 0.0;     ///< m per pulse, of a range; 0: a quarter of the wavelength
    double threshold_db = 13.0;    ///< above the median power of the sums, of what belongs to a ridge
    double smallest_change = 0.0;  ///< m, of the range along a ridge: what changes less may be clutter; 0: three times the resolution
    double shortest = 0.2;         ///< of all pulses, that a ridge must cover, or a piece of one
    /// Each piece of an interrupted ridge is handed back as a ridge of its own: where scatterers cross, another may follow behind.
    bool pieces = false;
    Execution execution;

    SARFOCUS_API void validate() const;
};

/// One ridge.
struct Ridge {
    std::ptrdiff_t first = 0;  ///< pulse
    std::ptrdiff_t last = 0;   ///< pulse, included
    double score =
        0.0;  ///< of the whole, like power, coherence and envelope_std: sum along it of the log of the power over the threshold, capped
    double power = 0.0;         ///< mean power of the coherent sums
    double coherence = 0.0;     ///< mean of |sum|^2 over the power summed: 1 for a lone scatterer without noise
    double envelope_std = 0.0;  ///< m, robust: scatter of the envelope's peak about the range that the phase gives
    double change = 0.0;        ///< m, largest range less smallest
};

struct Ridges {
    Array<double, 2> range;     ///< [n_ridge, n_pulse], m; nan where a ridge isn't seen
    std::vector<Ridge> ridges;  ///< [n_ridge]
    int dropped = 0;            ///< followed, but still or too short
    std::string reason;         ///< one sentence
};

/// Follows strong scatterers over the pulses. Short coherent sums along straight pieces of range, carrier included, tell scatterers at one
/// range apart by the rate at which it changes, without the ambiguity of the Doppler frequency; the path through them of the greatest score
/// is a ridge (dynamic programming over range and rate, the rate changing by at most one step from node to node), its surroundings in range
/// and rate are blanked, and the next one is looked for. Along each the phase of the echo, unwrapped, then refines the range; what
/// interrupts it is bridged by the whole number of half wavelengths that the envelope tells.
///
/// Ranges follow the phase: their changes are good to a small fraction of the wavelength, their constant is that of the envelope.
/// profiles: one range_start for all pulses, coupling removed. No ridge is no error: n_ridge is then 0 and `reason` says why.
/// Throws ShapeError, ValueError, NumericalError, MemoryEstimateError, Cancelled.
[[nodiscard]] SARFOCUS_API Ridges track_ridges(const focus::RangeProfiles& profiles, const RidgeOptions& options);

}  // namespace sarfocus::autofocus
