#include "focus/factorized_plan.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <numeric>
#include <utility>

#include <sarfocus/core/constants.hpp>
#include <sarfocus/core/error.hpp>

#include "focus/factorized_error.hpp"
#include "focus/factorized_leaf.hpp"
#include "focus/factorized_lines.hpp"

namespace sarfocus::focus::detail {
namespace {

using geometry::ImageGrid;
using geometry::PhaseCentres;

constexpr std::ptrdiff_t leaf_columns = RowTable::columns;
constexpr double most_cubic_band = 0.7;   // of the bins' sampling rate
constexpr double least_slope = 0.1;       // of the range along a row, m a metre: flatter rows are left to the exact sum
constexpr double most_exact_share = 0.3;  // of the image, before all of it is formed exactly

// Cycles of one processor with AVX-512, measured once; only their ratios matter.
namespace cost {
constexpr double exact_plane_term = 0.85;
constexpr double exact_point_term = 1.9;  // of the pixels of a polar grid
constexpr double exact_sample = 20.0;
constexpr double edge_term = 5.0;
constexpr double upsampled_sample = 30.0;
constexpr double line_sample = 3.0;
constexpr double line = 150.0;
constexpr double leaf_bin = 15.0;
constexpr double leaf_term = 0.7;
constexpr double leaf_row = 20.0;
constexpr double planning = 5e7;  // on one thread, while another one waits
}  // namespace cost

// How the tiles of successive levels follow from the smallest.
struct Candidate {
    std::ptrdiff_t leaf_rows;
    std::vector<std::ptrdiff_t> factors;  // from the smallest tile to that of each level, largest first
    double work = 0.0;
};

std::vector<Candidate> candidates(const PixelFrame& frame) {
    std::vector<Candidate> out;
    for (const std::ptrdiff_t rows : {16, 32, 64}) {
        for (const std::ptrdiff_t factor : {1, 2, 4, 8, 16}) {
            if (factor > 1 && (rows * factor > 2 * frame.rows() && leaf_columns * factor > 2 * frame.columns())) continue;
            if (factor == 1)
                out.push_back({rows, {1}});
            else
                out.push_back({rows, {factor, 1}});
            if (factor == 8 || factor == 16) {
                out.push_back({rows, {factor, factor / 4, 1}});
                out.push_back({rows, {factor, 2, 1}});
            }
        }
    }
    return out;
}

// First rows (or columns) of sample tiles: evenly over the image, both edges among them.
std::vector<std::ptrdiff_t> sample_starts(std::ptrdiff_t whole, std::ptrdiff_t tile, std::ptrdiff_t most) {
    const std::ptrdiff_t last = std::max<std::ptrdiff_t>(whole - tile, 0);
    const std::ptrdiff_t n = std::min(most, last / tile + 2);
    std::vector<std::ptrdiff_t> out;
    for (std::ptrdiff_t k = 0; k < n; ++k) {
        const std::ptrdiff_t start = n == 1 ? 0 : last * k / (n - 1);
        if (out.empty() || start != out.back()) out.push_back(start);
    }
    return out;
}

std::vector<std::ptrdiff_t> regular_starts(std::ptrdiff_t whole, std::ptrdiff_t tile) {
    std::vector<std::ptrdiff_t> out;
    for (std::ptrdiff_t start = 0; start < whole; start += tile) out.push_back(start);
    return out;
}

// Share of the image for which each of n samples of `sample_starts` stands.
std::vector<double> weights_of(std::size_t n, std::ptrdiff_t whole, std::ptrdiff_t tile) {
    std::vector<double> out(n, 1.0 / static_cast<double>(n));
    const double tiles = std::max(static_cast<double>(whole) / static_cast<double>(tile), static_cast<double>(n));
    if (n > 2) {
        std::fill(out.begin(), out.end(), (tiles - 2.0) / (static_cast<double>(n - 2) * tiles));
        out.front() = out.back() = 1.0 / tiles;
    }
    return out;
}

// The last of ascending starts that is not behind `at`.
std::size_t last_start(const std::vector<std::ptrdiff_t>& starts, std::ptrdiff_t at) {
    return static_cast<std::size_t>(std::upper_bound(starts.begin(), starts.end(), at) - starts.begin()) - 1;
}

std::vector<Antennas> sample_track(const VirtualTrack& track, std::ptrdiff_t n, bool rates) {
    std::vector<Antennas> out;
    for (std::ptrdiff_t k = 0; k < n; ++k) {
        const double t = track.begin() + (track.end() - track.begin()) * static_cast<double>(k) / static_cast<double>(n - 1);
        out.push_back(rates ? track.rate(t) : track.at(t));
    }
    return out;
}

// Change of range with the track's parameter.
double range_rate(const Antennas& place, const Antennas& rate, const Vector3& p) {
    const Vector3 forth = place.tx - p;
    const Vector3 back = place.rx - p;
    return 0.5 * (dot(forth, rate.tx) / norm(forth) + dot(back, rate.rx) / norm(back));
}

// Rows must be straight and go across the lines of equal range, in one direction.
bool rows_cross_ranges(const PixelFrame& frame, const Tile& tile, std::ptrdiff_t leaf_rows, const std::vector<Antennas>& places) {
    double sign = 0.0;
    for (const double i : {0.0, 1.0})
        for (const double j : {0.0, 1.0}) {
            const double row = static_cast<double>(tile.row) + i * static_cast<double>(tile.rows - 1);
            const Vector3 p = frame.position(row, static_cast<double>(tile.column) + j * static_cast<double>(tile.columns - 1));
            const Vector3 step = frame.along_row(row);
            const Vector3 across =
                frame.position(row + 1.0, static_cast<double>(tile.column)) - frame.position(row, static_cast<double>(tile.column));
            for (const Antennas& a : places) {
                const Vector3 forth = p - a.tx;
                const Vector3 back = p - a.rx;
                const double slope = 0.5 * (dot(forth, step) / norm(forth) + dot(back, step) / norm(back));
                const double tilt = 0.5 * (dot(forth, across) / norm(forth) + dot(back, across) / norm(back));
                if (sign == 0.0) sign = slope;
                const double shift = std::abs(tilt) * 0.5 * static_cast<double>(leaf_rows);
                if (!(slope * sign > 0.0) || std::abs(slope) < least_slope * norm(step) ||
                    shift > static_cast<double>(RowTable::margin - 2) * std::abs(slope))
                    return false;
            }
        }
    return true;
}

class Planner {
public:
    Planner(const RangeProfiles& profiles, const PhaseCentres& centres, const ImageGrid& grid, const FactorizedOptions& options)
        : profiles_(profiles),
          centres_(centres),
          threads_(resolve_threads(options.execution.threads)),
          target_(std::pow(10.0, options.target_error_db / 20.0)) {
        plan_.monostatic = centres.monostatic();
        plan_.spacing = profiles.range_spacing / line_upsample;
        plan_.cycles_per_metre = 2.0 / profiles.wavelength;
        terms_ = static_cast<double>(grid.size()) * static_cast<double>(centres.n_pulse());
        plan_.exact_work = terms_ * (grid.kind() == ImageGrid::Kind::plane ? cost::exact_plane_term : cost::exact_point_term) +
                           cost::exact_sample * static_cast<double>(profiles.data.size());
        highest_ = plan_.cycles_per_metre + 0.5 / profiles.range_spacing;
        choose_frame(grid);
    }

