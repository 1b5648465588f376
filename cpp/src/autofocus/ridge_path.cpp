#include <sarfocus/autofocus/ridge_path.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <optional>
#include <utility>

#include <sarfocus/core/checks.hpp>
#include <sarfocus/core/error.hpp>

#include "ridge_fit.hpp"

namespace sarfocus::autofocus {
namespace {

using detail::RidgeFit;
using detail::RidgeRanges;
using detail::StartLine;
using Start = ArrayView<const double, 2>;

constexpr double sigma_of_median = 1.4826;
constexpr double least_overlap = 0.25;  // of the pulses, with as many ridges as determine them
constexpr int trial_iterations = 20;    // of a fit that only tells which ridge to leave out

struct Frame {
    Vector3 origin{};
    Vector3 along{};
    Vector3 look{};
};

Vector3 pulse_position(const Start& start, std::ptrdiff_t pulse) {
    return {start(pulse, 0), start(pulse, 1), start(pulse, 2)};
}

Frame frame_of(const Start& start, const Vector3& look) {
    Frame out;
    out.origin = pulse_position(start, 0);
    const Vector3 way = pulse_position(start, start.extent(0) - 1) - out.origin;
    const double length = norm(way);
    if (!(length > 0.0)) throw ValueError("start", "a track that ends elsewhere than it begins", "a length of 0 m");
    out.along = (1.0 / length) * way;
    const Vector3 towards = norm(look) > 0.0 ? look : cross(out.along, {0.0, 0.0, 1.0});
    const Vector3 aside = towards - dot(towards, out.along) * out.along;
    constexpr double too_small = 1e-6;
    if (!(norm(aside) > too_small * norm(towards)) || !(norm(towards) > 0.0))
        throw ValueError("look", "a direction across the track", "one along it");
    out.look = (1.0 / norm(aside)) * aside;
    return out;
}

StartLine line_of(const Start& start, const Frame& frame) {
    StartLine out;
    const std::ptrdiff_t n = start.extent(0);
    for (std::ptrdiff_t p = 0; p < n; ++p) {
        const Vector3 from = pulse_position(start, p) - frame.origin;
        out.along.push_back(dot(from, frame.along));
        out.across.push_back(dot(from, frame.look));
        out.mean += out.along.back() / static_cast<double>(n);
    }
    for (const double s : out.along) out.square += (s - out.mean) * (s - out.mean);
    out.length = out.along.back() - out.along.front();
    return out;
}

void require_ranges(const RidgeRanges& range) {
    for (std::ptrdiff_t k = 0; k < range.extent(0); ++k)
        for (std::ptrdiff_t p = 0; p < range.extent(1); ++p)
            if (!std::isnan(range(k, p)) && !(range(k, p) > 0.0 && std::isfinite(range(k, p))))
                throw ValueError("range", "ranges above 0 m, or nan where a ridge isn't seen",
                                 number_text(range(k, p)) + " m at [" + std::to_string(k) + ", " + std::to_string(p) + "]");
}

std::ptrdiff_t pulses_seen(const RidgeRanges& range, std::ptrdiff_t ridge) {
    std::ptrdiff_t seen = 0;
    for (std::ptrdiff_t p = 0; p < range.extent(1); ++p) seen += std::isnan(range(ridge, p)) ? 0 : 1;
    return seen;
}

struct Misfit {
    double robust = 0.0;
    double rms = 0.0;
};

Misfit misfit(const RidgeFit& fit, std::size_t k, std::ptrdiff_t n_pulse) {
    std::vector<double> size;
    double squares = 0.0;
    for (std::ptrdiff_t p = 0; p < n_pulse; ++p) {
        const double e = fit.residual(k, p);
        if (std::isnan(e)) continue;
        size.push_back(std::abs(e));
        squares += e * e;
    }
    const auto middle = size.begin() + std::ssize(size) / 2;
    std::nth_element(size.begin(), middle, size.end());
    return {sigma_of_median * *middle, std::sqrt(squares / static_cast<double>(size.size()))};
}

class Estimate {
public:
    Estimate(const RidgeRanges& range, const Start& start, const RidgePathOptions& options)
        : range_(range), start_(start), options_(options), frame_(frame_of(start, options.look)), line_(line_of(start, frame_)) {}

