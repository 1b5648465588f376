#include <sarfocus/detect/cfar.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <string>

#include <sarfocus/core/array.hpp>
#include <sarfocus/core/checks.hpp>
#include <sarfocus/core/error.hpp>

#include "power.hpp"

namespace sarfocus::detect {
namespace {

using detail::PowerRows;

constexpr std::ptrdiff_t block = 64;

/// Half-open range of rows or columns.
struct Span {
    std::ptrdiff_t begin = 0;
    std::ptrdiff_t end = 0;
    [[nodiscard]] std::ptrdiff_t size() const { return end - begin; }
};

/// Along one axis: the whole window about a cell and the guard cells within it, cut to what exists.
struct Reach {
    Span window;
    Span guard;
};

Reach reach_of(std::ptrdiff_t position, std::ptrdiff_t reference, std::ptrdiff_t guard, std::ptrdiff_t extent) {
    const auto span = [&](std::ptrdiff_t half) {
        // Compared before added: a half width may be as large as the type allows.
        return Span{half < position ? position - half : 0, half < extent - 1 - position ? position + half + 1 : extent};
    };
    const Span inner = span(guard);
    const Span outer{reference < inner.begin ? inner.begin - reference : 0,
                     reference < extent - inner.end ? inner.end + reference : extent};
    return {outer, inner};
}

/// The four parts of the frame of reference cells: rows before and behind the guard cells over the whole width, and what lies beside them.
struct Frame {
    Reach rows;
    Reach columns;

    [[nodiscard]] std::ptrdiff_t before() const { return (rows.guard.begin - rows.window.begin) * columns.window.size(); }
    [[nodiscard]] std::ptrdiff_t behind() const { return (rows.window.end - rows.guard.end) * columns.window.size(); }
    [[nodiscard]] std::ptrdiff_t beside() const { return rows.guard.size() * (columns.window.size() - columns.guard.size()); }
    [[nodiscard]] std::ptrdiff_t size() const { return before() + behind() + beside(); }

    /// visit(rows, columns) for every part.
    template <class Visit>
    void for_each_part(const Visit& visit) const {
        visit(Span{rows.window.begin, rows.guard.begin}, columns.window);
        visit(Span{rows.guard.end, rows.window.end}, columns.window);
        for_each_side(visit);
    }
    /// visit(rows, columns) for the parts beside the guard cells.
    template <class Visit>
    void for_each_side(const Visit& visit) const {
        visit(rows.guard, Span{columns.window.begin, columns.guard.begin});
        visit(rows.guard, Span{columns.guard.end, columns.window.end});
    }
};

std::ptrdiff_t rank_of(double rank, std::ptrdiff_t cells) {
    return std::clamp<std::ptrdiff_t>(static_cast<std::ptrdiff_t>(std::ceil(rank * static_cast<double>(cells))), 1, cells);
}

double factor_of(const Frame& frame, const CfarOptions& options) {
    const double p = options.false_alarm_probability;
    const std::ptrdiff_t before = frame.before();
    const std::ptrdiff_t behind = frame.behind();
    const bool greatest = options.method == CfarMethod::greatest_of;
    const std::ptrdiff_t cells = greatest ? before + behind : frame.size();
    if (cells == 0) return std::numeric_limits<double>::infinity();
    if (options.looks > 1.0)
        return multi_look_factor(options.looks, greatest && before > 0 && behind > 0 ? std::min(before, behind) : cells, p);
    if (greatest && before > 0 && behind > 0) return greatest_of_factor(before, behind, p);
    if (options.method == CfarMethod::ordered_statistic) return ordered_statistic_factor(cells, rank_of(options.rank, cells), p);
    return cell_averaging_factor(cells, p);
}

/// The windows of all rows or of all columns. Those with as many cells before, guarded and behind are of one kind.
struct Windows {
    std::vector<Reach> reach;
    std::vector<std::size_t> kind;
    std::vector<Reach> kinds;

