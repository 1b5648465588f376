// The inner loops of backprojection, compiled once for each instruction set and chosen at run time.
#pragma once

#include <cstddef>
#include <cstdint>

namespace sarfocus::focus::detail {

/// One pulse as the kernels see it. Bin b of the profile table covers ranges within half a bin of first_range + (b - 1) / bins_per_metre
/// and holds the eight floats (re, im) x (1, x, x^2, x^3) of a cubic in x = the offset from the bin centre, in bins;
/// bins 0 and n_bin - 1 are zero and catch what lies outside the record.
struct PulseTable {
    const float* bins;
    std::int32_t n_bin;
    double first_range;
    double bins_per_metre;
    double tx[3];
    double rx[3];
};

/// Positions of up to `capacity` pixels, one array for each axis.
struct PixelBlock {
    static constexpr std::ptrdiff_t capacity = 256;
    alignas(64) double x[capacity];
    alignas(64) double y[capacity];
    alignas(64) double z[capacity];
    std::ptrdiff_t count;
};

/// Factors by direction: entry k = 1 … n_entry holds (re, im) for sines in [start + (k - 1) / scale, start + k / scale); entries 0 and
/// n_entry + 1 are zero and catch the rest.
struct AspectTable {
    const float* entries;
    const std::int32_t* run_end;  ///< [n_entry + 2], the last of the equal entries that follow one another from this one on
    std::int32_t n_entry;
    float axis[3];
    float start;
    float scale;
};

struct Kernels {
    const char* name;
    /// re[i], im[i] += s(R_i) exp(+j 2 pi R_i cycles_per_metre)
    void (*gather)(const PulseTable& pulse, const PixelBlock& pixels, double cycles_per_metre, bool monostatic, float* re, float* im);
    /// The same, every term times the entry of its direction.
    void (*gather_weighted)(const PulseTable& pulse, const PixelBlock& pixels, const AspectTable& aspect, double cycles_per_metre,
                            bool monostatic, float* re, float* im);
    /// The offsets and phases alone, for the adjoint: bin[i], x[i], and (c, s) = exp(-j 2 pi R_i cycles_per_metre).
    void (*locate)(const PulseTable& pulse, const PixelBlock& pixels, double cycles_per_metre, bool monostatic, std::int32_t* bin, float* x,
                   float* c, float* s);
};

extern const Kernels kernels_baseline;
#if defined(__x86_64__)
extern const Kernels kernels_avx2;
extern const Kernels kernels_avx512;
#endif

/// The fastest set this processor runs; the environment variable SARFOCUS_KERNELS (baseline, avx2, avx512) narrows the choice.
const Kernels& select_kernels();

}  // namespace sarfocus::focus::detail