    RidgePath run() {
        const std::ptrdiff_t n_pulse = start_.extent(0);
        RidgePath out;
        out.positions = Array<double, 2>({n_pulse, 3});
        out.motion = Array<double, 2>({n_pulse, 3});
        out.motion_std = Array<double, 2>({n_pulse, 3});
        std::fill(out.motion_std.begin(), out.motion_std.end(), std::numeric_limits<double>::quiet_NaN());
        out.points.resize(static_cast<std::size_t>(range_.extent(0)));
        std::vector<std::ptrdiff_t> used;
        for (std::ptrdiff_t k = 0; k < range_.extent(0); ++k) {
            const std::ptrdiff_t seen = pulses_seen(range_, k);
            out.points[static_cast<std::size_t>(k)].coverage = static_cast<double>(seen) / static_cast<double>(n_pulse);
            if (seen >= 2L * options_.knots) used.push_back(k);
        }
        bool settled = false;
        std::optional<RidgeFit> fit;
        while (determined(used, out)) {
            fit.emplace(range_, line_, used, options_);
            settled = fit->run();
            if (worst_residual(*fit, out) <= options_.largest_residual) break;
            used.erase(used.begin() + odd_one_out(used));
            ++out.rejected;
            fit.reset();
        }
        if (fit) hand_out(*fit, settled, out);
        for (std::ptrdiff_t p = 0; p < n_pulse; ++p)
            for (std::ptrdiff_t axis = 0; axis < 3; ++axis) out.positions(p, axis) = start_(p, axis) + out.motion(p, axis);
        return out;
    }

private:
    bool determined(const std::vector<std::ptrdiff_t>& used, RidgePath& out) const {
        const std::size_t needed = options_.across ? 3 : 2;
        std::ptrdiff_t covered = 0;
        for (std::ptrdiff_t p = 0; p < range_.extent(1); ++p) {
            std::size_t seen = 0;
            for (const std::ptrdiff_t k : used) seen += std::isnan(range_(k, p)) ? 0U : 1U;
            covered += seen >= needed ? 1 : 0;
        }
        out.coverage = static_cast<double>(covered) / static_cast<double>(range_.extent(1));
        if (used.size() >= needed && out.coverage >= least_overlap) return true;
        char text[200];
        std::snprintf(text, sizeof text,
                      "%zu of %td ridges can be used (%d do not fit the others), %.0f %% of the pulses see the %zu it takes", used.size(),
                      range_.extent(0), out.rejected, 100.0 * out.coverage, needed);
        out.reason = text;
        return false;
    }

    double worst_residual(const RidgeFit& fit, RidgePath& out) const {
        double worst = 0.0;
        for (std::size_t k = 0; k < fit.used().size(); ++k) {
            const Misfit now = misfit(fit, k, range_.extent(1));
            RidgePoint& point = out.points[static_cast<std::size_t>(fit.used()[k])];
            point.residual = now.robust;
            point.residual_rms = now.rms;
            const RidgeFit::Place place = fit.place(k);
            point.position = frame_.origin + place.along * frame_.along + place.across * frame_.look;
            point.offset = place.offset;
            worst = std::max(worst, now.robust);
        }
        return worst;
    }

    // Index of the ridge without which the others fit best: the one that disagrees often fits best itself and bends the path for the
    // others.
    [[nodiscard]] std::ptrdiff_t odd_one_out(const std::vector<std::ptrdiff_t>& used) const {
        RidgePathOptions trial = options_;
        trial.iterations = std::min(trial.iterations, trial_iterations);
        std::ptrdiff_t odd = 0;
        double least = std::numeric_limits<double>::infinity();
        for (std::ptrdiff_t k = 0; k < std::ssize(used); ++k) {
            std::vector<std::ptrdiff_t> others = used;
            others.erase(others.begin() + k);
            RidgeFit fit(range_, line_, std::move(others), trial);
            (void)fit.run();
            if (fit.objective() < least) {
                least = fit.objective();
                odd = k;
            }
        }
        return odd;
    }