    Plan run() {
        const std::vector<std::ptrdiff_t> ends = pieces_of_path(centres_);
        if (ends.empty()) return exact("the path does not go on in one direction for 64 pulses");
        if (plan_.exact_work < 2.0 * cost::planning) return exact("the job is small");
        if (too_coarse()) return exact("pixels lie too far apart along range");
        std::vector<Candidate> list = candidates(*plan_.frame);
        for (Candidate& c : list) {
            prepare(c, ends, false);
            c.work = plan_.work;
        }
        std::erase_if(list, [&](const Candidate& c) { return !(c.work < 0.9 * plan_.exact_work); });
        if (list.empty()) return exact("factorising would take as long");
        std::stable_sort(list.begin(), list.end(), [](const Candidate& a, const Candidate& b) { return a.work < b.work; });
        for (const Candidate& c : list) {
            prepare(c, ends, true);
            if (!(plan_.work < 0.9 * plan_.exact_work)) continue;
            plan_.predicted_error = predict();
            if (plan_.predicted_error <= target_) return std::move(plan_);
        }
        return exact("no way of factorising keeps the target");
    }

private:
    Plan exact(const char* why) {
        plan_.pieces.clear();
        plan_.roots.clear();
        plan_.exact_because = why;
        plan_.work = plan_.exact_work;
        return std::move(plan_);
    }

