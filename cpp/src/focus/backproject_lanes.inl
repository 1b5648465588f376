// Vectors of one instruction set, and what differs between the sets: looking up bins. Included by backproject_kernel.inl.
#if defined(__AVX2__)
#include <immintrin.h>
#endif

#define SARFOCUS_INLINE inline __attribute__((always_inline))

namespace sarfocus::focus::detail {
namespace {

#if defined(__AVX512F__)
constexpr std::ptrdiff_t width = 16;
constexpr ProfileLayout layout{};
#elif defined(__AVX2__)
constexpr std::ptrdiff_t width = 8;
constexpr ProfileLayout layout{ProfileLayout::chunk + 4};  // four bins from anywhere on are one load
#else
constexpr std::ptrdiff_t width = 4;
constexpr ProfileLayout layout{};
#endif
using Floats = float __attribute__((vector_size(width * sizeof(float))));
using Indices = std::int32_t __attribute__((vector_size(width * sizeof(float))));
using FloatsInMemory = float __attribute__((vector_size(width * sizeof(float)), may_alias));

// Added to a number of lesser magnitude by far, they leave the nearest whole number in the low bits.
constexpr float rounder = 12582912.0f;            // 1.5 x 2^23
constexpr double rounder64 = 6755399441055744.0;  // 1.5 x 2^52

SARFOCUS_INLINE Floats load(const float* p) {
    return *reinterpret_cast<const FloatsInMemory*>(p);
}

SARFOCUS_INLINE void store(float* p, Floats v) {
    *reinterpret_cast<FloatsInMemory*>(p) = v;
}

SARFOCUS_INLINE Floats broadcast(float x) {
#if defined(__AVX512F__)
    return _mm512_set1_ps(x);
#elif defined(__AVX2__)
    return _mm256_set1_ps(x);
#else
    return Floats{x, x, x, x};
#endif
}

SARFOCUS_INLINE float nearest_whole(float x) {
    return (x + rounder) - rounder;
}

SARFOCUS_INLINE double nearest_whole(double x) {
    return (x + rounder64) - rounder64;
}

// Whole numbers and what is left of them, |x| < 2^22.
struct Rounded {
    Indices whole;  // + 2^22 and more bits above, of which look-ups within a window see nothing
    Floats rest;
};

SARFOCUS_INLINE Rounded rounded(Floats x) {
    const Floats t = x + rounder;
#if defined(__AVX2__) && !defined(__AVX512F__)
    const Floats nearest = _mm256_round_ps(x, _MM_FROUND_TO_NEAREST_INT | _MM_FROUND_NO_EXC);  // without waiting for t
#else
    const Floats nearest = t - rounder;
#endif
    return {reinterpret_cast<Indices>(t), x - nearest};
}

SARFOCUS_INLINE Indices integers(Indices whole) {
    constexpr std::int32_t bits_of_rounder = 0x4B400000;
    return whole - bits_of_rounder;
}

// How far apart the bins of one vector lie: in one bin, a little beyond its edges at most, within a window of half a register of bins,
// each half of the lanes within such a window of its own, within one register (AVX-512: two), one twice as wide, or anywhere.
enum class Reach { single, close, halves, near, far, anywhere };

// Coefficients of the bins `index`. They count from the bin where the window begins, and only their low bits are looked at: where they lie
// outside of it, it holds zeros alone. Where the reach is `anywhere`, they count from bin 0. first: where that bin's first coefficient lies
// in the table.
template <Reach reach>
struct LookUp;

// Bins over which the places of one vector may spread to be taken from the cubic of one: a tenth of a bin beyond its edges that still errs
// little, by -69 dB instead of -75 where they spread so far. Twice as much would be 8 % faster, for -66 dB.
constexpr float single_span = 0.2f;

template <>
struct LookUp<Reach::single> {
    const float* bin;

    SARFOCUS_INLINE LookUp(const float* bins, std::int32_t first, Indices /*index*/) : bin(bins + first) {}

