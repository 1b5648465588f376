#include <sarfocus/autofocus/strip.hpp>

#include <algorithm>
#include <cmath>
#include <exception>
#include <memory>
#include <string>

#include <omp.h>

#include <sarfocus/core/array.hpp>
#include <sarfocus/core/checks.hpp>
#include <sarfocus/core/error.hpp>
#include <sarfocus/detect/selection.hpp>

#include "strip_chain.hpp"
#include "strip_lines.hpp"
#include "strip_window.hpp"

namespace sarfocus::autofocus {
namespace {

using detail::at;
using geometry::StripmapGeometry;

constexpr std::ptrdiff_t gates_of_a_block = 8;        // one cache line of a row-major image
constexpr std::ptrdiff_t sections_per_aperture = 16;  // of azimuth, each with one candidate a gate
constexpr int candidates_per_wanted = 6;              // tested, for one that is wanted

// A gate's energy is not finite; which sample is at fault is found out afterwards.
class NotFinite : public std::exception {};

// Sections of azimuth, each some pixels long.
struct Sections {
    std::ptrdiff_t length = 1;
    std::ptrdiff_t count = 1;
    Sections(std::ptrdiff_t n_azimuth, double aperture)
        : length(std::clamp<std::ptrdiff_t>(static_cast<std::ptrdiff_t>(aperture) / sections_per_aperture, 1, n_azimuth)),
          count((n_azimuth + length - 1) / length) {}
};

// Running sums of the intensity of a few range gates, gate by gate next to one another.
class RunningSums {
public:
    RunningSums(std::ptrdiff_t n, std::ptrdiff_t gates) : n_(n), gates_(gates), sums_({(n + 1) * gates}) {}