    void choose_frame(const ImageGrid& grid) {
        plan_.frame = std::make_unique<PixelFrame>(grid, false);
        if (grid.kind() != ImageGrid::Kind::plane) return;
        const PixelFrame& frame = *plan_.frame;
        const std::ptrdiff_t p = centres_.n_pulse() / 2;
        const double i = 0.5 * static_cast<double>(frame.rows() - 1);
        const double j = 0.5 * static_cast<double>(frame.columns() - 1);
        const double here = centres_.range(p, frame.position(i, j));
        const double along_row = std::abs(centres_.range(p, frame.position(i, j + 1.0)) - here) / norm(frame.along_row(i));
        const double across =
            std::abs(centres_.range(p, frame.position(i + 1.0, j)) - here) / norm(frame.position(i + 1.0, j) - frame.position(i, j));
        if (across > along_row) plan_.frame = std::make_unique<PixelFrame>(grid, true);
    }

    // Everything about a candidate; without `thorough` the path is a curve of the third order, and no tables are built.
    void prepare(const Candidate& candidate, const std::vector<std::ptrdiff_t>& ends, bool thorough) {
        const std::ptrdiff_t root_rows = candidate.leaf_rows * candidate.factors.front();
        const std::ptrdiff_t root_columns = leaf_columns * candidate.factors.front();
        const auto n_level = static_cast<double>(candidate.factors.size());
        // Along range there is one filter a level and one to the bins, whose errors may add up with one sign; along the track one filter a
        // level, of which the largest error, at the edge of a tile, is many times the mean; then the cubic, and the geometry.
        const double share = target_ / std::sqrt(n_level + 1.0);
        choose_range_kernel(0.85 * target_ / (n_level + 1.0), 0.4 * target_, thorough);
        plan_.pieces.clear();
        for (std::size_t k = 0; k + 1 < ends.size(); ++k)
            plan_.pieces.push_back(piece(ends[k], ends[k + 1], root_rows, root_columns, thorough));
        cut_roots(root_rows, root_columns, candidate.leaf_rows, thorough);
        for (Piece& p : plan_.pieces) set_levels(p, candidate, share, thorough);
        plan_.work = estimate(candidate);
        if (thorough) group_roots();
    }

    void choose_range_kernel(double share, double cubic_share, bool thorough) {
        const double band = 1.0 / line_upsample;
        range_taps_ = 4;
        while (range_taps_ < BandKernel::most_taps && BandKernel::error(range_taps_, band).mean > share) range_taps_ += 2;
        range_error_ = BandKernel::error(range_taps_, band).mean;
        if (thorough) plan_.range_kernel = std::make_unique<BandKernel>(range_taps_, band);
        if (!thorough && plan_.cubic) return;
        const PixelFrame& frame = *plan_.frame;
        const double pixel = norm(frame.along_row(0.5 * static_cast<double>(frame.rows())));
        for (plan_.row_phases = 1; plan_.row_phases <= RowTable::most_phases; ++plan_.row_phases) {
            const double bin = pixel / static_cast<double>(plan_.row_phases);  // along a row that runs straight away from the radar
            const double cubic_band = bin / profiles_.range_spacing;
            if (cubic_band > most_cubic_band) continue;
            plan_.cubic = std::make_unique<BandCubic>(cubic_band);
            if (plan_.cubic->error() <= cubic_share) return;
        }
        plan_.row_phases = RowTable::most_phases;
    }

    // Pixels so far apart that even the most bins between them sample the data too coarsely.
    [[nodiscard]] bool too_coarse() const {
        const double pixel = norm(plan_.frame->along_row(0.5 * static_cast<double>(plan_.frame->rows())));
        return pixel > most_cubic_band * static_cast<double>(RowTable::most_phases) * profiles_.range_spacing;
    }

    std::shared_ptr<const VirtualTrack> track(std::ptrdiff_t begin, std::ptrdiff_t count, std::ptrdiff_t degree) {
        std::shared_ptr<const VirtualTrack>& found = tracks_[{begin, degree}];
        if (!found) found = std::make_shared<VirtualTrack>(centres_, begin, count, degree);
        return found;
    }

