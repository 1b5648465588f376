#include "line_sums.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include <sarfocus/core/multiversion.hpp>

#include "turns.hpp"

namespace sarfocus::autofocus::detail {
namespace {

using sarfocus::detail::VectorOf;

constexpr std::ptrdiff_t lanes = Turns::lanes;

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

inline __attribute__((always_inline)) void exchange_neighbours(const VectorOf<double, 64>::Type& a, VectorOf<double, 64>::Type& out) {
    out = __builtin_shufflevector(a, a, 1, 0, 3, 2, 5, 4, 7, 6);
}

inline __attribute__((always_inline)) void exchange_neighbours(const VectorOf<double, 32>::Type& a, VectorOf<double, 32>::Type& out) {
    out = __builtin_shufflevector(a, a, 1, 0, 3, 2);
}

// The zeroth moment without a slope: products of neighbours in memory, sorted out at the end. `count` numbers at a time.
template <int count>
inline __attribute__((always_inline)) cdouble plain_sum(const cfloat* line, const cdouble* rotation, std::ptrdiff_t n) {
    const auto* d = reinterpret_cast<const float*>(line);
    const auto* r = reinterpret_cast<const double*>(rotation);
    using Floats = VectorOf<float, 4 * count>::Type;
    using Doubles = VectorOf<double, 8 * count>::Type;
    constexpr int parts = 2 * lanes / count;
    Doubles straight[parts] = {};
    Doubles crossed[parts] = {};
    const std::ptrdiff_t whole = n / lanes * lanes;
    for (std::ptrdiff_t k = 0; k < whole; k += lanes)
        for (int h = 0; h < parts; ++h) {
            Floats narrow;
            std::memcpy(&narrow, d + 2 * k + h * count, sizeof narrow);
            const Doubles a = __builtin_convertvector(narrow, Doubles);
            Doubles b;
            std::memcpy(&b, r + 2 * k + h * count, sizeof b);
            straight[h] += a * b;
            Doubles exchanged;
            exchange_neighbours(a, exchanged);
            crossed[h] += exchanged * b;
        }
    double re = 0.0;
    double im = 0.0;
    for (int h = 0; h < parts; ++h)
        for (int i = 0; i < count; ++i) {
            re += straight[h][i];
            im += i % 2 == 0 ? crossed[h][i] : -crossed[h][i];
        }
    for (std::ptrdiff_t k = whole; k < n; ++k) {
        re += static_cast<double>(d[2 * k]) * r[2 * k] + static_cast<double>(d[2 * k + 1]) * r[2 * k + 1];
        im += static_cast<double>(d[2 * k + 1]) * r[2 * k] - static_cast<double>(d[2 * k]) * r[2 * k + 1];
    }
    return {re, im};
}

// turned: the slope is not zero.
template <bool turned>
inline __attribute__((always_inline)) void add(const cfloat* line, std::ptrdiff_t n, cdouble gain, double slope, double middle,
                                               double share, cdouble* sum, double* own) {
    const auto* d = reinterpret_cast<const float*>(line);
    auto* s = reinterpret_cast<double*>(sum);
    const double gain_re = gain.real();
    const double gain_im = gain.imag();
    Turns turn(slope, middle);
    const std::ptrdiff_t whole = n / lanes * lanes;
    const auto one = [&](std::ptrdiff_t k, std::ptrdiff_t l) {
        const auto re = static_cast<double>(d[2 * k]);
        const auto im = static_cast<double>(d[2 * k + 1]);
        const double factor_re = turned ? gain_re * turn.re[l] - gain_im * turn.im[l] : gain_re;
        const double factor_im = turned ? gain_re * turn.im[l] + gain_im * turn.re[l] : gain_im;
        s[2 * k] += re * factor_re - im * factor_im;
        s[2 * k + 1] += re * factor_im + im * factor_re;
        own[k] += share * (re * re + im * im);
    };
    for (std::ptrdiff_t k = 0; k < whole; k += lanes) {
        for (std::ptrdiff_t l = 0; l < lanes; ++l) one(k + l, l);
        if constexpr (turned) turn.advance();
    }
    for (std::ptrdiff_t k = whole; k < n; ++k) one(k, k - whole);
}

}  // namespace

SARFOCUS_MULTIVERSION LineMoments line_moments(const cfloat* line, const cdouble* rotation, std::ptrdiff_t n, double slope, double middle) {
    return sums<2>(line, rotation, n, slope, middle);
}

SARFOCUS_MULTIVERSION cdouble line_sum(const cfloat* line, const cdouble* rotation, std::ptrdiff_t n, double slope, double middle,
                                       std::ptrdiff_t register_bytes) {
    if (slope != 0.0) return sums<0>(line, rotation, n, slope, middle).zeroth;
    return register_bytes == 64 ? plain_sum<8>(line, rotation, n) : plain_sum<4>(line, rotation, n);
}

SARFOCUS_MULTIVERSION void add_line(const cfloat* line, std::ptrdiff_t n, cdouble gain, double slope, double middle, double share,
                                    cdouble* sum, double* own) {
    if (slope == 0.0)
        add<false>(line, n, gain, slope, middle, share, sum, own);
    else
        add<true>(line, n, gain, slope, middle, share, sum, own);
}

SARFOCUS_MULTIVERSION LinePower line_power(const cfloat* line, std::ptrdiff_t n) {
    const auto* d = reinterpret_cast<const float*>(line);
    double power[2 * lanes] = {};
    std::ptrdiff_t zeros = 0;
    const std::ptrdiff_t whole = n / lanes * lanes;
    for (std::ptrdiff_t k = 0; k < whole; k += lanes)
        for (std::ptrdiff_t i = 0; i < 2 * lanes; ++i) {
            const auto value = static_cast<double>(d[2 * k + i]);
            power[i] += value * value;
        }
    for (std::ptrdiff_t k = 0; k < n; ++k) zeros += static_cast<std::ptrdiff_t>(d[2 * k] == 0.0F && d[2 * k + 1] == 0.0F);
    LinePower out{0.0, n - zeros};
    for (const double p : power) out.sum += p;
    for (std::ptrdiff_t i = 2 * whole; i < 2 * n; ++i) out.sum += static_cast<double>(d[i]) * static_cast<double>(d[i]);
    return out;
}

SARFOCUS_MULTIVERSION LineIntensity line_intensity(const cfloat* line, std::ptrdiff_t n) {
    const auto* d = reinterpret_cast<const float*>(line);
    const auto intensity = [d](std::ptrdiff_t k) {
        const auto re = static_cast<double>(d[2 * k]);
        const auto im = static_cast<double>(d[2 * k + 1]);
        return re * re + im * im;
    };
    double sum[lanes] = {};
    double square[lanes] = {};
    const std::ptrdiff_t whole = n / lanes * lanes;
    for (std::ptrdiff_t k = 0; k < whole; k += lanes)
        for (std::ptrdiff_t l = 0; l < lanes; ++l) {
            const double value = intensity(k + l);
            sum[l] += value;
            square[l] += value * value;
        }
    for (std::ptrdiff_t k = whole; k < n; ++k) {
        sum[k - whole] += intensity(k);
        square[k - whole] += intensity(k) * intensity(k);
    }
    LineIntensity out;
    for (std::ptrdiff_t l = 0; l < lanes; ++l) {
        out.sum += sum[l];
        out.square += square[l];
    }
    return out;
}

SARFOCUS_MULTIVERSION void add_scatter(const cfloat* line, const cdouble* rotation, std::ptrdiff_t n, cdouble gain, double* scatter) {
    const auto* d = reinterpret_cast<const float*>(line);
    const auto* r = reinterpret_cast<const double*>(rotation);
    const double gain_re = gain.real();
    const double gain_im = gain.imag();
    for (std::ptrdiff_t k = 0; k < n; ++k) {
        const auto re = static_cast<double>(d[2 * k]);
        const auto im = static_cast<double>(d[2 * k + 1]);
        const double across = (gain_re * im + gain_im * re) * r[2 * k] - (gain_re * re - gain_im * im) * r[2 * k + 1];
        scatter[k] += across * across;
    }
}

SARFOCUS_MULTIVERSION std::ptrdiff_t strongest_sample(const cfloat* line, std::ptrdiff_t n) {
    constexpr std::ptrdiff_t wide = 16;
    const auto* d = reinterpret_cast<const float*>(line);
    const auto power = [d](std::ptrdiff_t k) { return d[2 * k] * d[2 * k] + d[2 * k + 1] * d[2 * k + 1]; };
    float greatest[wide] = {};
    const std::ptrdiff_t whole = n / wide * wide;
    for (std::ptrdiff_t k = 0; k < whole; k += wide)
        for (std::ptrdiff_t l = 0; l < wide; ++l) greatest[l] = std::max(greatest[l], power(k + l));
    // Rounding may differ between the vectorised loop and this one: what comes within it of the greatest is looked at again.
    const float most = *std::max_element(greatest, greatest + wide) * (1.0F - 1e-6F);
    std::ptrdiff_t out = 0;
    for (std::ptrdiff_t k = 0; k < n; ++k)
        if (power(k) >= most && power(k) > power(out)) out = k;
    return out;
}

SARFOCUS_MULTIVERSION void turn_line(const cfloat* line, std::ptrdiff_t n, double slope, double first, cfloat* out) {
    const auto* d = reinterpret_cast<const float*>(line);
    auto* o = reinterpret_cast<float*>(out);
    Turns turn(-slope, -first);
    const auto one = [&](std::ptrdiff_t k, std::ptrdiff_t l) {
        const auto re = static_cast<float>(turn.re[l]);
        const auto im = static_cast<float>(turn.im[l]);
        o[2 * k] = d[2 * k] * re - d[2 * k + 1] * im;
        o[2 * k + 1] = d[2 * k] * im + d[2 * k + 1] * re;
    };
    const std::ptrdiff_t whole = n / lanes * lanes;
    for (std::ptrdiff_t k = 0; k < whole; k += lanes) {
        for (std::ptrdiff_t l = 0; l < lanes; ++l) one(k + l, l);
        turn.advance();
    }
    for (std::ptrdiff_t k = whole; k < n; ++k) one(k, k - whole);
}

}  // namespace sarfocus::autofocus::detail
