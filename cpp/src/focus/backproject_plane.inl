// Sums over tiles of a plane grid. Included by backproject_kernel.inl.
namespace sarfocus::focus::detail {
namespace {

constexpr std::ptrdiff_t pulse_capacity = PulseGroup::capacity;
constexpr std::ptrdiff_t tile_lanes = TileShape::lanes;
constexpr std::ptrdiff_t tile_rows = TileShape::most_rows;
constexpr double full_circle = 6.283185307179586;
constexpr double radians_a_bin = 0.5;  // by which a profile changes, for errors of places that are largest in the corners
constexpr double most_bins = 4096.0;   // from the centre of a tile to its edge, for places in single precision

using PerPulse = double[pulse_capacity];

// The range over a tile, R(i, j) = sum of c[a][b] i^a j^b for rows i and lanes j counted from the centre, m, and of the nearer antenna.
struct alignas(64) RangeSeries {
    PerPulse c00, c10, c20, c30, c01, c11, c21, c02, c12, c03;
    PerPulse nearest;
};

// The series as the sums need it: places in bins from the beginning of a chunk, phases in cycles.
struct alignas(64) PlaneTerms {
    float place[4][pulse_capacity];        // of the lanes' centre, powers of the row
    float slope[3][pulse_capacity];        // a lane, powers of the row
    float bend[2][pulse_capacity];         // times the square and the cube of the lane
    float first[4][pulse_capacity];        // phase of row 0, powers of the lane
    float step[3][pulse_capacity];         // from row 0 to row 1
    float step_change[2][pulse_capacity];  // of that step from row 0 to row 1
    float bend_change[pulse_capacity];     // of that change from each row to the next, rad; 0 where a line does for the cubic
    float level_first[2][pulse_capacity];  // phase of row 0 beyond that of the tile's bend, and what a lane adds to it,
    float level_step[2][pulse_capacity];   // and both from each row to the next
    float tilt[2][pulse_capacity];         // what is left of the bend, rad, times x^2 - m^2 / 2 and x^3 - 3 m^2 x / 4,
    float most_tilt[pulse_capacity];       // all of it at most,
    float most_squint[pulse_capacity];     // and what the lanes add to it at most, rad
    double chunk[pulse_capacity];
    double error[pulse_capacity];    // rad, bound of the phase error
    double outside[pulse_capacity];  // bins between the tile and the record, where positive
    double beyond[pulse_capacity];   // bins by which the tile reaches beyond an end of the record, where positive
};

// How the range bends over the rows of a tile for one pulse in the midst of a group, x^2 (square + cube x + lane j), and so, but for
// little, for all of them: the sums leave it out, and are turned by it when all pulses have been added.
struct TileBend {
    double square;
    double cube;
    double lane;
};

// Sums over the pixels of a tile.
struct alignas(64) TileSums {
    float re[TileShape::pixels];
    float im[TileShape::pixels];
};

SARFOCUS_INLINE double dot(const double* a, const double* b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

SARFOCUS_INLINE double larger(double a, double b) {
    return a > b ? a : b;
}

SARFOCUS_INLINE double magnitude(double x) {
    return __builtin_fabs(x);
}

SARFOCUS_INLINE double half_diagonal(const PlaneTile& tile) {
    const double rows = 0.5 * static_cast<double>(tile.rows - 1);
    const double lanes = 0.5 * static_cast<double>(tile_lanes - 1);
    return __builtin_sqrt(rows * rows * dot(tile.row_step, tile.row_step) + lanes * lanes * dot(tile.lane_step, tile.lane_step) +
                          2.0 * rows * lanes * magnitude(dot(tile.row_step, tile.lane_step)));
}

// R = sqrt(D^2 + 2 D d + d^2) about d = 0: with x the component of d along D, and m = d^2 - x^2,
// R = D + x + m / (2 D) - x m / (2 D^2) + m (4 x^2 - m) / (8 D^3) - …
SARFOCUS_INLINE void add_range_series(const double (&antenna)[3][pulse_capacity], double share, const PlaneTile& tile,
                                      RangeSeries& series) {
    const double rr = dot(tile.row_step, tile.row_step);
    const double rl = dot(tile.row_step, tile.lane_step);
    const double ll = dot(tile.lane_step, tile.lane_step);
    const double px = tile.centre[0], py = tile.centre[1], pz = tile.centre[2];
    const double rx = tile.row_step[0], ry = tile.row_step[1], rz = tile.row_step[2];
    const double lx = tile.lane_step[0], ly = tile.lane_step[1], lz = tile.lane_step[2];
#pragma omp simd
    for (std::ptrdiff_t p = 0; p < pulse_capacity; ++p) {
        const double x = px - antenna[0][p], y = py - antenna[1][p], z = pz - antenna[2][p];
        const double range = __builtin_sqrt(x * x + y * y + z * z);
        const double inverse = 1.0 / range;
        const double r = (x * rx + y * ry + z * rz) * inverse;
        const double l = (x * lx + y * ly + z * lz) * inverse;
        const double m_rr = rr - r * r, m_rl = rl - r * l, m_ll = ll - l * l;
        const double second = 0.5 * share * inverse;
        const double third = -second * inverse;
        series.nearest[p] = range < series.nearest[p] ? range : series.nearest[p];
        series.c00[p] += share * range;
        series.c10[p] += share * r;
        series.c01[p] += share * l;
        series.c20[p] += second * m_rr;
        series.c11[p] += second * 2.0 * m_rl;
        series.c02[p] += second * m_ll;
        series.c30[p] += third * r * m_rr;
        series.c21[p] += third * (l * m_rr + 2.0 * r * m_rl);
        series.c12[p] += third * (r * m_ll + 2.0 * l * m_rl);
        series.c03[p] += third * l * m_ll;
    }
}

// Where it is small, the cubic along the rows is replaced by the line that errs least, by a quarter of the cubic's value at the edge.
SARFOCUS_INLINE void find_terms(const PulseGroup& pulses, const PlaneTile& tile, const RangeSeries& series, const TileBend& bend,
                                PlaneTerms& terms) {
    const double h = half_diagonal(tile);
    const double m = 0.5 * static_cast<double>(tile.rows - 1);
    const double bins = pulses.bins_per_metre;
    const double cycles = pulses.cycles_per_metre;
    const double first_bin = ProfileLayout::frame - 1;
    const double last_bin = pulses.n_bin - ProfileLayout::frame;
    constexpr double lane_squares = 0.25 * (tile_lanes - 1) * (tile_lanes - 1);
#pragma omp simd
    for (std::ptrdiff_t p = 0; p < pulse_capacity; ++p) {
        const double c10 = series.c10[p], c20 = series.c20[p], c30 = series.c30[p];
        const double c01 = series.c01[p], c11 = series.c11[p], c21 = series.c21[p], c12 = series.c12[p];

        const double ratio = h / series.nearest[p];
        const double fourth = ratio < 0.5 && h * bins < most_bins ? 0.125 * h * ratio * ratio * ratio / (1.0 - ratio) : h;
        const double line_error = 0.25 * full_circle * cycles * m * m * m * magnitude(c30);
        const double cubic = line_error > 0.25 * series_phase_error ? c30 : 0.0;
        const double line = 0.75 * m * m * (c30 - cubic);
        const double displaced = magnitude(c12) * m * lane_squares + fourth;
        const double phase_error = full_circle * cycles * fourth + (cubic == 0.0 ? line_error : 0.0);
        terms.error[p] = larger(phase_error, bins * displaced * radians_a_bin);

        double place = (series.c00[p] - pulses.first_range[p]) * bins;
        terms.outside[p] = larger(first_bin - place, place - last_bin) - h * bins;
        terms.beyond[p] = terms.outside[p] + 2.0 * h * bins;
        place = place < 1e8 ? place : 1e8;
        place = place > -1e8 ? place : -1e8;
        const double chunk = nearest_whole(place / ProfileLayout::chunk - 0.5);
        terms.chunk[p] = chunk;
        terms.place[0][p] = static_cast<float>(place - chunk * ProfileLayout::chunk);
        terms.place[1][p] = static_cast<float>(c10 * bins);
        terms.place[2][p] = static_cast<float>(c20 * bins);
        terms.place[3][p] = static_cast<float>(c30 * bins);
        terms.slope[0][p] = static_cast<float>(c01 * bins);
        terms.slope[1][p] = static_cast<float>(c11 * bins);
        terms.slope[2][p] = static_cast<float>(c21 * bins);
        terms.bend[0][p] = static_cast<float>(series.c02[p] * bins);
        terms.bend[1][p] = static_cast<float>(series.c03[p] * bins);

        // About row 0, at x = -m.
        const double along = c10 + line;
        const double first = (series.c00[p] - m * (along - m * (c20 - m * cubic))) * cycles;
        const double lane = (c01 - m * c11 + m * m * c21) * cycles;
        const double step = (along + (1.0 - 2.0 * m) * c20 + (1.0 - 3.0 * m * (1.0 - m)) * cubic) * cycles;
        terms.first[0][p] = static_cast<float>(first - nearest_whole(first));
        // Lanes lie 7.5 and less from the centre, so that 2 cycles a lane are whole ones.
        terms.first[1][p] = static_cast<float>(lane - 2.0 * nearest_whole(0.5 * lane));
        terms.first[2][p] = static_cast<float>((series.c02[p] - m * c12) * cycles);
        terms.first[3][p] = static_cast<float>(series.c03[p] * cycles);
        terms.step[0][p] = static_cast<float>(step - nearest_whole(step));
        terms.step[1][p] = static_cast<float>((c11 + (1.0 - 2.0 * m) * c21) * cycles);
        terms.step[2][p] = static_cast<float>(c12 * cycles);
        terms.step_change[0][p] = static_cast<float>((2.0 * c20 + 6.0 * (1.0 - m) * cubic) * cycles);
        terms.step_change[1][p] = static_cast<float>(2.0 * c21 * cycles);
        terms.bend_change[p] = static_cast<float>(6.0 * cubic * cycles * full_circle);
        // What is left of the bend is taken for the line that errs least: a x^2 for its middle value, a x^3 for 3 m^2 / 4 times a x.
        const double square = c20 - bend.square, cube = c30 - bend.cube, squint = c21 - bend.lane;
        const double level_along = c10 + 0.75 * m * m * cube;
        const double level = (series.c00[p] - m * level_along + 0.5 * m * m * square) * cycles;
        const double level_lane = (c01 - m * c11 + 0.5 * m * m * squint) * cycles;
        const double level_step = level_along * cycles;
        terms.level_first[0][p] = static_cast<float>(level - nearest_whole(level));
        terms.level_first[1][p] = static_cast<float>(level_lane - 2.0 * nearest_whole(0.5 * level_lane));
        terms.level_step[0][p] = static_cast<float>(level_step - nearest_whole(level_step));
        terms.level_step[1][p] = static_cast<float>(c11 * cycles);
        const double radians = full_circle * cycles;
        terms.tilt[0][p] = static_cast<float>(radians * square);
        terms.tilt[1][p] = static_cast<float>(radians * cube);
        terms.most_tilt[p] = static_cast<float>(radians * m * m * (0.5 * magnitude(square) + 0.25 * m * magnitude(cube)));
        terms.most_squint[p] = static_cast<float>(radians * m * m * 0.25 * (tile_lanes - 1) * magnitude(squint));
    }
}

constexpr std::ptrdiff_t lane_groups = tile_lanes / width;

// The middle of the lanes of a group.
constexpr float group_centre(std::ptrdiff_t group) {
    return static_cast<float>(group * width) + 0.5f * static_cast<float>(width - tile_lanes);
}

// Where the rows of one pulse lie in its table, for each group of `width` lanes.
struct alignas(64) RowPlaces {
    float place[lane_groups][tile_rows];         // of the group's centre, in bins from the row's window
    std::int32_t first[lane_groups][tile_rows];  // where the window lies in the table; without one, the bin that places count from
    std::int32_t upper[lane_groups][tile_rows];  // where that of the upper half of the lanes lies, if it has its own,
    std::int32_t apart[lane_groups][tile_rows];  // and by how many bins above the other; places count from the lower one
    float slope[tile_rows];                      // a lane
};

struct LaneRange {
    float lowest;
    float highest;
};

// What the bend adds at most to places on a line, bins.
SARFOCUS_INLINE LaneRange bend_range(const PlaneTerms& terms, std::ptrdiff_t p) {
    constexpr float half = 0.5f * (tile_lanes - 1);
    const float square = terms.bend[0][p] * half * half;
    const float cube = __builtin_fabsf(terms.bend[1][p]) * half * half * half;
    return {(square < 0.0f ? square : 0.0f) - cube, (square > 0.0f ? square : 0.0f) + cube};
}

constexpr float window_margin = 0.01f;  // bins, above all rounding of places

// `half`: of a half of the lanes, where that may have a window of its own.
SARFOCUS_INLINE Reach reach_of_span(float span, float half = __builtin_inff()) {
    if (narrowest_window == Reach::close && span <= window_span(Reach::close)) return Reach::close;
    if (narrowest_window == Reach::close && half <= window_span(Reach::halves)) return Reach::halves;
    if (widest_window != Reach::anywhere && span <= window_span(Reach::near)) return Reach::near;
    if (widest_window == Reach::far && span <= window_span(Reach::far)) return Reach::far;
    return Reach::anywhere;
}

// Where a window lies in the table that is kept within it.
SARFOCUS_INLINE std::int32_t clamped_place(std::int32_t first, std::int32_t last) {
    first = first < 0 ? 0 : first;
    return place_in_table(first > last ? last : first);
}

// The step of windows with which the one for places rounded from `low` on begins; a ten-thousandth early, which the margin covers.
SARFOCUS_INLINE float window_of(float low) {
    return window_step > 1 ? nearest_whole(low / window_step - 0.4999f) : nearest_whole(low + 0.4999f);
}

SARFOCUS_INLINE Reach reach_of(const PlaneTerms& terms, std::ptrdiff_t p, float last_row) {
    const float m = 0.5f * last_row;
    const LaneRange bend = bend_range(terms, p);
    const float slope =
        __builtin_fabsf(terms.slope[0][p]) + m * __builtin_fabsf(terms.slope[1][p]) + m * m * __builtin_fabsf(terms.slope[2][p]);
    const float across = bend.highest - bend.lowest;
    const float span = (width - 1) * slope + across;
    // At the ends of the record every place counts by the bin that it lies in, as for all other ways of summation.
    if (span <= single_span && terms.beyond[p] < -2.0) return Reach::single;
    return reach_of_span(span + 5.0f * window_margin, (0.5f * width - 1) * slope + across + 5.0f * window_margin);
}

template <Reach reach>
SARFOCUS_INLINE void find_rows(const PulseGroup& pulses, const PlaneTile& tile, const PlaneTerms& terms, std::ptrdiff_t p,
                               RowPlaces& rows) {
    const float b0 = terms.slope[0][p], b1 = terms.slope[1][p], b2 = terms.slope[2][p];
    const float a0 = terms.place[0][p], a1 = terms.place[1][p], a2 = terms.place[2][p], a3 = terms.place[3][p];
    const LaneRange bend = bend_range(terms, p);
    const float lowest = bend.lowest - 0.5f - window_margin;
    const float middle = 0.5f * (bend.lowest + bend.highest);
    const float m = 0.5f * static_cast<float>(tile.rows - 1);
    const auto begin = static_cast<std::int32_t>(terms.chunk[p]) * ProfileLayout::chunk;
    const std::int32_t last = pulses.n_bin - window_bins(reach);
#pragma omp simd
    for (std::int32_t i = 0; i < tile_rows; ++i) {
        const float x = static_cast<float>(i) - m;
        const float slope = b0 + x * (b1 + x * b2);
        const float centre = a0 + x * (a1 + x * (a2 + x * a3));
        rows.slope[i] = slope;
        for (std::ptrdiff_t g = 0; g < lane_groups; ++g) {
            const float place = centre + group_centre(g) * slope;
            if (reach == Reach::anywhere) {
                rows.place[g][i] = place;
                rows.first[g][i] = begin;
            } else if (reach == Reach::halves) {
                const float low = place - 0.5f * (0.5f * width - 1) * __builtin_fabsf(slope) + lowest;
                const float block = window_of(low - 0.25f * width * slope);
                const float above = window_of(low + 0.25f * width * slope);
                rows.first[g][i] = clamped_place(begin + static_cast<std::int32_t>(block), last);
                rows.upper[g][i] = clamped_place(begin + static_cast<std::int32_t>(above), last);
                rows.apart[g][i] = static_cast<std::int32_t>(above - block);
                rows.place[g][i] = place - (block < above ? block : above);
            } else {
                constexpr std::int32_t step = reach == Reach::single ? 1 : window_step;
                const float low = place - 0.5f * (width - 1) * __builtin_fabsf(slope) + lowest;
                const float block = reach == Reach::single ? nearest_whole(place + middle) : window_of(low);
                const std::int32_t first = begin + static_cast<std::int32_t>(block) * step;
                rows.first[g][i] = reach == Reach::single ? place_in_table(first) : clamped_place(first, last);
                rows.place[g][i] = place - block * step;
            }
        }
    }
}

template <Reach reach>
SARFOCUS_INLINE Indices bins_of(Indices whole, std::int32_t first, std::int32_t last_bin) {
    if constexpr (reach != Reach::anywhere) return whole;
    Indices bin = integers(whole) + first;
    bin = bin > 0 ? bin : Indices{};
    return bin < last_bin ? bin : Indices{} + last_bin;
}

struct LaneWeights {
    alignas(64) float re[tile_lanes];
    alignas(64) float im[tile_lanes];
};

template <Reach reach>
SARFOCUS_INLINE LookUp<reach> look_up(const float* table, const RowPlaces& rows, std::ptrdiff_t g, std::ptrdiff_t i, Indices whole,
                                      std::int32_t last_bin) {
    const std::int32_t first = rows.first[g][i];
    if constexpr (reach == Reach::halves)
        return {table, first, rows.upper[g][i], rows.apart[g][i], whole};
    else
        return {table, first, bins_of<reach>(whole, first, last_bin)};
}

// What the rows of a tile have in common: neither the bend of the phase nor the slope of the lanes, the first but for a small angle, the
// first, or both.
enum class Rows { own, tilted, level, even };

SARFOCUS_INLINE Rows rows_of(const PlaneTerms& terms, std::ptrdiff_t p, float last_row) {
    constexpr float negligible = static_cast<float>(0.5 * series_phase_error / radians_a_bin);  // bins
    constexpr float small_angle = 0.014f;                                                       // rad, of which half the square is 1e-4
    constexpr auto allowed = static_cast<float>(0.25 * series_phase_error);
    if (!(terms.most_squint[p] <= allowed && terms.most_tilt[p] <= small_angle)) return Rows::own;
    if (terms.most_tilt[p] + terms.most_squint[p] > allowed) return Rows::tilted;
    const float m = 0.5f * last_row;
    const float change = m * (__builtin_fabsf(terms.slope[1][p]) + m * __builtin_fabsf(terms.slope[2][p]));
    return 0.5f * (width - 1) * change <= negligible ? Rows::even : Rows::level;
}

// Places of the lanes of a row, from that of their centre.
template <Reach reach>
SARFOCUS_INLINE Rounded lane_places(Floats place) {
    if constexpr (reach == Reach::single) return {Indices{}, place};
    return rounded(place);
}

SARFOCUS_INLINE Floats lanes_of_group() {
    alignas(64) float numbers[width];
    for (std::ptrdiff_t l = 0; l < width; ++l) numbers[l] = static_cast<float>(l) - 0.5f * (width - 1);
    return load(numbers);
}

// What is left of the bend in each row, rad.
SARFOCUS_INLINE void find_tilts(const PlaneTerms& terms, std::ptrdiff_t p, float m, float* tilt) {
    const float square = terms.tilt[0][p], cube = terms.tilt[1][p];
#pragma omp simd
    for (std::int32_t i = 0; i < static_cast<std::int32_t>(tile_rows); ++i) {
        const float x = static_cast<float>(i) - m;
        tilt[i] = square * (x * x - 0.5f * m * m) + cube * x * (x * x - 0.75f * m * m);
    }
}

// The sums of one pulse over all rows, but for the bend of the tile. Without it the phase of a lane turns by the same angle from row to
// row: the next is 2 cos(angle) times it, less the one before.
template <Reach reach, Rows kind>
void add_level_rows(const PulseGroup& pulses, const PlaneTile& tile, const PlaneTerms& terms, std::ptrdiff_t p, const LaneWeights* weights,
                    float* re, float* im) {
    constexpr bool even = kind == Rows::even;
    RowPlaces rows;
    find_rows<reach>(pulses, tile, terms, p, rows);
    alignas(64) float tilt[tile_rows];
    if (kind == Rows::tilted) find_tilts(terms, p, 0.5f * static_cast<float>(tile.rows - 1), tilt);
    Floats across[lane_groups], twice[lane_groups];
    Complex first_phase[lane_groups], one_before[lane_groups];
    for (std::ptrdiff_t g = 0; g < lane_groups; ++g) {
        const Floats j = lanes_of_group() + group_centre(g);
        across[g] = j * j * (terms.bend[0][p] + j * terms.bend[1][p]);
        if (even) across[g] += lanes_of_group() * terms.slope[0][p];
        first_phase[g] = turn(terms.level_first[0][p] + j * (terms.level_first[1][p] + j * (terms.first[2][p] + j * terms.first[3][p])));
        const Complex step = turn(terms.level_step[0][p] + j * (terms.level_step[1][p] + j * terms.step[2][p]));
        if (weights != nullptr) first_phase[g] = first_phase[g] * Complex{load(weights->re + g * width), load(weights->im + g * width)};
        one_before[g] = first_phase[g] * Complex{step.re, -step.im};
        twice[g] = 2.0f * step.re;
    }
    const float* table = pulses.bins[p];
    const std::ptrdiff_t n_row = tile.rows;
    for (std::ptrdiff_t g = 0; g < lane_groups; ++g) {
        const auto add_row = [&](std::ptrdiff_t i, Complex phase) __attribute__((always_inline)) {
            const Floats from_centre = even ? across[g] : lanes_of_group() * rows.slope[i] + across[g];
            const Rounded at = lane_places<reach>(from_centre + rows.place[g][i]);
            const LookUp<reach> bins = look_up<reach>(table, rows, g, i, at.whole, pulses.n_bin - 1);
            const std::ptrdiff_t k = i * tile_lanes + g * width;
            if (kind == Rows::tilted) phase = {phase.re - tilt[i] * phase.im, phase.im + tilt[i] * phase.re};
            add_product(re + k, im + k, interpolated(bins, at.rest), phase);
        };
        Complex even_row = first_phase[g], odd_row = one_before[g];
        std::ptrdiff_t i = 0;
        for (; i + 1 < n_row; i += 2) {
            add_row(i, even_row);
            odd_row = {twice[g] * even_row.re - odd_row.re, twice[g] * even_row.im - odd_row.im};
            add_row(i + 1, odd_row);
            even_row = {twice[g] * odd_row.re - even_row.re, twice[g] * odd_row.im - even_row.im};
        }
        if (i < n_row) add_row(i, even_row);
    }
}

// Adds the sums that leave out the bend of the tile, turned by it.
SARFOCUS_INLINE void add_bent(const PulseGroup& pulses, const PlaneTile& tile, const TileBend& bend, const TileSums& level, float* re,
                              float* im) {
    constexpr double few_radians = 0.03;  // of which the third power may be left out
    const double m = 0.5 * static_cast<double>(tile.rows - 1);
    const double radians = full_circle * pulses.cycles_per_metre;
    const bool small = radians * m * m * 0.5 * (tile_lanes - 1) * magnitude(bend.lane) <= few_radians;
    alignas(64) float row_re[tile_rows], row_im[tile_rows], a_lane[tile_rows];
    for (std::ptrdiff_t i = 0; i < tile_rows; i += width) {
        alignas(64) float cycles[width];
#pragma omp simd
        for (std::int32_t l = 0; l < static_cast<std::int32_t>(width); ++l) {
            const double x = static_cast<double>(static_cast<std::int32_t>(i) + l) - m;
            const double of_row = pulses.cycles_per_metre * x * x * (bend.square + bend.cube * x);
            cycles[l] = static_cast<float>(of_row - nearest_whole(of_row));
            a_lane[i + l] = static_cast<float>(radians * x * x * bend.lane);
        }
        const Complex of_rows = turn(load(cycles));
        store(row_re + i, of_rows.re);
        store(row_im + i, of_rows.im);
    }
    for (std::ptrdiff_t i = 0; i < tile.rows; ++i) {
        const Complex of_row{broadcast(row_re[i]), broadcast(row_im[i])};
        for (std::ptrdiff_t g = 0; g < lane_groups; ++g) {
            const std::ptrdiff_t k = i * tile_lanes + g * width;
            const Floats angle = (lanes_of_group() + group_centre(g)) * a_lane[i];
            const Complex of_lane =
                small ? Complex{1.0f - 0.5f * angle * angle, angle} : turn(angle * static_cast<float>(1.0 / full_circle));
            add_product(re + k, im + k, {load(level.re + k), load(level.im + k)}, of_row * of_lane);
        }
    }
}

// The sums of one pulse over all rows. The phase is turned on from row to row by a step, the step by its change, and that by a small
// angle.
template <Reach reach>
void add_rows(const PulseGroup& pulses, const PlaneTile& tile, const PlaneTerms& terms, std::ptrdiff_t p, const LaneWeights* weights,
              float* re, float* im) {
    RowPlaces rows;
    find_rows<reach>(pulses, tile, terms, p, rows);
    Floats bend[lane_groups];
    Complex first_phase[lane_groups], first_step[lane_groups], first_change[lane_groups];
    for (std::ptrdiff_t g = 0; g < lane_groups; ++g) {
        const Floats j = lanes_of_group() + group_centre(g);
        bend[g] = j * j * (terms.bend[0][p] + j * terms.bend[1][p]);
        first_phase[g] = turn(terms.first[0][p] + j * (terms.first[1][p] + j * (terms.first[2][p] + j * terms.first[3][p])));
        first_step[g] = turn(terms.step[0][p] + j * (terms.step[1][p] + j * terms.step[2][p]));
        first_change[g] = turn(terms.step_change[0][p] + j * terms.step_change[1][p]);
        if (weights != nullptr) first_phase[g] = first_phase[g] * Complex{load(weights->re + g * width), load(weights->im + g * width)};
    }
    const float bend_change = terms.bend_change[p];
    const float* table = pulses.bins[p];
    const std::ptrdiff_t n_row = tile.rows;
    for (std::ptrdiff_t g = 0; g < lane_groups; ++g) {
        Complex phase = first_phase[g], step = first_step[g], step_change = first_change[g];
#pragma GCC unroll 4
        for (std::ptrdiff_t i = 0; i < n_row; ++i) {
            const Rounded at = lane_places<reach>(lanes_of_group() * rows.slope[i] + bend[g] + rows.place[g][i]);
            const LookUp<reach> bins = look_up<reach>(table, rows, g, i, at.whole, pulses.n_bin - 1);
            const std::ptrdiff_t k = i * tile_lanes + g * width;
            add_product(re + k, im + k, interpolated(bins, at.rest), phase);
            turn_by(phase, step);
            turn_by(step, step_change);
            step_change.re -= bend_change * step_change.im;
            step_change.im += bend_change * step_change.re;
        }
    }
}

// Where in the table of directions a tile lies, pulse by pulse: the least and the greatest entry.
struct alignas(64) DirectionSpan {
    float low[pulse_capacity];
    float high[pulse_capacity];
};

// Entry, with a fraction, of the direction in which pulse p sees a point.
SARFOCUS_INLINE float aspect_place(const PulseGroup& pulses, const AspectTable& aspect, std::ptrdiff_t p, double x, double y, double z) {
    const double share = pulses.monostatic ? 0.0 : 0.5;
    const auto dx = static_cast<float>(x - pulses.tx[0][p] - share * (pulses.rx[0][p] - pulses.tx[0][p]));
    const auto dy = static_cast<float>(y - pulses.tx[1][p] - share * (pulses.rx[1][p] - pulses.tx[1][p]));
    const auto dz = static_cast<float>(z - pulses.tx[2][p] - share * (pulses.rx[2][p] - pulses.tx[2][p]));
    const float sine = (dx * aspect.axis[0] + dy * aspect.axis[1] + dz * aspect.axis[2]) / __builtin_sqrtf(dx * dx + dy * dy + dz * dz);
    const auto last = static_cast<float>(aspect.n_entry + 1);
    float place = (sine - aspect.start) * aspect.scale + 1.0f;
    place = place < 0.0f ? 0.0f : place;
    return place > last ? last : place;
}

struct Corner {
    double row;
    double lane;
};

// From the corners; what the sine bends between them is of the second order of the tile's size by its distance.
SARFOCUS_INLINE void find_aspects(const PulseGroup& pulses, const PlaneTile& tile, const AspectTable& aspect, const RangeSeries& series,
                                  DirectionSpan& span) {
    const double m = 0.5 * static_cast<double>(tile.rows - 1);
    const double n = 0.5 * static_cast<double>(tile_lanes - 1);
    const double h = half_diagonal(tile);
    for (std::ptrdiff_t p = 0; p < pulse_capacity; ++p) {
        span.low[p] = static_cast<float>(aspect.n_entry + 1);
        span.high[p] = 0.0f;
    }
    const Corner corners[] = {{-m, -n}, {-m, n}, {m, -n}, {m, n}};
    for (const Corner corner : corners) {
        const double x = tile.centre[0] + corner.row * tile.row_step[0] + corner.lane * tile.lane_step[0];
        const double y = tile.centre[1] + corner.row * tile.row_step[1] + corner.lane * tile.lane_step[1];
        const double z = tile.centre[2] + corner.row * tile.row_step[2] + corner.lane * tile.lane_step[2];
#pragma omp simd
        for (std::ptrdiff_t p = 0; p < pulse_capacity; ++p) {
            const float place = aspect_place(pulses, aspect, p, x, y, z);
            const auto ratio = static_cast<float>(h / series.nearest[p]);
            const float margin = ratio * ratio * aspect.scale;
            span.low[p] = place - margin < span.low[p] ? place - margin : span.low[p];
            span.high[p] = place + margin > span.high[p] ? place + margin : span.high[p];
        }
    }
}

enum class Weighting { zero, by_lane, by_pixel };

// The entries of the first and the last row of a tile, lane by lane.
struct alignas(64) LaneEntries {
    std::int32_t low[tile_lanes];
    std::int32_t high[tile_lanes];
};

SARFOCUS_INLINE void find_lane_entries(const PulseGroup& pulses, const PlaneTile& tile, const AspectTable& aspect, std::ptrdiff_t p,
                                       LaneEntries& entries) {
    const double m = 0.5 * static_cast<double>(tile.rows - 1);
    const double first[3] = {tile.centre[0] - m * tile.row_step[0], tile.centre[1] - m * tile.row_step[1],
                             tile.centre[2] - m * tile.row_step[2]};
    const double last[3] = {tile.centre[0] + m * tile.row_step[0], tile.centre[1] + m * tile.row_step[1],
                            tile.centre[2] + m * tile.row_step[2]};
#pragma omp simd
    for (std::int32_t j = 0; j < static_cast<std::int32_t>(tile_lanes); ++j) {
        const double lane = static_cast<double>(j) - 0.5 * (tile_lanes - 1);
        const double x = lane * tile.lane_step[0], y = lane * tile.lane_step[1], z = lane * tile.lane_step[2];
        const auto one = static_cast<std::int32_t>(aspect_place(pulses, aspect, p, first[0] + x, first[1] + y, first[2] + z));
        const auto other = static_cast<std::int32_t>(aspect_place(pulses, aspect, p, last[0] + x, last[1] + y, last[2] + z));
        entries.low[j] = one < other ? one : other;
        entries.high[j] = one < other ? other : one;
    }
}

// The entry for all from low to high, where they are the same, or few and as good as the middle one; else none.
SARFOCUS_INLINE const float* common_entry(const AspectTable& aspect, std::int32_t low, std::int32_t high) {
    constexpr std::int32_t few = 8;
    constexpr float equal_power = 1e-5f;  // -50 dB of the greatest factor; the differences of a tile's pixels are half that and less
    const float* first = aspect.entries + static_cast<std::ptrdiff_t>(2 * low);
    if (aspect.run_end[low] >= high) return first;
    if (high - low > few) return nullptr;
    const float* last = aspect.entries + static_cast<std::ptrdiff_t>(2 * high);
    const float* a = aspect.entries + static_cast<std::ptrdiff_t>(2 * ((low + high) / 2));
    const float most = equal_power * aspect.most_power;
    for (const float* b = first; b <= last; b += 2)
        if (!((a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1]) <= most)) return nullptr;
    return a;
}

// One factor for each lane, where it changes little from the first to the last row.
SARFOCUS_INLINE Weighting find_lane_weights(const PulseGroup& pulses, const PlaneTile& tile, const AspectTable& aspect, std::ptrdiff_t p,
                                            LaneWeights& weights) {
    LaneEntries entries;
    find_lane_entries(pulses, tile, aspect, p, entries);
    bool zero = true;
    for (std::ptrdiff_t j = 0; j < tile_lanes; ++j) {
        const float* a = common_entry(aspect, entries.low[j], entries.high[j]);
        if (a == nullptr) return Weighting::by_pixel;
        weights.re[j] = a[0];
        weights.im[j] = a[1];
        zero = zero && a[0] == 0.0f && a[1] == 0.0f;
    }
    return zero ? Weighting::zero : Weighting::by_lane;
}

SARFOCUS_INLINE Weighting find_weights(const PulseGroup& pulses, const PlaneTile& tile, const AspectTable& aspect,
                                       const DirectionSpan& span, std::ptrdiff_t p, LaneWeights& weights) {
    const float low = span.low[p] > 0.0f ? span.low[p] : 0.0f;
    const auto last = static_cast<float>(aspect.n_entry + 1);
    const float high = span.high[p] < last ? span.high[p] : last;
    const auto entry = static_cast<std::int32_t>(low);
    if (aspect.run_end[entry] < static_cast<std::int32_t>(high)) return find_lane_weights(pulses, tile, aspect, p, weights);
    const float* w = aspect.entries + static_cast<std::ptrdiff_t>(2 * entry);
    if (w[0] == 0.0f && w[1] == 0.0f) return Weighting::zero;
    for (std::ptrdiff_t j = 0; j < tile_lanes; ++j) {
        weights.re[j] = w[0];
        weights.im[j] = w[1];
    }
    return Weighting::by_lane;
}

// Adds a pulse to the sums that leave out the bend of the tile, where that errs little, and else to those that do not.
template <Reach reach>
SARFOCUS_INLINE void add_pulse_within(const PulseGroup& pulses, const PlaneTile& tile, const PlaneTerms& terms, std::ptrdiff_t p, Rows kind,
                                      const LaneWeights* weights, TileSums& level, float* re, float* im) {
    if (kind == Rows::even) return add_level_rows<reach, Rows::even>(pulses, tile, terms, p, weights, level.re, level.im);
    if (kind == Rows::level) return add_level_rows<reach, Rows::level>(pulses, tile, terms, p, weights, level.re, level.im);
    if (kind == Rows::tilted) return add_level_rows<reach, Rows::tilted>(pulses, tile, terms, p, weights, level.re, level.im);
    add_rows<reach>(pulses, tile, terms, p, weights, re, im);
}

SARFOCUS_INLINE void add_pulse(const PulseGroup& pulses, const PlaneTile& tile, const PlaneTerms& terms, std::ptrdiff_t p, Rows kind,
                               const LaneWeights* weights, TileSums& level, float* re, float* im) {
    const Reach reach = reach_of(terms, p, static_cast<float>(tile.rows - 1));
    if (reach == Reach::single) return add_pulse_within<Reach::single>(pulses, tile, terms, p, kind, weights, level, re, im);
    if constexpr (narrowest_window == Reach::close) {
        if (reach == Reach::close) return add_pulse_within<Reach::close>(pulses, tile, terms, p, kind, weights, level, re, im);
        if (reach == Reach::halves) return add_pulse_within<Reach::halves>(pulses, tile, terms, p, kind, weights, level, re, im);
    }
    if constexpr (widest_window != Reach::anywhere) {
        if (reach == Reach::near) return add_pulse_within<Reach::near>(pulses, tile, terms, p, kind, weights, level, re, im);
    }
    if constexpr (widest_window == Reach::far) {
        if (reach == Reach::far) return add_pulse_within<Reach::far>(pulses, tile, terms, p, kind, weights, level, re, im);
    }
    add_pulse_within<Reach::anywhere>(pulses, tile, terms, p, kind, weights, level, re, im);
}

PulseMask add_plane(const PulseGroup& pulses, PulseMask wanted, const PlaneTile& tile, const AspectTable* aspect, float* re, float* im) {
    RangeSeries series{};
    for (double& nearest : series.nearest) nearest = __builtin_inf();
    add_range_series(pulses.tx, pulses.monostatic ? 1.0 : 0.5, tile, series);
    if (!pulses.monostatic) add_range_series(pulses.rx, 0.5, tile, series);
    const std::ptrdiff_t middle = pulses.count / 2;
    const TileBend bend{series.c20[middle], series.c30[middle], series.c21[middle]};
    PlaneTerms terms;
    find_terms(pulses, tile, series, bend, terms);

    DirectionSpan span;
    if (aspect != nullptr) find_aspects(pulses, tile, *aspect, series, span);

    PulseMask left = 0;
    LaneWeights weights;
    TileSums level{};
    bool any_level = false;
    for (std::ptrdiff_t p = 0; p < pulses.count; ++p) {
        const PulseMask bit = PulseMask{1} << p;
        if ((wanted & bit) == 0 || terms.outside[p] > 0.0) continue;
        if (!(terms.error[p] <= series_phase_error)) {
            left |= bit;
            continue;
        }
        if (aspect != nullptr) {
            const Weighting weighting = find_weights(pulses, tile, *aspect, span, p, weights);
            if (weighting == Weighting::by_pixel) left |= bit;
            if (weighting != Weighting::by_lane) continue;
        }
        const Rows kind = rows_of(terms, p, static_cast<float>(tile.rows - 1));
        add_pulse(pulses, tile, terms, p, kind, aspect != nullptr ? &weights : nullptr, level, re, im);
        any_level = any_level || kind != Rows::own;
    }
    if (any_level) add_bent(pulses, tile, bend, level, re, im);
    return left;
}

}  // namespace
}  // namespace sarfocus::focus::detail
