#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include <sarfocus/core/array.hpp>
#include <sarfocus/core/array_view.hpp>
#include <sarfocus/core/execution.hpp>
#include <sarfocus/fft/plan.hpp>
#include <sarfocus/geometry/stripmap_geometry.hpp>

#include "spectrum_source.hpp"

namespace sarfocus::autofocus::detail {

/// The strongest range gates of an image as pulses that a phase error acts on, and the unitary way from them to the image and back.
class PulseSet {
public:
    /// Pulses: the occupied part of the azimuth spectrum.
    PulseSet(const ImageView& image, const Execution& execution);
    /// Pulses: slow-time samples.
    PulseSet(const ImageView& image, const geometry::StripmapGeometry& geometry, const Execution& execution);

    /// Some of the gates of another, by index; in the same memory.
    [[nodiscard]] PulseSet subset(const std::vector<std::ptrdiff_t>& columns) const;
    /// At most `count` of the gates, those with the largest sum of squared intensity.
    [[nodiscard]] PulseSet strongest(std::ptrdiff_t count, const Execution& execution) const;

    [[nodiscard]] const std::vector<std::ptrdiff_t>& gates() const { return gates_; }
    [[nodiscard]] std::ptrdiff_t n_gate() const { return static_cast<std::ptrdiff_t>(gates_.size()); }
    [[nodiscard]] std::ptrdiff_t n_azimuth() const { return n_azimuth_; }
    [[nodiscard]] std::ptrdiff_t n_pulse() const { return n_pulse_; }
    /// Place of a pulse in a line.
    [[nodiscard]] std::ptrdiff_t place(std::ptrdiff_t pulse) const { return ((first_ + pulse) % n_azimuth_ + n_azimuth_) % n_azimuth_; }
    /// Transform bin where the azimuth spectrum of the image begins.
    [[nodiscard]] std::ptrdiff_t first_bin() const { return first_bin_; }
    /// Samples from one line to the next of an array that `form` fills: n_azimuth rounded up.
    [[nodiscard]] std::ptrdiff_t line_length() const;
    /// The pulses of a gate, [n_azimuth], aligned.
    [[nodiscard]] const cfloat* pulses(std::ptrdiff_t gate) const { return row(*lines_, gate); }
    /// Sum of the squared magnitudes of all lines; no phase changes it.
    [[nodiscard]] double energy() const { return energy_; }

    /// lines = exp(-j phase) on the pulses, taken to the image. phase: [n_pulse].
    void form(const std::vector<double>& phase, Array<cfloat, 2>& lines, const Execution& execution) const;
    /// What form_line multiplies a line by: [n_azimuth].
    [[nodiscard]] std::vector<cfloat> factors(const std::vector<double>& phase) const;
    /// One gate: line [n_azimuth], aligned.
    void form_line(std::ptrdiff_t gate, const std::vector<cfloat>& factors, cfloat* line) const;
    /// In place: a line of the image to pulses.
    void to_pulses(std::ptrdiff_t gate, cfloat* line) const;
    /// [n_azimuth, n_gate] of lines.
    [[nodiscard]] MutableImageView as_image(Array<cfloat, 2>& lines) const {
        return {lines.data(), {n_azimuth_, n_gate()}, {1, lines.extent(1)}};
    }
    /// From pulses to all n_azimuth, shifted for a spectrum.
    [[nodiscard]] std::vector<double> over_azimuth(const std::vector<double>& values, double elsewhere) const;

private:
    PulseSet() = default;
    void plan();
    void share(Array<cfloat, 2> lines, Array<cfloat, 2> chirps);
    void measure_energy();
    /// In place: a line of a strip to slow time.
    void slow_time(const cfloat* chirp, cfloat* line) const;

    [[nodiscard]] bool strip() const { return chirps_ != nullptr; }
    [[nodiscard]] const cfloat* row(const Array<cfloat, 2>& of, std::ptrdiff_t gate) const {
        return of.data() + rows_[static_cast<std::size_t>(gate)] * of.extent(1);
    }

    std::ptrdiff_t n_azimuth_ = 0;
    std::ptrdiff_t n_pulse_ = 0;
    std::ptrdiff_t first_ = 0;
    std::ptrdiff_t first_bin_ = 0;
    std::vector<std::ptrdiff_t> gates_;
    std::vector<std::ptrdiff_t> rows_;  // of every gate, in what a set shares with its subsets:
    std::shared_ptr<const Array<cfloat, 2>> lines_;
    std::shared_ptr<const Array<cfloat, 2>> chirps_;  // strips: spectrum of azimuth compression over n_azimuth
    double energy_ = 0.0;
    std::shared_ptr<const fft::Plan<float>> forward_;
    std::shared_ptr<const fft::Plan<float>> inverse_;
};

}  // namespace sarfocus::autofocus::detail
