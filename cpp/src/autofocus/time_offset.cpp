#include <sarfocus/autofocus/time_offset.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <limits>
#include <map>
#include <utility>

#include <sarfocus/core/array.hpp>
#include <sarfocus/core/checks.hpp>
#include <sarfocus/core/error.hpp>
#include <sarfocus/detect/local_maxima.hpp>
#include <sarfocus/geometry/phase_centres.hpp>

#include "score.hpp"
#include "strong_points.hpp"

namespace sarfocus::autofocus {
namespace {

using detail::HalfSums;
using focus::RangeProfiles;
using geometry::ImageGrid;
using geometry::Track;
using Times = ArrayView<const double, 1>;

constexpr int refinements = 3;
constexpr int images_per_refinement = 4;
constexpr int images_to_judge = 3;
constexpr double rounding = 1e-9;  // share of a step

class GridLayout : public detail::PixelLayout {
public:
    explicit GridLayout(const ImageGrid& grid) : grid_(grid) {}
    [[nodiscard]] std::array<std::ptrdiff_t, 2> shape() const override { return grid_.shape(); }
    [[nodiscard]] std::ptrdiff_t range_gate(std::ptrdiff_t column) const override { return column; }
    [[nodiscard]] bool fractional_columns() const override { return true; }
    [[nodiscard]] bool is_list() const override { return grid_.kind() == ImageGrid::Kind::points && grid_.shape()[1] == 1; }

private:
    const ImageGrid& grid_;
};

// Of the image at one offset.
struct Halved {
    std::array<HalfSums, 2> half;

