#include "tone_sums.hpp"

#include <cmath>

#include <sarfocus/core/multiversion.hpp>

#include "turns.hpp"

namespace sarfocus::autofocus::detail {
namespace {

constexpr std::ptrdiff_t lanes = Turns::lanes;

// Moments up to `order`, inlined into the versions below.
template <int order>
inline __attribute__((always_inline)) LineMoments moments(const cdouble* signal, std::ptrdiff_t n, double slope, double middle) {
    const auto* z = reinterpret_cast<const double*>(signal);
    Turns turn(slope, middle);
    double re[3][lanes] = {};
    double im[3][lanes] = {};
    const auto one = [&](std::ptrdiff_t k, std::ptrdiff_t l) {
        const double a = z[2 * (k + l)] * turn.re[l] - z[2 * (k + l) + 1] * turn.im[l];
        const double b = z[2 * (k + l)] * turn.im[l] + z[2 * (k + l) + 1] * turn.re[l];
        re[0][l] += a;
        im[0][l] += b;
        if constexpr (order > 0) {
            const double x = static_cast<double>(k + l) - middle;
            re[1][l] += x * a;
            im[1][l] += x * b;
            re[2][l] += x * x * a;
            im[2][l] += x * x * b;
        }
    };
    const std::ptrdiff_t whole = n / lanes * lanes;
    for (std::ptrdiff_t k = 0; k < whole; k += lanes) {
        for (std::ptrdiff_t l = 0; l < lanes; ++l) one(k, l);
        turn.advance();
    }
    for (std::ptrdiff_t l = 0; l < n - whole; ++l) one(whole, l);
    cdouble out[3];
    for (int m = 0; m < 3; ++m)
        for (std::ptrdiff_t l = 0; l < lanes; ++l) out[m] += cdouble(re[m][l], im[m][l]);
    return {out[0], out[1], out[2]};
}

}  // namespace

SARFOCUS_MULTIVERSION LineMoments tone_moments(const cdouble* signal, std::ptrdiff_t n, double slope, double middle) {
    return moments<2>(signal, n, slope, middle);
}

SARFOCUS_MULTIVERSION cdouble tone_sum(const cdouble* signal, std::ptrdiff_t n, double slope, double middle) {
    return moments<0>(signal, n, slope, middle).zeroth;
}

SARFOCUS_MULTIVERSION double signal_power(const cdouble* signal, std::ptrdiff_t n) {
    const auto* z = reinterpret_cast<const double*>(signal);
    double power[2 * lanes] = {};
    const std::ptrdiff_t whole = n / lanes * lanes;
    for (std::ptrdiff_t k = 0; k < whole; k += lanes)
        for (std::ptrdiff_t i = 0; i < 2 * lanes; ++i) power[i] += z[2 * k + i] * z[2 * k + i];
    for (std::ptrdiff_t i = 0; i < 2 * (n - whole); ++i) power[i] += z[2 * whole + i] * z[2 * whole + i];
    double out = 0.0;
    for (const double p : power) out += p;
    return out;
}

SARFOCUS_MULTIVERSION void turn_signal(cdouble* signal, std::ptrdiff_t n, double slope, double first) {
    auto* z = reinterpret_cast<double*>(signal);
    Turns turn(slope, -first);
    const auto one = [&](std::ptrdiff_t k, std::ptrdiff_t l) {
        const double re = z[2 * (k + l)];
        const double im = z[2 * (k + l) + 1];
        z[2 * (k + l)] = re * turn.re[l] - im * turn.im[l];
        z[2 * (k + l) + 1] = re * turn.im[l] + im * turn.re[l];
    };
    const std::ptrdiff_t whole = n / lanes * lanes;
    for (std::ptrdiff_t k = 0; k < whole; k += lanes) {
        for (std::ptrdiff_t l = 0; l < lanes; ++l) one(k, l);
        turn.advance();
    }
    for (std::ptrdiff_t l = 0; l < n - whole; ++l) one(whole, l);
}

SARFOCUS_MULTIVERSION void whiten(const cfloat* line, const float* weight, const cdouble* rotation, std::ptrdiff_t n, double slope,
                                  double first, cdouble* out) {
    const auto* d = reinterpret_cast<const float*>(line);
    const auto* r = reinterpret_cast<const double*>(rotation);
    auto* z = reinterpret_cast<double*>(out);
    if (rotation == nullptr)
        for (std::ptrdiff_t k = 0; k < n; ++k) {
            const float root = std::sqrt(weight[k]);
            z[2 * k] = static_cast<double>(root * d[2 * k]);
            z[2 * k + 1] = static_cast<double>(root * d[2 * k + 1]);
        }
    else
        for (std::ptrdiff_t k = 0; k < n; ++k) {
            const float root = std::sqrt(weight[k]);
            const auto re = static_cast<double>(root * d[2 * k]);
            const auto im = static_cast<double>(root * d[2 * k + 1]);
            z[2 * k] = re * r[2 * k] - im * r[2 * k + 1];
            z[2 * k + 1] = re * r[2 * k + 1] + im * r[2 * k];
        }
    if (slope != 0.0) turn_signal(out, n, slope, first);
}

SARFOCUS_MULTIVERSION void conjugate_products(const cfloat* a, const float* a_weight, const cfloat* b, const float* b_weight,
                                              std::ptrdiff_t n, cdouble* out) {
    const auto* p = reinterpret_cast<const float*>(a);
    const auto* q = reinterpret_cast<const float*>(b);
    auto* z = reinterpret_cast<double*>(out);
    for (std::ptrdiff_t k = 0; k < n; ++k) {
        const auto root = static_cast<double>(std::sqrt(a_weight[k] * b_weight[k]));
        const auto a_re = static_cast<double>(p[2 * k]);
        const auto a_im = static_cast<double>(p[2 * k + 1]);
        const auto b_re = static_cast<double>(q[2 * k]);
        const auto b_im = static_cast<double>(q[2 * k + 1]);
        z[2 * k] = root * (a_re * b_re + a_im * b_im);
        z[2 * k + 1] = root * (a_im * b_re - a_re * b_im);
    }
}

SARFOCUS_MULTIVERSION cdouble weighted_product(const cdouble* a, const float* a_weight, const cdouble* b, const float* b_weight,
                                               std::ptrdiff_t n) {
    const auto* p = reinterpret_cast<const double*>(a);
    const auto* q = reinterpret_cast<const double*>(b);
    double re[lanes] = {};
    double im[lanes] = {};
    const auto one = [&](std::ptrdiff_t k, std::ptrdiff_t l) {
        const auto root = static_cast<double>(std::sqrt(a_weight[k] * b_weight[k]));
        re[l] += root * (p[2 * k] * q[2 * k] + p[2 * k + 1] * q[2 * k + 1]);
        im[l] += root * (p[2 * k + 1] * q[2 * k] - p[2 * k] * q[2 * k + 1]);
    };
    const std::ptrdiff_t whole = n / lanes * lanes;
    for (std::ptrdiff_t k = 0; k < whole; k += lanes)
        for (std::ptrdiff_t l = 0; l < lanes; ++l) one(k + l, l);
    for (std::ptrdiff_t l = 0; l < n - whole; ++l) one(whole + l, l);
    cdouble out{};
    for (std::ptrdiff_t l = 0; l < lanes; ++l) out += cdouble(re[l], im[l]);
    return out;
}

SARFOCUS_MULTIVERSION void add_weighted(const cdouble* signal, const float* weight, std::ptrdiff_t n, cdouble gain, cdouble* sum) {
    const auto* z = reinterpret_cast<const double*>(signal);
    auto* s = reinterpret_cast<double*>(sum);
    const double gain_re = gain.real();
    const double gain_im = gain.imag();
    for (std::ptrdiff_t k = 0; k < n; ++k) {
        const auto root = static_cast<double>(std::sqrt(weight[k]));
        s[2 * k] += root * (gain_re * z[2 * k] - gain_im * z[2 * k + 1]);
        s[2 * k + 1] += root * (gain_re * z[2 * k + 1] + gain_im * z[2 * k]);
    }
}

}  // namespace sarfocus::autofocus::detail
