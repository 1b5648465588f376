#pragma once

#include <vector>

#include <sarfocus/core/array_view.hpp>
#include <sarfocus/core/execution.hpp>
#include <sarfocus/core/export.hpp>

namespace sarfocus::autofocus {

enum class Estimator {
    maximum_likelihood,  ///< alternating [methods 3]: reaches the Cramer-Rao bound
    gradient             ///< classic phase gradient, summed up: its errors accumulate along the aperture
};

struct PhaseEstimateOptions {
    Estimator estimator = Estimator::maximum_likelihood;
    int max_iterations = 100;  ///< of the alternation; 0 dB a sample takes about 30
    double tolerance = 1e-4;   ///< rad, largest change of the phase at which the alternation ends; far below any bound met in practice
    bool linear_terms = true;  ///< every line has a linear phase of its own (a point's position within its pixel), refitted as it goes
    /// Least noise a line is credited with, of its power: measured points are never ideal, so one 13 dB above its surroundings counts as
    /// much as any stronger one (0.01 to 0.1 made no difference on measured data, 0.3 did).
    double noise_floor = 0.05;
    std::vector<double> initial_phase;  ///< rad [n_pulse] to start from; empty: the gradient's
    Execution execution;

    SARFOCUS_API void validate() const;
};

struct PhaseEstimate {
    std::vector<double> phase;         ///< rad [n_pulse], unwrapped along the aperture, constant and line removed
    std::vector<double> phase_std;     ///< rad [n_pulse], standard deviation of `phase`; nan where no line has energy
    std::vector<double> linear_terms;  ///< rad a pulse [n_line]; their weighted mean is zero
    std::vector<cdouble> amplitude;    ///< [n_line], at the middle of the aperture
    std::vector<double> signal_power;  ///< [n_line], |A_n|^2 without its share of noise
    std::vector<double> noise_power;   ///< [n_line], per sample
    int iterations = 0;
};

/// The phase common to all lines: line n is A_n exp(j (phase(k) + b_n k)) + noise [methods 3; bound sqrt(1 / (2 M SNR))].
///
/// lines: [n_line, n_pulse] complex64, any strides; zeros where a pulse has no data. A line counts by its signal power over its noise
/// power; a pulse does not vote for itself (its own term is taken out of A_n). phase_std comes from the scatter of the lines about the
/// common phase, smoothed over a few pulses, and is at least what the noise power implies; for the gradient it has the distance to the
/// alternation's phase added. Throws ShapeError, ValueError, NumericalError (NaN; all lines zero).
[[nodiscard]] SARFOCUS_API PhaseEstimate estimate_phase(const ImageView& lines, const PhaseEstimateOptions& options = {});

/// Subtracts the least-squares constant and line over the entries that are finite [methods 0, gauge].
SARFOCUS_API void remove_linear(std::vector<double>& phase);

/// The same for a phase known modulo 2 pi; nan where it is not known. A small phase is laid about the line that fits exp(j phase) best,
/// which no single bad pulse can tilt; a large one is unwrapped along the aperture, about its mean step, before its line is taken out.
SARFOCUS_API void remove_gauge(std::vector<double>& phase);

}  // namespace sarfocus::autofocus
