#include <sarfocus/focus/factorized.hpp>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>
#include <vector>

#include <omp.h>

#include <sarfocus/core/array.hpp>
#include <sarfocus/core/checks.hpp>
#include <sarfocus/core/constants.hpp>
#include <sarfocus/core/error.hpp>

#include "focus/factorized_leaf.hpp"
#include "focus/factorized_lines.hpp"
#include "focus/factorized_plan.hpp"
#include "focus/pulse_block.hpp"
#include "focus/range_upsampler.hpp"

namespace sarfocus::focus {
namespace {

using detail::Antennas;
using detail::BandKernel;
using detail::Extent;
using detail::Level;
using detail::line_floats;
using detail::Piece;
using detail::Plan;
using detail::PulseBlock;
using detail::RangeUpsampler;
using detail::Tile;
using geometry::ImageGrid;
using geometry::PhaseCentres;

static_assert(PulseBlock::capacity == detail::block_pulses);

constexpr std::ptrdiff_t block = detail::block_pulses;
constexpr std::ptrdiff_t slack_floats = 32;  // behind the last line: whole registers are read

void check(const RangeProfiles& profiles, const PhaseCentres& centres, const ImageGrid& grid, const FactorizedOptions& options) {
    centres.validate(profiles.data.extent(0));
    if (grid.kind() == ImageGrid::Kind::points)
        throw ValueError("grid", "a plane or polar grid for the factorised way, the exact one takes any", "arbitrary points");
    if (!(options.target_error_db >= -90.0 && options.target_error_db <= -20.0))
        throw ValueError("target_error_db", "-90 ... -20", number_text(options.target_error_db));
}

// Lines of one tile: those of the level's centres [begin, end), sample 0 at range `first` from that of the tile's centre.
struct TileLines {
    Tile tile;
    Extent extent{};
    std::ptrdiff_t width = 0;
    double first = 0.0;
    std::ptrdiff_t begin = 0;
    std::ptrdiff_t end = 0;
    float* lines = nullptr;

    void lay_out(const Plan& plan, const Level& level, const Tile& of) {
        tile = of;
        const std::size_t n = level.centres.size();
        extent = extent_of(*plan.frame, tile, level.centres.data(), n, std::max<std::size_t>(1, n / 8), plan.monostatic);
        const auto samples =
            static_cast<std::ptrdiff_t>(std::ceil((extent.high - extent.low) / plan.spacing)) + 1 + level.margin + level.margin_behind;
        width =
            std::min((samples + detail::line_lanes - 1) / detail::line_lanes, level.most_width / detail::line_lanes) * detail::line_lanes;
        first = extent.low - static_cast<double>(level.margin) * plan.spacing;
    }
    [[nodiscard]] std::ptrdiff_t floats() const { return line_floats(width); }
};

const double* const* pointers(const std::vector<double> (&coordinates)[3], std::ptrdiff_t begin, const double* (&out)[3]) {
    for (std::size_t a = 0; a < 3; ++a) out[a] = coordinates[a].data() + begin;
    return out;
}

// What one thread works on below the first level.
struct ThreadMemory {
    struct Step {
        Array<float, 1> lines;
        std::vector<double> ranges;        // from the tile's centre to the level's centres
        std::vector<double> child_ranges;  // the same for a tile of the next level
    };
    std::vector<Step> steps;  // one for each level, the first without lines
    Array<float, 1> shifted;  // a block of lines
    detail::LeafWorkspace leaf;
    std::vector<float> weights;  // [centres of the first level][block]
    RangeUpsampler::Workspace upsampling;

