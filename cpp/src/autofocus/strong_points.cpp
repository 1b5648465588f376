#include "strong_points.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <sarfocus/core/constants.hpp>
#include <sarfocus/detect/local_maxima.hpp>

namespace sarfocus::autofocus::detail {
namespace {

double intensity(const ImageView& image, std::ptrdiff_t i, std::ptrdiff_t j) {
    return std::norm(cdouble(image(i, j)));
}

bool neighbours(const PixelLayout& layout, std::ptrdiff_t a, std::ptrdiff_t b) {
    return std::abs(layout.range_gate(a) - layout.range_gate(b)) == 1;
}

Pixel refined(const ImageView& image, const PixelLayout& layout, std::ptrdiff_t i, std::ptrdiff_t j) {
    const double value = intensity(image, i, j);
    Pixel out{static_cast<double>(i), static_cast<double>(j)};
    if (i > 0 && i + 1 < image.extent(0)) out.azimuth += sub_pixel(intensity(image, i - 1, j), value, intensity(image, i + 1, j));
    if (layout.fractional_columns() && j > 0 && j + 1 < image.extent(1))
        out.column += sub_pixel(intensity(image, i, j - 1), value, intensity(image, i, j + 1));
    return out;
}

// Coalescence by range gate, then back to columns.
std::vector<Pixel> coalesced(const ImageView& image, const PixelLayout& layout, int count, const CellSize& separation,
                             std::vector<detect::Point> maxima) {
    for (detect::Point& p : maxima) p.range = layout.range_gate(p.range);
    maxima = detect::coalesce(std::move(maxima), reach_of(separation));
    if (maxima.size() > static_cast<std::size_t>(count)) maxima.resize(static_cast<std::size_t>(count));
    return to_pixels(maxima, image, layout);
}

// An intensity that about `pixels` of the image exceed, from a sample of it; 0: that is more than a quarter of it.
double upper_intensity(const ImageView& image, std::ptrdiff_t pixels) {
    constexpr std::ptrdiff_t sample = 65536;
    constexpr std::ptrdiff_t least = 16;  // samples above it, for the number of pixels above it to be known
    const std::ptrdiff_t step = std::clamp<std::ptrdiff_t>(image.size() / sample, 1, std::max<std::ptrdiff_t>(pixels / least - 1, 1)) | 1;
    const std::ptrdiff_t above = pixels / step;
    if (above < least || 4 * above * step > image.size()) return 0.0;
    std::vector<double> values;
    values.reserve(static_cast<std::size_t>(image.size() / step + 1));
    for (std::ptrdiff_t k = 0; k < image.size(); k += step) values.push_back(intensity(image, k / image.extent(1), k % image.extent(1)));
    const auto place = values.end() - above;
    std::nth_element(values.begin(), place, values.end());
    return *place;
}

}  // namespace

double pixels_per_cell(double correlation) {
    // sinc(1 / s) = correlation
    double low = 1.0 / 16.0;
    double high = 1.0;
    for (int step = 0; step < 60; ++step) {
        const double x = 0.5 * (low + high);
        (std::sin(pi * x) / (pi * x) > correlation ? low : high) = x;
    }
    return 2.0 / (low + high);
}

CellSize cell_size(const ImageView& image, const PixelLayout& layout) {
    double power = 0.0;
    cdouble along_azimuth{};
    cdouble along_range{};
    double range_power = 0.0;
    for (std::ptrdiff_t i = 0; i < image.extent(0); ++i)
        for (std::ptrdiff_t j = 0; j < image.extent(1); ++j) {
            const cdouble value(image(i, j));
            power += std::norm(value);
            if (i + 1 < image.extent(0)) along_azimuth += value * std::conj(cdouble(image(i + 1, j)));
            if (j + 1 < image.extent(1) && neighbours(layout, j, j + 1)) {
                along_range += value * std::conj(cdouble(image(i, j + 1)));
                range_power += std::norm(value);
            }
        }
    CellSize out;
    if (power > 0.0) out.azimuth = pixels_per_cell(std::abs(along_azimuth) / power);
    if (range_power > 0.0) out.range = pixels_per_cell(std::abs(along_range) / range_power);
    return out;
}

std::vector<Pixel> strongest_points(const ImageView& image, const PixelLayout& layout, int count, const CellSize& separation,
                                    const ArrayView<const bool, 2>& wanted, const Execution& execution) {
    std::vector<Pixel> out;
    if (layout.is_list()) {
        for (std::ptrdiff_t i = 0; i < image.extent(0); ++i)
            if (wanted.data() == nullptr || wanted(i, 0)) out.push_back({static_cast<double>(i), 0.0});
        return out;
    }
    detect::LocalMaximaOptions options;
    options.half_width = {1, 0};  // neighbouring columns need not be neighbouring gates; coalescence sees to those that are
    options.execution = execution;
    // The strongest that are wanted stand out of most pixels: weaker ones are looked for only where these do not suffice.
    for (const std::ptrdiff_t pixels_a_point : {6, 30, 0}) {
        options.minimum = pixels_a_point > 0 ? upper_intensity(image, pixels_a_point * count) : 0.0;
        out = coalesced(image, layout, count, separation, detect::local_maxima(image, options, wanted));
        if (static_cast<int>(out.size()) == count || options.minimum == 0.0) break;
    }
    return out;
}

double sub_pixel(double left, double centre, double right) {
    if (!(left > 0.0 && right > 0.0)) return 0.0;
    const double l = std::log(left);
    const double c = std::log(centre);
    const double r = std::log(right);
    const double curvature = l - 2.0 * c + r;
    return curvature < 0.0 ? std::clamp(0.5 * (l - r) / curvature, -0.5, 0.5) : 0.0;
}

std::array<std::ptrdiff_t, 2> reach_of(const CellSize& separation) {
    return {std::max(std::lround(separation.azimuth), 1L), std::max(std::lround(separation.range), 1L)};
}

std::vector<Pixel> to_pixels(const std::vector<detect::Point>& points, const ImageView& image, const PixelLayout& layout) {
    std::vector<std::ptrdiff_t> gates;
    for (std::ptrdiff_t j = 0; j < image.extent(1); ++j) gates.push_back(layout.range_gate(j));
    std::vector<Pixel> out;
    for (const detect::Point& p : points)
        out.push_back(refined(image, layout, p.azimuth, std::lower_bound(gates.begin(), gates.end(), p.range) - gates.begin()));
    return out;
}

}  // namespace sarfocus::autofocus::detail
