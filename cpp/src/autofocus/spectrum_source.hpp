#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <utility>
#include <vector>

#include <sarfocus/core/array.hpp>
#include <sarfocus/core/array_view.hpp>
#include <sarfocus/core/execution.hpp>
#include <sarfocus/fft/plan.hpp>
#include <sarfocus/quality/image_measures.hpp>

#include "point_source.hpp"

namespace sarfocus::autofocus::detail {

/// Range gates worth estimating from, ascending: those with the largest sum of squared intensity, which a strong point raises most,
/// defocused or not. 512 of them, or the eighth where that is more. Throws NumericalError (NaN, infinity) where it leaves gates out; else
/// it looks at none.
[[nodiscard]] std::vector<std::ptrdiff_t> strong_gates(const ImageView& image, const Execution& execution);

/// Whether an image has more pixels than are looked at as a whole, 2^20: estimation is bounded, from some of the range gates, of which no
/// image is kept.
[[nodiscard]] bool is_large(const ImageView& image);

/// The azimuth spectrum of some range gates. Its pulses are the occupied part of the spectrum, in the order in which it is one piece: a
/// Doppler centroid may have folded it round the ends.
class SpectrumSource : public PointSource {
public:
    /// Of the strong gates.
    SpectrumSource(const ImageView& image, const Execution& execution);
    /// gates: ascending.
    SpectrumSource(const ImageView& image, std::vector<std::ptrdiff_t> gates, const Execution& execution);

    [[nodiscard]] std::ptrdiff_t n_pulse() const override { return n_pulse_; }
    [[nodiscard]] std::array<std::ptrdiff_t, 2> shape() const override { return {n_azimuth_, spectrum_.extent(0)}; }
    [[nodiscard]] std::ptrdiff_t range_gate(std::ptrdiff_t column) const override { return gates_[static_cast<std::size_t>(column)]; }
    [[nodiscard]] bool fractional_columns() const override { return false; }
    [[nodiscard]] bool is_list() const override { return false; }
    [[nodiscard]] bool is_large() const override { return large_; }
    [[nodiscard]] double sum_scale() const override { return static_cast<double>(n_azimuth_) * static_cast<double>(n_azimuth_); }

    void form(const std::vector<double>& phase, MutableImageView image, const Execution& execution) override;
    [[nodiscard]] std::unique_ptr<Picture> picture(const PictureRequest& request, const Execution& execution) override;
    void histories(const std::vector<Pixel>& points, MutableImageView histories, const Execution& execution) override;

    /// Puts other samples [n_azimuth, gates] in place of those that the support was found from, their spectrum times `factor`
    /// [gates, n_azimuth], whose order is that of the unshifted transform.
    void replace(const ImageView& lines, const Array<float, 2>& factor, const Execution& execution);

    /// From pulses to fftshift(fft(image)): index p of the support goes to its place among all n_azimuth.
    [[nodiscard]] std::vector<double> over_spectrum(const std::vector<double>& values, double elsewhere) const;
    /// Unshifted transform bin of pulse p.
    [[nodiscard]] std::ptrdiff_t bin(std::ptrdiff_t p) const { return ((first_ + p) % n_azimuth_ + n_azimuth_) % n_azimuth_; }
    /// What a line of the spectrum is multiplied by before its inverse transform: [n_azimuth], unshifted.
    [[nodiscard]] std::vector<cfloat> factors(const std::vector<double>& phase) const;
    /// [gates, n_azimuth], unnormalised, unshifted.
    [[nodiscard]] const Array<cfloat, 2>& spectrum() const { return spectrum_; }
    /// The same, for its memory; the source can only be destroyed afterwards.
    [[nodiscard]] Array<cfloat, 2> take_spectrum() { return std::move(spectrum_); }

private:
    void find_support(const Execution& execution);

    std::ptrdiff_t n_azimuth_;
    bool large_;
    std::vector<std::ptrdiff_t> gates_;
    Array<cfloat, 2> spectrum_;
    fft::Plan<float> inverse_;
    std::ptrdiff_t first_ = 0;  // frequency index of pulse 0
    std::ptrdiff_t n_pulse_ = 0;
};

/// corrected = the image whose shifted azimuth spectrum is multiplied by exp(-j phase); may be the image itself. Where `before` and `after`
/// are given, the entropies of both as their gates go by.
void correct_spectrum(const ImageView& image, const std::vector<double>& phase, const MutableImageView& corrected,
                      quality::EntropySums* before, quality::EntropySums* after, const Execution& execution);

}  // namespace sarfocus::autofocus::detail
