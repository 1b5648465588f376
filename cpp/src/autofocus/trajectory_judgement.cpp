#include "trajectory_estimator.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstdint>
#include <cstdio>
#include <limits>
#include <numbers>
#include <random>
#include <utility>

#include <Eigen/Core>
#include <Eigen/QR>

namespace sarfocus::autofocus::detail {
namespace {

constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();

}  // namespace

// The greatest coherence of a region near its place for a given motion, and that place.
double TrajectoryEstimator::brightest(const MotionModel& model, const Coefficients& motion, std::size_t m, Vector3* where) const {
    MotionPoint point = points_[m];
    Place place = places_[m];
    double best = std::norm(model.sum(point, motion));
    Vector3 at = point.position;
    if (regions_[m].kind() != ImageGrid::Kind::points) {
        const auto last = static_cast<double>(regions_[m].shape()[0] - 1);
        const Place centre = place;
        const double reach = std::max({last - centre.i, centre.i, 2.0 * cell_[m]});
        const double coarse = std::max(0.25 * cell_[m], reach / 128.0);
        const auto consider = [&](double i, double j) {
            point.position = regions_[m].position(i, j);
            const double now = std::norm(model.sum(point, motion));
            if (now <= best) return false;
            best = now;
            place = {i, j};
            at = point.position;
            return true;
        };
        for (double i = centre.i - reach; i <= centre.i + reach; i += coarse) consider(i, centre.j);
        double share = 0.5;
        for (int level = 0; level < 7; ++level, share *= 0.5)
            for (int pass = 0; pass < 4; ++pass) {
                bool better = false;
                for (const double s : {-1.0, 1.0}) {
                    better = consider(place.i + s * share * coarse, place.j) || better;
                    better = consider(place.i, place.j + s * share) || better;
                }
                if (!better) break;
            }
    }
    if (where != nullptr) *where = at;
    return best;
}

// What random phases hardly reach.
double TrajectoryEstimator::by_chance(const MotionModel& model) {
    constexpr int draws = 8;
    constexpr double sigmas = 5.0;
    const auto regions = static_cast<double>(regions_.size());
    const Coefficients none = model.zero();
    std::array<double, draws> chance{};
    parallel_for(options_.execution, "chance", draws, [&](std::int64_t draw) {
        std::mt19937_64 random(static_cast<std::uint64_t>(draw) + 1);
        std::vector<MotionPoint> mixed = points_;
        MotionPoints points;
        for (MotionPoint& p : mixed) {
            for (std::size_t k = 0; k < n_pulse_; ++k) {
                const cdouble turn = std::polar(1.0, 2.0 * std::numbers::pi * static_cast<double>(random() >> 11U) * 0x1p-53);
                for (std::size_t n = 0; n < n_channel_; ++n) p.terms[k * n_channel_ + n] *= turn;
            }
            points.push_back(&p);
        }
        Coefficients own = none;
        chance[static_cast<std::size_t>(draw)] = model.alternate(points, own, 30, 1e-5, true).objective / regions;
    });
    for (const double c : chance) result_.coherence_by_chance += c / draws;
    double spread = 0.0;
    for (const double c : chance) spread += (c - result_.coherence_by_chance) * (c - result_.coherence_by_chance) / (draws - 1);
    result_.chance_std = std::sqrt(spread);
    return result_.coherence_by_chance + sigmas * result_.chance_std + 0.04 * (1.0 - result_.coherence_by_chance);
}

// Of two regions that one motion explains in any case: their phase differences, the best of so many pixels, were they random.
double TrajectoryEstimator::between_by_chance() {
    constexpr double sigmas = 5.0;
    const auto n = static_cast<double>(n_pulse_);
    result_.coherence_by_chance = std::sqrt(std::log(std::max(static_cast<double>(trials_), 2.0)) / n);
    result_.chance_std = 0.5 / std::sqrt(n);
    return result_.coherence_by_chance + sigmas * result_.chance_std;
}

// Weighted RMS over the terms of a region of its range less that of a motion, m.
double TrajectoryEstimator::spread(const MotionModel& model, const Coefficients& motion, std::size_t m, const Vector3& position) const {
    MotionPoint point = points_[m];
    point.position = position;
    const cdouble sum = model.sum(point, motion);
    double weight = 0.0;
    double square = 0.0;
    for (std::size_t k = 0; k < n_pulse_; ++k) {
        const Vector3 towards = model.displacement(motion, k) - position;
        for (std::size_t i = k * n_channel_; i < (k + 1) * n_channel_; ++i) {
            const double phase = model.radians_per_metre() * (norm(centres_[i] + towards) - point.range[i]);
            const double angle = std::arg(std::conj(sum) * point.terms[i] * std::polar(1.0, phase));
            weight += std::abs(point.terms[i]);
            square += std::abs(point.terms[i]) * angle * angle;
        }
    }
    return weight > 0.0 ? std::sqrt(square / weight) / model.radians_per_metre() : not_a_number;
}

// The motion that some of the regions give. Over a search of several turns of the phase they leave it open which: those of the motion of
// all are kept.
Coefficients TrajectoryEstimator::from_others(const MotionModel& model, const MotionPoints& others, const Coefficients& motion) const {
    constexpr int iterations = 60;
    constexpr double tolerance = 1e-8;
    Coefficients own = widened_ ? motion : model.zero();
    const double reached = model.alternate(others, own, iterations, tolerance, !widened_).objective;
    if (model.free()) return own;
    Coefficients smooth = model.unwrapped(others);
    return model.alternate(others, smooth, iterations, tolerance, false).objective > reached ? smooth : own;
}

void TrajectoryEstimator::judge(const MotionModel& model, Coefficients& motion, bool converged) {
    const auto regions = static_cast<double>(regions_.size());
    const Coefficients none = model.zero();
    result_.points.resize(regions_.size());
    double held_gain = 0.0;
    bool held = true;
    for (std::size_t m = 0; m < regions_.size(); ++m) {
        TrajectoryPoint& p = result_.points[m];
        p.position = points_[m].position;
        p.power = power_[m];
        p.coherence_before = brightest(model, none, m);
        p.coherence = std::norm(model.sum(points_[m], motion));
        result_.coherence_before += p.coherence_before / regions;
        result_.coherence += p.coherence / regions;
        p.held_out_before = p.held_out = p.spread = not_a_number;
        if (model.free() && regions_.size() - 1 < axes_.size()) {
            held = false;
            continue;
        }
        MotionPoints others;
        for (std::size_t o = 0; o < regions_.size(); ++o)
            if (o != m) others.push_back(&points_[o]);
        const Coefficients own = from_others(model, others, motion);
        p.held_out_before = p.coherence_before;
        p.held_out = brightest(model, own, m, &p.position);
        p.spread = spread(model, own, m, p.position);
        p.position = points_[m].position;
        held_gain += (p.held_out - p.held_out_before) / regions;
    }
    const double bar = result_.by_construction ? between_by_chance() : by_chance(model);
    const double reached = result_.by_construction ? result_.coherence_between : result_.coherence;
    std_ = model.deviation(all(), motion);
    char text[240];
    bool improved = false;
    if (!(reached > bar)) {
        std::snprintf(text, sizeof text, "coherence %.4f %s the regions is no more than random phases reach (%.4f)", reached,
                      result_.by_construction ? "between" : "of", bar);
    } else if (!(result_.coherence > result_.coherence_before)) {
        std::snprintf(text, sizeof text, "the regions were as coherent before (%.4f)", result_.coherence_before);
    } else if (held && result_.coherence_before > 0.5 && !(held_gain > 0.0)) {
        std::snprintf(text, sizeof text, "held-out coherence changed by %+.4f", held_gain);
    } else {
        improved = true;
        std::snprintf(text, sizeof text, "coherence rose from %.4f to %.4f; %s%.4f, random phases reach %.4f", result_.coherence_before,
                      result_.coherence, result_.by_construction ? "by construction: that between the regions is " : "of its points ",
                      reached, bar);
    }
    result_.reason = text;
    if (dropped_) result_.reason += "; the direction that all regions see at a right angle can't be told and was left alone";
    if (improved || !options_.do_no_harm) result_.status = converged ? TrajectoryStatus::converged : TrajectoryStatus::max_iterations;
    remove_line(model, motion);
    shift_by_channels(model, motion);
}

Coefficients TrajectoryEstimator::without_line(const Coefficients& motion) const {
    const std::size_t n = axes_.size();
    Coefficients flat = motion;
    const double middle = 0.5 * static_cast<double>(n_pulse_ - 1);
    for (std::size_t a = 0; a < n; ++a) {
        double mean = 0.0;
        double slope = 0.0;
        double square = 0.0;
        for (std::size_t k = 0; k < n_pulse_; ++k) {
            const double x = static_cast<double>(k) - middle;
            mean += motion[k * n + a] / static_cast<double>(n_pulse_);
            slope += motion[k * n + a] * x;
            square += x * x;
        }
        for (std::size_t k = 0; k < n_pulse_; ++k)
            flat[k * n + a] -= mean + (square > 0.0 ? slope / square : 0.0) * (static_cast<double>(k) - middle);
    }
    return flat;
}

void TrajectoryEstimator::remove_line(const MotionModel& model, Coefficients& motion) {
    constexpr double loss = 1e-4;
    Coefficients flat = without_line(motion);
    std::vector<Vector3> at(regions_.size());
    double coherence = 0.0;
    for (std::size_t m = 0; m < regions_.size(); ++m) coherence += brightest(model, flat, m, &at[m]) / static_cast<double>(regions_.size());
    if (!(coherence > (1.0 - loss) * result_.coherence)) return;
    motion = std::move(flat);
    result_.line_removed = true;
    for (std::size_t m = 0; m < regions_.size(); ++m) result_.points[m].position = at[m];
}

// How far along the track a region's point lies from where it is assumed, by the phases of a pulse's channels to one another: a common
// phase of the pulse, and so any motion, does not touch them.
TrajectoryEstimator::ChannelShift TrajectoryEstimator::channel_shift(const MotionModel& model, const Coefficients& motion, std::size_t m,
                                                                     const Vector3& position) const {
    const MotionPoint& p = points_[m];
    const Vector3 track = track_direction();
    cdouble moment{};
    double scatter = 0.0;
    double square = 0.0;
    double distance = 0.0;
    double weight = 0.0;
    for (std::size_t k = 0; k < n_pulse_; ++k) {
        const Vector3 towards = model.displacement(motion, k) - position;
        std::vector<cdouble> terms(n_channel_);
        cdouble together{};
        double middle = 0.0;
        for (std::size_t n = 0; n < n_channel_; ++n) {
            const std::size_t i = k * n_channel_ + n;
            terms[n] = p.terms[i] * std::polar(1.0, model.radians_per_metre() * (norm(centres_[i] + towards) - p.range[i]));
            together += terms[n];
            middle += dot(centres_[i], track) / static_cast<double>(n_channel_);
        }
        if (!(std::abs(together) > 0.0)) continue;
        for (std::size_t n = 0; n < n_channel_; ++n) {
            const std::size_t i = k * n_channel_ + n;
            const double offset = dot(centres_[i], track) - middle;
            const cdouble turned = terms[n] * std::conj(together) / std::abs(together);
            moment += turned * offset;
            scatter += turned.imag() * turned.imag() * offset * offset;
            square += turned.real() * offset * offset;
            distance += std::abs(terms[n]) * p.range[i];
            weight += std::abs(terms[n]);
        }
    }
    if (!(square > 0.0)) return {};
    const double scale = distance / weight / model.radians_per_metre() / square;
    return {moment.imag() * scale, std::sqrt(scatter) * scale};
}

Vector3 TrajectoryEstimator::track_direction() const {
    const Vector3 along = centres_.back() - centres_.front();
    return (1.0 / norm(along)) * along;
}

// Moves all points along the track, by a line over the pulses for every unknown, to where the channels see them, if they do: a shift of the
// scene leaves the regions coherent, but the channels out of phase, and that brings back ambiguities.
void TrajectoryEstimator::shift_by_channels(const MotionModel& model, Coefficients& motion) {
    constexpr double significant = 9.0;
    const std::size_t n = axes_.size();
    if (n_channel_ < 2 || n > regions_.size() || !(norm(centres_.back() - centres_.front()) > 0.0)) return;
    const Vector3 track = track_direction();
    const Vector3& middle = centres_[centres_.size() / 2];
    const auto rows = static_cast<Eigen::Index>(regions_.size());
    Eigen::MatrixXd matrix(rows, static_cast<Eigen::Index>(n));
    Eigen::VectorXd right(rows);
    double surprise = 0.0;
    for (std::size_t m = 0; m < regions_.size(); ++m) {
        const Vector3 sight = middle - result_.points[m].position;
        const ChannelShift found = channel_shift(model, motion, m, result_.points[m].position);
        const double reach =
            norm(regions_[m].position(static_cast<double>(regions_[m].shape()[0]) + cell_[m], 0.0) - regions_[m].position(0.0, 0.0));
        if (!(found.deviation > 0.0) || std::abs(found.shift) > reach) return;
        surprise += found.shift * found.shift / (found.deviation * found.deviation);
        const auto row = static_cast<Eigen::Index>(m);
        const double weight = norm(sight) / found.deviation;
        for (std::size_t a = 0; a < n; ++a) matrix(row, static_cast<Eigen::Index>(a)) = weight * dot(sight, axes_[a]) / norm(sight);
        right(row) = weight * found.shift / norm(sight);
    }
    if (!(surprise > significant * static_cast<double>(regions_.size()))) return;
    const Eigen::VectorXd slope = matrix.colPivHouseholderQr().solve(right);
    for (std::size_t k = 0; k < n_pulse_; ++k)
        for (std::size_t a = 0; a < n; ++a)
            motion[k * n + a] += slope(static_cast<Eigen::Index>(a)) * dot(centres_[k * n_channel_] - middle, track);
    for (std::size_t m = 0; m < regions_.size(); ++m) {
        const Vector3 sight = middle - result_.points[m].position;
        double shift = 0.0;
        for (std::size_t a = 0; a < n; ++a) shift += slope(static_cast<Eigen::Index>(a)) * dot(sight, axes_[a]);
        result_.points[m].position = result_.points[m].position + shift * track;
    }
}

}  // namespace sarfocus::autofocus::detail