    Piece piece(std::ptrdiff_t begin, std::ptrdiff_t end, std::ptrdiff_t root_rows, std::ptrdiff_t root_columns, bool thorough) {
        Piece out;
        const std::ptrdiff_t count = end - begin;
        for (const std::ptrdiff_t degree : {1, 2, 3, 4, 6, 8, 12, 16, 24}) {
            if (!thorough && degree != 3) continue;
            if (degree > 4 && degree > count / 8) break;
            out.track = track(begin, count, degree);
            out.off_track = out.track->deviation() > 1e-5 * profiles_.wavelength;
            if (!out.off_track) break;
            if (thorough && track_error(*plan_.frame, plan_.roots, centres_, begin, end, *out.track, root_rows, root_columns, highest_,
                                        profiles_.range_spacing) < 0.3 * target_)
                break;
        }
        if (!thorough) {
            out.pulses.resize(static_cast<std::size_t>(count));
            out.along = {out.track->begin(), out.track->end()};
            return out;
        }
        std::vector<double> along(static_cast<std::size_t>(count));
        for (std::ptrdiff_t p = begin; p < end; ++p) along[static_cast<std::size_t>(p - begin)] = out.track->along(middle_of(centres_, p));
        out.pulses.resize(static_cast<std::size_t>(count));
        std::iota(out.pulses.begin(), out.pulses.end(), begin);
        std::stable_sort(out.pulses.begin(), out.pulses.end(), [&](std::ptrdiff_t a, std::ptrdiff_t b) {
            return along[static_cast<std::size_t>(a - begin)] < along[static_cast<std::size_t>(b - begin)];
        });
        for (const std::ptrdiff_t p : out.pulses) out.along.push_back(along[static_cast<std::size_t>(p - begin)]);
        return out;
    }

    // All tiles of the first level, or samples of them.
    void cut_roots(std::ptrdiff_t root_rows, std::ptrdiff_t root_columns, std::ptrdiff_t leaf_rows, bool thorough) {
        const PixelFrame& frame = *plan_.frame;
        std::vector<Antennas> places;
        for (const Piece& p : plan_.pieces)
            for (const Antennas& a : sample_track(*p.track, 9, false)) places.push_back(a);
        plan_.roots.clear();
        root_rows_ = thorough ? regular_starts(frame.rows(), root_rows) : sample_starts(frame.rows(), root_rows, 7);
        root_columns_ = thorough ? regular_starts(frame.columns(), root_columns) : sample_starts(frame.columns(), root_columns, 7);
        for (const std::ptrdiff_t i : root_rows_)
            for (const std::ptrdiff_t j : root_columns_) {
                const Tile tile(frame, i, j, root_rows, root_columns);
                plan_.roots.push_back({tile, rows_cross_ranges(frame, tile, leaf_rows, places), edge_share(tile, places)});
            }
    }

    // Share of the pulses whose record begins or ends within the tile.
    [[nodiscard]] double edge_share(const Tile& tile, const std::vector<Antennas>& places) const {
        constexpr std::ptrdiff_t n = 16;
        const Extent extent = extent_of(*plan_.frame, tile, places.data(), places.size(), 1, plan_.monostatic);
        const double record = static_cast<double>(profiles_.data.extent(1) - 1) * profiles_.range_spacing;
        double found = 0.0;
        for (std::ptrdiff_t k = 0; k <= n; ++k) {
            const std::ptrdiff_t pulse = (centres_.n_pulse() - 1) * k / n;
            const double behind = centres_.range(pulse, tile.centre) - profiles_.first_range(pulse);
            const double low = behind + extent.low - 2.0 * plan_.spacing;
            const double high = behind + extent.high + 2.0 * plan_.spacing;
            if ((low < 0.0 && high > 0.0) || (low < record && high > record)) found += 1.0 / (n + 1.0);
        }
        return found;
    }

