#include <sarfocus/detect/selection.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include <sarfocus/core/checks.hpp>
#include <sarfocus/core/error.hpp>

#include "power.hpp"

namespace sarfocus::detect {
namespace {

constexpr std::ptrdiff_t block = 64;

/// Better first; a strict order of different pixels.
bool better(const Point& a, const Point& b, PointOrder order) {
    if (order == PointOrder::contrast) {
        const bool has = !std::isnan(a.contrast);
        if (has != !std::isnan(b.contrast)) return has;
        if (has && a.contrast != b.contrast) return a.contrast < b.contrast;
    }
    return stronger(a, b);
}

}  // namespace

double contrast(const ArrayView<const cfloat, 1>& signal) {
    require_not_empty(signal, "signal");
    double amplitudes = 0.0;
    double powers = 0.0;
    for (std::ptrdiff_t i = 0; i < signal.extent(0); ++i) {
        const double power = detail::power(signal(i));
        amplitudes += std::sqrt(power);
        powers += power;
    }
    if (!std::isfinite(powers)) throw NumericalError("signal: expected finite samples, got NaN or infinity");
    if (powers == 0.0) throw NumericalError("signal: expected at least one sample different from zero, got zeros");
    return std::max(0.0, 1.0 - amplitudes * amplitudes / (static_cast<double>(signal.extent(0)) * powers));
}

std::vector<Point> filter_contrast(std::vector<Point> points, double maximum) {
    require_finite_value(maximum, "maximum");
    std::erase_if(points, [&](const Point& point) { return !(point.contrast <= maximum); });
    return points;
}

std::vector<RangeGate> strongest_gates(const ImageView& image, const GateOptions& options) {
    if (options.count < 0) throw ValueError("count", "0 (all) or a positive number", std::to_string(options.count));
    detail::require_samples(image, options.execution);
    const std::ptrdiff_t gates = image.extent(1);
    std::vector<RangeGate> out(static_cast<std::size_t>(gates));
    parallel_for(options.execution, "strongest gates", (gates + block - 1) / block, [&](std::ptrdiff_t b) {
        const std::ptrdiff_t begin = b * block;
        const ImageView part = image.slice(1, begin, std::min(block, gates - begin));
        std::array<double, block> energy{};
        std::array<double, block> peak{};
        detail::walk(part, 0, part.extent(0), [&](std::ptrdiff_t i, std::ptrdiff_t j) {
            const double power = detail::power(part(i, j));
            const auto k = static_cast<std::size_t>(j);
            energy[k] += power;
            peak[k] = std::max(peak[k], power);
        });
        for (std::ptrdiff_t j = 0; j < part.extent(1); ++j) {
            const auto k = static_cast<std::size_t>(j);
            const double mean = energy[k] / static_cast<double>(image.extent(0));
            const double score = options.score == GateScore::energy ? energy[k] : (mean > 0.0 ? peak[k] / mean : 0.0);
            out[static_cast<std::size_t>(begin + j)] = {begin + j, score};
        }
    });
    std::stable_sort(out.begin(), out.end(), [](const RangeGate& a, const RangeGate& b) { return a.score > b.score; });
    if (options.count > 0 && static_cast<std::size_t>(options.count) < out.size()) out.resize(static_cast<std::size_t>(options.count));
    return out;
}

std::vector<Point> spread_evenly(const std::vector<Point>& points, std::ptrdiff_t n_azimuth, const SpreadOptions& options) {
    if (options.sections < 1) throw ValueError("sections", "a positive number", std::to_string(options.sections));
    if (options.limit < 0) throw ValueError("limit", "0 (point_limit) or a positive number", std::to_string(options.limit));
    const auto limit = static_cast<std::size_t>(options.limit == 0 ? point_limit(n_azimuth) : options.limit);
    const auto order = [&](const Point& a, const Point& b) { return better(a, b, options.order); };
    const double length = static_cast<double>(n_azimuth) / static_cast<double>(options.sections);
    std::vector<std::vector<Point>> sections(static_cast<std::size_t>(options.sections));
    for (const Point& point : points) {
        if (point.azimuth < 0 || point.azimuth >= n_azimuth)
            throw ValueError("points", "azimuth from 0 to " + std::to_string(n_azimuth - 1), std::to_string(point.azimuth));
        const auto section = static_cast<std::size_t>(static_cast<double>(point.azimuth) / length);
        sections[std::min(section, sections.size() - 1)].push_back(point);
    }
    for (auto& section : sections) std::sort(section.begin(), section.end(), order);

    std::vector<Point> out;
    for (std::size_t round = 0; out.size() < std::min(limit, points.size()); ++round) {
        std::vector<Point> next;
        for (const auto& section : sections)
            if (round < section.size()) next.push_back(section[round]);
        const std::size_t room = limit - out.size();
        if (next.size() > room) {
            std::sort(next.begin(), next.end(), order);
            next.resize(room);
        }
        out.insert(out.end(), next.begin(), next.end());
    }
    std::sort(out.begin(), out.end(),
              [](const Point& a, const Point& b) { return a.azimuth != b.azimuth ? a.azimuth < b.azimuth : a.range < b.range; });
    return out;
}

std::ptrdiff_t point_limit(std::ptrdiff_t n_azimuth, std::ptrdiff_t iterations) {
    if (n_azimuth < 1) throw ValueError("n_azimuth", "a positive number", std::to_string(n_azimuth));
    if (iterations < 1) throw ValueError("iterations", "a positive number", std::to_string(iterations));
    const auto n = static_cast<double>(n_azimuth);
    const double limit = std::numbers::sqrt2 * std::pow(static_cast<double>(iterations), 0.75) * std::sqrt(n * std::log2(n));
    return std::max<std::ptrdiff_t>(1, static_cast<std::ptrdiff_t>(std::floor(limit)));
}

}  // namespace sarfocus::detect
