#pragma once

#include <array>
#include <cstddef>
#include <limits>

#include <sarfocus/core/array_view.hpp>

namespace sarfocus::detect {

/// A strong pixel of an image.
struct Point {
    std::ptrdiff_t azimuth = 0;
    std::ptrdiff_t range = 0;
    double intensity = 0.0;                                      ///< |I|^2
    double contrast = std::numeric_limits<double>::quiet_NaN();  ///< Q_k where somebody computed it, see `contrast`
};

/// Stronger first; of equals the one with the smaller azimuth, then range: a strict order of different pixels.
[[nodiscard]] constexpr bool stronger(const Point& a, const Point& b) {
    if (a.intensity != b.intensity) return a.intensity > b.intensity;
    return a.azimuth != b.azimuth ? a.azimuth < b.azimuth : a.range < b.range;
}

/// [n_azimuth, n_range] intensities, finite and >= 0, where there are no complex samples.
using IntensityView = ArrayView<const float, 2>;

}  // namespace sarfocus::detect