    // The fastest change of a tile pixel's range against that of its centre along the track, m a metre, over sample tiles.
    double fastest(const Piece& p, std::ptrdiff_t rows, std::ptrdiff_t columns, bool thorough, double& half_diagonal) const {
        const PixelFrame& frame = *plan_.frame;
        const std::ptrdiff_t most_tiles = thorough ? 9 : 3;
        const std::ptrdiff_t n_place = thorough ? 17 : 5;
        const std::vector<Antennas> places = sample_track(*p.track, n_place, false);
        const std::vector<Antennas> rates = sample_track(*p.track, n_place, true);
        double out = 0.0;
        for (const std::ptrdiff_t i : sample_starts(frame.rows(), rows, most_tiles))
            for (const std::ptrdiff_t j : sample_starts(frame.columns(), columns, most_tiles)) {
                if (!factorized_at(i, j)) continue;
                const Tile tile(frame, i, j, rows, columns);
                for (const double u : {-0.5, 0.5})
                    for (const double v : {-0.5, 0.5}) {
                        const Vector3 corner = corner_of(tile, u, v);
                        half_diagonal = std::max(half_diagonal, norm(corner - tile.centre));
                        for (std::size_t k = 0; k < places.size(); ++k)
                            out = std::max(
                                out, std::abs(range_rate(places[k], rates[k], corner) - range_rate(places[k], rates[k], tile.centre)));
                    }
            }
        return out;
    }

    [[nodiscard]] Vector3 corner_of(const Tile& tile, double u, double v) const {
        return plan_.frame->position(static_cast<double>(tile.row) + (0.5 + u) * static_cast<double>(tile.rows - 1),
                                     static_cast<double>(tile.column) + (0.5 + v) * static_cast<double>(tile.columns - 1));
    }

    [[nodiscard]] bool factorized_at(std::ptrdiff_t row, std::ptrdiff_t column) const {
        return plan_.roots[last_start(root_rows_, row) * root_columns_.size() + last_start(root_columns_, column)].factorized;
    }

    // Taps and oversampling that keep `share` with the fewest centres and sums.
    static std::pair<std::ptrdiff_t, double> choose_track_kernel(double needed, double share) {
        static const std::vector<std::array<double, 3>> table = [] {
            std::vector<std::array<double, 3>> out;
            for (const double oversampling : {1.25, 1.4, 1.6, 1.8, 2.0, 2.4, 3.0})
                for (std::ptrdiff_t taps = 4; taps <= BandKernel::most_taps; taps += 2)
                    out.push_back({oversampling, static_cast<double>(taps), BandKernel::error(taps, 1.0 / oversampling).largest});
            return out;
        }();
        std::array<double, 3> best = table.back();
        double least = 1e300;
        for (const auto& row : table) {
            const double effort = needed * row[0] + 2.0 * row[1];
            if (row[2] <= share && effort < least) {
                least = effort;
                best = row;
            }
        }
        return {static_cast<std::ptrdiff_t>(best[1]), best[0]};
    }

    void set_levels(Piece& p, const Candidate& candidate, double share, bool thorough) {
        double begin = p.along.front();
        double end = p.along.back();
        const std::size_t n_level = candidate.factors.size();
        for (std::size_t l = 0; l < n_level; ++l) {
            Level level;
            level.rows = candidate.leaf_rows * candidate.factors[l];
            level.columns = leaf_columns * candidate.factors[l];
            double half_diagonal = 0.0;
            const double rate = std::max(1.02 * fastest(p, level.rows, level.columns, thorough, half_diagonal), 1e-12);
            const double needed = 2.0 * highest_ * rate * (end - begin);
            const auto [taps, oversampling] = choose_track_kernel(needed, share);
            level.oversampling = oversampling;
            level.step = std::min(0.5 / (oversampling * highest_ * rate), end - begin);
            // Pulses beside the track are moved along it a little.
            const std::ptrdiff_t slack = l == 0 && p.off_track ? 1 : 0;
            const std::ptrdiff_t before = taps / 2 - 1 + slack;
            level.first = begin - static_cast<double>(before) * level.step;
            const std::ptrdiff_t n = static_cast<std::ptrdiff_t>(std::floor((end - begin) / level.step)) + taps + 2 * slack;
            level.margin = (range_taps_ / 2 + 1) * static_cast<std::ptrdiff_t>(n_level - l) + BandCubic::side + 2;
            level.margin_behind = level.margin + line_lanes * static_cast<std::ptrdiff_t>(n_level - 1 - l);
            level.most_width = static_cast<std::ptrdiff_t>(2.0 * 1.05 * half_diagonal / plan_.spacing) + level.margin +
                               level.margin_behind + 4 + line_lanes;
            begin = level.first;
            end = level.first + static_cast<double>(n - 1) * level.step;
            if (n > 4 * static_cast<std::ptrdiff_t>(p.pulses.size()) + 64) {  // far from paying
                plan_too_large_ = true;
                level.centres.resize(1);
                p.levels.push_back(std::move(level));
                continue;
            }
            level.centres.resize(static_cast<std::size_t>(n));
            if (thorough) {
                level.kernel = std::make_unique<BandKernel>(taps, 1.0 / oversampling);
                for (std::ptrdiff_t k = 0; k < n; ++k)
                    level.centres[static_cast<std::size_t>(k)] = p.track->at(level.first + static_cast<double>(k) * level.step);
                level.arrays = std::make_unique<AntennaArrays>(level.centres);
                if (l > 0) set_sources(p.levels.back(), level);
            }
            p.levels.push_back(std::move(level));
        }
    }