    [[nodiscard]] double log_sharpness() const {
        HalfSums whole;
        for (const HalfSums& h : half) {
            whole.power += h.power;
            whole.square += h.square;
        }
        return whole.log_sharpness();
    }
};

Halved halved(const ImageView& image, const Array<std::uint8_t, 2>& half) {
    Halved out;
    for (std::ptrdiff_t i = 0; i < image.extent(0); ++i)
        for (std::ptrdiff_t j = 0; j < image.extent(1); ++j) {
            const double intensity = std::norm(cdouble(image(i, j)));
            HalfSums& sums = out.half[half(i, j)];
            sums.pixels += 1.0;
            sums.power += intensity;
            sums.square += intensity * intensity;
        }
    return out;
}

// Two halves of the scene with an equal share of what is bright: every pixel goes with the strong point next to it, so that no response is
// cut in two, and the points, the strongest first, with the half that has less so far.
Array<std::uint8_t, 2> halves_of(const ImageView& image, const detail::CellSize& cell, int threads) {
    constexpr double cells_apart = 24.0;  // wider than a point's response with its sidelobes
    constexpr std::size_t most_points = 64;
    detect::LocalMaximaOptions options;
    options.execution.threads = threads;
    options.count = 4096;
    std::vector<detect::Point> points = detect::coalesce(detect::local_maxima(image, options),
                                                         {std::lround(cells_apart * cell.azimuth), std::lround(cells_apart * cell.range)});
    points.resize(std::min(points.size(), most_points));
    std::vector<std::uint8_t> side;
    std::array<double, 2> square{};
    for (const detect::Point& p : points) {
        side.push_back(square[1] < square[0] ? 1 : 0);
        square[side.back()] += p.intensity * p.intensity;
    }
    Array<std::uint8_t, 2> out(image.extents());
    for (std::ptrdiff_t i = 0; i < image.extent(0); ++i)
        for (std::ptrdiff_t j = 0; j < image.extent(1); ++j) {
            double nearest = std::numeric_limits<double>::infinity();
            for (std::size_t n = 0; n < points.size(); ++n) {
                const double away = std::hypot(static_cast<double>(i - points[n].azimuth) / cell.azimuth,
                                               static_cast<double>(j - points[n].range) / cell.range);
                if (away < nearest) {
                    nearest = away;
                    out(i, j) = side[n];
                }
            }
        }
    return out;
}

// The pulses that move, placed and weighted for one offset.
struct Placed {
    Array<cfloat, 2> data;
    Array<double, 2> positions;
    Array<double, 1> range_start;
};

Placed place(const RangeProfiles& profiles, const Times& pulse_time, const Track& track, double offset, double minimum_step) {
    const std::ptrdiff_t n = pulse_time.extent(0);
    Array<double, 1> at({n});
    for (std::ptrdiff_t p = 0; p < n; ++p) at(p) = pulse_time(p) + offset;
    Array<double, 2> positions({n, 3});
    Array<double, 1> weights({n});
    geometry::interpolate_track(track, ArrayView<const double, 1>(at.view()), positions.view());
    geometry::path_weights(ArrayView<const double, 2>(positions.view()), minimum_step, weights.view());
    const std::ptrdiff_t moving = n - std::count(weights.begin(), weights.end(), 0.0);
    const std::ptrdiff_t n_range = profiles.data.extent(1);
    Placed out{Array<cfloat, 2>({moving, n_range}), Array<double, 2>({moving, 3}), Array<double, 1>({moving})};
    std::ptrdiff_t row = 0;
    for (std::ptrdiff_t p = 0; p < n; ++p) {
        if (weights(p) == 0.0) continue;
        const auto weight = static_cast<float>(weights(p));
        for (std::ptrdiff_t i = 0; i < n_range; ++i) out.data(row, i) = weight * profiles.data(p, i);
        for (std::ptrdiff_t axis = 0; axis < 3; ++axis) out.positions(row, axis) = positions(p, axis);
        out.range_start(row) = profiles.first_range(p);
        ++row;
    }
    return out;
}

// Offset of the peak of a parabola through three points.
double vertex(const std::array<double, 3>& x, const std::array<double, 3>& y) {
    const double left = (y[1] - y[0]) / (x[1] - x[0]);
    const double right = (y[2] - y[1]) / (x[2] - x[1]);
    const double curvature = (right - left) / (x[2] - x[0]);
    if (!(curvature < 0.0)) return x[1];
    return std::clamp(0.5 * (x[0] + x[1]) - 0.5 * left / curvature, x[0], x[2]);
}

std::string sentence(const char* format, double a, double b) {
    char text[200];
    std::snprintf(text, sizeof text, format, a, b);
    return text;
}

class Search {
public:
    Search(const RangeProfiles& profiles, const Times& pulse_time, const Track& track, const ImageGrid& grid,
           const TimeOffsetOptions& options)
        : profiles_(profiles), pulse_time_(pulse_time), track_(track), grid_(grid), options_(options), image_(grid.shape()) {
        double first = pulse_time(0);
        double last = first;
        for (std::ptrdiff_t p = 0; p < pulse_time.extent(0); ++p) {
            first = std::min(first, pulse_time(p));
            last = std::max(last, pulse_time(p));
        }
        least_ = track.time(0) - first;
        most_ = track.time(track.time.extent(0) - 1) - last;
        if (!(options.start >= least_ && options.start <= most_))
            throw ValueError(
                "start", "an offset with which the track covers all pulses, " + number_text(least_) + " to " + number_text(most_) + " s",
                number_text(options.start) + " s");
    }

    TimeOffset run() {
        look();
        TimeOffset result;
        const double start = options_.start;
        result.log_sharpness_before = curve_.at(start).log_sharpness();
        result.offset = start;
        result.estimate = sharpest(everywhere);
        result.offset_std = std::numeric_limits<double>::quiet_NaN();
        if (result.estimate == curve_.begin()->first || result.estimate == curve_.rbegin()->first) {
            result.status = TimeOffsetStatus::at_the_edge;
            result.log_sharpness_after = curve_.at(result.estimate).log_sharpness();
            result.reason = sentence("the scene is sharpest at the end of what was searched, %.6g to %.6g s", curve_.begin()->first,
                                     curve_.rbegin()->first);
        } else {
            refine();
            result.estimate = sharpest(everywhere);
            judge(result);
        }
        for (const auto& [offset, halved] : curve_) {
            result.offsets.push_back(offset);
            result.log_sharpness.push_back(halved.log_sharpness());
        }
        return result;
    }

private:
    static constexpr int everywhere = -1;