    Windows(std::ptrdiff_t extent, std::ptrdiff_t reference, std::ptrdiff_t guard) {
        std::map<std::array<std::ptrdiff_t, 3>, std::size_t> known;
        for (std::ptrdiff_t i = 0; i < extent; ++i) {
            const Reach r = reach_of(i, reference, guard, extent);
            const auto [entry, is_new] =
                known.try_emplace({r.guard.begin - r.window.begin, r.guard.size(), r.window.end - r.guard.end}, kinds.size());
            if (is_new) kinds.push_back(r);
            reach.push_back(r);
            kind.push_back(entry->second);
        }
    }
};

/// mu for every kind of row and of column.
Array<double, 2> factor_table(const Windows& rows, const Windows& columns, const CfarOptions& options) {
    Array<double, 2> out({static_cast<std::ptrdiff_t>(rows.kinds.size()), static_cast<std::ptrdiff_t>(columns.kinds.size())});
    // Frames of the same numbers of cells share their factor, which takes some time to find.
    std::map<std::array<std::ptrdiff_t, 3>, double> known;
    for (std::size_t r = 0; r < rows.kinds.size(); ++r)
        for (std::size_t c = 0; c < columns.kinds.size(); ++c) {
            const Frame frame{rows.kinds[r], columns.kinds[c]};
            const auto [entry, is_new] = known.try_emplace({frame.before(), frame.behind(), frame.beside()}, 0.0);
            if (is_new) entry->second = factor_of(frame, options);
            out(r, c) = entry->second;
        }
    return out;
}

/// Sums over rectangles by plain addition.
template <class Value>
double plain_sum(const Value& value, const Span& rows, const Span& columns) {
    double sum = 0.0;
    for (std::ptrdiff_t i = rows.begin; i < rows.end; ++i)
        for (std::ptrdiff_t j = columns.begin; j < columns.end; ++j) sum += value(i, j);
    return sum;
}

/// Sums over rectangles of some rows of an image from a summed-area table of them.
class AreaTable {
public:
    explicit AreaTable(const PowerRows& rows) : rows_(rows), table_({rows.values.extent(0) + 1, rows.values.extent(1) + 1}) {
        for (std::ptrdiff_t i = 0; i < rows.values.extent(0); ++i) {
            double sum = 0.0;
            for (std::ptrdiff_t j = 0; j < rows.values.extent(1); ++j) {
                sum += rows.values(i, j);
                table_(i + 1, j + 1) = table_(i, j + 1) + sum;
            }
        }
        smallest_ = 1e-10 * table_(rows.values.extent(0), rows.values.extent(1));
    }