    static void set_sources(const Level& parent, Level& level) {
        level.sources.assign(level.centres.size(), {});
        float weights[BandKernel::most_taps];
        for (std::ptrdiff_t k = 0; k < parent.n_centre(); ++k) {
            const double place = (parent.first - level.first + static_cast<double>(k) * parent.step) / level.step + 1e-9;
            const double whole = std::floor(place);
            level.kernel->weights(place - whole, weights);
            const std::ptrdiff_t first = static_cast<std::ptrdiff_t>(whole) - level.kernel->before();
            for (std::ptrdiff_t t = 0; t < level.kernel->taps(); ++t) {
                const std::ptrdiff_t at = first + t;
                if (at < 0 || at >= level.n_centre()) continue;
                Level::Sources& source = level.sources[static_cast<std::size_t>(at)];
                if (source.weights.empty()) source.first = k;
                source.weights.push_back(weights[t]);
            }
        }
    }

    double estimate(const Candidate& candidate) {
        const PixelFrame& frame = *plan_.frame;
        const Level& root = plan_.pieces.front().levels.front();
        const std::vector<double> row_weights = weights_of(root_rows_.size(), frame.rows(), root.rows);
        const std::vector<double> column_weights = weights_of(root_columns_.size(), frame.columns(), root.columns);
        double exact_share = 0.0;
        double edge_share = 0.0;
        for (std::size_t k = 0; k < plan_.roots.size(); ++k) {
            const double weight = row_weights[k / root_columns_.size()] * column_weights[k % root_columns_.size()];
            (plan_.roots[k].factorized ? edge_share : exact_share) +=
                weight * (plan_.roots[k].factorized ? plan_.roots[k].edge_share : 1.0);
        }
        double work = cost::planning + exact_share * plan_.exact_work + edge_share * cost::edge_term * terms_;
        if (exact_share > most_exact_share || plan_too_large_) {
            plan_too_large_ = false;
            return 2.0 * plan_.exact_work;
        }
        const std::vector<Antennas> places = sample_track(*plan_.pieces.front().track, 5, false);
        for (const Piece& p : plan_.pieces) {
            const auto n_pulse = static_cast<double>(p.pulses.size());
            const double upsampling =
                cost::upsampled_sample * n_pulse * line_upsample * static_cast<double>(profiles_.data.extent(1) + 2 * guard_samples);
            double lines = n_pulse;
            for (std::size_t l = 0; l < p.levels.size(); ++l) {
                const Level& level = p.levels[l];
                const Tile tile(frame, frame.rows() / 2, frame.columns() / 2, level.rows, level.columns);
                const Extent extent = extent_of(frame, tile, places.data(), places.size(), 1, plan_.monostatic);
                const double width = (extent.high - extent.low) / plan_.spacing + static_cast<double>(level.margin + level.margin_behind);
                const double tiles = std::ceil(static_cast<double>(frame.rows()) / static_cast<double>(level.rows)) *
                                     std::ceil(static_cast<double>(frame.columns()) / static_cast<double>(level.columns));
                work += tiles * lines * (cost::line_sample * width + cost::line);
                lines = static_cast<double>(level.n_centre());
                if (l == 0) work += upsampling * std::ceil(tiles * lines * 2.0 * sizeof(float) * width / budget());
                if (l + 1 == p.levels.size())
                    work +=
                        tiles * lines *
                        (cost::leaf_bin * static_cast<double>(plan_.row_phases * (leaf_columns + 14)) +
                         static_cast<double>(candidate.leaf_rows) * (cost::leaf_term * static_cast<double>(leaf_columns) + cost::leaf_row));
            }
        }
        return work;
    }