    ThreadMemory(const Plan& plan, const RangeUpsampler& upsampler) : upsampling(upsampler) {
        std::ptrdiff_t shifted_floats = 0;
        std::ptrdiff_t most_centres = 0;
        const std::size_t n_level = plan.pieces.front().levels.size();
        steps.resize(n_level);
        for (const Piece& piece : plan.pieces)
            for (std::size_t l = 0; l < n_level; ++l) {
                const Level& level = piece.levels[l];
                const std::ptrdiff_t floats = line_floats(level.most_width) * level.n_centre() + slack_floats;
                if (l > 0 && steps[l].lines.size() < floats) steps[l].lines = Array<float, 1>({floats});
                if (l == 0) most_centres = std::max(most_centres, level.n_centre());
                shifted_floats = std::max(shifted_floats, line_floats(level.most_width) * block + slack_floats);
                const auto n = static_cast<std::size_t>(level.n_centre());
                if (steps[l].ranges.size() < n) {
                    steps[l].ranges.resize(n);
                    steps[l].child_ranges.resize(n);
                }
            }
        shifted = Array<float, 1>({shifted_floats});
        weights.resize(static_cast<std::size_t>(most_centres * block));
    }
};

class Former {
public:
    Former(const RangeProfiles& profiles, const PhaseCentres& centres, const Plan& plan, MutableImageView image, const Execution& execution)
        : profiles_(profiles),
          centres_(centres),
          plan_(plan),
          image_(plan.frame->swapped()
                     ? MutableImageView(image.data(), {image.extent(1), image.extent(0)}, {image.stride(1), image.stride(0)})
                     : image),
          execution_(execution),
          threads_(resolve_threads(execution.threads)),
          upsampler_(profiles.data.extent(1), detail::guard_samples) {
        for (int t = 0; t < threads_; ++t) memory_.push_back(std::make_unique<ThreadMemory>(plan, upsampler_));
        held_pulses_ = detail::held_pulses(upsampler_.width());
        upsampled_ = Array<float, 1>({held_pulses_ * line_floats(upsampler_.width()) + slack_floats});
        pulses_.resize(static_cast<std::size_t>(held_pulses_ / block));
    }