    void hand_out(const RidgeFit& fit, bool settled, RidgePath& out) const {
        double squares = 0.0;
        for (const std::ptrdiff_t k : fit.used()) {
            RidgePoint& point = out.points[static_cast<std::size_t>(k)];
            point.used = true;
            squares += point.residual_rms * point.residual_rms;
        }
        out.residual_rms = std::sqrt(squares / static_cast<double>(fit.used().size()));
        const RidgeFit::Spread spread = fit.spread();
        double stretch = 0.0;
        for (std::ptrdiff_t p = 0; p < start_.extent(0); ++p) {
            const double s = fit.along(p);
            const double h = fit.across(p);
            const auto pulse = static_cast<std::size_t>(p);
            stretch += s * (line_.along[pulse] - line_.mean) / line_.square;
            for (std::size_t axis = 0; axis < 3; ++axis) {
                const auto column = static_cast<std::ptrdiff_t>(axis);
                out.motion(p, column) = s * frame_.along[axis] + h * frame_.look[axis];
                out.motion_std(p, column) = std::hypot(spread.along[pulse] * frame_.along[axis], spread.across[pulse] * frame_.look[axis]);
            }
        }
        out.length_ratio = 1.0 + stretch;
        out.length_std = spread.length;
        out.iterations = fit.iterations();
        out.status = settled ? RidgePathStatus::converged : RidgePathStatus::max_iterations;
        char text[200];
        std::snprintf(text, sizeof text, "%zu ridges fit within %.2g m RMS, %d do not; length %.3g +- %.2g of the start's",
                      fit.used().size(), out.residual_rms, out.rejected, out.length_ratio, out.length_std);
        out.reason = text;
    }

    RidgeRanges range_;
    Start start_;
    const RidgePathOptions& options_;
    Frame frame_;
    StartLine line_;
};

}  // namespace

const char* status_text(RidgePathStatus status) {
    switch (status) {
        case RidgePathStatus::converged:
            return "converged";
        case RidgePathStatus::max_iterations:
            return "max_iterations";
        case RidgePathStatus::not_determined:
            return "not_determined";
    }
    return "unknown";
}

void RidgePathOptions::validate() const {
    for (const double value : look) require_finite_value(value, "look");
    if (knots < 1) throw ValueError("knots", "at least 1 pulse", std::to_string(knots));
    if (correlation < 1) throw ValueError("correlation", "at least 1 pulse", std::to_string(correlation));
    if (iterations < 1) throw ValueError("iterations", "at least 1", std::to_string(iterations));
    const std::array<std::pair<double, const char*>, 6> positive{{{range_std, "range_std"},
                                                                  {offset_std, "offset_std"},
                                                                  {length_std, "length_std"},
                                                                  {across_std, "across_std"},
                                                                  {largest_residual, "largest_residual"},
                                                                  {tolerance, "tolerance"}}};
    for (const auto& [value, name] : positive) require_positive(value, name);
    if (!(step_change >= 0.0 && std::isfinite(step_change))) throw ValueError("step_change", "a length >= 0 m", number_text(step_change));
}

RidgePath trajectory_from_ridges(const RidgeRanges& range, const Start& start, const RidgePathOptions& options) {
    options.validate();
    constexpr std::ptrdiff_t fewest_pulses = 8;
    if (start.extent(0) < fewest_pulses || start.extent(1) != 3)
        throw ShapeError("start", "(n_pulse, 3) with at least 8 pulses", shape_text(start.extents()));
    if (range.extent(1) != start.extent(0))
        throw ShapeError("range", "(n_ridge, " + std::to_string(start.extent(0)) + "), a range for each position of start",
                         shape_text(range.extents()));
    require_finite(start, "start");
    require_ranges(range);
    return Estimate(range, start, options).run();
}

}  // namespace sarfocus::autofocus