    // Bytes of lines that may be held at a time: half the size of input and output.
    [[nodiscard]] double budget() const {
        const auto pixels = static_cast<double>(plan_.frame->rows()) * static_cast<double>(plan_.frame->columns());
        return std::max(32e6, 0.5 * static_cast<double>(sizeof(cfloat)) * (static_cast<double>(profiles_.data.size()) + pixels));
    }

    // Groups of root tiles whose lines are held together.
    void group_roots() {
        plan_.groups.assign(1, 0);
        double held = 0.0;
        double most = 0.0;
        std::ptrdiff_t centres = 1;
        for (const Piece& p : plan_.pieces) centres = std::max(centres, p.levels.front().n_centre());
        for (std::size_t k = 0; k < plan_.roots.size(); ++k) {
            const Extent extent = extent_on(plan_.roots[k].tile);
            const double bytes = sizeof(float) * static_cast<double>(centres) *
                                 static_cast<double>(line_floats(line_width(extent, plan_.pieces.front().levels.front())));
            if (held > 0.0 && held + bytes > budget()) {
                plan_.groups.push_back(k);
                held = 0.0;
            }
            held += bytes;
            most = std::max(most, held);
        }
        plan_.groups.push_back(plan_.roots.size());
        const std::ptrdiff_t width = line_upsample * (profiles_.data.extent(1) + 2 * guard_samples) + line_lanes;
        plan_.memory = static_cast<std::uint64_t>(most) +
                       static_cast<std::uint64_t>(held_pulses(width)) * static_cast<std::uint64_t>(line_floats(width)) * sizeof(float);
        for (const Piece& p : plan_.pieces)
            for (std::size_t l = 1; l < p.levels.size(); ++l)
                plan_.memory += static_cast<std::uint64_t>(threads_) * sizeof(float) *
                                static_cast<std::uint64_t>(p.levels[l].n_centre() * line_floats(p.levels[l].most_width));
    }

    [[nodiscard]] Extent extent_on(const Tile& tile) const {
        Extent out{0.0, 0.0};
        for (const Piece& p : plan_.pieces) {
            const Level& level = p.levels.front();
            const Extent e = extent_of(*plan_.frame, tile, level.centres.data(), level.centres.size(),
                                       std::max<std::size_t>(1, level.centres.size() / 16), plan_.monostatic);
            out = {std::min(out.low, e.low), std::max(out.high, e.high)};
        }
        return out;
    }

    [[nodiscard]] std::ptrdiff_t line_width(const Extent& extent, const Level& level) const {
        const auto n =
            static_cast<std::ptrdiff_t>(std::ceil((extent.high - extent.low) / plan_.spacing)) + 1 + level.margin + level.margin_behind;
        return (n + line_lanes - 1) / line_lanes * line_lanes;
    }

    [[nodiscard]] double predict() const {
        const auto n_level = static_cast<double>(plan_.pieces.front().levels.size());
        double power = (n_level + 1.0) * (n_level + 1.0) * range_error_ * range_error_ + plan_.cubic->error() * plan_.cubic->error();
        double geometric = 0.0;
        for (const Piece& p : plan_.pieces)
            geometric = std::max(geometric, geometric_error(plan_, p, centres_, highest_, profiles_.range_spacing));
        return std::sqrt(power + geometric);
    }

