#include "strip_boxes.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <exception>
#include <memory>

#include <omp.h>

#include <sarfocus/core/array.hpp>
#include <sarfocus/core/checks.hpp>
#include <sarfocus/core/error.hpp>
#include <sarfocus/core/intensities.hpp>
#include <sarfocus/core/logarithm.hpp>
#include <sarfocus/core/multiversion.hpp>

#include "strip_lines.hpp"

namespace sarfocus::autofocus::detail {
namespace {

constexpr std::ptrdiff_t lanes = 8;                   // range gates at a time: one cache line of a row-major image
constexpr std::ptrdiff_t rows_of_a_tile = 64;         // azimuth
constexpr std::ptrdiff_t sections_per_aperture = 16;  // each with one candidate a gate
constexpr std::ptrdiff_t most_pieces = 64;            // of a gate, for its clutter

using Lanes = std::array<double, lanes>;
// Half the lanes: wider vectors than the processor has would be taken apart value by value.
using Doubles = double __attribute__((vector_size(4 * lanes)));
using Integers = std::int64_t __attribute__((vector_size(4 * lanes)));
using Floats = sarfocus::detail::EightFloats;

// A gate's energy is not finite; which sample is at fault is found out afterwards.
class NotFinite : public std::exception {};

inline __attribute__((always_inline)) float intensity_of(const float* sample) {
    return sample[0] * sample[0] + sample[1] * sample[1];
}

// 8 x 8 floats, columns of samples in the order of `eight_intensities` for rows.
inline __attribute__((always_inline)) void transpose(const float* from, std::ptrdiff_t pitch, float* to) {
    Floats a[lanes];
    Floats b[lanes];
    for (std::ptrdiff_t i = 0; i < lanes; ++i) std::memcpy(&a[i], from + i * pitch, sizeof a[i]);
    for (std::ptrdiff_t i = 0; i < 4; ++i) {
        b[2 * i] = __builtin_shufflevector(a[i], a[i + 4], 0, 8, 1, 9, 2, 10, 3, 11);
        b[2 * i + 1] = __builtin_shufflevector(a[i], a[i + 4], 4, 12, 5, 13, 6, 14, 7, 15);
    }
    for (std::ptrdiff_t i = 0; i < 4; ++i) {
        a[2 * i] = __builtin_shufflevector(b[i], b[i + 4], 0, 8, 1, 9, 2, 10, 3, 11);
        a[2 * i + 1] = __builtin_shufflevector(b[i], b[i + 4], 4, 12, 5, 13, 6, 14, 7, 15);
    }
    for (std::ptrdiff_t i = 0; i < 4; ++i) {
        b[2 * i] = __builtin_shufflevector(a[i], a[i + 4], 0, 8, 1, 9, 2, 10, 3, 11);
        b[2 * i + 1] = __builtin_shufflevector(a[i], a[i + 4], 4, 12, 5, 13, 6, 14, 7, 15);
    }
    for (std::ptrdiff_t i = 0; i < lanes; ++i) std::memcpy(to + sarfocus::detail::sample_of_lane[i] * lanes, &b[i], sizeof b[i]);
}

// Intensities of a tile [rows_of_a_tile, lanes] from gates that lie `pitch` samples apart, each contiguous.
SARFOCUS_MULTIVERSION void tile_of_gates(const cfloat* first, std::ptrdiff_t pitch, float* tile) {
    float gates[lanes * rows_of_a_tile];
    for (std::ptrdiff_t g = 0; g < lanes; ++g) {
        const auto* x = reinterpret_cast<const float*>(first + g * pitch);
        for (std::ptrdiff_t i = 0; i < rows_of_a_tile; i += lanes) {
            Floats intensity;
            sarfocus::detail::eight_intensities(x + 2 * i, intensity);
            std::memcpy(gates + g * rows_of_a_tile + i, &intensity, sizeof intensity);
        }
    }
    for (std::ptrdiff_t i = 0; i < rows_of_a_tile; i += lanes) transpose(gates + i, rows_of_a_tile, tile + i * lanes);
}

// The same from lines that lie `pitch` samples apart. They are too far apart for the processor to foresee.
SARFOCUS_MULTIVERSION void tile_of_lines(const cfloat* first, std::ptrdiff_t pitch, float* tile) {
    constexpr std::ptrdiff_t ahead = 24;
    for (std::ptrdiff_t i = 0; i < rows_of_a_tile; ++i) {
        __builtin_prefetch(first + (i + ahead) * pitch);
        __builtin_prefetch(first + (i + ahead) * pitch + lanes - 1);
        const auto* x = reinterpret_cast<const float*>(first + i * pitch);
        for (std::ptrdiff_t g = 0; g < lanes; ++g) tile[i * lanes + g] = intensity_of(x + 2 * g);
    }
}

// sums[i + 1] = sums[i] + tile[i], gate by gate.
SARFOCUS_MULTIVERSION void add_up(const float* tile, std::ptrdiff_t rows, double* sums) {
    double running[lanes];
    std::memcpy(running, sums, sizeof running);
    for (std::ptrdiff_t i = 0; i < rows; ++i)
        for (std::ptrdiff_t g = 0; g < lanes; ++g) {
            running[g] += static_cast<double>(tile[i * lanes + g]);
            sums[(i + 1) * lanes + g] = running[g];
        }
}

// The most striking box of a section so far, of every gate.
struct Held {
    double statistic[lanes] = {};
    double energy[lanes] = {};
    std::int64_t begin[lanes] = {};
    std::int64_t extent[lanes] = {};
};

struct Search {
    std::ptrdiff_t begin;
    std::ptrdiff_t end;
    std::ptrdiff_t step;
    std::ptrdiff_t extent;
    double looks;
};

// The box of most energy that begins in [begin, end), and its statistic: log likelihood ratio of a mean of `looks` exponential
// intensities, `ratio` times what clutter alone would give.
SARFOCUS_MULTIVERSION void look_for_box(const double* sums, const Search& search, const double* clutter, const double* per_clutter,
                                        Held& held) {
    Doubles greatest[2] = {};
    Integers at_line[2] = {};
    for (std::ptrdiff_t u = search.begin; u < search.end; u += search.step)
        for (std::ptrdiff_t half = 0; half < 2; ++half) {
            Doubles low;
            Doubles high;
            std::memcpy(&low, sums + u * lanes + half * lanes / 2, sizeof low);
            std::memcpy(&high, sums + (u + search.extent) * lanes + half * lanes / 2, sizeof high);
            const Doubles energy = high - low;
            at_line[half] = energy > greatest[half] ? Integers{} + u : at_line[half];
            greatest[half] = energy > greatest[half] ? energy : greatest[half];
        }
    double best[lanes];
    std::int64_t where[lanes];
    std::memcpy(best, greatest, sizeof best);
    std::memcpy(where, at_line, sizeof where);
    const auto extent = static_cast<double>(search.extent);
    for (std::ptrdiff_t g = 0; g < lanes; ++g) {
        const double ratio = std::max(best[g] * per_clutter[g] / extent, 1.0);
        const double statistic = search.looks * (ratio - 1.0 - plain_logarithm(ratio));
        const bool better = statistic > held.statistic[g];
        held.energy[g] = better ? best[g] - extent * clutter[g] : held.energy[g];
        held.begin[g] = better ? where[g] : held.begin[g];
        held.extent[g] = better ? search.extent : held.extent[g];
        held.statistic[g] = better ? statistic : held.statistic[g];
    }
}

// Running sums of the intensity of a few range gates, next to one another, and what has been found in them.
class Workspace {
public:
    Workspace(std::ptrdiff_t n, const Sections& sections) : n_(n), sums_({(n + 1) * lanes}), held_(at(sections.count)) {}