    /// Whether any pulse recorded any pixel of the tiles that are factorised.
    bool run() {
        for (std::ptrdiff_t i = 0; i < image_.extent(0); ++i)
            for (std::ptrdiff_t j = 0; j < image_.extent(1); ++j) image_(i, j) = cfloat{};
        std::int64_t total = 0;
        for (const Piece& piece : plan_.pieces) total += static_cast<std::int64_t>(2 * piece.pulses.size() * plan_.roots.size());
        Monitor monitor(execution_, "backproject, factorised", total);
        for (const Piece& piece : plan_.pieces) {
            places_.clear();
            rates_.clear();
            for (const double t : piece.along) {
                places_.push_back(piece.track->at(t));
                rates_.push_back(piece.track->rate(t));
            }
            for (std::size_t g = 0; g + 1 < plan_.groups.size() && !monitor.stopped(); ++g)
                form_group(piece, plan_.groups[g], plan_.groups[g + 1], monitor);
        }
        monitor.finish();
        return std::any_of(seen_.begin(), seen_.end(), [](char s) { return s != 0; });
    }

private:
    void form_group(const Piece& piece, std::size_t begin, std::size_t end, Monitor& monitor) {
        const Level& root = piece.levels.front();
        std::vector<TileLines> tiles;
        std::ptrdiff_t floats = slack_floats;
        for (std::size_t k = begin; k < end; ++k) {
            if (!plan_.roots[k].factorized) continue;
            tiles.emplace_back();
            tiles.back().lay_out(plan_, root, plan_.roots[k].tile);
            tiles.back().begin = root.n_centre();
            floats += tiles.back().floats() * root.n_centre();
        }
        if (tiles.empty()) return;
        if (lines_.size() < floats) {
            require_memory(static_cast<std::uint64_t>(floats) * sizeof(float), "lines of factorised backprojection");
            lines_ = Array<float, 1>();
            lines_ = Array<float, 1>({floats});
        }
        float* at = lines_.data();
        for (TileLines& t : tiles) {
            t.lines = at;
            at += t.floats() * root.n_centre();
        }
        seen_.resize(tiles.size() > seen_.size() ? tiles.size() : seen_.size());

        const auto n_pulse = static_cast<std::ptrdiff_t>(piece.pulses.size());
        const auto n_tile = static_cast<std::ptrdiff_t>(tiles.size());
#pragma omp parallel for schedule(static) num_threads(threads_) if (threads_ > 1)
        for (std::ptrdiff_t t = 0; t < n_tile; ++t) {
            const TileLines& target = tiles[static_cast<std::size_t>(t)];
            std::fill_n(target.lines, target.floats() * root.n_centre(), 0.0f);
        }
        for (std::ptrdiff_t first = 0; first < n_pulse && !monitor.stopped(); first += held_pulses_) {
            const std::ptrdiff_t count = std::min(held_pulses_, n_pulse - first);
#pragma omp parallel num_threads(threads_) if (threads_ > 1)
            {
                ThreadMemory& own = *memory_[static_cast<std::size_t>(omp_get_thread_num())];
#pragma omp for schedule(dynamic)
                for (std::ptrdiff_t k = 0; k < count; ++k) {
                    if (monitor.stopped()) continue;
                    const auto at_pulse = static_cast<std::size_t>(first + k);
                    const std::ptrdiff_t pulse = piece.pulses[at_pulse];
                    float* line = upsampled_.data() + k * line_floats(upsampler_.width());
                    upsampler_.run(profiles_.data.row(pulse), line, line + upsampler_.width(), own.upsampling);
                    pulses_[static_cast<std::size_t>(k / block)].set(k % block, {centres_.tx(pulse), centres_.rx(pulse)}, places_[at_pulse],
                                                                     rates_[at_pulse]);
                }
#pragma omp for schedule(dynamic)
                for (std::ptrdiff_t t = 0; t < n_tile; ++t)
                    for (std::ptrdiff_t k = 0; k < count; k += block) {
                        if (monitor.stopped()) continue;
                        const std::ptrdiff_t n = std::min(block, count - k);
                        const HeldPulses held{pulses_[static_cast<std::size_t>(k / block)], first + k, n,
                                              upsampled_.data() + k * line_floats(upsampler_.width())};
                        add_pulses(piece, held, tiles[static_cast<std::size_t>(t)], seen_[static_cast<std::size_t>(t)], own);
                        monitor.advance(n);
                    }
            }
        }
#pragma omp parallel for schedule(dynamic) num_threads(threads_) if (threads_ > 1)
        for (std::ptrdiff_t t = 0; t < n_tile; ++t) {
            if (monitor.stopped()) continue;
            descend(piece, 0, tiles[static_cast<std::size_t>(t)], *memory_[static_cast<std::size_t>(omp_get_thread_num())]);
            monitor.advance(n_pulse);
        }
    }

    // A block of pulses of a piece, in the order of the piece, and their lines.
    struct HeldPulses {
        const PulseBlock& places;
        std::ptrdiff_t first;
        std::ptrdiff_t count;
        const float* lines;
    };

