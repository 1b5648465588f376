#include "trajectory_estimator.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <numeric>
#include <utility>

#include <Eigen/Core>
#include <Eigen/QR>

namespace sarfocus::autofocus::detail {

// Pixels and motion. Where the regions do not quite agree the search is widened: displacements are beyond it, or their common line is. A
// wider one finds turns of the phase in noise, too, so it has to make more of a difference.
MotionModel TrajectoryEstimator::solve(Coefficients& motion) {
    constexpr double agreed = 0.999;
    constexpr double gain = 1e-3;
    MotionModel model = model_of(search_);
    motion = result_.by_construction ? match(model) : choose(model);
    refine(model, motion);
    if (result_.by_construction || !model.free() || options_.search > 0.0) return model;
    for (const double factor : {2.0, 4.0}) {
        if (model.objective(all(), motion) / static_cast<double>(regions_.size()) > agreed) break;
        const double reached = preference(model, motion);
        const std::vector<MotionPoint> points = points_;
        const std::vector<Place> places = places_;
        MotionModel wide = model_of(factor * search_);
        Coefficients other = turned(wide, motion);
        refine(wide, other);
        if (preference(wide, other) > reached + gain) {
            motion = std::move(other);
            model = std::move(wide);
            widened_ = true;
            continue;
        }
        points_ = points;
        places_ = places;
    }
    return model;
}

// The most coherent of alternations that start with the other regions' sums turned against the first's and their pixels shifted a little:
// wrong turns of the phase towards the ends of the aperture and a wrong pixel make up for one another.
Coefficients TrajectoryEstimator::turned(const MotionModel& model, const Coefficients& motion) {
    constexpr int turns = 8;
    constexpr int shifts = 4;
    constexpr double apart = 0.08;  // cells
    constexpr int iterations = 8;
    constexpr double tolerance = 1e-5;
    constexpr int n = turns * (2 * shifts + 1);
    std::vector<Coefficients> found(n, motion);
    std::vector<std::vector<MotionPoint>> moved(n, points_);
    std::vector<std::vector<Place>> places(n, places_);
    std::vector<double> value(n);
    parallel_for(options_.execution, "pixels", n, [&](std::int64_t job) {
        const auto u = static_cast<std::size_t>(job);
        const std::int64_t number = job / turns - shifts;
        const double shift = apart * static_cast<double>(number);
        MotionPoints points;
        std::vector<cdouble> sums;
        for (std::size_t m = 0; m < points_.size(); ++m) {
            sums.push_back(model.sum(points_[m], motion) *
                           std::polar(1.0, 2.0 * std::numbers::pi * static_cast<double>(u * m % turns) / turns));
            if (m > 0 && regions_[m].kind() != ImageGrid::Kind::points) {
                places[u][m].i += shift * cell_[m];
                moved[u][m].position = regions_[m].position(places[u][m].i, places[u][m].j);
            }
            points.push_back(&moved[u][m]);
        }
        value[u] = model.alternate(points, found[u], iterations, tolerance, true, sums).objective;
    });
    const auto best = static_cast<std::size_t>(std::max_element(value.begin(), value.end()) - value.begin());
    points_ = std::move(moved[best]);
    places_ = std::move(places[best]);
    return std::move(found[best]);
}

// One region after the other: the pixel that together with those chosen can be made most coherent.
Coefficients TrajectoryEstimator::choose(const MotionModel& model) {
    constexpr int iterations = 15;
    constexpr double tolerance = 1e-5;
    constexpr int turns = 4;
    Coefficients motion = model.zero();
    model.alternate({&points_[0]}, motion, iterations, tolerance, true);
    for (std::size_t m = 1; m < regions_.size(); ++m) {
        std::vector<Place> places = candidates(m);
        std::vector<MotionPoint> trials = histories(m, places);
        const std::size_t starts = turns + 2 + (model.free() ? 0 : 1);
        std::vector<Coefficients> found(trials.size() * starts);
        std::vector<double> value(found.size());
        parallel_for(options_.execution, "pixels", static_cast<std::int64_t>(found.size()), [&](std::int64_t job) {
            const auto u = static_cast<std::size_t>(job);
            MotionPoints points;
            for (std::size_t p = 0; p < m; ++p) points.push_back(&points_[p]);
            points.push_back(&trials[u / starts]);
            const std::size_t start = u % starts;
            Coefficients own = start == 0 ? model.zero() : motion;
            std::vector<cdouble> sums;
            if (start == turns + 2) {
                own = model.unwrapped(points);
            } else if (start >= 2) {
                for (const MotionPoint* p : points) sums.push_back(model.sum(*p, own));
                sums.back() = std::polar(std::abs(sums.front()), 2.0 * std::numbers::pi * static_cast<double>(start - 2) / turns);
            }
            value[u] = model.alternate(points, own, iterations, tolerance, start != turns + 2, sums).objective;
            found[u] = std::move(own);
        });
        const auto best = static_cast<std::size_t>(std::max_element(value.begin(), value.end()) - value.begin());
        motion = found[best];
        points_[m] = trials[best / starts];
        places_[m] = places[best / starts];
    }
    if (model.free()) centre(model, motion);
    return motion;
}

// As many regions as unknowns: the second pixel is the one whose phases follow those of the first most closely, and the motion of a
// pulse solves for the phases, the difference between the regions within half a turn.
Coefficients TrajectoryEstimator::match(const MotionModel& model) {
    const std::vector<Place> places = candidates(1);
    std::vector<MotionPoint> trials = histories(1, places);
    const std::vector<cdouble> first = phasors(points_[0]);
    std::size_t best = 0;
    for (std::size_t c = 0; c < trials.size(); ++c) {
        const double now = std::abs(together(phasors(trials[c]), first));
        if (c > 0 && now <= result_.coherence_between) continue;
        best = c;
        result_.coherence_between = now;
    }
    trials_ = trials.size();
    points_[1] = trials[best];
    places_[1] = places[best];
    const std::vector<cdouble> second = phasors(points_[1]);
    const double between = std::arg(together(second, first));
    const double middle = std::arg(std::accumulate(first.begin(), first.end(), cdouble{}));
    Coefficients motion = model.zero();
    for (std::size_t k = 0; k < n_pulse_; ++k) {
        const bool one = std::abs(first[k]) > 0.0;
        const bool two = std::abs(second[k]) > 0.0;
        const double own = one ? std::arg(first[k] * std::polar(1.0, -middle)) : 0.0;
        const double other = !two  ? 0.0
                             : one ? own + std::arg(second[k] * std::conj(first[k]) * std::polar(1.0, -between))
                                   : std::arg(second[k] * std::polar(1.0, -middle - between));
        Eigen::Matrix2d rate = Eigen::Matrix2d::Zero();
        Eigen::Vector2d phase(-own, -other);
        for (std::size_t m = 0; m < 2; ++m) {
            const Vector3 sight = centres_[k * n_channel_] - points_[m].position;
            for (std::size_t a = 0; a < 2 && (m == 0 ? one : two); ++a)
                rate(static_cast<Eigen::Index>(m), static_cast<Eigen::Index>(a)) =
                    model.radians_per_metre() * dot(sight, axes_[a]) / norm(sight);
        }
        const Eigen::Vector2d solved = rate.completeOrthogonalDecomposition().solve(phase);
        motion[2 * k] = solved(0);
        motion[2 * k + 1] = solved(1);
    }
    return motion;
}

// The sum of each pulse's channels.
std::vector<cdouble> TrajectoryEstimator::phasors(const MotionPoint& point) const {
    std::vector<cdouble> out(n_pulse_);
    for (std::size_t k = 0; k < n_pulse_; ++k)
        for (std::size_t n = 0; n < n_channel_; ++n) {
            const std::size_t i = k * n_channel_ + n;
            out[k] += point.terms[i];
        }
    return out;
}

// Of modulus 1 where the second's phases differ by a constant from the first's.
cdouble TrajectoryEstimator::together(const std::vector<cdouble>& second, const std::vector<cdouble>& first) {
    cdouble sum{};
    double weight = 0.0;
    for (std::size_t k = 0; k < first.size(); ++k) {
        const cdouble product = second[k] * std::conj(first[k]);
        sum += product;
        weight += std::abs(product);
    }
    return weight > 0.0 ? sum / weight : cdouble{};
}

// A common shift of all points and a constant are a line over the pulses, which may take free displacements beyond the search and
// there to the next turn of the phase; tried again with others.
void TrajectoryEstimator::centre(const MotionModel& model, Coefficients& motion) {
    constexpr int iterations = 15;
    constexpr double tolerance = 1e-5;
    constexpr int shifts = 6;
    constexpr int constants = 2;
    constexpr double gain = 1e-6;
    for (const ImageGrid& region : regions_)
        if (region.kind() == ImageGrid::Kind::points) return;
    const int n = (2 * shifts + 1) * (2 * constants + 1);
    std::vector<Coefficients> found(static_cast<std::size_t>(n), model.zero());
    std::vector<std::vector<MotionPoint>> moved(found.size(), points_);
    std::vector<std::vector<Place>> places(found.size(), places_);
    std::vector<double> value(found.size());
    const double unit = 0.25 * cell_[0] * norm(regions_[0].position(places_[0].i + 1.0, places_[0].j) - points_[0].position);
    parallel_for(options_.execution, "pixels", n, [&](std::int64_t job) {
        const auto u = static_cast<std::size_t>(job);
        const std::int64_t number = job / (2 * constants + 1) - shifts;
        const double shift = unit * static_cast<double>(number);
        const double constant = 0.25 * search_ * static_cast<double>(static_cast<int>(job) % (2 * constants + 1) - constants);
        MotionPoints points;
        std::vector<cdouble> sums;
        for (std::size_t m = 0; m < regions_.size(); ++m) {
            const MotionPoint& p = points_[m];
            Place& place = places[u][m];
            place.i += shift / norm(regions_[m].position(place.i + 1.0, place.j) - p.position);
            const Vector3 sight = centres_[centres_.size() / 2] - p.position;
            sums.push_back(model.sum(p, motion) *
                           std::polar(1.0, model.radians_per_metre() * constant * dot(sight, axes_[0]) / norm(sight)));
            moved[u][m].position = regions_[m].position(place.i, place.j);
            points.push_back(&moved[u][m]);
        }
        value[u] = model.alternate(points, found[u], iterations, tolerance, true, sums).objective;
    });
    refine(model, motion);
    double most = preference(model, motion);
    std::vector<MotionPoint> chosen_points = points_;
    std::vector<Place> chosen_places = places_;
    constexpr std::size_t each = 2 * constants + 1;
    for (std::size_t first = 0; first < value.size(); first += each) {
        const auto begin = value.begin() + static_cast<std::ptrdiff_t>(first);
        const auto best = static_cast<std::size_t>(std::max_element(begin, begin + each) - value.begin());
        points_ = moved[best];
        places_ = places[best];
        refine(model, found[best]);
        const double now = preference(model, found[best]);
        if (now <= most + gain) continue;
        most = now;
        motion = found[best];
        chosen_points = points_;
        chosen_places = places_;
    }
    points_ = std::move(chosen_points);
    places_ = std::move(chosen_places);
}

// Coherence, less a little for a motion that scatters more about its line: in noise a displacement and one that is a turn of the phase
// away are nearly as coherent.
double TrajectoryEstimator::preference(const MotionModel& model, const Coefficients& motion) const {
    constexpr double reluctance = 0.02;
    const Coefficients flat = without_line(motion);
    double square = 0.0;
    for (const double x : flat) square += x * x / static_cast<double>(n_pulse_);
    return model.objective(all(), motion) / static_cast<double>(regions_.size()) - reluctance * square / (search_ * search_);
}

std::vector<Place> TrajectoryEstimator::candidates(std::size_t m) const {
    constexpr double apart = 0.5;  // cells
    constexpr int most = 96;
    const auto last = static_cast<double>(regions_[m].shape()[0] - 1);
    const double step = std::max(apart * cell_[m], (last + 2.0 * cell_[m]) / most);
    std::vector<Place> out;
    if (regions_[m].kind() == ImageGrid::Kind::points) {
        const auto pixels = std::min<std::ptrdiff_t>(regions_[m].size(), most);
        for (std::ptrdiff_t c = 0; c < pixels; ++c) {
            const std::ptrdiff_t at = c * regions_[m].size() / pixels;
            const std::ptrdiff_t row = at / regions_[m].shape()[1];
            out.push_back({static_cast<double>(row), static_cast<double>(at % regions_[m].shape()[1])});
        }
        return out;
    }
    const double centre = places_[m].i;
    const auto before = static_cast<int>(std::ceil((centre + cell_[m]) / step));
    const auto behind = static_cast<int>(std::ceil((last - centre + cell_[m]) / step));
    for (int s = -before; s <= behind; ++s) out.push_back({centre + s * step, places_[m].j});
    return out;
}

// Moves a point one step forth or back where that is more coherent, in range within a sample of where it was brightest: farther off its
// history is another's.
bool TrajectoryEstimator::step_aside(const MotionModel& model, Coefficients& motion, std::size_t m, const Place& step, double& best) {
    constexpr int iterations = 8;
    for (const double sign : {-1.0, 1.0}) {
        const Place old = places_[m];
        const Place next{old.i + sign * step.i, old.j + sign * step.j};
        if (std::abs(next.j - brightest_[m].j) > range_cell_[m]) continue;
        const Vector3 at = points_[m].position;
        places_[m] = next;
        points_[m].position = regions_[m].position(next.i, next.j);
        Coefficients trial = motion;
        const double now = model.alternate(all(), trial, iterations, 1e-9, false).objective;
        if (now > best * (1.0 + 1e-9)) {
            best = now;
            motion = std::move(trial);
            return true;
        }
        places_[m] = old;
        points_[m].position = at;
    }
    return false;
}

// Places to a small fraction of a cell, by steps along both indices that are halved, the motion following.
void TrajectoryEstimator::refine(const MotionModel& model, Coefficients& motion) {
    constexpr int levels = 9;
    if (result_.by_construction) {  // nothing tells the places
        model.alternate(all(), motion, options_.iterations, options_.tolerance, false);
        return;
    }
    double best = model.alternate(all(), motion, options_.iterations, 1e-7, true).objective;
    double share = 0.25;
    for (int level = 0; level < levels; ++level, share *= 0.5) {
        bool better = true;
        for (int pass = 0; pass < 4 && better; ++pass) {
            better = false;
            for (std::size_t m = 0; m < regions_.size(); ++m) {
                if (regions_[m].kind() == ImageGrid::Kind::points) continue;
                better = (m > 0 && step_aside(model, motion, m, {share * cell_[m], 0.0}, best)) || better;
                better = step_aside(model, motion, m, {0.0, share}, best) || better;
            }
        }
    }
    model.alternate(all(), motion, options_.iterations, options_.tolerance, true);
}

}  // namespace sarfocus::autofocus::detail
