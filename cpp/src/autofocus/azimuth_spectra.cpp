#include "azimuth_spectra.hpp"

#include <algorithm>

#include <sarfocus/core/array.hpp>

namespace sarfocus::autofocus::detail {

void transform_azimuth(const ImageView& from, fft::Direction direction, const MutableImageView& to, const Execution& execution) {
    constexpr std::ptrdiff_t columns = 16;  // whole cache lines of a row-major image
    const std::ptrdiff_t n = from.extent(0);
    const std::ptrdiff_t length = (n + 7) / 8 * 8;  // every line aligned
    const fft::Plan<float> plan(n, direction);
    parallel_for(execution, "azimuth spectrum", (from.extent(1) + columns - 1) / columns, [&](std::int64_t b) {
        const std::ptrdiff_t first = b * columns;
        const std::ptrdiff_t count = std::min(columns, from.extent(1) - first);
        Array<cfloat, 2> lines({count, length});
        for (std::ptrdiff_t i = 0; i < n; ++i)
            for (std::ptrdiff_t c = 0; c < count; ++c) lines(c, i) = from(i, first + c);
        for (std::ptrdiff_t c = 0; c < count; ++c) plan.execute(lines.data() + c * length);
        for (std::ptrdiff_t i = 0; i < n; ++i)
            for (std::ptrdiff_t c = 0; c < count; ++c) to(i, first + c) = lines(c, i);
    });
}

}  // namespace sarfocus::autofocus::detail
