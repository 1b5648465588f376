#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdlib>
#include <functional>
#include <vector>

#include <sarfocus/core/array_view.hpp>
#include <sarfocus/core/execution.hpp>

namespace sarfocus::quality::detail {

/// Sums (or what `combine` makes of two values, from zero) of `term(i, j)`, an array of N doubles, over all pixels: every row from left to
/// right, then the rows from the first to the last.
/// `strides` only decide the order in which memory is walked, never the order of summation.
template <std::size_t N, class Term, class Combine = std::plus<>>
std::array<double, N> sum_rows(const std::array<std::ptrdiff_t, 2>& extents, const std::array<std::ptrdiff_t, 2>& strides,
                               const Execution& execution, const char* phase, const Term& term, const Combine& combine = {}) {
    using Sums = std::array<double, N>;
    constexpr std::ptrdiff_t block = 32;
    const std::ptrdiff_t rows = extents[0];
    const std::ptrdiff_t columns = extents[1];
    const bool column_major = std::abs(strides[0]) < std::abs(strides[1]);
    std::vector<Sums> row_sums(static_cast<std::size_t>(rows), Sums{});
    parallel_for(execution, phase, (rows + block - 1) / block, [&](std::ptrdiff_t b) {
        const std::ptrdiff_t begin = b * block;
        const std::ptrdiff_t end = std::min(rows, begin + block);
        const auto add = [&](std::ptrdiff_t i, std::ptrdiff_t j) {
            const Sums value = term(i, j);
            Sums& sums = row_sums[static_cast<std::size_t>(i)];
            for (std::size_t n = 0; n < N; ++n) sums[n] = combine(sums[n], value[n]);
        };
        if (column_major) {
            for (std::ptrdiff_t j = 0; j < columns; ++j)
                for (std::ptrdiff_t i = begin; i < end; ++i) add(i, j);
        } else {
            for (std::ptrdiff_t i = begin; i < end; ++i)
                for (std::ptrdiff_t j = 0; j < columns; ++j) add(i, j);
        }
    });
    Sums total{};
    for (const Sums& sums : row_sums)
        for (std::size_t n = 0; n < N; ++n) total[n] = combine(total[n], sums[n]);
    return total;
}

/// |x|^2 in float64, which no complex64 sample overflows or, being different from zero, underflows.
inline double intensity(const cfloat& x) {
    const double re = x.real();
    const double im = x.imag();
    return re * re + im * im;
}

}  // namespace sarfocus::quality::detail
