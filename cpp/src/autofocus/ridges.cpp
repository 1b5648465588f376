#include <sarfocus/autofocus/ridges.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include <sarfocus/core/checks.hpp>
#include <sarfocus/core/error.hpp>
#include <sarfocus/signal/interpolation.hpp>

#include "ridge_refine.hpp"
#include "ridge_search.hpp"

namespace sarfocus::autofocus {
namespace {

using detail::RidgeGrid;
using focus::RangeProfiles;

constexpr float score_cap = 4.0f;              // nat: what is very strong counts no more than what is strong throughout
constexpr double bins_per_wavelength = 7.9;    // half a bin at either end of the window's core turns the phase by less than a radian
constexpr double bins_per_resolution = 8.0;    // for linear interpolation between them
constexpr double cells_changed = 3.0;          // a path through clutter at rest wanders by one or two
constexpr std::ptrdiff_t looks_per_ridge = 4;  // ridges at rest between those wanted

Array<cfloat, 2> on_fine_bins(const ImageView& data, std::ptrdiff_t factor, const Execution& execution) {
    Array<cfloat, 2> out({data.extent(0), data.extent(1) * factor});
    const signal::LineUpsampler<float> upsampler(data.extent(1), factor);
    parallel_for(execution, "resample", data.extent(0), [&](std::int64_t pulse) {
        upsampler.apply({&data(pulse, 0), {data.extent(1)}, {data.strides()[1]}}, {&out(pulse, 0), {out.extent(1)}});
    });
    return out;
}

// log(power / median) - threshold, capped, in place. False where there is nothing.
bool to_score(const ArrayView<float, 3>& power, std::ptrdiff_t size, double threshold_db) {
    float* const all = &power(0, 0, 0);
    std::vector<float> sorted(all, all + size);
    const auto middle = sorted.begin() + size / 2;
    std::nth_element(sorted.begin(), middle, sorted.end());
    if (!(*std::max_element(middle, sorted.end()) > 0.0f)) return false;
    const float level = std::max(*middle, std::numeric_limits<float>::min());
    const auto threshold = static_cast<float>(threshold_db / 10.0 * std::log(10.0));
    for (std::ptrdiff_t i = 0; i < size; ++i)
        all[i] = std::min(std::log(std::max(all[i] / level, std::numeric_limits<float>::min())) - threshold, score_cap);
    return true;
}

RidgeGrid grid_of(const RangeProfiles& profiles, const RidgeOptions& options, std::ptrdiff_t factor) {
    RidgeGrid grid;
    grid.half_window = options.half_window;
    grid.hop = std::max(1, options.half_window / 2);
    grid.step = profiles.range_spacing / static_cast<double>(factor);
    grid.wavelength = profiles.wavelength;
    grid.n_node = (profiles.data.extent(0) - 1) / grid.hop + 1;
    grid.n_bin = profiles.data.extent(1) * factor;
    const double rate = options.largest_rate > 0.0 ? options.largest_rate : 0.25 * profiles.wavelength;
    grid.rates = static_cast<int>(std::ceil(rate * grid.hop / grid.step));
    return grid;
}

class Tracker {
public:
    Tracker(const RangeProfiles& profiles, const ImageView& samples, const RidgeGrid& grid, const RidgeOptions& options)
        : samples_(samples), grid_(grid), options_(options), start_(profiles.range_start(0)) {
        smallest_change_ = options.smallest_change > 0.0 ? options.smallest_change : cells_changed * options.resolution;
    }

    Ridges run() {
        Ridges out;
        Array<float, 3> score = detail::slope_power(samples_, grid_, options_.execution);
        if (!to_score(score.view(), score.size(), options_.threshold_db)) {
            hand_out(out);
            out.reason = "the echoes are zero";
            return out;
        }
        const auto bins = static_cast<std::ptrdiff_t>(std::ceil(options_.resolution / grid_.step));
        const int rates = 1 + static_cast<int>(std::ceil(0.5 * grid_.wavelength * grid_.hop / (options_.half_window * grid_.step)));
        for (std::ptrdiff_t look = 0; look < looks_per_ridge * (options_.most + 1) && followed_ < options_.most; ++look) {
            const detail::RidgeTrace trace = detail::best_trace(score.view());
            if (trace.nodes.empty()) break;
            if (!keep(trace, out)) ++out.dropped;
            detail::blank(trace, bins, rates, score.view());
        }
        hand_out(out);
        return out;
    }

private:
    // False where it is still or too short, as a whole or all its pieces.
    bool keep(const detail::RidgeTrace& trace, Ridges& out) {
        detail::RefinedRidge refined = detail::refine(samples_, grid_, trace, options_.resolution / grid_.step);
        for (double& value : refined.bin) value = start_ + value * grid_.step;
        Ridge ridge;
        ridge.score = trace.score;
        ridge.power = refined.power;
        ridge.coherence = refined.coherence;
        ridge.envelope_std = refined.envelope_std * grid_.step;
        if (!survey(refined.bin, ridge) || ridge.change < smallest_change_) return false;
        const std::size_t before = found_.size();
        if (options_.pieces) {
            for (std::vector<double>& piece : pieces_of(refined.bin))
                if (survey(piece, ridge)) add(std::move(piece), ridge, out);
        } else {
            add(std::move(refined.bin), ridge, out);
        }
        const bool any = found_.size() > before;
        followed_ += any ? 1 : 0;
        return any;
    }

