// The inner loops of factorised backprojection: lines of samples along range, real parts and imaginary parts apart.
#pragma once

#include <cstddef>
#include <cstdint>

#include <sarfocus/core/multiversion.hpp>

namespace sarfocus::focus::detail {

// register_bytes: of the vectors that are used; other widths than that of the processor give the same, slower.

constexpr std::ptrdiff_t line_lanes = 16;  ///< lengths of lines are multiples of it

/// A line's floats: `width` real parts, `width` imaginary parts, and a gap that keeps equal samples of successive lines out of one cache
/// set.
[[nodiscard]] constexpr std::ptrdiff_t line_floats(std::ptrdiff_t width) {
    return 2 * width + line_lanes;
}

/// out[i] = (cosine + j sine) sum_t weights[t] in[i + t], i < width.
void shift_line(const float* in_re, const float* in_im, const float* weights, std::ptrdiff_t taps, float cosine, float sine, float* out,
                std::ptrdiff_t width, std::ptrdiff_t register_bytes = sarfocus::detail::register_bytes);

/// line[i] *= exp(2 pi j (start + i * step)), cycles.
void turn_line(float* line, std::ptrdiff_t width, double start, double step);

/// out += sum_k weights[k] lines[k], k < count; every line `floats` long, and so far apart.
void add_lines(const float* lines, std::ptrdiff_t floats, const float* weights, std::ptrdiff_t count, float* out,
               std::ptrdiff_t register_bytes = sarfocus::detail::register_bytes);

/// (cosine, sine)[i] = exp(2 pi j cycles[i]).
void phasors(const double* cycles, std::ptrdiff_t n, float* cosine, float* sine);

/// Cubics round the bins of one row of pixels; see `add_rows`.
struct RowTable {
    static constexpr std::ptrdiff_t columns = 32;  ///< pixels of a row
    static constexpr std::ptrdiff_t margin = 15;   ///< pixels by which rows may be displaced against one another
    static constexpr std::ptrdiff_t span =
        columns + 2 * (margin + 1) + line_lanes;      ///< pixels that have bins, and room for whole registers
    static constexpr std::ptrdiff_t most_phases = 8;  ///< bins a pixel
    alignas(64) float cubic[most_phases][4][2][span];
};

/// Where the pixels of a row lie: pixel j, s = j - (columns - 1) / 2, is looked up `place[0] + place[1] s + place[2] s^2` bins behind the
/// bin `phase` of pixel j + shift, and turned by `cycles[0] + cycles[1] s + cycles[2] s^2 + cycles[3] s^3`.
struct RowTerms {
    float place[3];
    float cycles[4];
    std::int32_t shift;
    std::int32_t phase;
};

/// sums[row][re, im][column] += the rows looked up in the table.
void add_rows(const RowTable& table, const RowTerms* terms, std::ptrdiff_t rows, float* sums);

/// For bins b < count: (re, im)[b] = the line at place[b], in samples, 0 <= place. weights: the table of a BandKernel with its taps.
void sample_line(const float* in_re, const float* in_im, const float* weights, std::ptrdiff_t before, const double* place,
                 std::ptrdiff_t count, float* re, float* im, std::ptrdiff_t register_bytes = sarfocus::detail::register_bytes);

}  // namespace sarfocus::focus::detail
