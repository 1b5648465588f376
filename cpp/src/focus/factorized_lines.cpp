#include "focus/factorized_lines.hpp"

#include <cmath>
#include <cstring>

#include <sarfocus/core/multiversion.hpp>

#include "focus/band_kernel.hpp"

namespace sarfocus::focus::detail {
namespace {

template <std::ptrdiff_t count>
using Lanes = sarfocus::detail::VectorOf<float, count* static_cast<std::ptrdiff_t>(sizeof(float))>::Type;

static_assert(BandKernel::most_taps == line_lanes);

#define SARFOCUS_INLINE inline __attribute__((always_inline))

template <class Vector>
SARFOCUS_INLINE void load(const float* from, Vector& to) {
    std::memcpy(&to, from, sizeof(Vector));
}

template <class Vector>
SARFOCUS_INLINE void store(const Vector& from, float* to) {
    std::memcpy(to, &from, sizeof(Vector));
}

// sin and cos of 2 pi f on |f| <= 1/2: those of pi f by polynomials of least maximum error (3e-9, 5e-8), then the double angle.
SARFOCUS_INLINE void turn(float f, float& cosine, float& sine) {
    const float z = f * f;
    const float s = f * (3.1415925f + z * (-5.167707f + z * (2.5500314f + z * (-0.5980452f + z * 0.07722016f))));
    const float c = 0.99999994f + z * (-4.934793f + z * (4.058412f + z * (-1.3318809f + z * 0.21969818f)));
    cosine = c * c - s * s;
    sine = 2.0f * s * c;
}

template <std::ptrdiff_t lanes, int n>
SARFOCUS_INLINE void shift_block(const float* in_re, const float* in_im, const float* weights, std::ptrdiff_t taps, float cosine,
                                 float sine, float* out_re, float* out_im) {
    Lanes<lanes> re[n] = {};
    Lanes<lanes> im[n] = {};
    for (std::ptrdiff_t t = 0; t < taps; ++t) {
        const float w = weights[t];
        for (int k = 0; k < n; ++k) {
            Lanes<lanes> x;
            Lanes<lanes> y;
            load(in_re + t + k * lanes, x);
            load(in_im + t + k * lanes, y);
            re[k] += w * x;
            im[k] += w * y;
        }
    }
    for (int k = 0; k < n; ++k) {
        const Lanes<lanes> x = cosine * re[k] - sine * im[k];
        const Lanes<lanes> y = sine * re[k] + cosine * im[k];
        store(x, out_re + k * lanes);
        store(y, out_im + k * lanes);
    }
}

// Sums of n registers side by side.
template <std::ptrdiff_t lanes, int n>
SARFOCUS_INLINE void shift_all(const float* in_re, const float* in_im, const float* weights, std::ptrdiff_t taps, float cosine, float sine,
                               float* out, std::ptrdiff_t width) {
    std::ptrdiff_t i = 0;
    for (; i + n * lanes <= width; i += n * lanes)
        shift_block<lanes, n>(in_re + i, in_im + i, weights, taps, cosine, sine, out + i, out + width + i);
    for (; i < width; i += lanes) shift_block<lanes, 1>(in_re + i, in_im + i, weights, taps, cosine, sine, out + i, out + width + i);
}

template <std::ptrdiff_t lanes, int n>
SARFOCUS_INLINE void add_block(const float* lines, std::ptrdiff_t floats, const float* weights, std::ptrdiff_t count, float* out) {
    Lanes<lanes> sum[n];
    for (int k = 0; k < n; ++k) load(out + k * lanes, sum[k]);
    for (std::ptrdiff_t p = 0; p < count; ++p) {
        const float w = weights[p];
        const float* line = lines + p * floats;
        for (int k = 0; k < n; ++k) {
            Lanes<lanes> x;
            load(line + k * lanes, x);
            sum[k] += w * x;
        }
    }
    for (int k = 0; k < n; ++k) store(sum[k], out + k * lanes);
}

template <std::ptrdiff_t lanes, int n>
SARFOCUS_INLINE void add_all(const float* lines, std::ptrdiff_t floats, const float* weights, std::ptrdiff_t count, float* out) {
    std::ptrdiff_t i = 0;
    for (; i + n * lanes <= floats; i += n * lanes) add_block<lanes, n>(lines + i, floats, weights, count, out + i);
    for (; i < floats; i += lanes) add_block<lanes, 1>(lines + i, floats, weights, count, out + i);
}

// out[k] = the sum of the lanes of v[k]: halves of two registers are added into one, until one is left.
SARFOCUS_INLINE void sum_each(Lanes<16> (&v)[16], Lanes<16>& out) {
    for (int k = 0; k < 8; ++k)
        v[k] = __builtin_shufflevector(v[k], v[k + 8], 0, 1, 2, 3, 4, 5, 6, 7, 16, 17, 18, 19, 20, 21, 22, 23) +
               __builtin_shufflevector(v[k], v[k + 8], 8, 9, 10, 11, 12, 13, 14, 15, 24, 25, 26, 27, 28, 29, 30, 31);
    for (int k = 0; k < 4; ++k)
        v[k] = __builtin_shufflevector(v[k], v[k + 4], 0, 1, 2, 3, 16, 17, 18, 19, 8, 9, 10, 11, 24, 25, 26, 27) +
               __builtin_shufflevector(v[k], v[k + 4], 4, 5, 6, 7, 20, 21, 22, 23, 12, 13, 14, 15, 28, 29, 30, 31);
    for (int k = 0; k < 2; ++k)
        v[k] = __builtin_shufflevector(v[k], v[k + 2], 0, 1, 16, 17, 4, 5, 20, 21, 8, 9, 24, 25, 12, 13, 28, 29) +
               __builtin_shufflevector(v[k], v[k + 2], 2, 3, 18, 19, 6, 7, 22, 23, 10, 11, 26, 27, 14, 15, 30, 31);
    out = __builtin_shufflevector(v[0], v[1], 0, 16, 2, 18, 4, 20, 6, 22, 8, 24, 10, 26, 12, 28, 14, 30) +
          __builtin_shufflevector(v[0], v[1], 1, 17, 3, 19, 5, 21, 7, 23, 9, 25, 11, 27, 13, 29, 15, 31);
}

SARFOCUS_INLINE void sum_each(Lanes<8> (&v)[8], Lanes<8>& out) {
    for (int k = 0; k < 4; ++k)
        v[k] = __builtin_shufflevector(v[k], v[k + 4], 0, 1, 2, 3, 8, 9, 10, 11) +
               __builtin_shufflevector(v[k], v[k + 4], 4, 5, 6, 7, 12, 13, 14, 15);
    for (int k = 0; k < 2; ++k)
        v[k] = __builtin_shufflevector(v[k], v[k + 2], 0, 1, 8, 9, 4, 5, 12, 13) +
               __builtin_shufflevector(v[k], v[k + 2], 2, 3, 10, 11, 6, 7, 14, 15);
    out = __builtin_shufflevector(v[0], v[1], 0, 8, 2, 10, 4, 12, 6, 14) + __builtin_shufflevector(v[0], v[1], 1, 9, 3, 11, 5, 13, 7, 15);
}

SARFOCUS_INLINE void sum_each(Lanes<4> (&v)[4], Lanes<4>& out) {
    for (int k = 0; k < 2; ++k)
        v[k] = __builtin_shufflevector(v[k], v[k + 2], 0, 1, 4, 5) + __builtin_shufflevector(v[k], v[k + 2], 2, 3, 6, 7);
    out = __builtin_shufflevector(v[0], v[1], 0, 4, 2, 6) + __builtin_shufflevector(v[0], v[1], 1, 5, 3, 7);
}

template <std::ptrdiff_t lanes>
SARFOCUS_INLINE void sample_all(const float* in_re, const float* in_im, const float* weights, std::ptrdiff_t before, const double* place,
                                std::ptrdiff_t count, float* re, float* im) {
    constexpr std::ptrdiff_t taps = BandKernel::most_taps;
    constexpr std::ptrdiff_t group = lanes / 2;  // bins whose real and imaginary parts are summed together
    for (std::ptrdiff_t at = 0; at < count; at += group) {
        Lanes<lanes> products[lanes] = {};
        for (std::ptrdiff_t k = 0; k < group && at + k < count; ++k) {
            const auto whole = static_cast<std::int32_t>(place[at + k]);
            const double entry = (place[at + k] - static_cast<double>(whole)) * static_cast<double>(BandKernel::fractions);
            const auto index = static_cast<std::int32_t>(entry);
            const auto part = static_cast<float>(entry - static_cast<double>(index));
            const float* row = weights + static_cast<std::ptrdiff_t>(index) * taps;
            for (std::ptrdiff_t t = 0; t < taps; t += lanes) {
                Lanes<lanes> low;
                Lanes<lanes> high;
                Lanes<lanes> x;
                Lanes<lanes> y;
                load(row + t, low);
                load(row + taps + t, high);
                load(in_re + whole - before + t, x);
                load(in_im + whole - before + t, y);
                low += part * (high - low);
                products[k] += low * x;
                products[group + k] += low * y;
            }
        }
        Lanes<lanes> sums;
        sum_each(products, sums);
        alignas(64) float out[lanes];
        store(sums, out);
        const std::ptrdiff_t n = count - at < group ? count - at : group;
        for (std::ptrdiff_t k = 0; k < n; ++k) {
            re[at + k] = out[k];
            im[at + k] = out[group + k];
        }
    }
}

}  // namespace

SARFOCUS_MULTIVERSION void shift_line(const float* in_re, const float* in_im, const float* weights, std::ptrdiff_t taps, float cosine,
                                      float sine, float* out, std::ptrdiff_t width, std::ptrdiff_t register_bytes) {
    if (register_bytes == 64) return shift_all<16, 4>(in_re, in_im, weights, taps, cosine, sine, out, width);
    if (register_bytes == 32) return shift_all<8, 6>(in_re, in_im, weights, taps, cosine, sine, out, width);
    shift_all<4, 6>(in_re, in_im, weights, taps, cosine, sine, out, width);
}

SARFOCUS_MULTIVERSION void turn_line(float* line, std::ptrdiff_t width, double start, double step) {
    float* __restrict re = line;
    float* __restrict im = line + width;
    const double base = start - std::nearbyint(start);
#pragma omp simd
    for (std::ptrdiff_t i = 0; i < width; ++i) {
        const double cycles = base + static_cast<double>(static_cast<std::int32_t>(i)) * step;
        float c;
        float s;
        turn(static_cast<float>(cycles - __builtin_floor(cycles + 0.5)), c, s);
        const float x = re[i];
        re[i] = x * c - im[i] * s;
        im[i] = x * s + im[i] * c;
    }
}

SARFOCUS_MULTIVERSION void add_lines(const float* lines, std::ptrdiff_t floats, const float* weights, std::ptrdiff_t count, float* out,
                                     std::ptrdiff_t register_bytes) {
    if (register_bytes == 64) return add_all<16, 8>(lines, floats, weights, count, out);
    if (register_bytes == 32) return add_all<8, 12>(lines, floats, weights, count, out);
    add_all<4, 12>(lines, floats, weights, count, out);
}

SARFOCUS_MULTIVERSION void phasors(const double* cycles, std::ptrdiff_t n, float* cosine, float* sine) {
#pragma omp simd
    for (std::ptrdiff_t i = 0; i < n; ++i) turn(static_cast<float>(cycles[i] - __builtin_floor(cycles[i] + 0.5)), cosine[i], sine[i]);
}

SARFOCUS_MULTIVERSION void add_rows(const RowTable& table, const RowTerms* terms, std::ptrdiff_t rows, float* sums) {
    constexpr std::ptrdiff_t n = RowTable::columns;
    constexpr float middle = 0.5f * static_cast<float>(n - 1);
    constexpr float to_nearest = 12582912.0f;  // 1.5 * 2^23: adding and subtracting it rounds
    for (std::ptrdiff_t i = 0; i < rows; ++i) {
        const RowTerms& row = terms[i];
        const float x0 = row.place[0], x1 = row.place[1], x2 = row.place[2];
        const float f0 = row.cycles[0], f1 = row.cycles[1], f2 = row.cycles[2], f3 = row.cycles[3];
        const float(*cubic)[2][RowTable::span] = table.cubic[row.phase];
        const std::ptrdiff_t at = RowTable::margin + 1 + row.shift;
        const float* __restrict r0 = cubic[0][0] + at;
        const float* __restrict i0 = cubic[0][1] + at;
        const float* __restrict r1 = cubic[1][0] + at;
        const float* __restrict i1 = cubic[1][1] + at;
        const float* __restrict r2 = cubic[2][0] + at;
        const float* __restrict i2 = cubic[2][1] + at;
        const float* __restrict r3 = cubic[3][0] + at;
        const float* __restrict i3 = cubic[3][1] + at;
        float* __restrict re = sums + 2 * n * i;
        float* __restrict im = re + n;
#pragma omp simd
        for (std::int32_t j = 0; j < static_cast<std::int32_t>(n); ++j) {
            const float s = static_cast<float>(j) - middle;
            const float x = x0 + s * (x1 + s * x2);
            const float f = f0 + s * (f1 + s * (f2 + s * f3));
            float c;
            float d;
            turn(f - ((f + to_nearest) - to_nearest), c, d);
            const float a = r0[j] + x * (r1[j] + x * (r2[j] + x * r3[j]));
            const float b = i0[j] + x * (i1[j] + x * (i2[j] + x * i3[j]));
            re[j] += a * c - b * d;
            im[j] += a * d + b * c;
        }
    }
}

SARFOCUS_MULTIVERSION void sample_line(const float* in_re, const float* in_im, const float* weights, std::ptrdiff_t before,
                                       const double* place, std::ptrdiff_t count, float* re, float* im, std::ptrdiff_t register_bytes) {
    if (register_bytes == 64) return sample_all<16>(in_re, in_im, weights, before, place, count, re, im);
    if (register_bytes == 32) return sample_all<8>(in_re, in_im, weights, before, place, count, re, im);
    sample_all<4>(in_re, in_im, weights, before, place, count, re, im);
}

}  // namespace sarfocus::focus::detail