    void add(std::vector<double> range, const Ridge& ridge, Ridges& out) {
        out.ridges.push_back(ridge);
        found_.push_back(std::move(range));
    }

    static std::vector<std::vector<double>> pieces_of(const std::vector<double>& range) {
        std::vector<std::vector<double>> out;
        bool inside = false;
        for (std::size_t pulse = 0; pulse < range.size(); ++pulse) {
            const bool seen = !std::isnan(range[pulse]);
            if (seen && !inside) out.emplace_back(range.size(), std::numeric_limits<double>::quiet_NaN());
            if (seen) out.back()[pulse] = range[pulse];
            inside = seen;
        }
        return out;
    }

    // Where the ridge is seen and how far its range goes; false where that is for too few pulses.
    bool survey(const std::vector<double>& range, Ridge& ridge) const {
        ridge.first = -1;
        double low = std::numeric_limits<double>::infinity();
        double high = -low;
        std::ptrdiff_t seen = 0;
        for (std::size_t pulse = 0; pulse < range.size(); ++pulse) {
            if (std::isnan(range[pulse])) continue;
            low = std::min(low, range[pulse]);
            high = std::max(high, range[pulse]);
            if (ridge.first < 0) ridge.first = static_cast<std::ptrdiff_t>(pulse);
            ridge.last = static_cast<std::ptrdiff_t>(pulse);
            ++seen;
        }
        ridge.change = seen > 0 ? high - low : 0.0;
        return seen > 0 && static_cast<double>(seen) >= options_.shortest * static_cast<double>(range.size());
    }

    void hand_out(Ridges& out) const {
        const std::ptrdiff_t n_pulse = samples_.extent(0);
        out.range = Array<double, 2>({std::ssize(found_), n_pulse});
        for (std::ptrdiff_t k = 0; k < std::ssize(found_); ++k)
            std::copy_n(found_[static_cast<std::size_t>(k)].begin(), n_pulse, &out.range(k, 0));
        out.reason = std::to_string(found_.size()) + " ridges found, " + std::to_string(out.dropped) +
                     " others dropped: too short, or their range doesn't change";
    }

    const ImageView& samples_;
    const RidgeGrid& grid_;
    const RidgeOptions& options_;
    double start_;
    double smallest_change_ = 0.0;
    int followed_ = 0;
    std::vector<std::vector<double>> found_;
};

}  // namespace

void RidgeOptions::validate() const {
    require_positive(resolution, "resolution");
    if (most < 1) throw ValueError("most", "at least 1 ridge", std::to_string(most));
    if (half_window < 2) throw ValueError("half_window", "at least 2 pulses", std::to_string(half_window));
    if (!(largest_rate >= 0.0 && std::isfinite(largest_rate))) throw ValueError("largest_rate", "a rate >= 0 m", number_text(largest_rate));
    require_finite_value(threshold_db, "threshold_db");
    if (!(smallest_change >= 0.0 && std::isfinite(smallest_change)))
        throw ValueError("smallest_change", "a length >= 0 m", number_text(smallest_change));
    if (!(shortest > 0.0 && shortest <= 1.0)) throw ValueError("shortest", "a share above 0, at most 1", number_text(shortest));
    (void)resolve_threads(execution.threads);
}

Ridges track_ridges(const RangeProfiles& profiles, const RidgeOptions& options) {
    options.validate();
    profiles.validate(options.execution.threads);
    const std::ptrdiff_t n_pulse = profiles.data.extent(0);
    if (profiles.range_start.extent(0) != 1)
        throw ShapeError("range_start", "one value for all pulses", shape_text(profiles.range_start.extents()));
    if (n_pulse <= 2 * options.half_window)
        throw ShapeError("data", "more pulses than the window's " + std::to_string(2 * options.half_window),
                         shape_text(profiles.data.extents()));
    const double coarsest = std::min(profiles.wavelength / bins_per_wavelength, options.resolution / bins_per_resolution);
    const double bins_per_sample = std::ceil(profiles.range_spacing / coarsest);
    constexpr double most_bins_per_sample = 64.0;
    if (!(bins_per_sample <= most_bins_per_sample))
        throw ValueError("range_spacing", "at most 64 times an eighth of the wavelength and of the resolution",
                         number_text(profiles.range_spacing) + " m");
    const auto factor = static_cast<std::ptrdiff_t>(bins_per_sample);
    const RidgeGrid grid = grid_of(profiles, options, factor);
    if (2.0 * grid.rates + 1.0 > static_cast<double>(grid.n_bin))
        throw ValueError("largest_rate", "one that crosses less than half the record in half a window",
                         number_text(options.largest_rate) + " m per pulse");
    const auto states =
        static_cast<std::uint64_t>(grid.n_node) * static_cast<std::uint64_t>(grid.n_bin) * static_cast<std::uint64_t>(2 * grid.rates + 1);
    require_memory(states * (2 * sizeof(float) + 1) + static_cast<std::uint64_t>(n_pulse * grid.n_bin) * sizeof(cfloat), "track_ridges");
    const Array<cfloat, 2> fine = on_fine_bins(profiles.data, factor, options.execution);
    const ImageView samples = fine.view();
    return Tracker(profiles, samples, grid, options).run();
}

}  // namespace sarfocus::autofocus
