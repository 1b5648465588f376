#include "line_sums.hpp"

#include <algorithm>
#include <cmath>

#include <sarfocus/core/multiversion.hpp>

namespace sarfocus::autofocus::detail {
namespace {

constexpr std::ptrdiff_t lanes = 8;

// exp(-j slope (k - middle)) for `lanes` consecutive k, by recurrence from each to the one `lanes` further on.
struct Turns {
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

// Moments of z up to `order`, inlined into the versions below.
template <int order>
inline __attribute__((always_inline)) LineMoments sums(const cfloat* line, const cdouble* rotation, std::ptrdiff_t n, double slope,
                                                       double middle) {
    const auto* d = reinterpret_cast<const float*>(line);
    const auto* r = reinterpret_cast<const double*>(rotation);
    Turns turn(slope, middle);
    double re[3][lanes] = {};
    double im[3][lanes] = {};
    for (std::ptrdiff_t k = 0; k < n; k += lanes) {
        double a[2 * lanes] = {};
        double b[2 * lanes] = {};
        const std::ptrdiff_t count = std::min(lanes, n - k);
        if (count == lanes) {
            for (std::ptrdiff_t i = 0; i < 2 * lanes; ++i) a[i] = static_cast<double>(d[2 * k + i]);
            for (std::ptrdiff_t i = 0; i < 2 * lanes; ++i) b[i] = r[2 * k + i];
        } else {
            for (std::ptrdiff_t i = 0; i < 2 * count; ++i) a[i] = static_cast<double>(d[2 * k + i]);
            for (std::ptrdiff_t i = 0; i < 2 * count; ++i) b[i] = r[2 * k + i];
        }
        for (std::ptrdiff_t l = 0; l < lanes; ++l) {
            const double p = a[2 * l] * b[2 * l] + a[2 * l + 1] * b[2 * l + 1];
            const double q = a[2 * l + 1] * b[2 * l] - a[2 * l] * b[2 * l + 1];
            const double z_re = p * turn.re[l] - q * turn.im[l];
            const double z_im = p * turn.im[l] + q * turn.re[l];
            re[0][l] += z_re;
            im[0][l] += z_im;
            if constexpr (order > 0) {
                const double x = static_cast<double>(k + l) - middle;
                re[1][l] += x * z_re;
                im[1][l] += x * z_im;
                re[2][l] += x * x * z_re;
                im[2][l] += x * x * z_im;
            }
        }
        turn.advance();
    }
    cdouble out[3];
    for (int m = 0; m < 3; ++m)
        for (std::ptrdiff_t l = 0; l < lanes; ++l) out[m] += cdouble(re[m][l], im[m][l]);
    return {out[0], out[1], out[2]};
}

}  // namespace

SARFOCUS_MULTIVERSION LineMoments line_moments(const cfloat* line, const cdouble* rotation, std::ptrdiff_t n, double slope, double middle) {
    return sums<2>(line, rotation, n, slope, middle);
}

SARFOCUS_MULTIVERSION cdouble line_sum(const cfloat* line, const cdouble* rotation, std::ptrdiff_t n, double slope, double middle) {
    return sums<0>(line, rotation, n, slope, middle).zeroth;
}

SARFOCUS_MULTIVERSION void add_line(const cfloat* line, std::ptrdiff_t n, cdouble gain, double slope, double middle, double share,
                                    cdouble* sum, double* own) {
    const auto* d = reinterpret_cast<const float*>(line);
    auto* s = reinterpret_cast<double*>(sum);
    const double gain_re = gain.real();
    const double gain_im = gain.imag();
    Turns turn(slope, middle);
    const std::ptrdiff_t whole = n / lanes * lanes;
    const auto one = [&](std::ptrdiff_t k, std::ptrdiff_t l) {
        const auto re = static_cast<double>(d[2 * k]);
        const auto im = static_cast<double>(d[2 * k + 1]);
        const double factor_re = gain_re * turn.re[l] - gain_im * turn.im[l];
        const double factor_im = gain_re * turn.im[l] + gain_im * turn.re[l];
        s[2 * k] += re * factor_re - im * factor_im;
        s[2 * k + 1] += re * factor_im + im * factor_re;
        own[k] += share * (re * re + im * im);
    };
    for (std::ptrdiff_t k = 0; k < whole; k += lanes) {
        for (std::ptrdiff_t l = 0; l < lanes; ++l) one(k + l, l);
        turn.advance();
    }
    for (std::ptrdiff_t k = whole; k < n; ++k) one(k, k - whole);
}

}  // namespace sarfocus::autofocus::detail