    [[nodiscard]] double operator()(const Span& rows, const Span& columns) const {
        if (rows.size() == 0 || columns.size() == 0) return 0.0;
        const std::ptrdiff_t top = rows.begin - rows_.begin;
        const std::ptrdiff_t bottom = rows.end - rows_.begin;
        const double sum =
            (table_(bottom, columns.end) - table_(top, columns.end)) - (table_(bottom, columns.begin) - table_(top, columns.begin));
        // Differences of sums that large have lost their digits (a bright target elsewhere in the table).
        if (sum >= smallest_) return sum;
        return plain_sum([&](std::ptrdiff_t i, std::ptrdiff_t j) { return rows_.row(i)[j]; }, rows, columns);
    }

private:
    const PowerRows& rows_;
    Array<double, 2> table_;
    double smallest_ = 0.0;
};

/// Clutter estimate from box(rows, columns), the sum over a rectangle.
template <class Box>
double mean_clutter(const Box& box, const Frame& frame, CfarMethod method) {
    const double before = box(Span{frame.rows.window.begin, frame.rows.guard.begin}, frame.columns.window);
    const double behind = box(Span{frame.rows.guard.end, frame.rows.window.end}, frame.columns.window);
    const auto mean = [](double sum, std::ptrdiff_t n) { return n == 0 ? 0.0 : sum / static_cast<double>(n); };
    if (method == CfarMethod::greatest_of) return std::max(mean(before, frame.before()), mean(behind, frame.behind()));
    double beside = 0.0;
    frame.for_each_side([&](const Span& rows, const Span& columns) { beside += box(rows, columns); });
    return mean(before + behind + beside, frame.size());
}

/// Clutter estimate from value(i, j), a single cell.
template <class Value>
double ordered_clutter(const Value& value, const Frame& frame, double rank) {
    std::vector<double> scratch;
    frame.for_each_part([&](const Span& rows, const Span& columns) {
        for (std::ptrdiff_t i = rows.begin; i < rows.end; ++i)
            for (std::ptrdiff_t j = columns.begin; j < columns.end; ++j) scratch.push_back(value(i, j));
    });
    if (scratch.empty()) return 0.0;
    const auto kth = scratch.begin() + (rank_of(rank, static_cast<std::ptrdiff_t>(scratch.size())) - 1);
    std::nth_element(scratch.begin(), kth, scratch.end());
    return *kth;
}

/// x > factor * (k-th smallest), without sorting: at least k of the products are smaller than x.
bool exceeds_ordered(const PowerRows& power, double x, double factor, const Frame& frame, double rank) {
    std::ptrdiff_t smaller = 0;
    const auto count = [&](const Span& rows, const Span& columns) {
        for (std::ptrdiff_t i = rows.begin; i < rows.end; ++i) {
            const double* row = power.row(i);
            for (std::ptrdiff_t j = columns.begin; j < columns.end; ++j) smaller += factor * row[j] < x ? 1 : 0;
        }
    };
    frame.for_each_part(count);
    return smaller >= rank_of(rank, frame.size());
}

double threshold_of(double factor, double clutter) {
    return std::isinf(factor) ? factor : factor * clutter;
}

void validate(const CfarOptions& options) {
    if (!(options.false_alarm_probability > 0.0 && options.false_alarm_probability < 1.0))
        throw ValueError("false_alarm_probability", "a number between 0 and 1", number_text(options.false_alarm_probability));
    for (const std::size_t d : {0U, 1U})
        if (options.reference[d] < 0 || options.guard[d] < 0)
            throw ValueError("reference, guard", "0 or more cells", shape_text(options.reference) + ", " + shape_text(options.guard));
    if (options.reference[0] == 0 && options.reference[1] == 0) throw ValueError("reference", "at least one reference cell", "none");
    if (options.method == CfarMethod::greatest_of && options.reference[0] == 0)
        throw ValueError("reference", "cells along azimuth, whose two sides greatest_of compares", shape_text(options.reference));
    if (!(options.looks >= 1.0)) throw ValueError("looks", "at least 1", number_text(options.looks));
    if (!(options.rank > 0.0 && options.rank <= 1.0)) throw ValueError("rank", "a number above 0, at most 1", number_text(options.rank));
}

CfarOptions along_azimuth(CfarOptions options) {
    options.reference[1] = 0;
    options.guard[1] = 0;
    return options;
}

template <class Sample>
void detect_all(const ArrayView<const Sample, 2>& view, const ArrayView<bool, 2>& mask, const CfarOptions& options) {
    validate(options);
    require_same_shape(mask, "mask", view, "the image");
    detail::require_samples(view, options.execution);
    const std::ptrdiff_t rows = view.extent(0);
    const std::ptrdiff_t columns = view.extent(1);
    const Windows row_windows(rows, options.reference[0], options.guard[0]);
    const Windows column_windows(columns, options.reference[1], options.guard[1]);
    const Array<double, 2> factors = factor_table(row_windows, column_windows, options);
    const bool ordered = options.method == CfarMethod::ordered_statistic;
    const auto threads = static_cast<std::uint64_t>(resolve_threads(options.execution.threads));
    const std::ptrdiff_t halo = row_windows.reach[static_cast<std::size_t>(rows / 2)].window.size();
    require_memory(threads * static_cast<std::uint64_t>(std::min(rows, block + halo) * columns) * 16U, "cfar");
    parallel_for(options.execution, "cfar", (rows + block - 1) / block, [&](std::ptrdiff_t b) {
        const std::ptrdiff_t begin = b * block;
        const std::ptrdiff_t end = std::min(rows, begin + block);
        const Span needed{row_windows.reach[static_cast<std::size_t>(begin)].window.begin,
                          row_windows.reach[static_cast<std::size_t>(end - 1)].window.end};
        const PowerRows power(view, needed.begin, needed.end);
        const auto run = [&](const auto& exceeds) {
            for (std::ptrdiff_t i = begin; i < end; ++i)
                for (std::ptrdiff_t j = 0; j < columns; ++j) {
                    const auto r = static_cast<std::size_t>(i);
                    const auto c = static_cast<std::size_t>(j);
                    const double factor = factors(row_windows.kind[r], column_windows.kind[c]);
                    mask(i, j) =
                        !std::isinf(factor) && exceeds(power.row(i)[j], factor, Frame{row_windows.reach[r], column_windows.reach[c]});
                }
        };
        if (ordered) {
            run([&](double x, double factor, const Frame& frame) { return exceeds_ordered(power, x, factor, frame, options.rank); });
        } else {
            const AreaTable table(power);
            run([&](double x, double factor, const Frame& frame) { return x > factor * mean_clutter(table, frame, options.method); });
        }
    });
}

CfarCell test_cell(const ImageView& image, const std::array<std::ptrdiff_t, 2>& cell, const CfarOptions& options) {
    for (const std::size_t d : {0U, 1U})
        if (cell[d] < 0 || cell[d] >= image.extent(d))
            throw ValueError("cells", "a cell of the image " + shape_text(image.extents()), shape_text(cell));
    const Frame frame{reach_of(cell[0], options.reference[0], options.guard[0], image.extent(0)),
                      reach_of(cell[1], options.reference[1], options.guard[1], image.extent(1))};
    require_finite(
        image.slice(0, frame.rows.window.begin, frame.rows.window.size()).slice(1, frame.columns.window.begin, frame.columns.window.size()),
        "the window of a cell", 1);
    const auto value = [&](std::ptrdiff_t i, std::ptrdiff_t j) { return detail::power(image(i, j)); };
    CfarCell out;
    out.intensity = value(cell[0], cell[1]);
    if (options.method == CfarMethod::ordered_statistic) {
        out.clutter = ordered_clutter(value, frame, options.rank);
    } else {
        out.clutter = mean_clutter([&](const Span& r, const Span& c) { return plain_sum(value, r, c); }, frame, options.method);
    }
    out.threshold = threshold_of(factor_of(frame, options), out.clutter);
    out.detected = out.intensity > out.threshold;
    return out;
}

std::vector<CfarCell> test_cells(const ImageView& image, const std::vector<std::array<std::ptrdiff_t, 2>>& cells,
                                 const CfarOptions& options) {
    validate(options);
    require_not_empty(image, "image");
    std::vector<CfarCell> out(cells.size());
    parallel_for(options.execution, "cfar", static_cast<std::int64_t>(cells.size()), [&](std::ptrdiff_t i) {
        out[static_cast<std::size_t>(i)] = test_cell(image, cells[static_cast<std::size_t>(i)], options);
    });
    return out;
}

}  // namespace

void cfar_1d(const ImageView& image, const ArrayView<bool, 2>& mask, const CfarOptions& options) {
    detect_all(image, mask, along_azimuth(options));
}
void cfar_1d(const IntensityView& intensity, const ArrayView<bool, 2>& mask, const CfarOptions& options) {
    detect_all(intensity, mask, along_azimuth(options));
}
void cfar_2d(const ImageView& image, const ArrayView<bool, 2>& mask, const CfarOptions& options) {
    detect_all(image, mask, options);
}
void cfar_2d(const IntensityView& intensity, const ArrayView<bool, 2>& mask, const CfarOptions& options) {
    detect_all(intensity, mask, options);
}

std::vector<CfarCell> cfar_1d_at(const ImageView& image, const std::vector<std::array<std::ptrdiff_t, 2>>& cells,
                                 const CfarOptions& options) {
    return test_cells(image, cells, along_azimuth(options));
}
std::vector<CfarCell> cfar_2d_at(const ImageView& image, const std::vector<std::array<std::ptrdiff_t, 2>>& cells,
                                 const CfarOptions& options) {
    return test_cells(image, cells, options);
}

}  // namespace sarfocus::detect