    // Lays a block of pulses on the virtual centres of a tile of the first level.
    void add_pulses(const Piece& piece, const HeldPulses& held, TileLines& target, char& seen, ThreadMemory& own) {
        const std::ptrdiff_t first = held.first;
        const std::ptrdiff_t count = held.count;
        const Level& level = piece.levels.front();
        const Tile& tile = target.tile;
        alignas(64) double range[block];
        alignas(64) double shift[block] = {};
        alignas(64) double scale[block] = {};
        alignas(64) double cycles[block];
        alignas(64) float cosine[block];
        alignas(64) float sine[block];
        held.places.ranges(tile.centre, count, plan_.monostatic, range);
        if (piece.off_track) held.places.match(tile.centre, plan_.frame->axis(0), plan_.frame->axis(1), count, shift, scale);
        for (std::ptrdiff_t k = 0; k < count; ++k) cycles[k] = range[k] * plan_.cycles_per_metre;
        detail::phasors(cycles, count, cosine, sine);

        const double record = static_cast<double>(profiles_.data.extent(1) - 1) * profiles_.range_spacing;
        const std::ptrdiff_t taps = level.kernel->taps();
        const std::ptrdiff_t last_whole = level.n_centre() - 1 - taps / 2;
        std::ptrdiff_t lines = 0;
        std::ptrdiff_t edges = 0;
        std::ptrdiff_t at_edge[block];
        std::ptrdiff_t first_centre[block];
        float weights[block][BandKernel::most_taps];
        for (std::ptrdiff_t k = 0; k < count; ++k) {
            const auto at = static_cast<std::size_t>(first + k);
            const double start = profiles_.first_range(piece.pulses[at]);
            const double slack = 1.5 * plan_.spacing + std::abs(scale[k]) * (target.extent.high - target.extent.low);
            const double low = range[k] + target.extent.low - slack - start;
            const double high = range[k] + target.extent.high + slack - start;
            if (high < 0.0 || low > record) continue;
            seen = 1;
            const float* line = held.lines + k * line_floats(upsampler_.width());
            if (low < 0.0 || high > record) {
                at_edge[edges++] = k;
                continue;
            }
            const double place = (range[k] + target.first - start) / plan_.spacing + 2.0 * detail::guard_samples;
            float* to = own.shifted.data() + lines * target.floats();
            shift_to(line, upsampler_.width(), place, cosine[k], sine[k], to, target.width);
            if (std::abs(scale[k]) * plan_.cycles_per_metre * (target.extent.high - target.extent.low) > 1e-5)
                detail::turn_line(to, target.width, scale[k] * plan_.cycles_per_metre * target.first,
                                  scale[k] * plan_.cycles_per_metre * plan_.spacing);
            const double along = std::clamp((piece.along[at] + shift[k] - level.first) / level.step,
                                            static_cast<double>(level.kernel->before()), static_cast<double>(last_whole) + 0.999999);
            const double whole = std::floor(along);
            level.kernel->weights(along - whole, weights[lines]);
            first_centre[lines] = static_cast<std::ptrdiff_t>(whole) - level.kernel->before();
            ++lines;
        }
        if (edges > 0) add_directly(piece, held, at_edge, edges, tile, own);
        if (lines == 0) return;
        const auto [least, most] = std::minmax_element(first_centre, first_centre + lines);
        const std::ptrdiff_t begin = *least;
        const std::ptrdiff_t end = *most + taps;
        std::fill_n(own.weights.data(), (end - begin) * block, 0.0f);
        for (std::ptrdiff_t p = 0; p < lines; ++p)
            for (std::ptrdiff_t t = 0; t < taps; ++t)
                own.weights[static_cast<std::size_t>((first_centre[p] - begin + t) * block + p)] = weights[p][t];
        for (std::ptrdiff_t n = begin; n < end; ++n) {
            const float* w = own.weights.data() + (n - begin) * block;
            std::ptrdiff_t from = 0;
            std::ptrdiff_t to = lines;
            while (from < to && w[from] == 0.0f) ++from;
            while (to > from && w[to - 1] == 0.0f) --to;
            detail::add_lines(own.shifted.data() + from * target.floats(), target.floats(), w + from, to - from,
                              target.lines + n * target.floats());
        }
        target.begin = std::min(target.begin, begin);
        target.end = std::max(target.end, end);
    }

