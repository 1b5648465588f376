#pragma once

#include <cmath>
#include <cstddef>

namespace sarfocus::autofocus::detail {

/// exp(-j slope (k - middle)) for `lanes` consecutive k, by recurrence from each to the one `lanes` further on.
struct Turns {
    static constexpr std::ptrdiff_t lanes = 8;
    double re[lanes];
    double im[lanes];
    double step_re;
    double step_im;

    Turns(double slope, double middle) : step_re(std::cos(slope * lanes)), step_im(-std::sin(slope * lanes)) {
        for (std::ptrdiff_t l = 0; l < lanes; ++l) {
            const double angle = -slope * (static_cast<double>(l) - middle);
            re[l] = std::cos(angle);
            im[l] = std::sin(angle);
        }
    }

    inline __attribute__((always_inline)) void advance() {
        for (std::ptrdiff_t l = 0; l < lanes; ++l) {
            const double next = re[l] * step_re - im[l] * step_im;
            im[l] = re[l] * step_im + im[l] * step_re;
            re[l] = next;
        }
    }
};

}  // namespace sarfocus::autofocus::detail
