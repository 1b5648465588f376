#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <limits>
#include <string>

#include <sarfocus/core/array.hpp>
#include <sarfocus/core/checks.hpp>
#include <sarfocus/core/error.hpp>
#include <sarfocus/core/execution.hpp>
#include <sarfocus/detect/point.hpp>

namespace sarfocus::detect::detail {

inline double power(const cfloat& x) {
    const double re = x.real();
    const double im = x.imag();
    return re * re + im * im;
}
inline double power(float x) {
    return x;
}

inline void require_samples(const ImageView& image, const Execution& execution) {
    require_not_empty(image, "image");
    require_finite(image, "image", execution.threads);
}
inline void require_samples(const IntensityView& intensity, const Execution&) {
    require_not_empty(intensity, "intensity");
    for (std::ptrdiff_t i = 0; i < intensity.extent(0); ++i)
        for (std::ptrdiff_t j = 0; j < intensity.extent(1); ++j)
            if (!(intensity(i, j) >= 0.0F && intensity(i, j) <= std::numeric_limits<float>::max()))
                throw NumericalError("intensity: expected finite values >= 0, got " + number_text(intensity(i, j)) + " at [" +
                                     std::to_string(i) + ", " + std::to_string(j) + "]");
}

/// Calls visit(i, j) for every element, rows from `begin` to `end`, along memory.
template <class Sample, class Visit>
void walk(const ArrayView<const Sample, 2>& view, std::ptrdiff_t begin, std::ptrdiff_t end, const Visit& visit) {
    if (std::abs(view.stride(0)) < std::abs(view.stride(1))) {
        for (std::ptrdiff_t j = 0; j < view.extent(1); ++j)
            for (std::ptrdiff_t i = begin; i < end; ++i) visit(i, j);
    } else {
        for (std::ptrdiff_t i = begin; i < end; ++i)
            for (std::ptrdiff_t j = 0; j < view.extent(1); ++j) visit(i, j);
    }
}

/// Rows [begin, end) of the image, as far as they exist, as intensities in float64.
struct PowerRows {
    std::ptrdiff_t begin = 0;
    std::ptrdiff_t end = 0;
    Array<double, 2> values;

    template <class Sample>
    PowerRows(const ArrayView<const Sample, 2>& view, std::ptrdiff_t first, std::ptrdiff_t last)
        : begin(std::max<std::ptrdiff_t>(0, first)), end(std::min(view.extent(0), last)), values({end - begin, view.extent(1)}) {
        walk(view, begin, end, [&](std::ptrdiff_t i, std::ptrdiff_t j) { values(i - begin, j) = power(view(i, j)); });
    }

    [[nodiscard]] const double* row(std::ptrdiff_t i) const { return values.data() + (i - begin) * values.extent(1); }
};

}  // namespace sarfocus::detect::detail