    void look() {
        const auto reach = static_cast<std::ptrdiff_t>(std::floor(options_.search / options_.step + rounding));
        std::vector<double> offsets{options_.start};  // first, because the halves are laid out by its resolution
        for (std::ptrdiff_t k = -reach; k <= reach; ++k) {
            const double offset = options_.start + static_cast<double>(k) * options_.step;
            if (k != 0 && offset >= least_ && offset <= most_) offsets.push_back(offset);
        }
        if (offsets.size() < 3)
            throw ValueError("search",
                             "at least 3 offsets that the track covers (" + number_text(least_) + " to " + number_text(most_) + " s)",
                             std::to_string(offsets.size()));
        images_ = static_cast<std::int64_t>(offsets.size()) + refinements * images_per_refinement + images_to_judge;
        for (const double offset : offsets) curve_.emplace(offset, sharpness_at(offset));
    }

    void refine() {
        double step = options_.step;
        for (int level = 0; level < refinements; ++level) {
            const double centre = top(everywhere)->first;
            step /= 3.0;
            for (const int k : {-2, -1, 1, 2}) {
                const double offset = centre + k * step;
                curve_.emplace(offset, sharpness_at(offset));
            }
        }
    }

    [[nodiscard]] Halved sharpness_at(double offset) {
        const Placed placed = place(profiles_, pulse_time_, track_, offset, options_.minimum_step);
        focus::BackprojectOptions how;
        how.execution.threads = options_.execution.threads;
        if (options_.execution.progress)
            how.execution.progress = [this](const ProgressUpdate&) { return options_.execution.progress({"time offset", done_, images_}); };
        focus::backproject({placed.data.view(), placed.range_start.view(), profiles_.range_spacing, profiles_.wavelength},
                           geometry::PhaseCentres(placed.positions.view()), grid_, image_.view(), how);
        ++done_;
        if (half_.empty()) {
            cell_ = detail::cell_size(image_.view(), GridLayout(grid_));
            half_ = halves_of(image_.view(), cell_, options_.execution.threads);
        }
        const Halved out = halved(image_.view(), half_);
        if (!(out.half[0].square + out.half[1].square > 0.0))
            throw NumericalError("data: expected an image that is not zero, got zeros at offset " + number_text(offset) + " s");
        return out;
    }

    [[nodiscard]] static double value(const Halved& halved, int half) {
        return half == everywhere ? halved.log_sharpness() : halved.half[static_cast<std::size_t>(half)].log_sharpness();
    }

    [[nodiscard]] std::map<double, Halved>::const_iterator top(int half) const {
        return std::max_element(curve_.begin(), curve_.end(),
                                [&](const auto& a, const auto& b) { return value(a.second, half) < value(b.second, half); });
    }

    // Of a half or of the whole scene, between the offsets tried.
    [[nodiscard]] double sharpest(int half) const {
        const auto best = top(half);
        if (best == curve_.begin() || std::next(best) == curve_.end()) return best->first;
        const auto before = std::prev(best);
        const auto behind = std::next(best);
        return vertex({before->first, best->first, behind->first},
                      {value(before->second, half), value(best->second, half), value(behind->second, half)});
    }

    // The smaller share of a half in the sum that is maximised.
    [[nodiscard]] static double smaller_share(const Halved& halved) {
        const double first = halved.half[0].square;
        const double second = halved.half[1].square;
        return std::min(first, second) / (first + second);
    }

