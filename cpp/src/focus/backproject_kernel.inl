// Included by one source file for each instruction set, which defines SARFOCUS_KERNELS_NAME and SARFOCUS_KERNELS_LABEL. Only plain
// loops over local arrays: an inline function of a standard header compiled here could end up in code for a lesser processor.
#include "backproject_kernel.hpp"

#include "backproject_lanes.inl"
#include "backproject_plane.inl"
#include "backproject_points.inl"

namespace sarfocus::focus::detail {
namespace {

constexpr std::ptrdiff_t capacity = PixelBlock::capacity;
constexpr std::int32_t pitch = layout.pitch;

// Bin, offset and exp(+j 2 pi R cycles_per_metre), the range phase reduced to a fraction of a cycle in double precision.
template <bool monostatic>
inline __attribute__((always_inline)) void locate_pixels(const PulseTable& pulse, const PixelBlock& pixels, double cycles_per_metre,
                                                         std::int32_t* __restrict bin, float* __restrict offset, float* __restrict cosine,
                                                         float* __restrict sine) {
    const double tx = pulse.tx[0], ty = pulse.tx[1], tz = pulse.tx[2];
    const double rx = pulse.rx[0], ry = pulse.rx[1], rz = pulse.rx[2];
    const double first = pulse.first_range;
    const double scale = pulse.bins_per_metre;
    const double last = static_cast<double>(pulse.n_bin - 1);
    const double* __restrict px = pixels.x;
    const double* __restrict py = pixels.y;
    const double* __restrict pz = pixels.z;
    const std::ptrdiff_t n = pixels.count;
#pragma omp simd
    for (std::ptrdiff_t i = 0; i < n; ++i) {
        const double ax = px[i] - tx, ay = py[i] - ty, az = pz[i] - tz;
        double range = __builtin_sqrt(ax * ax + ay * ay + az * az);
        if constexpr (!monostatic) {
            const double bx = px[i] - rx, by = py[i] - ry, bz = pz[i] - rz;
            range = 0.5 * (range + __builtin_sqrt(bx * bx + by * by + bz * bz));
        }
        double u = (range - first) * scale;
        u = u < 0.0 ? 0.0 : u;
        u = u > last ? last : u;
        const auto nearest = static_cast<std::int32_t>(u + 0.5);
        bin[i] = nearest;
        offset[i] = static_cast<float>(u - static_cast<double>(nearest));

        const double cycles = range * cycles_per_metre;
        const auto whole = static_cast<double>(static_cast<std::int64_t>(cycles + 0.5));
        const auto f = static_cast<float>(cycles - whole);
        // sin and cos of pi f on |f| <= 1/2, least maximum error (3e-9, 5e-8), then the double angle.
        const float z = f * f;
        const float s = f * (3.1415925f + z * (-5.167707f + z * (2.5500314f + z * (-0.5980452f + z * 0.07722016f))));
        const float c = 0.99999994f + z * (-4.934793f + z * (4.058412f + z * (-1.3318809f + z * 0.21969818f)));
        cosine[i] = c * c - s * s;
        sine[i] = 2.0f * s * c;
    }
}

template <bool monostatic>
inline __attribute__((always_inline)) void gather_pixels(const PulseTable& pulse, const PixelBlock& pixels, double cycles_per_metre,
                                                         float* __restrict re, float* __restrict im) {
    alignas(64) std::int32_t bin[capacity];
    alignas(64) float offset[capacity];
    alignas(64) float cosine[capacity];
    alignas(64) float sine[capacity];
    locate_pixels<monostatic>(pulse, pixels, cycles_per_metre, bin, offset, cosine, sine);
    const float* __restrict table = pulse.bins;
    const std::ptrdiff_t n = pixels.count;
#pragma omp simd
    for (std::ptrdiff_t i = 0; i < n; ++i) {
        const float* p = table + layout.offset(bin[i]);
        const float x = offset[i];
        const float sr = p[0] + x * (p[2 * pitch] + x * (p[4 * pitch] + x * p[6 * pitch]));
        const float si = p[pitch] + x * (p[3 * pitch] + x * (p[5 * pitch] + x * p[7 * pitch]));
        re[i] += sr * cosine[i] - si * sine[i];
        im[i] += sr * sine[i] + si * cosine[i];
    }
}

// The entry of every pixel's direction, and the lowest and highest of them.
struct EntryRange {
    std::int32_t lowest;
    std::int32_t highest;
};

template <bool monostatic>
inline __attribute__((always_inline)) EntryRange locate_aspect(const PulseTable& pulse, const PixelBlock& pixels, const AspectTable& aspect,
                                                               std::int32_t* __restrict entry) {
    const double tx = monostatic ? pulse.tx[0] : 0.5 * (pulse.tx[0] + pulse.rx[0]);
    const double ty = monostatic ? pulse.tx[1] : 0.5 * (pulse.tx[1] + pulse.rx[1]);
    const double tz = monostatic ? pulse.tx[2] : 0.5 * (pulse.tx[2] + pulse.rx[2]);
    const float ux = aspect.axis[0], uy = aspect.axis[1], uz = aspect.axis[2];
    const float start = aspect.start;
    const float scale = aspect.scale;
    const auto last = static_cast<float>(aspect.n_entry + 1);
    const double* __restrict px = pixels.x;
    const double* __restrict py = pixels.y;
    const double* __restrict pz = pixels.z;
    const std::ptrdiff_t n = pixels.count;
    std::int32_t lowest = aspect.n_entry + 1;
    std::int32_t highest = 0;
#pragma omp simd reduction(min : lowest) reduction(max : highest)
    for (std::ptrdiff_t i = 0; i < n; ++i) {
        const auto ax = static_cast<float>(px[i] - tx), ay = static_cast<float>(py[i] - ty), az = static_cast<float>(pz[i] - tz);
        const float sine = (ax * ux + ay * uy + az * uz) / __builtin_sqrtf(ax * ax + ay * ay + az * az);
        float place = (sine - start) * scale + 1.0f;
        place = place < 0.0f ? 0.0f : place;
        place = place > last ? last : place;
        const auto k = static_cast<std::int32_t>(place);
        entry[i] = k;
        lowest = k < lowest ? k : lowest;
        highest = k > highest ? k : highest;
    }
    return {lowest, highest};
}

// `uniform`: one factor for all pixels of the block.
template <bool monostatic, bool uniform>
inline __attribute__((always_inline)) void add_weighted(const PulseTable& pulse, const PixelBlock& pixels, const float* __restrict weight,
                                                        const std::int32_t* __restrict entry, double cycles_per_metre, float* __restrict re,
                                                        float* __restrict im) {
    alignas(64) std::int32_t bin[capacity];
    alignas(64) float offset[capacity];
    alignas(64) float cosine[capacity];
    alignas(64) float sine[capacity];
    locate_pixels<monostatic>(pulse, pixels, cycles_per_metre, bin, offset, cosine, sine);
    const float* __restrict table = pulse.bins;
    const std::ptrdiff_t n = pixels.count;
    const float first_re = weight[2 * entry[0]];
    const float first_im = weight[2 * entry[0] + 1];
#pragma omp simd
    for (std::ptrdiff_t i = 0; i < n; ++i) {
        const float* p = table + layout.offset(bin[i]);
        const float x = offset[i];
        const float sr = p[0] + x * (p[2 * pitch] + x * (p[4 * pitch] + x * p[6 * pitch]));
        const float si = p[pitch] + x * (p[3 * pitch] + x * (p[5 * pitch] + x * p[7 * pitch]));
        const float tr = sr * cosine[i] - si * sine[i];
        const float ti = sr * sine[i] + si * cosine[i];
        const float wr = uniform ? first_re : weight[2 * entry[i]];
        const float wi = uniform ? first_im : weight[2 * entry[i] + 1];
        re[i] += tr * wr - ti * wi;
        im[i] += tr * wi + ti * wr;
    }
}

template <bool monostatic>
inline __attribute__((always_inline)) void gather_weighted_pixels(const PulseTable& pulse, const PixelBlock& pixels,
                                                                  const AspectTable& aspect, double cycles_per_metre, float* __restrict re,
                                                                  float* __restrict im) {
    alignas(64) std::int32_t entry[capacity];
    const EntryRange range = locate_aspect<monostatic>(pulse, pixels, aspect, entry);
    if (range.highest == 0 || range.lowest > aspect.n_entry) return;
    if (aspect.run_end[range.lowest] >= range.highest)
        add_weighted<monostatic, true>(pulse, pixels, aspect.entries, entry, cycles_per_metre, re, im);
    else
        add_weighted<monostatic, false>(pulse, pixels, aspect.entries, entry, cycles_per_metre, re, im);
}

void gather(const PulseTable& pulse, const PixelBlock& pixels, double cycles_per_metre, bool monostatic, float* re, float* im) {
    if (monostatic)
        gather_pixels<true>(pulse, pixels, cycles_per_metre, re, im);
    else
        gather_pixels<false>(pulse, pixels, cycles_per_metre, re, im);
}

void gather_weighted(const PulseTable& pulse, const PixelBlock& pixels, const AspectTable& aspect, double cycles_per_metre, bool monostatic,
                     float* re, float* im) {
    if (monostatic)
        gather_weighted_pixels<true>(pulse, pixels, aspect, cycles_per_metre, re, im);
    else
        gather_weighted_pixels<false>(pulse, pixels, aspect, cycles_per_metre, re, im);
}

void locate(const PulseTable& pulse, const PixelBlock& pixels, double cycles_per_metre, bool monostatic, std::int32_t* bin, float* x,
            float* c, float* s) {
    if (monostatic)
        locate_pixels<true>(pulse, pixels, cycles_per_metre, bin, x, c, s);
    else
        locate_pixels<false>(pulse, pixels, cycles_per_metre, bin, x, c, s);
    for (std::ptrdiff_t i = 0; i < pixels.count; ++i) s[i] = -s[i];
}

}  // namespace

const Kernels SARFOCUS_KERNELS_NAME = {SARFOCUS_KERNELS_LABEL, layout,  run_lanes,  &gather,
                                       &gather_weighted,       &locate, &add_plane, &add_points};

}  // namespace sarfocus::focus::detail