    // `to` = `line` from `place` (samples) on, turned.
    void shift_to(const float* line, std::ptrdiff_t line_width, double place, float cosine, float sine, float* to,
                  std::ptrdiff_t width) const {
        const BandKernel& kernel = *plan_.range_kernel;
        float weights[BandKernel::most_taps];
        const double whole = std::floor(place);
        kernel.weights(place - whole, weights);
        const std::ptrdiff_t at =
            std::clamp<std::ptrdiff_t>(static_cast<std::ptrdiff_t>(whole) - kernel.before(), 0, line_width - width - kernel.taps());
        detail::shift_line(line + at, line + line_width + at, weights, kernel.taps(), cosine, sine, to, width);
    }

    // The terms of pulses whose record begins or ends within the tile, from their own lines.
    void add_directly(const Piece& piece, const HeldPulses& held, const std::ptrdiff_t* members, std::ptrdiff_t count, const Tile& tile,
                      ThreadMemory& own) {
        const Level& last = piece.levels.back();
        const double end = static_cast<double>(profiles_.data.extent(1) - 1) * profiles_.range_spacing + 0.5 * plan_.spacing;
        for (std::ptrdiff_t i = tile.row; i < tile.row + tile.rows; i += last.rows)
            for (std::ptrdiff_t j = tile.column; j < tile.column + tile.columns; j += last.columns) {
                const Tile part(*plan_.frame, i, j, last.rows, last.columns);
                detail::LeafGeometry leaf(*plan_.frame, part, plan_.monostatic);
                const std::ptrdiff_t middle = piece.pulses[static_cast<std::size_t>(held.first + members[count / 2])];
                leaf.set_reference({centres_.tx(middle), centres_.rx(middle)}, plan_.cycles_per_metre);
                own.leaf.clear(part.rows);
                for (std::ptrdiff_t m = 0; m < count; ++m) {
                    const std::ptrdiff_t pulse = piece.pulses[static_cast<std::size_t>(held.first + members[m])];
                    const double range = centres_.range(pulse, part.centre);
                    const double start = profiles_.first_range(pulse) - range;
                    const float* line = held.lines + members[m] * line_floats(upsampler_.width());
                    const Antennas antennas{centres_.tx(pulse), centres_.rx(pulse)};
                    add_leaf_line(plan_, leaf,
                                  {antennas, line, line + upsampler_.width(), upsampler_.width(),
                                   start - detail::guard_samples * profiles_.range_spacing, range * plan_.cycles_per_metre,
                                   start - 0.5 * plan_.spacing, start + end},
                                  own.leaf);
                }
                add_leaf_sums(leaf, own.leaf, pixels(part));
            }
    }

    [[nodiscard]] MutableImageView pixels(const Tile& tile) const {
        return image_.slice(0, tile.row, tile.rows).slice(1, tile.column, tile.columns);
    }

    void descend(const Piece& piece, std::size_t l, const TileLines& parent, ThreadMemory& own) {
        if (parent.begin >= parent.end) return;
        const Level& level = piece.levels[l];
        if (l + 1 == piece.levels.size()) {
            finish(level, parent, own);
            return;
        }
        const Level& next = piece.levels[l + 1];
        ThreadMemory::Step& step = own.steps[l];
        ranges(level, parent.tile.centre, parent.begin, parent.end, step.ranges.data());
        for (std::ptrdiff_t i = parent.tile.row; i < parent.tile.row + parent.tile.rows; i += next.rows)
            for (std::ptrdiff_t j = parent.tile.column; j < parent.tile.column + parent.tile.columns; j += next.columns) {
                TileLines child;
                child.lay_out(plan_, next, Tile(*plan_.frame, i, j, next.rows, next.columns));
                child.lines = own.steps[l + 1].lines.data();
                std::fill_n(child.lines, child.floats() * next.n_centre(), 0.0f);
                thin_out(level, next, parent, child, step, own);
                descend(piece, l + 1, child, own);
            }
    }

    void ranges(const Level& level, const Vector3& p, std::ptrdiff_t begin, std::ptrdiff_t end, double* out) const {
        const double* tx[3];
        const double* rx[3];
        detail::ranges_to(p, pointers(level.arrays->tx, begin, tx), plan_.monostatic ? nullptr : pointers(level.arrays->rx, begin, rx),
                          end - begin, out);
    }

