#include "strong_points.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include <sarfocus/core/array.hpp>
#include <sarfocus/core/constants.hpp>

namespace sarfocus::autofocus::detail {
namespace {

double intensity(const ImageView& image, std::ptrdiff_t i, std::ptrdiff_t j) {
    return std::norm(cdouble(image(i, j)));
}

bool neighbours(const PointSource& source, std::ptrdiff_t a, std::ptrdiff_t b) {
    return std::abs(source.range_gate(a) - source.range_gate(b)) == 1;
}

// Pixels per cell from the correlation at lag one: sinc(1 / s) = correlation.
double pixels_per_cell(double correlation) {
    double low = 1.0 / 16.0;
    double high = 1.0;
    for (int step = 0; step < 60; ++step) {
        const double x = 0.5 * (low + high);
        (std::sin(pi * x) / (pi * x) > correlation ? low : high) = x;
    }
    return 2.0 / (low + high);
}

double sub_pixel(double left, double centre, double right) {
    if (!(left > 0.0 && right > 0.0)) return 0.0;
    const double l = std::log(left);
    const double c = std::log(centre);
    const double r = std::log(right);
    const double curvature = l - 2.0 * c + r;
    return curvature < 0.0 ? std::clamp(0.5 * (l - r) / curvature, -0.5, 0.5) : 0.0;
}

bool is_local_maximum(const ImageView& image, const PointSource& source, std::ptrdiff_t i, std::ptrdiff_t j, double value) {
    for (std::ptrdiff_t b = std::max<std::ptrdiff_t>(j - 1, 0); b <= std::min(j + 1, image.extent(1) - 1); ++b) {
        if (b != j && !neighbours(source, b, j)) continue;
        for (std::ptrdiff_t a = i - 1; a <= i + 1; ++a)
            if ((a != i || b != j) && intensity(image, a, b) > value) return false;
    }
    return true;
}

Pixel refined(const ImageView& image, const PointSource& source, std::ptrdiff_t i, std::ptrdiff_t j) {
    const double value = intensity(image, i, j);
    Pixel out{static_cast<double>(i), static_cast<double>(j)};
    if (i > 0 && i + 1 < image.extent(0)) out.azimuth += sub_pixel(intensity(image, i - 1, j), value, intensity(image, i + 1, j));
    if (source.fractional_columns() && j > 0 && j + 1 < image.extent(1))
        out.column += sub_pixel(intensity(image, i, j - 1), value, intensity(image, i, j + 1));
    return out;
}

}  // namespace

CellSize cell_size(const ImageView& image, const PointSource& source) {
    double power = 0.0;
    cdouble along_azimuth{};
    cdouble along_range{};
    double range_power = 0.0;
    for (std::ptrdiff_t i = 0; i < image.extent(0); ++i)
        for (std::ptrdiff_t j = 0; j < image.extent(1); ++j) {
            const cdouble value(image(i, j));
            power += std::norm(value);
            if (i + 1 < image.extent(0)) along_azimuth += value * std::conj(cdouble(image(i + 1, j)));
            if (j + 1 < image.extent(1) && neighbours(source, j, j + 1)) {
                along_range += value * std::conj(cdouble(image(i, j + 1)));
                range_power += std::norm(value);
            }
        }
    CellSize out;
    if (power > 0.0) out.azimuth = pixels_per_cell(std::abs(along_azimuth) / power);
    if (range_power > 0.0) out.range = pixels_per_cell(std::abs(along_range) / range_power);
    return out;
}

std::vector<Pixel> strongest_points(const ImageView& image, const PointSource& source, int count, const CellSize& separation,
                                    const std::function<bool(std::ptrdiff_t, std::ptrdiff_t)>& wanted) {
    std::vector<Pixel> out;
    if (source.is_list()) {
        for (std::ptrdiff_t i = 0; i < image.extent(0); ++i)
            if (wanted(i, 0)) out.push_back({static_cast<double>(i), 0.0});
        return out;
    }
    struct Candidate {
        double value;
        std::ptrdiff_t i;
        std::ptrdiff_t j;
    };
    std::vector<Candidate> candidates;
    for (std::ptrdiff_t i = 1; i + 1 < image.extent(0); ++i)
        for (std::ptrdiff_t j = 0; j < image.extent(1); ++j) {
            const double value = intensity(image, i, j);
            if (value > 0.0 && wanted(i, j) && is_local_maximum(image, source, i, j, value)) candidates.push_back({value, i, j});
        }
    std::sort(candidates.begin(), candidates.end(), [](const Candidate& a, const Candidate& b) {
        return a.value != b.value ? a.value > b.value : (a.i != b.i ? a.i < b.i : a.j < b.j);
    });

    const auto reach_azimuth = static_cast<std::ptrdiff_t>(std::lround(separation.azimuth));
    const auto reach_range = static_cast<std::ptrdiff_t>(std::lround(separation.range));
    Array<std::uint8_t, 2> taken({image.extent(0), image.extent(1)});
    for (const Candidate& c : candidates) {
        if (static_cast<int>(out.size()) == count) break;
        if (taken(c.i, c.j) != 0) continue;
        out.push_back(refined(image, source, c.i, c.j));
        for (std::ptrdiff_t b = c.j; b >= 0 && source.range_gate(c.j) - source.range_gate(b) <= reach_range; --b)
            for (std::ptrdiff_t a = std::max<std::ptrdiff_t>(c.i - reach_azimuth, 0);
                 a <= std::min(c.i + reach_azimuth, image.extent(0) - 1); ++a)
                taken(a, b) = 1;
        for (std::ptrdiff_t b = c.j + 1; b < image.extent(1) && source.range_gate(b) - source.range_gate(c.j) <= reach_range; ++b)
            for (std::ptrdiff_t a = std::max<std::ptrdiff_t>(c.i - reach_azimuth, 0);
                 a <= std::min(c.i + reach_azimuth, image.extent(0) - 1); ++a)
                taken(a, b) = 1;
    }
    return out;
}

}  // namespace sarfocus::autofocus::detail
