#pragma once

#include <array>
#include <complex>
#include <cstddef>

#include <sarfocus/core/array.hpp>
#include <sarfocus/core/array_view.hpp>
#include <sarfocus/core/export.hpp>
#include <sarfocus/fft/plan.hpp>

namespace sarfocus::signal {

/// Band-limited interpolation of periodic lines of one length by an integer factor: FFT, zeros put into the gap of the spectrum, inverse
/// FFT. Sample factor * i of the result is sample i of the line, to rounding. The band is taken to be one sampling rate wide about
/// `band_centre`; the bin that lies on both of its edges (even length) is shared equally between them. Built once, applied from any number
/// of threads at once.
template <class Real>
class SARFOCUS_API LineUpsampler {
public:
    /// length: samples of a line, >= 1; factor >= 1; band_centre: centre of the band, cycles per sample (Doppler centroid / prf), rounded
    /// to a bin. Throws ValueError.
    LineUpsampler(std::ptrdiff_t length, std::ptrdiff_t factor, double band_centre = 0.0);

    [[nodiscard]] std::ptrdiff_t length() const { return forward_.length(); }
    [[nodiscard]] std::ptrdiff_t output_length() const { return inverse_.length(); }

    /// line [length], out [length * factor], any strides; may not overlap. Throws ShapeError.
    void apply(const ArrayView<const std::complex<Real>, 1>& line, const ArrayView<std::complex<Real>, 1>& out) const;

private:
    fft::Plan<Real> forward_;
    fft::Plan<Real> inverse_;
    std::ptrdiff_t first_bin_;
};

extern template class LineUpsampler<float>;
extern template class LineUpsampler<double>;

/// A small image, [n_azimuth, n_range], on a grid `factor` times finer both ways: [n_azimuth * factor, n_range * factor], in double
/// precision. Pixel (factor * i, factor * j) is chip(i, j). The chip is continued periodically: leave a margin about what is measured.
/// band_centre: as for LineUpsampler, azimuth and range. Throws ValueError, ShapeError, NumericalError (NaN, infinity),
/// MemoryEstimateError.
[[nodiscard]] SARFOCUS_API Array<cdouble, 2> upsample(const ImageView& chip, std::ptrdiff_t factor,
                                                      std::array<double, 2> band_centre = {0.0, 0.0});
[[nodiscard]] SARFOCUS_API Array<cdouble, 2> upsample(const ArrayView<const cdouble, 2>& chip, std::ptrdiff_t factor,
                                                      std::array<double, 2> band_centre = {0.0, 0.0});

}  // namespace sarfocus::signal