    // From the lines of a tile to those of a smaller one within, on fewer centres.
    void thin_out(const Level& level, const Level& next, const TileLines& parent, TileLines& child, ThreadMemory::Step& step,
                  ThreadMemory& own) const {
        alignas(64) double cycles[block];
        alignas(64) float cosine[block];
        alignas(64) float sine[block];
        double* away = step.child_ranges.data();
        ranges(level, child.tile.centre, parent.begin, parent.end, away);
        for (std::ptrdiff_t k = 0; k < parent.end - parent.begin; ++k) away[k] -= step.ranges[static_cast<std::size_t>(k)];
        std::ptrdiff_t centre = 0;
        child.begin = next.n_centre();
        for (std::ptrdiff_t first = parent.begin; first < parent.end; first += block) {
            const std::ptrdiff_t last = std::min(first + block, parent.end);
            for (std::ptrdiff_t n = first; n < last; ++n) cycles[n - first] = away[n - parent.begin] * plan_.cycles_per_metre;
            detail::phasors(cycles, last - first, cosine, sine);
            for (std::ptrdiff_t n = first; n < last; ++n)
                shift_to(parent.lines + n * parent.floats(), parent.width,
                         (away[n - parent.begin] + child.first - parent.first) / plan_.spacing, cosine[n - first], sine[n - first],
                         own.shifted.data() + (n - first) * child.floats(), child.width);
            while (centre < next.n_centre() && source_end(next, centre) <= first) ++centre;
            for (std::ptrdiff_t m = centre; m < next.n_centre() && next.sources[static_cast<std::size_t>(m)].first < last; ++m) {
                const Level::Sources& source = next.sources[static_cast<std::size_t>(m)];
                const std::ptrdiff_t from = std::max(first, source.first);
                const std::ptrdiff_t to = std::min(last, source_end(next, m));
                if (from >= to) continue;
                detail::add_lines(own.shifted.data() + (from - first) * child.floats(), child.floats(),
                                  source.weights.data() + (from - source.first), to - from, child.lines + m * child.floats());
                child.begin = std::min(child.begin, m);
                child.end = std::max(child.end, m + 1);
            }
        }
    }

    static std::ptrdiff_t source_end(const Level& level, std::ptrdiff_t centre) {
        const Level::Sources& source = level.sources[static_cast<std::size_t>(centre)];
        return source.first + static_cast<std::ptrdiff_t>(source.weights.size());
    }

    // The pixels of a smallest tile.
    void finish(const Level& level, const TileLines& tile, ThreadMemory& own) {
        detail::LeafGeometry leaf(*plan_.frame, tile.tile, plan_.monostatic);
        leaf.set_reference(level.centres[static_cast<std::size_t>((tile.begin + tile.end) / 2)], plan_.cycles_per_metre);
        own.leaf.clear(tile.tile.rows);
        for (std::ptrdiff_t n = tile.begin; n < tile.end; ++n) {
            const float* line = tile.lines + n * tile.floats();
            add_leaf_line(plan_, leaf, {level.centres[static_cast<std::size_t>(n)], line, line + tile.width, tile.width, tile.first},
                          own.leaf);
        }
        add_leaf_sums(leaf, own.leaf, pixels(tile.tile));
    }