    const RangeProfiles& profiles_;
    const PhaseCentres& centres_;
    int threads_;
    double target_;
    double terms_ = 0.0;    // of the exact sum
    double highest_ = 0.0;  // cycles of phase for a metre of range, at the upper end of the band
    std::ptrdiff_t range_taps_ = 4;
    double range_error_ = 0.0;
    bool plan_too_large_ = false;
    std::vector<std::ptrdiff_t> root_rows_;  // first rows and columns of the tiles in plan_.roots
    std::vector<std::ptrdiff_t> root_columns_;
    std::map<std::pair<std::ptrdiff_t, std::ptrdiff_t>, std::shared_ptr<const VirtualTrack>> tracks_;  // by first pulse and degree
    Plan plan_;
};

}  // namespace

PixelFrame::PixelFrame(const ImageGrid& grid, bool swapped) : grid_(&grid), swapped_(swapped) {
    const auto& v = grid.vectors();
    const Vector3 u = (1.0 / norm(v[1])) * v[1];
    const Vector3 rest = v[2] - dot(v[2], u) * u;
    axes_ = {u, (1.0 / norm(rest)) * rest};
}

Tile::Tile(const PixelFrame& frame, std::ptrdiff_t first_row, std::ptrdiff_t first_column, std::ptrdiff_t most_rows,
           std::ptrdiff_t most_columns)
    : row(first_row),
      column(first_column),
      rows(std::min(most_rows, frame.rows() - first_row)),
      columns(std::min(most_columns, frame.columns() - first_column)),
      centre(frame.position(static_cast<double>(row) + 0.5 * static_cast<double>(rows - 1),
                            static_cast<double>(column) + 0.5 * static_cast<double>(columns - 1))) {}

Extent extent_of(const PixelFrame& frame, const Tile& tile, const Antennas* antennas, std::size_t n, std::size_t step, bool monostatic) {
    const auto at = [&](double u, double v) {
        return frame.position(static_cast<double>(tile.row) + u * static_cast<double>(tile.rows - 1),
                              static_cast<double>(tile.column) + v * static_cast<double>(tile.columns - 1));
    };
    const std::array<Vector3, 2> rows{at(0.0, 0.5), at(1.0, 0.5)};
    const std::array<Vector3, 2> columns{at(0.5, 0.0), at(0.5, 1.0)};
    const std::array<std::array<Vector3, 2>, 2> corners{{{at(0.0, 0.0), at(0.0, 1.0)}, {at(1.0, 0.0), at(1.0, 1.0)}}};
    // Across the rows and along them apart, each over all antennas: so the extents of a tile hold those of its parts, whatever the
    // antennas at which they are reached.
    double low[2] = {};
    double high[2] = {};
    double rest = 0.0;
    const auto look = [&](const Antennas& a) {
        const Vector3 forth = tile.centre - a.tx;
        const Vector3 back = tile.centre - a.rx;
        const Vector3 gradient = 0.5 * ((1.0 / norm(forth)) * forth + (1.0 / norm(back)) * back);
        const double own = range_of(a, tile.centre, monostatic);
        double change[2][2];
        for (std::size_t k = 0; k < 2; ++k) {
            // A range is a convex function: nowhere below its tangent, greatest at the ends.
            low[0] = std::min(low[0], dot(gradient, rows[k] - tile.centre));
            low[1] = std::min(low[1], dot(gradient, columns[k] - tile.centre));
            change[0][k] = range_of(a, rows[k], monostatic) - own;
            change[1][k] = range_of(a, columns[k], monostatic) - own;
            high[0] = std::max(high[0], change[0][k]);
            high[1] = std::max(high[1], change[1][k]);
        }
        for (std::size_t i = 0; i < 2; ++i)
            for (std::size_t j = 0; j < 2; ++j)
                rest = std::max(rest, std::abs(range_of(a, corners[i][j], monostatic) - own - change[0][i] - change[1][j]));
    };
    for (std::size_t k = 0; k < n; k += step) look(antennas[k]);
    look(antennas[n - 1]);
    return {low[0] + low[1] - rest, high[0] + high[1] + rest};
}

AntennaArrays::AntennaArrays(const std::vector<Antennas>& antennas) {
    for (std::size_t a = 0; a < 3; ++a)
        for (const Antennas& place : antennas) {
            tx[a].push_back(place.tx[a]);
            rx[a].push_back(place.rx[a]);
        }
}

Plan make_plan(const RangeProfiles& profiles, const PhaseCentres& centres, const ImageGrid& grid, const FactorizedOptions& options) {
    return Planner(profiles, centres, grid, options).run();
}

FactorizedReport report_of(const Plan& plan) {
    FactorizedReport out;
    out.factorized = plan.exact_because.empty();
    out.reason = plan.exact_because;
    out.work = plan.work / plan.exact_work;
    out.memory = plan.memory;
    out.pieces = static_cast<std::ptrdiff_t>(plan.pieces.size());
    if (!out.factorized) {
        out.predicted_error_db = -68.0;
        return out;
    }
    out.predicted_error_db = 20.0 * std::log10(plan.predicted_error);
    for (std::size_t l = 0; l < plan.pieces.front().levels.size(); ++l) {
        const Level& level = plan.pieces.front().levels[l];
        FactorizedStage stage{level.rows, level.columns, 0, level.kernel->taps(), level.oversampling};
        for (const Piece& p : plan.pieces) stage.centres += p.levels[l].n_centre();
        out.stages.push_back(stage);
    }
    return out;
}

}  // namespace sarfocus::focus::detail
