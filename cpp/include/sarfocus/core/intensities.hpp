#pragma once

#include <cstddef>
#include <cstring>

namespace sarfocus::detail {

/// Eight values, a register of AVX2; half of one of AVX-512, since wider vectors than the processor has would be taken apart value by
/// value.
using EightFloats = float __attribute__((vector_size(8 * sizeof(float))));

/// Which of eight samples a lane of `eight_intensities` is of: the order in which two registers are put together at the least expense.
inline constexpr std::ptrdiff_t sample_of_lane[] = {0, 1, 4, 5, 2, 3, 6, 7};

/// Intensities of eight samples next to one another; samples: (re, im) of the first, at any address. For functions under
/// SARFOCUS_MULTIVERSION.
inline __attribute__((always_inline)) void eight_intensities(const float* samples, EightFloats& out) {
    EightFloats a;
    EightFloats b;
    std::memcpy(&a, samples, sizeof a);
    std::memcpy(&b, samples + 8, sizeof b);
    const EightFloats re = __builtin_shufflevector(a, b, 0, 2, 8, 10, 4, 6, 12, 14);
    const EightFloats im = __builtin_shufflevector(a, b, 1, 3, 9, 11, 5, 7, 13, 15);
    out = re * re + im * im;
}

}  // namespace sarfocus::detail
