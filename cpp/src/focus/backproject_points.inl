// Sums over tiles of pixels that may lie anywhere. Included by backproject_kernel.inl, behind backproject_plane.inl.
namespace sarfocus::focus::detail {
namespace {

// The series of the range to one antenna: unit vector from it to the centre, and half, fourth and eighth parts by powers of 1 / range.
struct SightLine {
    float direction[3];
    float second;
    float third;
    float fourth;
};

struct PointTerms {
    SightLine sight[2];
    float place;  // of the centre, bins from the beginning of `chunk`
    float phase;  // of the centre, cycles
    std::int32_t chunk;
    double outside;  // bins between the tile and the record, where positive
    double error;    // rad, bound of the phase error
};

template <class Value>
SARFOCUS_INLINE Value longer_by(const SightLine& sight, Value x, Value y, Value z, Value square) {
    const Value along = x * sight.direction[0] + y * sight.direction[1] + z * sight.direction[2];
    const Value m = square - along * along;
    return along + m * (sight.second + along * (sight.third + 4.0f * sight.fourth * along) - sight.fourth * m);
}

// How much farther than the centre a point lies, m.
template <bool monostatic, class Value>
SARFOCUS_INLINE Value farther_by(const PointTerms& terms, Value x, Value y, Value z, Value square) {
    const Value forth = longer_by(terms.sight[0], x, y, z, square);
    if constexpr (monostatic) return forth;
    return 0.5f * (forth + longer_by(terms.sight[1], x, y, z, square));
}

SARFOCUS_INLINE double find_sight(const double (&antenna)[3][pulse_capacity], std::ptrdiff_t p, const double* centre, SightLine& sight) {
    const double d[3] = {centre[0] - antenna[0][p], centre[1] - antenna[1][p], centre[2] - antenna[2][p]};
    const double range = __builtin_sqrt(dot(d, d));
    const double inverse = 1.0 / range;
    for (std::ptrdiff_t a = 0; a < 3; ++a) sight.direction[a] = static_cast<float>(d[a] * inverse);
    sight.second = static_cast<float>(0.5 * inverse);
    sight.third = static_cast<float>(-0.5 * inverse * inverse);
    sight.fourth = static_cast<float>(0.125 * inverse * inverse * inverse);
    return range;
}

// The fifth order errs by at most 0.11 D (h / D)^5; single precision by a few parts in 2^24 of the distance from the centre.
SARFOCUS_INLINE PointTerms find_point_terms(const PulseGroup& pulses, std::ptrdiff_t p, const PointTile& tile) {
    PointTerms terms;
    double range = find_sight(pulses.tx, p, tile.centre, terms.sight[0]);
    double nearest = range;
    if (!pulses.monostatic) {
        const double back = find_sight(pulses.rx, p, tile.centre, terms.sight[1]);
        nearest = back < range ? back : range;
        range = 0.5 * (range + back);
    }
    const double h = tile.radius;
    const double ratio = h / nearest;
    const double series = 0.11 * h * ratio * ratio * ratio * ratio / (1.0 - ratio);
    const bool valid = ratio < 0.5 && h * pulses.bins_per_metre < most_bins;
    terms.error = valid ? full_circle * pulses.cycles_per_metre * (series + 1.2e-7 * h) : h;

    double place = (range - pulses.first_range[p]) * pulses.bins_per_metre;
    terms.outside = larger(ProfileLayout::frame - 1 - place, place - (pulses.n_bin - ProfileLayout::frame)) - h * pulses.bins_per_metre;
    place = place < 1e8 ? place : 1e8;
    place = place > -1e8 ? place : -1e8;
    const double chunk = nearest_whole(place / ProfileLayout::chunk - 0.5);
    terms.chunk = static_cast<std::int32_t>(chunk);
    terms.place = static_cast<float>(place - chunk * ProfileLayout::chunk);
    const double cycles = range * pulses.cycles_per_metre;
    terms.phase = static_cast<float>(cycles - nearest_whole(cycles));
    return terms;
}

constexpr std::ptrdiff_t run_lanes = widest_window == Reach::anywhere ? tile_lanes : width;
constexpr std::ptrdiff_t tile_runs = TileShape::pixels / run_lanes;
static_assert(tile_runs <= PointTile::most_runs);

// Where the window of every run lies in the table, and what is to be taken off places for it.
struct alignas(64) PointRuns {
    float shift[tile_runs];
    float span[tile_runs];  // bins
    std::int32_t first[tile_runs];
};

// Along the line between a run's ends the range bends by at most length^2 / (8 D); off the line it changes by what the box allows.
template <bool monostatic>
SARFOCUS_INLINE void find_point_runs(const PulseGroup& pulses, const PointTile& tile, const PointTerms& terms, PointRuns& runs) {
    const auto bins = static_cast<float>(pulses.bins_per_metre);
    const std::int32_t begin = terms.chunk * ProfileLayout::chunk;
    const std::int32_t last = pulses.n_bin - window_bins(widest_window);
    const float curvature = monostatic || terms.sight[0].second > terms.sight[1].second ? terms.sight[0].second : terms.sight[1].second;
    const auto radius = static_cast<float>(tile.radius);
    float direction[3];
    for (std::ptrdiff_t a = 0; a < 3; ++a) {
        direction[a] = __builtin_fabsf(terms.sight[0].direction[a]);
        if (!monostatic) direction[a] = 0.5f * (direction[a] + __builtin_fabsf(terms.sight[1].direction[a]));
        direction[a] += 2.0f * curvature * radius;  // by which the direction differs over the tile at most, and more
    }
#pragma omp simd
    for (std::int32_t i = 0; i < tile_runs; ++i) {
        float at[2];
        for (std::ptrdiff_t e = 0; e < 2; ++e) {
            const float x = tile.ends[e][0][i], y = tile.ends[e][1][i], z = tile.ends[e][2][i];
            at[e] = terms.place + bins * farther_by<monostatic>(terms, x, y, z, x * x + y * y + z * z);
        }
        const float off = bins * (direction[0] * tile.box[0][i] + direction[1] * tile.box[1][i] + direction[2] * tile.box[2][i] +
                                  0.5f * curvature * tile.length_square[i]) +
                          window_margin;
        const float low = (at[0] < at[1] ? at[0] : at[1]) - off;
        runs.span[i] = (at[0] < at[1] ? at[1] : at[0]) + off - low + 3.0f * window_margin;
        const float block = window_of(low - 0.5f);
        std::int32_t first = begin + static_cast<std::int32_t>(block) * window_step;
        first = first < 0 ? 0 : first;
        runs.first[i] = place_in_table(first > last ? last : first);
        runs.shift[i] = block * window_step;
    }
}

// Vectors that are summed side by side: each is one long chain of steps, and half of the time would be waiting for the step before.
constexpr std::ptrdiff_t vectors_at_once = width == 8 ? 4 : 1;

// Where the bins of some vectors are to be found.
struct VectorPlaces {
    const float* table;
    std::int32_t first[vectors_at_once];
    float shift[vectors_at_once];
};

// The sums over `count` vectors from pixel `begin` on.
template <bool monostatic, Reach reach, std::ptrdiff_t count>
SARFOCUS_INLINE void add_vectors(const PulseGroup& pulses, const PointTile& tile, const PointTerms& terms, const VectorPlaces& places,
                                 std::ptrdiff_t begin, float* re, float* im) {
    const auto bins = static_cast<float>(pulses.bins_per_metre);
    const auto cycles = static_cast<float>(pulses.cycles_per_metre);
    Floats farther[count];
    Complex value[count];
    Complex phase[count];
    for (std::ptrdiff_t v = 0; v < count; ++v) {
        const std::ptrdiff_t k = begin + v * width;
        farther[v] = farther_by<monostatic>(terms, load(tile.offset[0] + k), load(tile.offset[1] + k), load(tile.offset[2] + k),
                                            load(tile.square + k));
    }
    quick_turns(farther, cycles, terms.phase, phase);
    for (std::ptrdiff_t v = 0; v < count; ++v) {
        const Rounded at = rounded(farther[v] * bins + (terms.place - places.shift[v]));
        const std::int32_t first = places.first[v];
        value[v] = interpolated(LookUp<reach>(places.table, first, bins_of<reach>(at.whole, first, pulses.n_bin - 1)), at.rest);
    }
    for (std::ptrdiff_t v = 0; v < count; ++v) add_product(re + begin + v * width, im + begin + v * width, value[v], phase[v]);
}

template <bool monostatic, std::ptrdiff_t count>
SARFOCUS_INLINE void add_vectors_within(Reach reach, const PulseGroup& pulses, const PointTile& tile, const PointTerms& terms,
                                        const VectorPlaces& places, std::ptrdiff_t begin, float* re, float* im) {
    if constexpr (narrowest_window == Reach::close) {
        if (reach == Reach::close) return add_vectors<monostatic, Reach::close, count>(pulses, tile, terms, places, begin, re, im);
    }
    if constexpr (widest_window != Reach::anywhere) {
        if (reach == Reach::near) return add_vectors<monostatic, Reach::near, count>(pulses, tile, terms, places, begin, re, im);
    }
    if constexpr (widest_window == Reach::far) {
        if (reach == Reach::far) return add_vectors<monostatic, Reach::far, count>(pulses, tile, terms, places, begin, re, im);
    }
    VectorPlaces anywhere{places.table, {}, {}};
    for (std::int32_t& first : anywhere.first) first = terms.chunk * ProfileLayout::chunk;
    add_vectors<monostatic, Reach::anywhere, count>(pulses, tile, terms, anywhere, begin, re, im);
}

template <bool monostatic>
void add_point_runs(const PulseGroup& pulses, const PointTile& tile, const PointTerms& terms, std::ptrdiff_t p, float* re, float* im) {
    PointRuns runs;
    if constexpr (widest_window == Reach::anywhere)
        runs = {};  // no windows, no runs
    else
        find_point_runs<monostatic>(pulses, tile, terms, runs);
    constexpr std::ptrdiff_t vectors_of_a_run = run_lanes / width;
    const std::ptrdiff_t n_vector = tile.rows * (tile_lanes / width);
    std::ptrdiff_t v = 0;
    for (; v + vectors_at_once <= n_vector; v += vectors_at_once) {
        VectorPlaces places{pulses.bins[p], {}, {}};
        float span = 0.0f;
        for (std::ptrdiff_t k = 0; k < vectors_at_once; ++k) {
            const std::ptrdiff_t run = (v + k) / vectors_of_a_run;
            places.first[k] = runs.first[run];
            places.shift[k] = runs.shift[run];
            span = runs.span[run] > span ? runs.span[run] : span;
        }
        add_vectors_within<monostatic, vectors_at_once>(reach_of_span(span), pulses, tile, terms, places, v * width, re, im);
    }
    for (; v < n_vector; ++v) {
        const std::ptrdiff_t run = v / vectors_of_a_run;
        const VectorPlaces places{pulses.bins[p], {runs.first[run]}, {runs.shift[run]}};
        add_vectors_within<monostatic, 1>(reach_of_span(runs.span[run]), pulses, tile, terms, places, v * width, re, im);
    }
}

PulseMask add_points(const PulseGroup& pulses, PulseMask wanted, const PointTile& tile, float* re, float* im) {
    PulseMask left = 0;
    for (std::ptrdiff_t p = 0; p < pulses.count; ++p) {
        const PulseMask bit = PulseMask{1} << p;
        if ((wanted & bit) == 0) continue;
        const PointTerms terms = find_point_terms(pulses, p, tile);
        if (terms.outside > 0.0) continue;
        if (!(terms.error <= series_phase_error))
            left |= bit;
        else if (pulses.monostatic)
            add_point_runs<true>(pulses, tile, terms, p, re, im);
        else
            add_point_runs<false>(pulses, tile, terms, p, re, im);
    }
    return left;
}

}  // namespace
}  // namespace sarfocus::focus::detail
