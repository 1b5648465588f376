#pragma once

#include <cmath>
#include <cstddef>

namespace sarfocus::signal {

/// sin(2 pi x) for |x| <= 1/4. Odd polynomial of degree 9, fitted to sin(y) - y on [-pi/2, pi/2] (minimax, 5e-9); error 1.2e-7 in single
/// precision.
inline float sine_of_cycles(double x) {
    const auto y = static_cast<float>(6.283185307179586 * x);
    const float u = y * y;
    const float p = ((2.600054754e-6f * u - 1.98066151945e-4f) * u + 8.333017291442e-3f) * u - 1.66666570965e-1f;
    return y + y * (u * p);
}

/// cos and sin of 2 pi `cycles`, |cycles| < 2^51: whole turns are taken off in double precision, the rest is single.
/// Error: 1.5e-7 plus 2 pi times that of `cycles`. No branches and no calls: loops over it vectorise.
inline void unit_phasor(double cycles, float& real, float& imag) {
    constexpr double to_whole = 6755399441055744.0;  // 1.5 * 2^52: adding it rounds to whole numbers
    const double rest = cycles - ((cycles + to_whole) - to_whole);
    const double size = std::abs(rest);
    real = sine_of_cycles(0.25 - size);
    imag = std::copysign(1.0f, static_cast<float>(rest)) * sine_of_cycles(0.25 - std::abs(size - 0.25));
}

}  // namespace sarfocus::signal