    void judge(TimeOffset& result) {
        constexpr double sigmas = 3.0;
        constexpr double too_little = 0.1;
        const Halved before = curve_.at(options_.start);
        const Halved after = sharpness_at(result.estimate);
        const std::array<double, 2> own{sharpest(0), sharpest(1)};
        double worst = std::numeric_limits<double>::infinity();
        double variance = 0.0;
        for (const int half : {0, 1}) {
            const double gain = value(sharpness_at(own[static_cast<std::size_t>(1 - half)]), half) - value(before, half);
            result.held_out_gain += 0.5 * gain;
            worst = std::min(worst, gain);
            // The log sharpness of n cells of speckle scatters by 1 / sqrt(n); a difference of two by sqrt(2) of that.
            const double cells = std::max(before.half[static_cast<std::size_t>(half)].pixels / (cell_.azimuth * cell_.range), 1.0);
            variance += 0.25 * 2.0 / cells;
        }
        result.held_out_noise = std::sqrt(variance);
        result.log_sharpness_after = after.log_sharpness();
        const double noise = sigmas * result.held_out_noise;
        const double whole = result.log_sharpness_after - result.log_sharpness_before;
        const bool alone = smaller_share(after) < too_little;
        if (!alone) result.offset_std = 0.5 * std::abs(own[1] - own[0]);

        bool improved = false;
        if (alone) {
            improved = whole > noise;
            result.reason = sentence("all that is bright lies in one half of the scene; sharpness rose by %.4f nat, by chance up to %.4f",
                                     whole, noise);
        } else if (!(result.held_out_gain > noise)) {
            result.reason = sentence("held-out sharpness changed by %+.4f nat, by chance up to %.4f", result.held_out_gain, noise);
        } else if (!(worst > 0.0)) {
            result.reason = sentence("one half of the scene lost %.4f nat with the offset of the other, %.4f gained on average", -worst,
                                     result.held_out_gain);
        } else {
            improved = true;
            result.reason = sentence("held-out sharpness rose by %.4f nat, by chance up to %.4f", result.held_out_gain, noise);
        }
        if (!options_.do_no_harm) result.reason += "; applied without judging, as asked";
        if (!improved && options_.do_no_harm) return;
        result.status = TimeOffsetStatus::converged;
        result.offset = result.estimate;
    }

    const RangeProfiles& profiles_;
    Times pulse_time_;
    const Track& track_;
    const ImageGrid& grid_;
    const TimeOffsetOptions& options_;
    Array<cfloat, 2> image_;
    double least_ = 0.0;
    double most_ = 0.0;
    detail::CellSize cell_;
    Array<std::uint8_t, 2> half_;
    std::map<double, Halved> curve_;
    std::int64_t done_ = 0;
    std::int64_t images_ = 0;
};

}  // namespace

const char* status_text(TimeOffsetStatus status) {
    switch (status) {
        case TimeOffsetStatus::converged:
            return "converged";
        case TimeOffsetStatus::not_improved:
            return "not_improved";
        case TimeOffsetStatus::at_the_edge:
            return "at_the_edge";
    }
    return "unknown";
}

void TimeOffsetOptions::validate() const {
    require_finite_value(start, "start");
    require_positive(search, "search");
    require_positive(step, "step");
    constexpr double most_steps = 1e4;
    if (step > search * (1.0 + rounding) || search > most_steps * step)
        throw ValueError("step", "between search / " + number_text(most_steps) + " and search (" + number_text(search) + " s)",
                         number_text(step) + " s");
    if (!(minimum_step >= 0.0)) throw ValueError("minimum_step", "a length >= 0 m", number_text(minimum_step));
    (void)resolve_threads(execution.threads);
}

TimeOffset estimate_time_offset(const RangeProfiles& profiles, const Times& pulse_time, const Track& track, const ImageGrid& grid,
                                const TimeOffsetOptions& options) {
    options.validate();
    profiles.validate(options.execution.threads);
    track.validate();
    if (pulse_time.extent(0) != profiles.data.extent(0))
        throw ShapeError("pulse_time", "one value for each of " + std::to_string(profiles.data.extent(0)) + " pulses",
                         shape_text(pulse_time.extents()));
    require_finite(pulse_time, "pulse_time");
    require_memory(static_cast<std::uint64_t>(2 * grid.size() + 2 * profiles.data.size()) * sizeof(cfloat), "estimate_time_offset");
    return Search(profiles, pulse_time, track, grid, options).run();
}

}  // namespace sarfocus::autofocus
