#include "focus/range_upsampler.hpp"

#include <algorithm>

namespace sarfocus::focus::detail {

RangeUpsampler::RangeUpsampler(std::ptrdiff_t n_range, std::ptrdiff_t guard)
    : n_range_(n_range),
      guard_(guard),
      width_((2 * (n_range + 2 * guard) + 15) / 16 * 16),
      n_padded_(fft::good_size(width_ / 2)),
      forward_(n_padded_, fft::Direction::forward),
      inverse_(2 * n_padded_, fft::Direction::inverse) {}

RangeUpsampler::Workspace::Workspace(const RangeUpsampler& upsampler)
    : spectrum_({upsampler.n_padded_}), line_({2 * upsampler.n_padded_}) {}

void RangeUpsampler::run(const ArrayView<const cfloat, 1>& profile, float* re, float* im, Workspace& workspace) const {
    cfloat* spectrum = workspace.spectrum_.data();
    cfloat* line = workspace.line_.data();
    std::fill(spectrum, spectrum + guard_, cfloat{});
    for (std::ptrdiff_t i = 0; i < n_range_; ++i) spectrum[guard_ + i] = profile(i);
    std::fill(spectrum + guard_ + n_range_, spectrum + n_padded_, cfloat{});
    forward_.execute(spectrum);

    const std::ptrdiff_t positive = (n_padded_ + 1) / 2;
    const float scale = 1.0f / static_cast<float>(n_padded_);
    for (std::ptrdiff_t k = 0; k < positive; ++k) line[k] = scale * spectrum[k];
    std::fill(line + positive, line + n_padded_ + positive, cfloat{});
    for (std::ptrdiff_t k = positive; k < n_padded_; ++k) line[n_padded_ + k] = scale * spectrum[k];
    // The Nyquist component of an even length is shared out between both signs.
    if (n_padded_ % 2 == 0) line[positive] = line[n_padded_ + positive] = 0.5f * scale * spectrum[positive];
    inverse_.execute(line);
    for (std::ptrdiff_t i = 0; i < width_; ++i) {
        re[i] = line[i].real();
        im[i] = line[i].imag();
    }
}

}  // namespace sarfocus::focus::detail
