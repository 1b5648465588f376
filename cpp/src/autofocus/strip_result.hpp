#pragma once

#include <string>
#include <vector>

#include <sarfocus/autofocus/result.hpp>
#include <sarfocus/autofocus/spga.hpp>
#include <sarfocus/autofocus/strip.hpp>
#include <sarfocus/focus/azimuth.hpp>
#include <sarfocus/quality/image_measures.hpp>

#include "strip_score.hpp"

namespace sarfocus::autofocus::detail {

/// Weight of point n in the mean shift: all alike, but for those that tell next to nothing; a few very bright points are not the scene.
[[nodiscard]] double gauge_weight(const Apertures& apertures, const StripPhase& phase, std::ptrdiff_t n);

/// The point that lies where a tie point belongs, or the nearest within the window; -1: none. after: pixels by which each point lies off
/// its own, [n_point].
[[nodiscard]] std::ptrdiff_t matching_point(const Apertures& apertures, const std::vector<double>& after, const TiePoint& tie);

/// Adds to the phase of every segment the line that the gauge asks for, and takes a constant off. Returns the azimuth pixels by which each
/// point is moved. Throws ValueError where a tie point matches no point.
[[nodiscard]] std::vector<double> apply_gauge(const Apertures& apertures, const SpgaLinearOptions& options, StripPhase& phase);

/// Points, seams, coverage and the rest, from one block of range gates; appended to what the result holds.
void append_details(const Apertures& apertures, const Stitching& stitching, const StripPhase& phase, const std::vector<double>& shift,
                    const StripEvidence& evidence, Result& result);

/// Copies an image; does nothing where both are the same memory.
void copy_image(const ImageView& from, const MutableImageView& to, const Execution& execution);

/// The status of an applied correction: converged where the apertures hang together and reach from one end of the strip to the other but
/// for half an aperture, beyond which the phase goes on as a line.
[[nodiscard]] Status coverage_status(const Result& result, const geometry::StripmapGeometry& geometry);

/// The entropy of an image and of what a correction makes of it, measured as their range gates go by.
class EntropyWatch {
public:
    EntropyWatch(std::ptrdiff_t n_azimuth, std::ptrdiff_t n_range);
    /// For focus::azimuth_correct; the watch must outlive the call.
    [[nodiscard]] focus::AzimuthCorrectOptions options(const Execution& execution);
    [[nodiscard]] double before() const { return total(before_).entropy(); }
    [[nodiscard]] double after() const { return total(after_).entropy(); }

private:
    [[nodiscard]] static quality::EntropySums total(const std::vector<quality::EntropySums>& sums);

    std::ptrdiff_t n_azimuth_;
    std::vector<quality::EntropySums> before_;
    std::vector<quality::EntropySums> after_;
};

/// The peaks of the points of an estimate, before a correction and after, between the pixels; only of those whose aperture lies within the
/// strip.
class PeakWatch {
public:
    PeakWatch(const std::vector<StrongPoint>& points, const geometry::StripmapGeometry& geometry, std::ptrdiff_t n_azimuth);
    void before(std::ptrdiff_t gate, const cfloat* samples) { measure(gate, samples, before_); }
    void after(std::ptrdiff_t gate, const cfloat* samples) { measure(gate, samples, after_); }
    /// Forgets what came after: of several corrections, one after the other, the last counts.
    void restart() { after_.assign(after_.size(), 0.0); }
    [[nodiscard]] int watched() const { return static_cast<int>(before_.size()); }
    /// Points whose peak falls by more than so many dB.
    [[nodiscard]] int fallen(double db) const;
    /// dB; 0 where there are none.
    [[nodiscard]] double mean_gain_db() const;
    /// dB, of the sum of their powers; 0 where there are none.
    [[nodiscard]] double total_gain_db() const;

private:
    struct Place {
        std::ptrdiff_t gate;
        std::ptrdiff_t first;
        std::ptrdiff_t count;
    };
    void measure(std::ptrdiff_t gate, const cfloat* samples, std::vector<double>& peaks) const;

    std::vector<Place> places_;   // in order of gate
    std::vector<double> before_;  // power of the peak [place]
    std::vector<double> after_;
};

/// For focus::azimuth_correct: both watches look on; the peaks before only in the first of several corrections. They must outlive the call.
[[nodiscard]] focus::AzimuthCorrectOptions watched_by(EntropyWatch& entropy, PeakWatch& peaks, bool first, const Execution& execution);

/// What speaks against a correction: entropy that does not fall, points that lose on average, more than a tenth of them that lose 3 dB.
/// Empty: nothing.
[[nodiscard]] std::string harm_done(const Score& score, const PeakWatch& peaks);

/// Corrects the image; keeps the correction where no harm is done (or `judge` is false), hands the input back otherwise. Sets phase_error,
/// status and the entropies of the score.
void apply_and_judge(const ImageView& image, const geometry::StripmapGeometry& geometry, const ArrayView<const double, 2>& phase,
                     const std::vector<double>& centres, const MutableImageView& corrected, bool judge, const Execution& execution,
                     Result& result);

/// Throws where an image can't be focused: wrong shape, all zero. NaN and infinity are found by the selection, which sees every pixel.
void require_strip_input(const ImageView& image, const geometry::StripmapGeometry& geometry, const MutableImageView& corrected);

}  // namespace sarfocus::autofocus::detail