    SARFOCUS_INLINE Floats coefficient(std::ptrdiff_t k) const { return broadcast(bin[k * layout.pitch]); }
};

template <>
struct LookUp<Reach::anywhere> {
    const float* table;
    Indices offset;

    SARFOCUS_INLINE LookUp(const float* bins, std::int32_t /*first*/, Indices index)
        : table(bins),
          offset((index & -ProfileLayout::chunk) * (layout.chunk_floats() / ProfileLayout::chunk) + (index & (ProfileLayout::chunk - 1))) {}

    SARFOCUS_INLINE Floats coefficient(std::ptrdiff_t k) const {
        const float* p = table + k * layout.pitch;
#if defined(__AVX512F__)
        return _mm512_mask_i32gather_ps(_mm512_setzero_ps(), 0xFFFF, reinterpret_cast<__m512i>(offset), p, 4);
#elif defined(__AVX2__)
        return _mm256_i32gather_ps(p, reinterpret_cast<__m256i>(offset), 4);
#else
        return Floats{p[offset[0]], p[offset[1]], p[offset[2]], p[offset[3]]};
#endif
    }
};

#if defined(__AVX512F__)
constexpr Reach narrowest_window = Reach::near;
constexpr Reach widest_window = Reach::far;
constexpr std::int32_t window_step = 16;  // windows begin at multiples of it

template <>
struct LookUp<Reach::near> {
    const float* window;
    __m512i index;

    SARFOCUS_INLINE LookUp(const float* bins, std::int32_t first, Indices at)
        : window(bins + first), index(reinterpret_cast<__m512i>(at)) {}

    SARFOCUS_INLINE Floats coefficient(std::ptrdiff_t k) const {
        const float* p = window + k * layout.pitch;
        return _mm512_permutex2var_ps(load(p), index, load(p + layout.chunk_floats()));
    }
};

template <>
struct LookUp<Reach::far> {
    LookUp<Reach::near> low;
    LookUp<Reach::near> high;
    __mmask16 upper;

    SARFOCUS_INLINE LookUp(const float* bins, std::int32_t first, Indices at)
        : low(bins, first, at),
          high(bins, first + 2 * layout.chunk_floats(), at),
          upper(_mm512_test_epi32_mask(low.index, _mm512_set1_epi32(32))) {}

    SARFOCUS_INLINE Floats coefficient(std::ptrdiff_t k) const {
        return _mm512_mask_blend_ps(upper, low.coefficient(k), high.coefficient(k));
    }
};
#elif defined(__AVX2__)
constexpr Reach narrowest_window = Reach::close;
constexpr Reach widest_window = Reach::far;
constexpr std::int32_t window_step = 1;

// Bins are looked up byte by byte, four bins at a time: the only permutation that every processor with AVX2 does at once; those of whole
// numbers take four times as long on some (Zen 2).
using Bytes = __m256i;

// In every byte of a lane the place of that byte of bin `index` of four; of later bins, 16 and more of each four.
SARFOCUS_INLINE Bytes bytes_of_bins(Indices index) {
    const __m256i lowest =
        _mm256_setr_epi8(0, 0, 0, 0, 4, 4, 4, 4, 8, 8, 8, 8, 12, 12, 12, 12, 0, 0, 0, 0, 4, 4, 4, 4, 8, 8, 8, 8, 12, 12, 12, 12);
    return _mm256_slli_epi32(_mm256_shuffle_epi8(reinterpret_cast<__m256i>(index), lowest), 2);
}

SARFOCUS_INLINE Bytes four_bins(const float* p) {
    return _mm256_castps_si256(_mm256_broadcast_ps(reinterpret_cast<const __m128*>(p)));
}

// Where the bin that many behind the one at `first` lies, in the same chunk or the next.
SARFOCUS_INLINE std::int32_t bins_on(std::int32_t first, std::int32_t count) {
    const std::int32_t within = first % layout.chunk_floats();
    return first + count + (within + count < ProfileLayout::chunk ? 0 : layout.chunk_floats() - ProfileLayout::chunk);
}

template <>
struct LookUp<Reach::close> {
    const float* window;
    Bytes at;

