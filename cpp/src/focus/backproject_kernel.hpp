// The inner loops of backprojection, compiled once for each instruction set and chosen at run time.
#pragma once

#include <cstddef>
#include <cstdint>

namespace sarfocus::focus::detail {

/// How a profile table lies in memory: chunks of 16 bins, each [8][pitch] floats, the coefficients (re, im) x (1, x, x^2, x^3) of a cubic
/// in x = the offset from the bin centre, in bins. Where the pitch is above 16, the first bins of the next chunk stand behind those of
/// each, so that pitch - 15 bins from anywhere on lie side by side. The record is framed by zero bins, into which everything outside of it
/// falls.
struct ProfileLayout {
    static constexpr std::int32_t chunk = 16;
    static constexpr std::int32_t degree = 3;
    static constexpr std::int32_t coefficients = 2 * (degree + 1);
    static constexpr std::int32_t frame = 4 * chunk;  ///< zero bins before the record, and at least as many behind it

    std::int32_t pitch = chunk;  ///< floats from one coefficient of a bin to the next

    /// From chunk to chunk.
    [[nodiscard]] constexpr std::int32_t chunk_floats() const { return coefficients * pitch; }
    /// Where the first coefficient of a bin lies.
    [[nodiscard]] constexpr std::int32_t offset(std::int32_t bin) const { return bin / chunk * chunk_floats() + bin % chunk; }
};

/// One pulse as the kernels see it. Bin b covers ranges within half a bin of first_range + b / bins_per_metre.
struct PulseTable {
    const float* bins;
    std::int32_t n_bin;  ///< the frame included
    double first_range;  ///< m, of bin 0, which lies before the record
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
    float most_power;  // of an entry
};

/// Pulses that are summed over a tile in one go, one array for each axis.
struct PulseGroup {
    static constexpr std::ptrdiff_t capacity = 32;
    alignas(64) double tx[3][capacity];
    alignas(64) double rx[3][capacity];
    alignas(64) double first_range[capacity];  ///< m, of bin 0
    const float* bins[capacity];
    std::ptrdiff_t count;
    std::int32_t n_bin;
    double bins_per_metre;
    double cycles_per_metre;
    bool monostatic;
};

/// Pixels summed together: rows of 16 lanes, which lie along the image axis nearest constant range. Sums are [row][lane].
struct TileShape {
    static constexpr std::ptrdiff_t lanes = 16;
    static constexpr std::ptrdiff_t most_rows = 32;
    static constexpr std::ptrdiff_t pixels = lanes * most_rows;
};

/// Evenly spaced pixels: row i, lane j at centre + (i - (rows - 1) / 2) row_step + (j - 7.5) lane_step.
struct PlaneTile {
    double centre[3];
    double row_step[3];
    double lane_step[3];
    std::ptrdiff_t rows;
};

/// Pixels anywhere, as offsets from a centre in single precision. Every run of pixels next to one another, as many as Kernels::run says,
/// lies within its `box` of the straight line between its ends.
struct PointTile {
    double centre[3];
    double radius;  ///< m, of the sphere round the centre that holds all pixels
    std::ptrdiff_t rows;
    alignas(64) float offset[3][TileShape::pixels];
    alignas(64) float square[TileShape::pixels];  ///< m^2, of the offset's length
    static constexpr std::ptrdiff_t most_runs = TileShape::pixels / 8;
    alignas(64) float ends[2][3][most_runs];
    alignas(64) float box[3][most_runs];
    alignas(64) float length_square[most_runs];  ///< m^2, of the line between the ends
};

/// Bit p: pulse p.
using PulseMask = std::uint32_t;
static_assert(PulseGroup::capacity == 32);

/// Largest phase error that the series in place of the range may cause anywhere on a tile, rad.
inline constexpr double series_phase_error = 5e-4;

struct Kernels {
    const char* name;
    ProfileLayout layout;  ///< of the tables that they read
    std::ptrdiff_t run;    ///< lanes whose bins are looked up together: 8 or 16
    /// re[i], im[i] += s(R_i) exp(+j 2 pi R_i cycles_per_metre)
    void (*gather)(const PulseTable& pulse, const PixelBlock& pixels, double cycles_per_metre, bool monostatic, float* re, float* im);
    /// The same, every term times the entry of its direction.
    void (*gather_weighted)(const PulseTable& pulse, const PixelBlock& pixels, const AspectTable& aspect, double cycles_per_metre,
                            bool monostatic, float* re, float* im);
    /// The offsets and phases alone, for the adjoint: bin[i], x[i], and (c, s) = exp(-j 2 pi R_i cycles_per_metre).
    void (*locate)(const PulseTable& pulse, const PixelBlock& pixels, double cycles_per_metre, bool monostatic, std::int32_t* bin, float* x,
                   float* c, float* s);
    /// The sum over the pulses of `wanted` for the pixels of a tile, the range by its series about the centre: third order, phases by
    /// rotation from row to row. `aspect` may be null. Returns the pulses left out, as the tile is too large or too near for them.
    PulseMask (*add_plane)(const PulseGroup& pulses, PulseMask wanted, const PlaneTile& tile, const AspectTable* aspect, float* re,
                           float* im);
    /// The same for pixels anywhere, to the fourth order.
    PulseMask (*add_points)(const PulseGroup& pulses, PulseMask wanted, const PointTile& tile, float* re, float* im);
};

extern const Kernels kernels_baseline;
#if defined(__x86_64__)
extern const Kernels kernels_avx2;
extern const Kernels kernels_avx512;
#endif

/// The fastest set this processor runs; the environment variable SARFOCUS_KERNELS (baseline, avx2, avx512) narrows the choice.
const Kernels& select_kernels();

}  // namespace sarfocus::focus::detail