    void load(const ImageView& image) {
        std::fill_n(sums_.data(), lanes, 0.0);
        const bool whole = image.extent(1) == lanes;
        for (std::ptrdiff_t begin = 0; begin < n_; begin += rows_of_a_tile) {
            const std::ptrdiff_t rows = std::min(rows_of_a_tile, n_ - begin);
            alignas(memory_alignment) float tile[rows_of_a_tile * lanes] = {};
            if (whole && rows == rows_of_a_tile && image.stride(0) == 1)
                tile_of_gates(&image(begin, 0), image.stride(1), tile);
            else if (whole && rows == rows_of_a_tile && image.stride(1) == 1)
                tile_of_lines(&image(begin, 0), image.stride(0), tile);
            else {  // the same arithmetic, so that the bits don't depend on the strides
                cfloat copy[rows_of_a_tile * lanes] = {};
                for (std::ptrdiff_t i = 0; i < rows; ++i)
                    for (std::ptrdiff_t g = 0; g < image.extent(1); ++g) copy[i * lanes + g] = image(begin + i, g);
                tile_of_lines(copy, lanes, tile);
            }
            add_up(tile, rows, sums_.data() + begin * lanes);
        }
    }

    void search(const Sections& sections, const BoxOptions& options) {
        Lanes clutter{};
        Lanes per_clutter{};
        for (std::ptrdiff_t g = 0; g < lanes; ++g) {
            const double total = sum(0, n_, g);
            if (!std::isfinite(total)) throw NotFinite();
            if (!(total > 0.0)) continue;
            // Twelve digits below the gate's own energy there is nothing to be seen.
            clutter[at(g)] = std::max(clutter_power(g), 1e-12 * total);
            per_clutter[at(g)] = 1.0 / clutter[at(g)];
        }
        std::fill(held_.begin(), held_.end(), Held{});
        // Section by section: its sums stay in the first cache for all extents.
        for (std::ptrdiff_t s = 0; s < sections.count; ++s) {
            for (const std::ptrdiff_t extent : options.extents) {
                if (extent > n_) continue;
                const std::ptrdiff_t end = std::min((s + 1) * sections.length, n_ - extent + 1);
                const double looks = std::max(static_cast<double>(extent) / options.cell, 1.0);
                look_for_box(sums_.data(), {s * sections.length, end, std::max<std::ptrdiff_t>(extent / 4, 1), extent, looks},
                             clutter.data(), per_clutter.data(), held_[at(s)]);
            }
        }
    }