    SARFOCUS_INLINE LookUp(const float* bins, std::int32_t first, Indices index)
        : window(bins + first), at(_mm256_add_epi32(bytes_of_bins(index), _mm256_set1_epi32(0x03020100))) {}

    SARFOCUS_INLINE Floats coefficient(std::ptrdiff_t k) const {
        return _mm256_castsi256_ps(_mm256_shuffle_epi8(four_bins(window + k * layout.pitch), at));
    }
};

// What is to be added to the bytes of bins that count from the lower of two windows, by how far the window of the upper half of the lanes
// lies above that of the lower half, from -7 on.
struct alignas(32) BytesOfHalves {
    std::int32_t lanes[15][8];
};

constexpr BytesOfHalves bytes_of_halves() {
    BytesOfHalves out{};
    for (std::int32_t apart = -7; apart <= 7; ++apart)
        for (std::int32_t lane = 0; lane < 8; ++lane) {
            const std::int32_t above = lane < 4 ? (apart < 0 ? -apart : 0) : (apart > 0 ? apart : 0);
            out.lanes[apart + 7][lane] = 0x03020100 - 0x04040404 * above;
        }
    return out;
}

template <>
struct LookUp<Reach::halves> {
    static constexpr BytesOfHalves bytes = bytes_of_halves();
    const float* lower;
    const float* upper;
    Bytes at;

    SARFOCUS_INLINE LookUp(const float* bins, std::int32_t first, std::int32_t first_of_upper, std::int32_t apart, Indices index)
        : lower(bins + first),
          upper(bins + first_of_upper),
          at(_mm256_add_epi32(bytes_of_bins(index), _mm256_load_si256(reinterpret_cast<const __m256i*>(bytes.lanes[apart + 7])))) {}

    SARFOCUS_INLINE Floats coefficient(std::ptrdiff_t k) const {
        const std::ptrdiff_t p = k * layout.pitch;
        const __m256 both = _mm256_insertf128_ps(_mm256_castps128_ps256(_mm_loadu_ps(lower + p)), _mm_loadu_ps(upper + p), 1);
        return _mm256_castsi256_ps(_mm256_shuffle_epi8(_mm256_castps_si256(both), at));
    }
};

// A byte whose place has its highest bit set becomes zero: so every four bins give what is theirs, and zero else. Adding 0x70 sets
// that bit for places from 16 on and leaves alone the four bits that are looked at.
template <>
struct LookUp<Reach::near> {
    const float* window[2];
    Bytes at[2];

    SARFOCUS_INLINE LookUp(const float* bins, std::int32_t first, Indices index)
        : window{bins + first, bins + bins_on(first, 4)},
          at{_mm256_add_epi32(bytes_of_bins(index), _mm256_set1_epi32(0x73727170)),
             _mm256_xor_si256(at[0], _mm256_set1_epi32(static_cast<std::int32_t>(0x80808080U)))} {}

    SARFOCUS_INLINE Floats coefficient(std::ptrdiff_t k) const {
        const std::ptrdiff_t p = k * layout.pitch;
        return _mm256_castsi256_ps(
            _mm256_or_si256(_mm256_shuffle_epi8(four_bins(window[0] + p), at[0]), _mm256_shuffle_epi8(four_bins(window[1] + p), at[1])));
    }
};

template <>
struct LookUp<Reach::far> {
    const float* window[4];
    Bytes at[4];

    SARFOCUS_INLINE LookUp(const float* bins, std::int32_t first, Indices index) {
        const Bytes places = bytes_of_bins(index);
        for (std::int32_t q = 0; q < 4; ++q) {
            window[q] = bins + bins_on(first, 4 * q);
            at[q] = _mm256_add_epi32(_mm256_xor_si256(places, _mm256_set1_epi32(0x10101010 * q)), _mm256_set1_epi32(0x73727170));
        }
    }

