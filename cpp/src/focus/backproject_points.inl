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

// Where the window of every row lies in the table, and what is to be taken off places for it.
struct alignas(64) PointRows {
    float shift[tile_rows];
    float span[tile_rows];  // bins
    std::int32_t first[tile_rows];
};

// Along the line between a row's ends the range bends by at most length^2 / (8 D); off the line it changes by what the box allows.
template <bool monostatic>
SARFOCUS_INLINE void find_point_rows(const PulseGroup& pulses, const PointTile& tile, const PointTerms& terms, PointRows& rows) {
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
    for (std::int32_t i = 0; i < tile_rows; ++i) {
        float at[2];
        for (std::ptrdiff_t e = 0; e < 2; ++e) {
            const float x = tile.ends[e][0][i], y = tile.ends[e][1][i], z = tile.ends[e][2][i];
            at[e] = terms.place + bins * farther_by<monostatic>(terms, x, y, z, x * x + y * y + z * z);
        }
        const float off = bins * (direction[0] * tile.box[0][i] + direction[1] * tile.box[1][i] + direction[2] * tile.box[2][i] +
                                  0.5f * curvature * tile.length_square[i]) +
                          window_margin;
        const float low = (at[0] < at[1] ? at[0] : at[1]) - off;
        rows.span[i] = (at[0] < at[1] ? at[1] : at[0]) + off - low + 3.0f * window_margin;
        const float block = window_of(low - 0.5f);
        std::int32_t first = begin + static_cast<std::int32_t>(block) * window_step;
        first = first < 0 ? 0 : first;
        rows.first[i] = place_in_table(first > last ? last : first);
        rows.shift[i] = block * window_step;
    }
}

template <bool monostatic, Reach reach>
SARFOCUS_INLINE void add_point_row(const PulseGroup& pulses, const PointTile& tile, const PointTerms& terms, const float* table,
                                   std::int32_t first, float shift, std::ptrdiff_t row, float* re, float* im) {
    const auto bins = static_cast<float>(pulses.bins_per_metre);
    const auto cycles = static_cast<float>(pulses.cycles_per_metre);
    for (std::ptrdiff_t k = row * tile_lanes; k < (row + 1) * tile_lanes; k += width) {
        const Floats farther = farther_by<monostatic>(terms, load(tile.offset[0] + k), load(tile.offset[1] + k), load(tile.offset[2] + k),
                                                      load(tile.square + k));
        const Rounded at = rounded(farther * bins + (terms.place - shift));
        const LookUp<reach> window(table, first, bins_of<reach>(at.whole, first, pulses.n_bin - 1));
        add_to(re + k, im + k, interpolated(window, at.rest) * quick_turn(farther * cycles + terms.phase));
    }
}

template <bool monostatic>
void add_point_rows(const PulseGroup& pulses, const PointTile& tile, const PointTerms& terms, std::ptrdiff_t p, float* re, float* im) {
    PointRows rows;
    find_point_rows<monostatic>(pulses, tile, terms, rows);
    const float* table = pulses.bins[p];
    for (std::ptrdiff_t i = 0; i < tile.rows; ++i) {
        if constexpr (narrowest_window == Reach::close) {
            if (reach_of_span(rows.span[i]) == Reach::close) {
                add_point_row<monostatic, Reach::close>(pulses, tile, terms, table, rows.first[i], rows.shift[i], i, re, im);
                continue;
            }
        }
        if constexpr (widest_window != Reach::anywhere) {
            if (reach_of_span(rows.span[i]) == Reach::near) {
                add_point_row<monostatic, Reach::near>(pulses, tile, terms, table, rows.first[i], rows.shift[i], i, re, im);
                continue;
            }
        }
        if constexpr (widest_window == Reach::far) {
            if (reach_of_span(rows.span[i]) == Reach::far) {
                add_point_row<monostatic, Reach::far>(pulses, tile, terms, table, rows.first[i], rows.shift[i], i, re, im);
                continue;
            }
        }
        add_point_row<monostatic, Reach::anywhere>(pulses, tile, terms, table, terms.chunk * ProfileLayout::chunk, 0.0f, i, re, im);
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
            add_point_rows<true>(pulses, tile, terms, p, re, im);
        else
            add_point_rows<false>(pulses, tile, terms, p, re, im);
    }
    return left;
}

}  // namespace
}  // namespace sarfocus::focus::detail