    void load(const ImageView& image) {
        double* next = sums_.data() + gates_;
        std::fill(sums_.data(), next, 0.0);
        for (std::ptrdiff_t i = 0; i < n_; ++i, next += gates_)
            for (std::ptrdiff_t g = 0; g < gates_; ++g) {
                const cfloat value = g < image.extent(1) ? image(i, g) : cfloat{};
                const float intensity = value.real() * value.real() + value.imag() * value.imag();
                next[g] = next[g - gates_] + static_cast<double>(intensity);
            }
    }
    [[nodiscard]] double sum(std::ptrdiff_t begin, std::ptrdiff_t end, std::ptrdiff_t gate) const {
        return sums_(end * gates_ + gate) - sums_(begin * gates_ + gate);
    }
    [[nodiscard]] const double* row(std::ptrdiff_t i) const { return sums_.data() + i * gates_; }

private:
    std::ptrdiff_t n_;
    std::ptrdiff_t gates_;
    Array<double, 1> sums_;
};

// Clutter power of a gate: the median over pieces of azimuth of their mean intensity, which points do not reach.
double clutter_power(const RunningSums& sums, std::ptrdiff_t gate, std::ptrdiff_t n) {
    const std::ptrdiff_t pieces = std::clamp<std::ptrdiff_t>(n / 32, 1, 64);
    std::vector<double> means;
    for (std::ptrdiff_t p = 0; p < pieces; ++p) {
        const std::ptrdiff_t begin = p * n / pieces;
        const std::ptrdiff_t end = (p + 1) * n / pieces;
        means.push_back(sums.sum(begin, end, gate) / static_cast<double>(end - begin));
    }
    std::nth_element(means.begin(), means.begin() + pieces / 2, means.end());
    return means[at(pieces / 2)];
}

// Log likelihood ratio of a mean of `looks` exponential intensities, `ratio` times what clutter alone would give.
double statistic_of(double ratio, double looks) {
    return ratio > 1.0 ? std::max(looks, 1.0) * (ratio - 1.0 - std::log(ratio)) : 0.0;
}

// The best box of every section of one block of gates.
void best_boxes(const ImageView& image, std::ptrdiff_t first_gate, const Sections& sections, const StripmapGeometry& geometry,
                const std::vector<int>& extents, RunningSums& sums, std::vector<StripPoint>& out) {
    const std::ptrdiff_t n = image.extent(0);
    sums.load(image);
    std::array<double, gates_of_a_block> clutter{};
    std::array<double, gates_of_a_block> total{};
    for (std::ptrdiff_t g = 0; g < image.extent(1); ++g) {
        total[at(g)] = sums.sum(0, n, g);
        // Twelve digits below the gate's own energy there is nothing to be seen.
        clutter[at(g)] = std::max(clutter_power(sums, g, n), 1e-12 * total[at(g)]);
        if (!std::isfinite(total[at(g)])) throw NotFinite();
    }
    const double cell = geometry.prf / geometry.doppler_bandwidth;  // pixels
    for (const int extent : extents) {
        if (extent > n) continue;
        const std::ptrdiff_t step = std::max(extent / 4, 1);
        for (std::ptrdiff_t s = 0; s < sections.count; ++s) {
            std::array<double, gates_of_a_block> best{};
            std::array<std::ptrdiff_t, gates_of_a_block> where{};
            const std::ptrdiff_t end = std::min((s + 1) * sections.length, n - extent + 1);
            for (std::ptrdiff_t u = s * sections.length; u < end; u += step) {
                const double* low = sums.row(u);
                const double* high = sums.row(u + extent);
                for (std::size_t g = 0; g < at(gates_of_a_block); ++g) {
                    const double energy = high[g] - low[g];
                    where[g] = energy > best[g] ? u : where[g];
                    best[g] = std::max(energy, best[g]);
                }
            }
            for (std::ptrdiff_t g = 0; g < image.extent(1); ++g) {
                if (!(total[at(g)] > 0.0)) continue;
                const double ratio = best[at(g)] / (static_cast<double>(extent) * clutter[at(g)]);
                const double statistic = statistic_of(ratio, static_cast<double>(extent) / cell);
                StripPoint& held = out[at((first_gate + g) * sections.count + s)];
                if (statistic <= held.statistic) continue;
                held.azimuth = where[at(g)] + extent / 2;
                held.range = first_gate + g;
                held.extent = extent;
                held.energy = best[at(g)] - static_cast<double>(extent) * clutter[at(g)];
                held.statistic = statistic;
            }
        }
    }
}

// Candidates, the most striking of every section first.
std::vector<std::vector<StripPoint>> candidates_of(const ImageView& image, const StripmapGeometry& geometry, const Sections& sections,
                                                   const StripSelectOptions& options) {
    const std::ptrdiff_t n_range = image.extent(1);
    std::vector<StripPoint> boxes(at(n_range * sections.count));
    std::vector<std::unique_ptr<RunningSums>> workspaces(static_cast<std::size_t>(resolve_threads(options.execution.threads)));
    parallel_for(options.execution, "find strong points", (n_range + gates_of_a_block - 1) / gates_of_a_block, [&](std::int64_t b) {
        auto& workspace = workspaces[static_cast<std::size_t>(omp_get_thread_num())];
        if (!workspace) workspace = std::make_unique<RunningSums>(image.extent(0), gates_of_a_block);
        const std::ptrdiff_t first = b * gates_of_a_block;
        best_boxes(image.slice(1, first, std::min(gates_of_a_block, n_range - first)), first, sections, geometry, options.extents,
                   *workspace, boxes);
    });
    std::vector<std::vector<StripPoint>> out(at(sections.count));
    for (std::ptrdiff_t s = 0; s < sections.count; ++s) {
        auto& here = out[at(s)];
        for (std::ptrdiff_t g = 0; g < n_range; ++g)
            if (boxes[at(g * sections.count + s)].statistic > 0.0) here.push_back(boxes[at(g * sections.count + s)]);
        std::sort(here.begin(), here.end(), [](const StripPoint& a, const StripPoint& b) {
            return a.statistic != b.statistic ? a.statistic > b.statistic : a.range < b.range;
        });
    }
    return out;
}

std::vector<std::vector<StripPoint>> finite_candidates_of(const ImageView& image, const StripmapGeometry& geometry,
                                                          const Sections& sections, const StripSelectOptions& options) {
    try {
        return candidates_of(image, geometry, sections, options);
    } catch (const NotFinite&) {
        require_finite(image, "image", options.execution.threads);
        throw NumericalError("image: expected pixels whose energy fits a number, got larger ones");
    }
}

bool by_statistic(const StripPoint& a, const StripPoint& b) {
    if (a.statistic != b.statistic) return a.statistic > b.statistic;
    return a.azimuth != b.azimuth ? a.azimuth < b.azimuth : a.range < b.range;
}

// From the most striking downwards (by energy alone, a longer box with some clutter would always win over the one that fits): what lies
// too near to one that is kept is its side lobe, or another box round the same scatterer.
std::vector<StripPoint> without_side_lobes(std::vector<StripPoint> points, double aperture, double window, double dynamic_range_db) {
    std::sort(points.begin(), points.end(), by_statistic);
    const double share = std::pow(10.0, -0.1 * dynamic_range_db);
    const double far_share = 0.1 * share;  // side lobes of an unweighted response fall by 10 dB from a few cells to some tens
    std::vector<StripPoint> out;
    for (const StripPoint& p : points) {
        const bool stands = std::none_of(out.begin(), out.end(), [&](const StripPoint& kept) {
            const auto azimuth = static_cast<double>(std::abs(p.azimuth - kept.azimuth));
            const auto range = std::abs(p.range - kept.range);
            const bool same = range <= 3 && azimuth <= std::max(window, 0.5 * static_cast<double>(p.extent));
            const bool near = range <= 16 && azimuth <= 0.5 * aperture;
            return same || (near && p.energy < share * kept.energy) || (range <= 3 && p.energy < far_share * kept.energy);
        });
        if (stands) out.push_back(p);
    }
    return out;
}

// The frame of boxes round a candidate, each the root of its mean intensity, so that the 2-D test sees that intensity.
bool stands_out(const ImageView& image, const StripPoint& point, const StripmapGeometry& geometry, detect::CfarOptions options) {
    const std::ptrdiff_t extent = point.extent;
    const std::ptrdiff_t rows = options.reference[0] + options.guard[0];
    const std::ptrdiff_t columns = options.reference[1] + options.guard[1];
    const std::ptrdiff_t begin = point.azimuth - extent / 2;
    const std::ptrdiff_t above = std::min(rows, begin / extent);
    const std::ptrdiff_t below = std::min(rows, (image.extent(0) - begin) / extent - 1);
    const std::ptrdiff_t left = std::min<std::ptrdiff_t>(columns, point.range);
    const std::ptrdiff_t right = std::min<std::ptrdiff_t>(columns, image.extent(1) - 1 - point.range);
    Array<cfloat, 2> patch({above + below + 1, left + right + 1});
    for (std::ptrdiff_t r = -above; r <= below; ++r)
        for (std::ptrdiff_t c = -left; c <= right; ++c) {
            double sum = 0.0;
            for (std::ptrdiff_t i = 0; i < extent; ++i) sum += std::norm(cdouble(image(begin + r * extent + i, point.range + c)));
            patch(r + above, c + left) = static_cast<float>(std::sqrt(sum / static_cast<double>(extent)));
        }
    options.looks = std::max(static_cast<double>(extent) * geometry.doppler_bandwidth / geometry.prf, 1.0);
    options.execution.threads = 1;
    const ImageView view = std::as_const(patch).view();
    if (!detect::cfar_2d_at(view, {{above, left}}, options).front().detected) return false;
    if (extent == 1) return true;
    // The border of a bright field stands out of the mean round a long box, but not of its brighter side, in azimuth or in range.
    options.method = detect::CfarMethod::greatest_of;
    const auto both_sides = [](std::ptrdiff_t before, std::ptrdiff_t behind, std::ptrdiff_t guard) {
        return before > guard && behind > guard;
    };
    if (both_sides(above, below, options.guard[0]) && !detect::cfar_2d_at(view, {{above, left}}, options).front().detected) return false;
    if (!both_sides(left, right, options.guard[1])) return true;
    const ImageView turned(view.data(), {view.extent(1), view.extent(0)}, {view.stride(1), view.stride(0)});
    std::swap(options.reference[0], options.reference[1]);
    std::swap(options.guard[0], options.guard[1]);
    return detect::cfar_2d_at(turned, {{left, above}}, options).front().detected;
}

std::ptrdiff_t wanted_points(const ImageView& image, double aperture, const StripSelectOptions& options) {
    if (options.points > 0) return options.points;
    const double apertures = std::max(static_cast<double>(image.extent(0)) / aperture, 1.0);
    const auto enough = static_cast<std::ptrdiff_t>(std::ceil(options.points_per_aperture * apertures));
    return std::min(detect::point_limit(image.extent(0)), std::max<std::ptrdiff_t>(enough, 2));
}

}  // namespace

void StripSelectOptions::validate() const {
    if (extents.empty()) throw ValueError("extents", "at least one length", "none");
    for (const int extent : extents)
        if (extent < 1) throw ValueError("extents", "lengths of at least one pixel", std::to_string(extent));
    if (!(maximum_contrast > 0.0 && maximum_contrast <= 1.0))
        throw ValueError("maximum_contrast", "a number above 0, at most 1", number_text(maximum_contrast));
    if (points < 0) throw ValueError("points", "0 (as many as are worth it) or a positive number", std::to_string(points));
    if (points_per_aperture < 1) throw ValueError("points_per_aperture", "at least 1", std::to_string(points_per_aperture));
    require_positive(dynamic_range_db, "dynamic_range_db");
    if (window < 0) throw ValueError("window", "0 (what holds the points) or a number of pixels", std::to_string(window));
    (void)resolve_threads(execution.threads);
}

std::vector<StripPoint> select_strip_points(const ImageView& image, const StripmapGeometry& geometry, const StripSelectOptions& options) {
    options.validate();
    detail::require_strip_image(image, geometry);
    const double aperture = geometry.aperture_samples(geometry.slant_range.size() / 2);
    const double apart = options.window > 0 ? options.window : detail::narrow_window(geometry);
    const Sections sections(image.extent(0), aperture);
    const std::ptrdiff_t wanted = wanted_points(image, aperture, options);

    std::vector<StripPoint> points;
    const auto per_section = at(candidates_per_wanted * wanted / sections.count + 8);
    for (auto& section : finite_candidates_of(image, geometry, sections, options)) {
        if (section.size() > per_section) section.resize(per_section);
        points.insert(points.end(), section.begin(), section.end());
    }
    points = without_side_lobes(std::move(points), aperture, apart, options.dynamic_range_db);
    std::vector<char> detected(points.size(), 0);
    parallel_for(options.execution, "cfar", static_cast<std::int64_t>(points.size()),
                 [&](std::int64_t i) { detected[at(i)] = stands_out(image, points[at(i)], geometry, options.cfar) ? 1 : 0; });
    std::vector<StripPoint> kept;
    for (std::size_t i = 0; i < points.size(); ++i)
        if (detected[i] != 0) kept.push_back(points[i]);
    return detail::best_spread(image, geometry, std::move(kept), options);
}

std::vector<StripPoint> detail::best_spread(const ImageView& image, const StripmapGeometry& geometry, std::vector<StripPoint> kept,
                                            const StripSelectOptions& options) {
    if (kept.empty()) return kept;
    const double aperture = geometry.aperture_samples(geometry.slant_range.size() / 2);
    const double apart = options.window > 0 ? options.window : detail::narrow_window(geometry);
    const Sections sections(image.extent(0), aperture);
    const std::ptrdiff_t wanted = wanted_points(image, aperture, options);

    StripExtractOptions extraction;
    extraction.window = options.window;
    extraction.execution = options.execution;
    // The most striking ones are enough to choose from; their signals are what takes memory.
    std::sort(kept.begin(), kept.end(), by_statistic);
    const auto tested = at(3 * wanted);
    if (kept.size() > tested) kept.resize(tested);
    Apertures apertures = extract_apertures(image, geometry, kept, extraction);
    // The middle of a box may lie beside the point: to where it is brightest, once.
    const std::vector<double> brightest = detail::imaged_before(apertures);
    for (std::ptrdiff_t n = 0; n < apertures.size(); ++n) {
        std::int64_t& azimuth = apertures.points[at(n)].azimuth;
        azimuth = std::clamp<std::int64_t>(azimuth + std::lround(brightest[at(n)]), 0, image.extent(0) - 1);
    }
    apertures.points = without_side_lobes(std::move(apertures.points), aperture, apart, options.dynamic_range_db);
    std::vector<detect::Point> spread;
    for (const StripPoint& p : apertures.points)
        if (p.contrast <= options.maximum_contrast) spread.push_back({p.azimuth, p.range, p.energy, p.contrast});
    detect::SpreadOptions even;
    even.limit = wanted;
    even.sections = std::max<std::ptrdiff_t>(sections.count / 4, 1);
    spread = detect::spread_evenly(spread, image.extent(0), even);
    std::vector<StripPoint> out;
    for (const detect::Point& chosen : spread)
        out.push_back(*std::find_if(apertures.points.begin(), apertures.points.end(),
                                    [&](const StripPoint& p) { return p.azimuth == chosen.azimuth && p.range == chosen.range; }));
    return out;
}

}  // namespace sarfocus::autofocus
