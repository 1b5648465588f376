#include "focus/factorized_error.hpp"

#include <algorithm>
#include <cmath>
#include <complex>

#include <sarfocus/core/constants.hpp>

#include "focus/factorized_leaf.hpp"
#include "focus/pulse_block.hpp"

namespace sarfocus::focus::detail {
namespace {

constexpr std::ptrdiff_t samples_across = 4;  // tiles tried along each side of the image
constexpr std::ptrdiff_t sample_pulses = 48;

bool holds(const Tile& tile, std::ptrdiff_t row, std::ptrdiff_t column) {
    return row >= tile.row && row < tile.row + tile.rows && column >= tile.column && column < tile.column + tile.columns;
}

// Without those that are left to the exact sum.
std::vector<Tile> sample_tiles(const PixelFrame& frame, const std::vector<RootTile>& roots, std::ptrdiff_t rows, std::ptrdiff_t columns) {
    const auto exact = [&](std::ptrdiff_t i, std::ptrdiff_t j) {
        return std::any_of(roots.begin(), roots.end(), [&](const RootTile& r) { return !r.factorized && holds(r.tile, i, j); });
    };
    std::vector<Tile> out;
    const std::ptrdiff_t last_row = std::max<std::ptrdiff_t>(frame.rows() - rows, 0);
    const std::ptrdiff_t last_column = std::max<std::ptrdiff_t>(frame.columns() - columns, 0);
    for (std::ptrdiff_t i = 0; i < samples_across; ++i)
        for (std::ptrdiff_t j = 0; j < samples_across; ++j)
            if (!exact(last_row * i / (samples_across - 1), last_column * j / (samples_across - 1)))
                out.emplace_back(frame, last_row * i / (samples_across - 1), last_column * j / (samples_across - 1), rows, columns);
    return out;
}

// Five by five pixels of a tile, its corners among them.
std::vector<Vector3> sample_pixels(const PixelFrame& frame, const Tile& tile) {
    std::vector<Vector3> out;
    for (int u = 0; u <= 4; ++u)
        for (int v = 0; v <= 4; ++v)
            out.push_back(frame.position(static_cast<double>(tile.row) + 0.25 * u * static_cast<double>(tile.rows - 1),
                                         static_cast<double>(tile.column) + 0.25 * v * static_cast<double>(tile.columns - 1)));
    return out;
}

double square(double x) {
    return x * x;
}

// A misplaced sample of a spectrum that fills the band: mean square of 2 pi f x, |f| <= 1 / 2 of the sampling rate.
double displacement_error(double metres, double spacing) {
    return square(pi * metres / spacing) / 3.0;
}

// Of exp(2 pi j highest range) along the track, interpolated by the kernel of a level; the sources lie between begin and end.
double kernel_error(const Plan& plan, const Piece& piece, const Level& level, double begin, double end, double highest) {
    const PixelFrame& frame = *plan.frame;
    double power = 0.0;
    double count = 0.0;
    float weights[BandKernel::most_taps];
    for (const Tile& tile : sample_tiles(frame, plan.roots, level.rows, level.columns))
        for (const Vector3& p : sample_pixels(frame, tile))
            for (int k = 0; k < 12; ++k) {
                const double t = begin + (end - begin) * (k + 0.5) / 12.0;
                const auto relative = [&](const Antennas& a) { return range_of(a, p, false) - range_of(a, tile.centre, false); };
                const double own = relative(piece.track->at(t));
                const double place = (t - level.first) / level.step;
                const double whole = std::floor(place);
                level.kernel->weights(place - whole, weights);
                std::complex<double> difference(-1.0, 0.0);
                for (std::ptrdiff_t n = 0; n < level.kernel->taps(); ++n) {
                    const std::ptrdiff_t at = static_cast<std::ptrdiff_t>(whole) - level.kernel->before() + n;
                    const double range =
                        relative(level.centres[static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(at, 0, level.n_centre() - 1))]);
                    difference += static_cast<double>(weights[n]) * std::polar(1.0, two_pi * highest * (range - own));
                }
                power += std::norm(difference);
                count += 1.0;
            }
    return power / std::max(count, 1.0);
}

double leaf_error(const Plan& plan, const Level& level, double spacing) {
    const PixelFrame& frame = *plan.frame;
    const auto scale = static_cast<double>(plan.row_phases);
    double power = 0.0;
    double count = 0.0;
    RowTerms terms[LeafGeometry::most_rows];
    for (const Tile& tile : sample_tiles(frame, plan.roots, level.rows, level.columns)) {
        LeafGeometry geometry(frame, tile, plan.monostatic);
        geometry.set_reference(level.centres[level.centres.size() / 2], plan.cycles_per_metre);
        for (std::size_t n = 0; n < level.centres.size(); n += std::max<std::size_t>(1, level.centres.size() / 5)) {
            double middle[4];
            geometry.locate(level.centres[n], plan.cycles_per_metre, plan.row_phases, terms, middle);
            const double own = range_of(level.centres[n], tile.centre, plan.monostatic);
            for (const std::ptrdiff_t i : {std::ptrdiff_t{0}, tile.rows / 3, tile.rows - 1})
                for (const double j : {0.0, 6.0, 15.0, 24.0, 31.0}) {
                    const double s = j - 0.5 * static_cast<double>(RowTable::columns - 1);
                    const RowTerms& term = terms[i];
                    const Vector3 p = frame.position(static_cast<double>(tile.row + i), static_cast<double>(tile.column) + j);
                    const double range = range_of(level.centres[n], p, plan.monostatic) - own;
                    const double cycles = term.cycles[0] + s * (term.cycles[1] + geometry.reference_slope() +
                                                                s * (term.cycles[2] + geometry.reference_bend() + s * term.cycles[3]));
                    const double q = s + static_cast<double>(term.shift) +
                                     (term.phase + term.place[0] + s * (term.place[1] + s * term.place[2])) / scale;
                    const double found = middle[0] + q * (middle[1] + q * (middle[2] + q * middle[3]));
                    power += square(two_pi * std::remainder(cycles - range * plan.cycles_per_metre, 1.0)) +
                             displacement_error(found - range, spacing);
                    count += 1.0;
                }
        }
    }
    return power / std::max(count, 1.0);
}

}  // namespace

