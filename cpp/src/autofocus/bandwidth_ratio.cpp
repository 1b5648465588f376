#include "bandwidth_ratio.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include <sarfocus/core/array.hpp>

#include "gate_layout.hpp"
#include "line_sums.hpp"
#include "score.hpp"
#include "strong_points.hpp"

namespace sarfocus::autofocus::detail {
namespace {

// Range stripes that are corrected each by itself, as circular images, the strongest ones of the scene.
class Stripes {
public:
    Stripes(const ImageView& image, const std::vector<double>& phase, MigrationModel model, const Execution& execution)
        : phase_(phase), model_(model), execution_(execution) {
        constexpr std::ptrdiff_t width = 64;  // several times the migration that a band of half the carrier makes of 80 rad
        constexpr std::size_t most = 16;
        const std::ptrdiff_t pieces = std::max<std::ptrdiff_t>(image.extent(1) / width, std::min<std::ptrdiff_t>(image.extent(1) / 16, 2));
        std::vector<double> strength;
        for (std::ptrdiff_t p = 0; p < pieces; ++p) {
            const std::ptrdiff_t begin = p * image.extent(1) / pieces;
            stripes_.push_back(image.slice(1, begin, (p + 1) * image.extent(1) / pieces - begin));
        }
        strength.resize(stripes_.size());
        parallel_for(execution, "choose stripes", pieces, [&](std::int64_t p) {
            const ImageView& stripe = stripes_[static_cast<std::size_t>(p)];
            for (std::ptrdiff_t i = 0; i < stripe.extent(0); ++i)
                for (std::ptrdiff_t j = 0; j < stripe.extent(1); ++j) {
                    const double intensity = std::norm(cdouble(stripe(i, j)));
                    strength[static_cast<std::size_t>(p)] += intensity * intensity;
                }
        });
        std::vector<std::size_t> order(stripes_.size());
        std::iota(order.begin(), order.end(), std::size_t{0});
        std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return strength[a] > strength[b]; });
        order.resize(std::min(order.size(), most));
        std::vector<ImageView> chosen;
        for (const std::size_t p : order) chosen.push_back(stripes_[p]);  // dealt out by strength: either half has its share
        stripes_ = chosen;
        for (const ImageView& stripe : stripes_)
            cells_ = std::max(cells_, [&] {
                const CellSize cell = cell_size(stripe, GateLayout(stripe.extent(0), stripe.extent(1)));
                return cell.azimuth * cell.range;
            }());
    }

    // Log sharpness of the two halves of the stripes and of all.
    [[nodiscard]] std::array<double, 3> log_sharpness(double ratio) {
        std::array<HalfSums, 3> sums;
        for (std::size_t s = 0; s < stripes_.size(); ++s) {
            if (corrected_.extents() != stripes_[s].extents()) corrected_ = Array<cfloat, 2>(stripes_[s].extents());
            correct_two_dimensional(stripes_[s], phase_, ratio, model_, corrected_.view(), execution_);
            const LineIntensity all = intensity_of_corrected();
            for (const std::size_t half : {s % 2, std::size_t{2}}) {
                sums[half].power += all.sum;
                sums[half].square += all.square;
            }
        }
        return {sums[0].log_sharpness(), sums[1].log_sharpness(), sums[2].log_sharpness()};
    }

    // Mean variance of the gain of the two halves by chance, as in `judge`.
    [[nodiscard]] double variance() const {
        std::array<double, 2> pixels{};
        for (std::size_t s = 0; s < stripes_.size(); ++s) pixels[s % 2] += static_cast<double>(stripes_[s].size());
        double out = 0.0;
        for (const double p : pixels) out += 0.25 * 2.0 / std::max(p / cells_, 1.0);
        return out;
    }

    [[nodiscard]] bool two_halves() const { return stripes_.size() >= 2; }

private:
    [[nodiscard]] LineIntensity intensity_of_corrected() const {
        constexpr std::ptrdiff_t samples = 16384;  // of a piece: the same whatever the threads, and so is the sum
        std::vector<LineIntensity> pieces(static_cast<std::size_t>((corrected_.size() + samples - 1) / samples));
        parallel_for(execution_, "bandwidth ratio", static_cast<std::int64_t>(pieces.size()), [&](std::int64_t p) {
            const std::ptrdiff_t first = p * samples;
            pieces[static_cast<std::size_t>(p)] = line_intensity(corrected_.data() + first, std::min(samples, corrected_.size() - first));
        });
        LineIntensity out;
        for (const LineIntensity& piece : pieces) {
            out.sum += piece.sum;
            out.square += piece.square;
        }
        return out;
    }

    const std::vector<double>& phase_;
    MigrationModel model_;
    const Execution& execution_;
    std::vector<ImageView> stripes_;
    Array<cfloat, 2> corrected_;  // one stripe after the other
    double cells_ = 1.0;
};

std::size_t largest_of(const std::vector<std::array<double, 3>>& values, std::size_t which) {
    std::size_t best = 0;
    for (std::size_t k = 1; k < values.size(); ++k)
        if (values[k][which] > values[best][which]) best = k;
    return best;
}

}  // namespace

BandwidthRatio find_bandwidth_ratio(const ImageView& image, const std::vector<double>& phase, MigrationModel model, double largest,
                                    const Execution& execution) {
    constexpr double gates = 0.5;  // of migration from one ratio tried to the next: the sharpness's peak is a cell or two wide
    const double whole = range_migration(phase, largest, model);
    BandwidthRatio out;
    if (whole < gates) return out;
    Stripes stripes(image, phase, model, execution);
    if (!stripes.two_halves()) return out;
    const auto steps = static_cast<std::ptrdiff_t>(std::clamp(std::ceil(whole / gates), 4.0, 64.0));
    std::vector<double> ratios;
    std::vector<std::array<double, 3>> values;
    for (std::ptrdiff_t k = -steps; k <= steps; ++k) {
        ratios.push_back(largest * static_cast<double>(k) / static_cast<double>(steps));
        values.push_back(stripes.log_sharpness(ratios.back()));
    }
    const std::array<double, 3> none = values[static_cast<std::size_t>(steps)];
    out.gain = 0.5 * (values[largest_of(values, 1)][0] - none[0] + values[largest_of(values, 0)][1] - none[1]);
    out.noise = std::sqrt(stripes.variance());
    double best = ratios[largest_of(values, 2)];
    double value = values[largest_of(values, 2)][2];
    for (double step = 0.5 * largest / static_cast<double>(steps); range_migration(phase, step, model) > 0.01; step *= 0.5)
        for (const double tried : {best - step, best + step}) {
            const double there = stripes.log_sharpness(std::clamp(tried, -largest, largest))[2];
            if (there > value) {
                value = there;
                best = std::clamp(tried, -largest, largest);
            }
        }
    out.best = best;
    constexpr double sigmas = 3.0;
    out.ratio = out.gain > sigmas * out.noise ? best : 0.0;
    return out;
}

}  // namespace sarfocus::autofocus::detail
