#pragma once

#include <cmath>
#include <complex>
#include <cstddef>
#include <vector>

#include <sarfocus/autofocus/strip.hpp>
#include <sarfocus/core/array_view.hpp>
#include <sarfocus/fft/plan.hpp>

namespace sarfocus::autofocus::detail {

[[nodiscard]] inline std::size_t at(std::ptrdiff_t i) {
    return static_cast<std::size_t>(i);
}

/// Complex product without the test for infinities that the operator of the standard makes.
[[nodiscard]] inline cdouble times(const cdouble& a, const cdouble& b) {
    return {a.real() * b.real() - a.imag() * b.imag(), a.real() * b.imag() + a.imag() * b.real()};
}
[[nodiscard]] inline cdouble times_conjugate(const cdouble& a, const cdouble& b) {
    return {a.real() * b.real() + a.imag() * b.imag(), a.imag() * b.real() - a.real() * b.imag()};
}

/// exp(j slope k) for k = first, first + 1, …, by recurrence.
class Ramp {
public:
    Ramp(double slope, double first) : value_(std::polar(1.0, slope * first)), step_(std::polar(1.0, slope)) {}
    cdouble next() {
        const cdouble out = value_;
        value_ = times(value_, step_);
        return out;
    }

private:
    cdouble value_;
    cdouble step_;
};

/// The next power of two from 64: apertures have many lengths, their transforms few.
[[nodiscard]] std::ptrdiff_t plan_length(std::ptrdiff_t n);

/// Transform of such a length, planned once in a process and kept.
[[nodiscard]] const fft::Plan<double>& kept_plan(std::ptrdiff_t length, fft::Direction direction);

/// The strongest tone of a signal.
struct Tone {
    double slope = 0.0;      ///< rad a sample
    double coherence = 0.0;  ///< |sum|^2 / (n sum of squares)
    cdouble sum;             ///< of the signal turned by exp(-j slope (k - middle))
};

/// Peak of the periodogram within +-limit rad a sample, from a transform at least three times as long, refined by Newton steps. Signals
/// longer than 512 samples are averaged down as far as the limit allows.
[[nodiscard]] Tone strongest_tone(const std::vector<cdouble>& signal, double limit);

/// exp(-j phase).
[[nodiscard]] std::vector<cdouble> rotation_of(const std::vector<double>& phase);

/// Line n times the root of its weights (white noise), times rotation(k) where there is one, turned by -slope (k - azimuth): [count].
[[nodiscard]] std::vector<cdouble> whitened_line(const Apertures& apertures, std::ptrdiff_t n, const std::vector<cdouble>& rotation,
                                                 double slope);

/// Slope limit within which a point's tone is looked for: displacements up to `pixels`.
[[nodiscard]] double slope_of(const Apertures& apertures, std::ptrdiff_t n, double pixels);

/// Where every point is imaged, azimuth pixels from where its aperture was cut: by its strongest tone.
[[nodiscard]] std::vector<double> imaged_before(const Apertures& apertures, const Execution& execution);

/// A phase of every sample, turned so that neighbours differ by less than pi.
void unwrap(std::vector<double>& phase, std::ptrdiff_t begin, std::ptrdiff_t end);

/// Samples [begin, end) that each segment answers for: its apertures, and half the gaps about them. covered: the apertures alone.
struct SegmentSpan {
    std::ptrdiff_t begin = 0;
    std::ptrdiff_t end = 0;
    std::ptrdiff_t covered_begin = 0;
    std::ptrdiff_t covered_end = 0;
};
[[nodiscard]] std::vector<SegmentSpan> segment_spans(const Apertures& apertures, const std::vector<int>& segment, int segments);

/// Apertures that reach each sample.
[[nodiscard]] std::vector<double> coverage_of(const Apertures& apertures);

/// Phase of stitched apertures without a prior: constants from the pairs, coherent sum, rounds of maximum likelihood.
struct CoherentPhase {
    std::vector<double> phase;  ///< [n_azimuth]; zero where no used aperture reaches
    std::vector<double> slope;  ///< [n_point]
    std::vector<bool> reached;  ///< [n_azimuth]
};

/// Only the points with use[n]; stitching.segment must be that of the points in use. `windows` as in StripRefineOptions; so many rounds in
/// each.
[[nodiscard]] CoherentPhase coherent_phase(const Apertures& apertures, const Stitching& stitching, const std::vector<bool>& use,
                                           const std::vector<double>& windows, int rounds, const Execution& execution);

/// `stitch` of the points in use alone; the others get segment -1.
[[nodiscard]] Stitching stitch_some(const Apertures& apertures, const std::vector<Seam>& seams, const std::vector<bool>& use);

/// The joint refinement of refine_strip_phase, from a phase that is already right to a fraction of a turn.
[[nodiscard]] StripPhase joint_refinement(const Apertures& apertures, const Stitching& stitching, const CoherentPhase& start,
                                          const StripRefineOptions& options);

}  // namespace sarfocus::autofocus::detail