    SARFOCUS_INLINE Floats coefficient(std::ptrdiff_t k) const {
        const std::ptrdiff_t p = k * layout.pitch;
        Bytes out[2];
        for (std::ptrdiff_t q = 0; q < 2; ++q)
            out[q] = _mm256_or_si256(_mm256_shuffle_epi8(four_bins(window[2 * q] + p), at[2 * q]),
                                     _mm256_shuffle_epi8(four_bins(window[2 * q + 1] + p), at[2 * q + 1]));
        return _mm256_castsi256_ps(_mm256_or_si256(out[0], out[1]));
    }
};
#else
constexpr Reach narrowest_window = Reach::anywhere;
constexpr Reach widest_window = Reach::anywhere;
constexpr std::int32_t window_step = 4;
#endif

// Where the first coefficient of a bin >= 0 lies.
SARFOCUS_INLINE std::int32_t place_in_table(std::int32_t bin) {
    constexpr std::int32_t chunk = ProfileLayout::chunk;
    return (bin & -chunk) * (layout.chunk_floats() / chunk) + (bin & (chunk - 1));
}

// Bins of a window.
constexpr std::int32_t window_bins(Reach reach) {
    if (reach == Reach::single) return 1;
    if (reach == Reach::close || reach == Reach::halves) return 4;
    return static_cast<std::int32_t>(width) * (reach == Reach::near ? 1 : 2) * (window_step > 1 ? 2 : 1);
}

// How far apart the places may lie, margins included, that a window holds wherever they begin: it begins at the multiple of `window_step`
// at or below the bin that the least of them may be rounded to.
constexpr float window_span(Reach reach) {
    return static_cast<float>(window_bins(reach) - (window_step > 1 ? window_step : 0) - 1);
}

struct Complex {
    Floats re;
    Floats im;
};

SARFOCUS_INLINE Complex operator*(Complex a, Complex b) {
    return {a.re * b.re - a.im * b.im, a.re * b.im + a.im * b.re};
}

// a * b in the place of a, the imaginary part first: then no register has to be copied.
SARFOCUS_INLINE void turn_by(Complex& a, Complex b) {
    Floats t = a.im * b.im;
    a.im = a.im * b.re + a.re * b.im;
#if defined(__AVX2__)
    asm("" : "+v"(a.im), "+v"(t));  // keeps the order
#endif
    a.re = a.re * b.re - t;
}

// exp(2 pi j cycles), |cycles| < 2^22, by polynomials of least maximum error (3e-9, 5e-8) for half the angle.
SARFOCUS_INLINE Complex turn(Floats cycles) {
    const Floats f = rounded(cycles).rest;
    const Floats z = f * f;
    const Floats s = f * (3.1415925f + z * (-5.167707f + z * (2.5500314f + z * (-0.5980452f + z * 0.07722016f))));
    const Floats c = 0.99999994f + z * (-4.934793f + z * (4.058412f + z * (-1.3318809f + z * 0.21969818f)));
    return {c * c - s * s, 2.0f * s * c};
}

#if defined(__AVX512F__)
// sin(2 pi k / 32); cosines from k = 8 on.
alignas(64) constexpr float thirty_seconds[40] = {
    0.0f,  0.19509032f,  0.38268343f,  0.55557023f,  0.70710678f,  0.83146961f,  0.92387953f,  0.98078528f,
    1.0f,  0.98078528f,  0.92387953f,  0.83146961f,  0.70710678f,  0.55557023f,  0.38268343f,  0.19509032f,
    0.0f,  -0.19509032f, -0.38268343f, -0.55557023f, -0.70710678f, -0.83146961f, -0.92387953f, -0.98078528f,
    -1.0f, -0.98078528f, -0.92387953f, -0.83146961f, -0.70710678f, -0.55557023f, -0.38268343f, -0.19509032f,
    0.0f,  0.19509032f,  0.38268343f,  0.55557023f,  0.70710678f,  0.83146961f,  0.92387953f,  0.98078528f};

// The same in fewer steps: the nearest of 32 directions, and the rest d to the second order, 1 - d^2 / 2 + j a d, where the a of least
// squares makes up for most of the third. RMS error 2.4e-5.
SARFOCUS_INLINE Complex quick_turn(Floats cycles) {
    constexpr float step = 0.19634954f * (1.0f - 0.1f * 0.09817477f * 0.09817477f);
    const Rounded at = rounded(cycles * 32.0f);
    const auto index = reinterpret_cast<__m512i>(at.whole);
    const Floats s = _mm512_permutex2var_ps(load(thirty_seconds), index, load(thirty_seconds + 16));
    const Floats c = _mm512_permutex2var_ps(_mm512_loadu_ps(thirty_seconds + 8), index, _mm512_loadu_ps(thirty_seconds + 24));
    const Floats d = at.rest * step;
    const Floats q = 1.0f - 0.019276571f * (at.rest * at.rest);  // (2 pi / 32)^2 / 2
    return {c * q - s * d, s * q + c * d};
}

// exp(2 pi j (x scale + first)) of some vectors, each by itself.
template <std::ptrdiff_t count>
SARFOCUS_INLINE void quick_turns(const Floats (&x)[count], float scale, float first, Complex (&out)[count]) {
    for (std::ptrdiff_t v = 0; v < count; ++v) out[v] = quick_turn(x[v] * scale + first);
}
#else
// exp(2 pi j (x scale + first)) of some vectors as `turn` has it, step by step for all of them.
template <std::ptrdiff_t count>
SARFOCUS_INLINE void quick_turns(const Floats (&x)[count], float scale, float first, Complex (&out)[count]) {
    Floats f[count], z[count], s[count], c[count];
    for (std::ptrdiff_t v = 0; v < count; ++v) f[v] = rounded(x[v] * scale + first).rest;
    for (std::ptrdiff_t v = 0; v < count; ++v) z[v] = f[v] * f[v];
    for (std::ptrdiff_t v = 0; v < count; ++v) s[v] = -0.5980452f + z[v] * 0.07722016f, c[v] = -1.3318809f + z[v] * 0.21969818f;
    for (std::ptrdiff_t v = 0; v < count; ++v) s[v] = 2.5500314f + z[v] * s[v], c[v] = 4.058412f + z[v] * c[v];
    for (std::ptrdiff_t v = 0; v < count; ++v) s[v] = -5.167707f + z[v] * s[v], c[v] = -4.934793f + z[v] * c[v];
    for (std::ptrdiff_t v = 0; v < count; ++v) s[v] = 3.1415925f + z[v] * s[v], c[v] = 0.99999994f + z[v] * c[v];
    for (std::ptrdiff_t v = 0; v < count; ++v) s[v] = f[v] * s[v];
    for (std::ptrdiff_t v = 0; v < count; ++v) out[v] = {c[v] * c[v] - s[v] * s[v], 2.0f * s[v] * c[v]};
}
#endif

// The profile at `rest` bins from the centres of the bins looked up.
template <Reach reach>
SARFOCUS_INLINE Complex interpolated(const LookUp<reach>& bins, Floats rest) {
    Complex value{bins.coefficient(6), bins.coefficient(7)};
    value = {value.re * rest + bins.coefficient(4), value.im * rest + bins.coefficient(5)};
    value = {value.re * rest + bins.coefficient(2), value.im * rest + bins.coefficient(3)};
    return {value.re * rest + bins.coefficient(0), value.im * rest + bins.coefficient(1)};
}

// Adds a * b to the sums, by fused steps alone.
SARFOCUS_INLINE void add_product(float* re, float* im, Complex a, Complex b) {
    const Floats real = load(re) + a.re * b.re;
    const Floats imag = load(im) + a.re * b.im;
    store(re, real - a.im * b.im);
    store(im, imag + a.im * b.re);
}

}  // namespace
}  // namespace sarfocus::focus::detail