    const RangeProfiles& profiles_;
    const PhaseCentres& centres_;
    const Plan& plan_;
    MutableImageView image_;
    const Execution& execution_;
    int threads_;
    RangeUpsampler upsampler_;
    std::vector<std::unique_ptr<ThreadMemory>> memory_;
    Array<float, 1> lines_;  // of the tiles of a group
    Array<float, 1> upsampled_;
    std::ptrdiff_t held_pulses_ = 0;
    std::vector<PulseBlock> pulses_;
    std::vector<Antennas> places_;  // on the track, of the pulses of the piece in work
    std::vector<Antennas> rates_;
    std::vector<char> seen_;
};

// Rectangles of root tiles that are left to the exact sum.
std::vector<Tile> exact_rectangles(const Plan& plan) {
    const std::ptrdiff_t columns = plan.frame->columns();
    const auto across = static_cast<std::size_t>((columns + plan.roots.front().tile.columns - 1) / plan.roots.front().tile.columns);
    const std::size_t down = plan.roots.size() / across;
    std::vector<char> open(plan.roots.size());
    for (std::size_t k = 0; k < open.size(); ++k) open[k] = plan.roots[k].factorized ? 0 : 1;
    std::vector<Tile> out;
    for (std::size_t i = 0; i < down; ++i)
        for (std::size_t j = 0; j < across; ++j) {
            std::size_t rows = 0;
            while (i + rows < down && open[(i + rows) * across + j] != 0) ++rows;
            if (rows == 0) continue;
            const auto whole = [&](std::size_t column) {
                for (std::size_t r = i; r < i + rows; ++r)
                    if (open[r * across + column] == 0) return false;
                return true;
            };
            std::size_t width = 1;
            while (j + width < across && whole(j + width)) ++width;
            for (std::size_t r = i; r < i + rows; ++r) std::fill_n(open.begin() + static_cast<std::ptrdiff_t>(r * across + j), width, 0);
            const Tile& first = plan.roots[i * across + j].tile;
            const Tile& last = plan.roots[(i + rows - 1) * across + j + width - 1].tile;
            out.emplace_back(*plan.frame, first.row, first.column, last.row + last.rows - first.row,
                             last.column + last.columns - first.column);
        }
    return out;
}

// The exact sum of a rectangle; false where no pulse recorded any of it.
bool form_exactly(const RangeProfiles& profiles, const PhaseCentres& centres, const ImageGrid& grid, bool swapped, const Tile& tile,
                  MutableImageView image, const Execution& execution) {
    const std::array<std::ptrdiff_t, 2> begin{swapped ? tile.column : tile.row, swapped ? tile.row : tile.column};
    const std::array<std::ptrdiff_t, 2> count{swapped ? tile.columns : tile.rows, swapped ? tile.rows : tile.columns};
    try {
        backproject(profiles, centres, grid.subgrid(begin, count), image.slice(0, begin[0], count[0]).slice(1, begin[1], count[1]),
                    {execution});
        return true;
    } catch (const ValueError&) {
        return false;
    }
}

}  // namespace

FactorizedReport plan_factorized(const RangeProfiles& profiles, const PhaseCentres& centres, const ImageGrid& grid,
                                 const FactorizedOptions& options) {
    check(profiles, centres, grid, options);
    return detail::report_of(detail::make_plan(profiles, centres, grid, options));
}

FactorizedReport backproject_factorized(const RangeProfiles& profiles, const PhaseCentres& centres, const ImageGrid& grid,
                                        MutableImageView image, const FactorizedOptions& options) {
    profiles.validate(options.execution.threads);
    check(profiles, centres, grid, options);
    if (image.extents() != grid.shape())
        throw ShapeError("image", "the shape of the grid " + shape_text(grid.shape()), shape_text(image.extents()));
    const Plan plan = detail::make_plan(profiles, centres, grid, options);
    if (plan.exact_because.empty()) {
        bool recorded = Former(profiles, centres, plan, image, options.execution).run();
        for (const Tile& tile : exact_rectangles(plan))
            recorded = form_exactly(profiles, centres, grid, plan.frame->swapped(), tile, image, options.execution) || recorded;
        if (!recorded) throw ValueError("grid", "pixels within the recorded ranges", "a grid that no pulse has recorded");
    } else
        backproject(profiles, centres, grid, image, {options.execution});
    return detail::report_of(plan);
}

}  // namespace sarfocus::focus