    [[nodiscard]] const Held& held(std::ptrdiff_t section) const { return held_[at(section)]; }

private:
    [[nodiscard]] double sum(std::ptrdiff_t begin, std::ptrdiff_t end, std::ptrdiff_t gate) const {
        return sums_(end * lanes + gate) - sums_(begin * lanes + gate);
    }

    [[nodiscard]] double clutter_power(std::ptrdiff_t gate) const {
        const std::ptrdiff_t pieces = std::clamp<std::ptrdiff_t>(n_ / 32, 1, most_pieces);
        std::array<double, most_pieces> means{};
        for (std::ptrdiff_t p = 0; p < pieces; ++p) {
            const std::ptrdiff_t begin = p * n_ / pieces;
            const std::ptrdiff_t end = (p + 1) * n_ / pieces;
            means[at(p)] = sum(begin, end, gate) / static_cast<double>(end - begin);
        }
        std::nth_element(means.begin(), means.begin() + pieces / 2, means.begin() + pieces);
        return means[at(pieces / 2)];
    }

    std::ptrdiff_t n_;
    Array<double, 1> sums_;
    std::vector<Held> held_;
};

bool more_striking(const StripPoint& a, const StripPoint& b) {
    return a.statistic != b.statistic ? a.statistic > b.statistic : a.range < b.range;
}

// The most striking boxes of one section, at most so many: a heap whose first is the least of them.
class Strongest {
public:
    void offer(const StripPoint& point, std::size_t most) {
        if (heap_.size() == most) {
            if (!more_striking(point, heap_.front())) return;
            std::pop_heap(heap_.begin(), heap_.end(), more_striking);
            heap_.pop_back();
        }
        heap_.push_back(point);
        std::push_heap(heap_.begin(), heap_.end(), more_striking);
    }
    [[nodiscard]] const std::vector<StripPoint>& points() const { return heap_; }

private:
    std::vector<StripPoint> heap_;
};

// What one thread works with. Which of its boxes are kept in the end does not depend on how the gates were dealt out.
struct Worker {
    Workspace workspace;
    std::vector<Strongest> strongest;

    Worker(std::ptrdiff_t n, const Sections& sections) : workspace(n, sections), strongest(at(sections.count)) {}

    void look_at(const ImageView& image, std::ptrdiff_t first, const Sections& sections, const BoxOptions& options) {
        workspace.load(image);
        workspace.search(sections, options);
        for (std::ptrdiff_t s = 0; s < sections.count; ++s) {
            const Held& held = workspace.held(s);
            for (std::ptrdiff_t g = 0; g < image.extent(1); ++g) {
                if (!(held.statistic[g] > 0.0)) continue;
                StripPoint point;
                point.azimuth = held.begin[g] + held.extent[g] / 2;
                point.range = first + g;
                point.extent = held.extent[g];
                point.energy = held.energy[g];
                point.statistic = held.statistic[g];
                strongest[at(s)].offer(point, options.most);
            }
        }
    }
};

std::vector<std::vector<StripPoint>> search_all(const ImageView& image, const Sections& sections, const BoxOptions& options) {
    const std::ptrdiff_t n_range = image.extent(1);
    std::vector<std::unique_ptr<Worker>> workers(at(resolve_threads(options.execution.threads)));
    parallel_for(options.execution, "find strong points", (n_range + lanes - 1) / lanes, [&](std::int64_t b) {
        auto& worker = workers[at(omp_get_thread_num())];
        if (!worker) worker = std::make_unique<Worker>(image.extent(0), sections);
        const std::ptrdiff_t first = b * lanes;
        worker->look_at(image.slice(1, first, std::min(lanes, n_range - first)), first, sections, options);
    });
    std::vector<std::vector<StripPoint>> out(at(sections.count));
    for (std::size_t s = 0; s < out.size(); ++s) {
        for (const auto& worker : workers)
            if (worker) out[s].insert(out[s].end(), worker->strongest[s].points().begin(), worker->strongest[s].points().end());
        std::sort(out[s].begin(), out[s].end(), more_striking);
        if (out[s].size() > options.most) out[s].resize(options.most);
    }
    return out;
}

}  // namespace

Sections::Sections(std::ptrdiff_t n_azimuth, double aperture)
    : length(std::clamp<std::ptrdiff_t>(static_cast<std::ptrdiff_t>(aperture) / sections_per_aperture, 1, n_azimuth)),
      count((n_azimuth + length - 1) / length) {}

std::vector<std::vector<StripPoint>> strongest_boxes(const ImageView& image, const Sections& sections, const BoxOptions& options) {
    try {
        return search_all(image, sections, options);
    } catch (const NotFinite&) {
        require_finite(image, "image", options.execution.threads);
        throw NumericalError("image: expected pixels whose energy fits a number, got larger ones");
    }
}

}  // namespace sarfocus::autofocus::detail
