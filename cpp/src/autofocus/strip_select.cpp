#include <sarfocus/autofocus/strip.hpp>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include <sarfocus/core/array.hpp>
#include <sarfocus/core/checks.hpp>
#include <sarfocus/core/error.hpp>
#include <sarfocus/detect/selection.hpp>

#include "strip_boxes.hpp"
#include "strip_chain.hpp"
#include "strip_lines.hpp"
#include "strip_window.hpp"

namespace sarfocus::autofocus {
namespace {

using detail::at;
using detail::Sections;
using geometry::StripmapGeometry;

constexpr int candidates_per_wanted = 6;  // tested, for one that is wanted

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
    detail::BoxOptions boxes;
    boxes.extents = options.extents;
    boxes.cell = geometry.prf / geometry.doppler_bandwidth;
    boxes.most = at(candidates_per_wanted * wanted / sections.count + 8);
    boxes.execution = options.execution;
    for (const auto& section : detail::strongest_boxes(image, sections, boxes)) points.insert(points.end(), section.begin(), section.end());
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
    const std::vector<double> brightest = detail::imaged_before(apertures, options.execution);
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
