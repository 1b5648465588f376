#include <sarfocus/signal/interpolation.hpp>

#include <algorithm>
#include <cmath>
#include <string>

#include <sarfocus/core/checks.hpp>
#include <sarfocus/core/error.hpp>

namespace sarfocus::signal {
namespace {

constexpr std::ptrdiff_t longest_line = 1 << 30;

std::ptrdiff_t output_length_of(std::ptrdiff_t length, std::ptrdiff_t factor) {
    if (length < 1) throw ShapeError("line", "at least one sample", std::to_string(length));
    if (factor < 1 || factor > longest_line / length)
        throw ValueError("factor", "a whole number from 1 to " + std::to_string(longest_line / length), std::to_string(factor));
    return length * factor;
}

std::ptrdiff_t wrapped(std::ptrdiff_t bin, std::ptrdiff_t length) {
    const std::ptrdiff_t rest = bin % length;
    return rest < 0 ? rest + length : rest;
}

void require_finite_chip(const ArrayView<const cdouble, 2>& chip) {
    for (std::ptrdiff_t i = 0; i < chip.extent(0); ++i)
        for (std::ptrdiff_t j = 0; j < chip.extent(1); ++j)
            if (!std::isfinite(chip(i, j).real()) || !std::isfinite(chip(i, j).imag()))
                throw NumericalError("chip: expected finite samples, got another value at [" + std::to_string(i) + ", " +
                                     std::to_string(j) + "]");
}

Array<cdouble, 2> upsample_checked(const ArrayView<const cdouble, 2>& chip, std::ptrdiff_t factor,
                                   const std::array<double, 2>& band_centre) {
    const std::ptrdiff_t rows = chip.extent(0);
    const std::ptrdiff_t columns = chip.extent(1);
    const LineUpsampler<double> along_range(columns, factor, band_centre[1]);
    const LineUpsampler<double> along_azimuth(rows, factor, band_centre[0]);
    const auto pixels = static_cast<std::uint64_t>(rows * factor) * static_cast<std::uint64_t>(columns * factor);
    require_memory(sizeof(cdouble) * (pixels + pixels / static_cast<std::uint64_t>(factor)), "upsample");
    Array<cdouble, 2> stretched({rows, along_range.output_length()});
    for (std::ptrdiff_t i = 0; i < rows; ++i) along_range.apply(chip.row(i), stretched.view().row(i));
    Array<cdouble, 2> out({along_azimuth.output_length(), along_range.output_length()});
    const Array<cdouble, 2>& source = stretched;
    for (std::ptrdiff_t j = 0; j < out.extent(1); ++j) along_azimuth.apply(source.view().column(j), out.view().column(j));
    return out;
}

}  // namespace

template <class Real>
LineUpsampler<Real>::LineUpsampler(std::ptrdiff_t length, std::ptrdiff_t factor, double band_centre)
    : forward_(length, fft::Direction::forward), inverse_(output_length_of(length, factor), fft::Direction::inverse) {
    require_finite_value(band_centre, "band_centre");
    const double folded = band_centre - std::floor(band_centre);
    // Whole turns of the centre multiply sample i of the fine grid by exp(2j pi turns i / factor): keep them.
    const auto turns = wrapped(static_cast<std::ptrdiff_t>(std::fmod(std::floor(band_centre), static_cast<double>(factor))), factor);
    first_bin_ = turns * length + std::lround(folded * static_cast<double>(length)) - length / 2;
}

template <class Real>
void LineUpsampler<Real>::apply(const ArrayView<const std::complex<Real>, 1>& line, const ArrayView<std::complex<Real>, 1>& out) const {
    const std::ptrdiff_t n = length();
    const std::ptrdiff_t m = output_length();
    if (line.extent(0) != n) throw ShapeError("line", "(" + std::to_string(n) + ",)", shape_text(line.extents()));
    if (out.extent(0) != m) throw ShapeError("out", "(" + std::to_string(m) + ",)", shape_text(out.extents()));
    Array<std::complex<Real>, 1> spectrum({n});
    Array<std::complex<Real>, 1> fine({m});
    for (std::ptrdiff_t i = 0; i < n; ++i) spectrum.data()[i] = line(i);
    forward_.execute(spectrum.data());
    const Real scale = Real(1) / static_cast<Real>(n);
    for (std::ptrdiff_t k = first_bin_; k < first_bin_ + n; ++k) fine.data()[wrapped(k, m)] = scale * spectrum.data()[wrapped(k, n)];
    if (n % 2 == 0) {
        const std::complex<Real> edge = Real(0.5) * fine.data()[wrapped(first_bin_, m)];
        fine.data()[wrapped(first_bin_, m)] = edge;
        fine.data()[wrapped(first_bin_ + n, m)] += edge;
    }
    inverse_.execute(fine.data());
    for (std::ptrdiff_t i = 0; i < m; ++i) out(i) = fine.data()[i];
}

template class LineUpsampler<float>;
template class LineUpsampler<double>;

Array<cdouble, 2> upsample(const ArrayView<const cdouble, 2>& chip, std::ptrdiff_t factor, std::array<double, 2> band_centre) {
    require_not_empty(chip, "chip");
    require_finite_chip(chip);
    return upsample_checked(chip, factor, band_centre);
}

Array<cdouble, 2> upsample(const ImageView& chip, std::ptrdiff_t factor, std::array<double, 2> band_centre) {
    require_not_empty(chip, "chip");
    require_finite(chip, "chip", 1);
    Array<cdouble, 2> wide({chip.extent(0), chip.extent(1)});
    for (std::ptrdiff_t i = 0; i < chip.extent(0); ++i)
        for (std::ptrdiff_t j = 0; j < chip.extent(1); ++j) wide(i, j) = cdouble(chip(i, j));
    const Array<cdouble, 2>& source = wide;
    return upsample_checked(source.view(), factor, band_centre);
}

}  // namespace sarfocus::signal
