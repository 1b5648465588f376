#include "image_evidence.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <sarfocus/core/array.hpp>
#include <sarfocus/fft/plan.hpp>

namespace sarfocus::autofocus::detail {
namespace {

constexpr std::ptrdiff_t upsample = 4;

// Power of columns between the samples, by zeros behind the one piece that the spectrum is.
class FinePower {
public:
    FinePower(std::ptrdiff_t n, std::ptrdiff_t first_bin)
        : n_(n), first_(first_bin), forward_(n, fft::Direction::forward), inverse_(upsample * n, fft::Direction::inverse) {}

    // Highest within `reach` samples of `centre`, circular; a parabola between the finer samples.
    [[nodiscard]] double peak(const ColumnWriter& image, std::ptrdiff_t column, double centre, std::ptrdiff_t reach) const {
        Array<cfloat, 1> line({n_});
        image(column, line.data());
        forward_.execute(line.data());
        const std::ptrdiff_t length = upsample * n_;
        Array<cfloat, 1> fine({length});
        for (std::ptrdiff_t p = 0; p < n_; ++p) fine(p) = line((first_ + p) % n_) * (1.0f / static_cast<float>(n_));
        inverse_.execute(fine.data());
        const auto power = [&](std::ptrdiff_t f) { return std::norm(cdouble(fine((f % length + length) % length))); };
        const auto middle = static_cast<std::ptrdiff_t>(std::lround(upsample * centre));
        std::ptrdiff_t best = middle;
        for (std::ptrdiff_t f = middle - upsample * reach; f <= middle + upsample * reach; ++f)
            if (power(f) > power(best)) best = f;
        const double left = power(best - 1);
        const double right = power(best + 1);
        const double curvature = left - 2.0 * power(best) + right;
        return power(best) - (curvature < 0.0 ? 0.125 * (left - right) * (left - right) / curvature : 0.0);
    }

private:
    std::ptrdiff_t n_;
    std::ptrdiff_t first_;
    fft::Plan<float> forward_;
    fft::Plan<float> inverse_;
};

ColumnWriter columns_of(const ImageView& image) {
    return [image](std::ptrdiff_t column, cfloat* line) {
        for (std::ptrdiff_t i = 0; i < image.extent(0); ++i) line[i] = image(i, column);
    };
}

double energy(const ImageView& image, std::ptrdiff_t column, double centre, std::ptrdiff_t window) {
    const auto middle = static_cast<std::ptrdiff_t>(std::lround(centre));
    const std::ptrdiff_t begin = window > 0 ? std::max<std::ptrdiff_t>(middle - window, 0) : 0;
    const std::ptrdiff_t end = window > 0 ? std::min(middle + window + 1, image.extent(0)) : image.extent(0);
    double sum = 0.0;
    for (std::ptrdiff_t i = begin; i < end; ++i) sum += std::norm(cdouble(image(i, column)));
    return sum;
}

}  // namespace

Evidence image_evidence(const ImageView& before, const ImageView& after, const PixelLayout& layout, const CellSize& cell,
                        const EvidenceOptions& options) {
    return image_evidence(columns_of(before), after, layout, cell, options);
}

Evidence image_evidence(const ColumnWriter& before, const ImageView& after, const PixelLayout& layout, const CellSize& cell,
                        const EvidenceOptions& options) {
    constexpr int count = 100;
    constexpr double separation = 6.5;      // cells, as in the coarse rounds of pga
    constexpr double most_coherent = 0.95;  // measured points are never ideal: PointOptions::fine_noise_floor
    const std::ptrdiff_t n = after.extent(0);
    Evidence out;
    out.points = strongest_points(after, layout, count, {separation * cell.azimuth, separation * cell.range}, {}, options.execution);
    out.weight.resize(out.points.size());
    out.coherence.resize(out.points.size());
    out.gain_db.resize(out.points.size());
    const FinePower fine(n, options.first_bin);
    const ColumnWriter afterwards = columns_of(after);
    const std::ptrdiff_t reach = std::max<std::ptrdiff_t>(n / 8, 1);
    parallel_for(options.execution, "points", static_cast<std::int64_t>(out.points.size()), [&](std::int64_t i) {
        const auto p = static_cast<std::size_t>(i);
        const double centre = out.points[p].azimuth;
        const std::ptrdiff_t column = std::lround(out.points[p].column);
        const double peak = fine.peak(afterwards, column, centre, 1);
        double earlier = 0.0;
        for (std::ptrdiff_t c = std::max<std::ptrdiff_t>(column - options.neighbours, 0);
             c <= std::min(column + options.neighbours, after.extent(1) - 1); ++c)
            earlier = std::max(earlier, fine.peak(before, c, centre, reach));
        const double all = energy(after, column, centre, options.window);
        out.coherence[p] = all > 0.0 ? std::min(peak * cell.azimuth / all, 1.0) : 0.0;
        const double c = std::min(out.coherence[p], most_coherent);
        out.weight[p] = c / (1.0 - c);
        out.gain_db[p] = earlier > 0.0 ? 10.0 * std::log10(peak / earlier) : 0.0;
    });
    // What is no brighter than speckle can be says nothing of either half; some are kept all the same, as in PointOptions.
    constexpr double minimum_contrast = 12.0;
    constexpr std::size_t minimum_points = 16;
    const double aperture = static_cast<double>(n) / cell.azimuth;
    Evidence kept;
    for (std::size_t p = 0; p < out.points.size(); ++p) {
        if (p >= minimum_points && out.coherence[p] * aperture < minimum_contrast) continue;
        kept.points.push_back(out.points[p]);
        kept.weight.push_back(out.weight[p]);
        kept.coherence.push_back(out.coherence[p]);
        kept.gain_db.push_back(out.gain_db[p]);
    }
    out = std::move(kept);
    double total = 0.0;
    for (const double w : out.weight) total += w;
    for (double& w : out.weight) w = total > 0.0 ? w / total : 0.0;
    return out;
}

}  // namespace sarfocus::autofocus::detail