double track_error(const PixelFrame& frame, const std::vector<RootTile>& roots, const geometry::PhaseCentres& centres, std::ptrdiff_t begin,
                   std::ptrdiff_t end, const VirtualTrack& track, std::ptrdiff_t rows, std::ptrdiff_t columns, double highest,
                   double spacing) {
    const std::ptrdiff_t n = std::min(sample_pulses, end - begin);
    PulseBlock block;
    std::vector<std::ptrdiff_t> pulses;
    for (std::ptrdiff_t k = 0; k < n; ++k) {
        pulses.push_back(begin + (end - begin - 1) * k / std::max<std::ptrdiff_t>(n - 1, 1));
        const double along = track.along(middle_of(centres, pulses.back()));
        block.set(k, {centres.tx(pulses.back()), centres.rx(pulses.back())}, track.at(along), track.rate(along));
    }
    double power = 0.0;
    double count = 0.0;
    double shift[PulseBlock::capacity];
    double scale[PulseBlock::capacity];
    for (const Tile& tile : sample_tiles(frame, roots, rows, columns)) {
        block.match(tile.centre, frame.axis(0), frame.axis(1), n, shift, scale);
        const std::vector<Vector3> pixels = sample_pixels(frame, tile);
        for (std::ptrdiff_t k = 0; k < n; ++k) {
            const std::ptrdiff_t pulse = pulses[static_cast<std::size_t>(k)];
            const Antennas place = track.at(track.along(middle_of(centres, pulse)) + shift[k]);
            for (const Vector3& p : pixels) {
                const double moved = (1.0 + scale[k]) * (range_of(place, p, false) - range_of(place, tile.centre, false));
                const double own = centres.range(pulse, p) - centres.range(pulse, tile.centre);
                power += std::min(square(two_pi * highest * (own - moved)), 4.0) + displacement_error(scale[k] * own, spacing);
                count += 1.0;
            }
        }
    }
    return std::sqrt(power / std::max(count, 1.0));
}

double geometric_error(const Plan& plan, const Piece& piece, const geometry::PhaseCentres& centres, double highest, double spacing) {
    double power = leaf_error(plan, piece.levels.back(), spacing);
    if (piece.off_track) {
        const auto [first, last] = std::minmax_element(piece.pulses.begin(), piece.pulses.end());
        const Level& root = piece.levels.front();
        power += square(
            track_error(*plan.frame, plan.roots, centres, *first, *last + 1, *piece.track, root.rows, root.columns, highest, spacing));
    }
    double begin = piece.along.front();
    double end = piece.along.back();
    for (const Level& level : piece.levels) {
        power += kernel_error(plan, piece, level, begin, end, highest);
        begin = level.first;
        end = level.first + static_cast<double>(level.n_centre() - 1) * level.step;
    }
    return power;
}

}  // namespace sarfocus::focus::detail
