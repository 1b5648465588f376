#include "trajectory_estimator.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <string>
#include <utility>

#include <Eigen/Core>
#include <Eigen/Eigenvalues>

#include <sarfocus/core/error.hpp>
#include <sarfocus/geometry/phase_centres.hpp>

#include "stopwatch.hpp"

namespace sarfocus::autofocus::detail {
namespace {

constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();
constexpr double worst_condition = 1e3;

}  // namespace

std::vector<Vector3> motion_axes(const ArrayView<const double, 3>& positions, const TrajectoryOptions& options) {
    const Vector3 up = (1.0 / norm(options.up)) * options.up;
    if (options.unknowns == TrajectoryUnknowns::height) return {up};
    const std::ptrdiff_t last = positions.extent(1) - 1;
    Vector3 track{};
    for (std::size_t a = 0; a < 3; ++a)
        track[a] = positions(0, last, static_cast<std::ptrdiff_t>(a)) - positions(0, 0, static_cast<std::ptrdiff_t>(a));
    if (!(norm(track) > 0.0)) throw ValueError("positions", "a track from the first to the last pulse", "one place");
    track = (1.0 / norm(track)) * track;
    const Vector3 side = cross(track, up);
    if (norm(side) < 1e-6) throw ValueError("up", "a direction other than the track's", "the track's");
    const Vector3 right = (1.0 / norm(side)) * side;
    std::vector<Vector3> out{cross(right, track), right};
    if (options.unknowns == TrajectoryUnknowns::full) out.push_back(track);
    return out;
}

TrajectoryEstimator::TrajectoryEstimator(const TrajectoryEchoes& echoes, const std::vector<ImageGrid>& regions,
                                         const TrajectoryOptions& options, const ArrayView<const double, 2>& initial)
    : echoes_(echoes),
      wavelength_(echoes.channels.front().wavelength),
      regions_(regions),
      options_(options),
      n_channel_(static_cast<std::size_t>(echoes.positions.extent(0))),
      n_pulse_(static_cast<std::size_t>(echoes.positions.extent(1))),
      axes_(motion_axes(echoes.positions, options)),
      initial_(n_pulse_, Vector3{}) {
    for (std::size_t k = 0; k < n_pulse_; ++k) {
        if (!initial.empty())
            for (std::size_t a = 0; a < 3; ++a) initial_[k][a] = initial(static_cast<std::ptrdiff_t>(k), static_cast<std::ptrdiff_t>(a));
        for (std::size_t n = 0; n < n_channel_; ++n) {
            Vector3 p = initial_[k];
            for (std::size_t a = 0; a < 3; ++a)
                p[a] += echoes.positions(static_cast<std::ptrdiff_t>(n), static_cast<std::ptrdiff_t>(k), static_cast<std::ptrdiff_t>(a));
            centres_.push_back(p);
        }
    }
}

Trajectory TrajectoryEstimator::run() {
    detail::Stopwatch watch(result_.timings);
    prepare();
    watch.lap("histories");
    if (!result_.reason.empty()) return finish(Coefficients(n_pulse_ * axes_.size(), 0.0));
    Coefficients motion;
    const MotionModel model = solve(motion);
    watch.lap("pixels");
    for (result_.rounds = 1; result_.rounds < options_.rounds && farthest(model, motion) > 0.25 * echoes_.channels.front().range_spacing;
         ++result_.rounds) {
        for (std::size_t m = 0; m < regions_.size(); ++m) points_[m] = histories(m, {places_[m]}, &model, &motion).front();
        refine(model, motion);
    }
    const auto last = model.alternate(all(), motion, options_.iterations, options_.tolerance, false);
    result_.objective = last.steps;
    watch.lap("alternation");
    judge(model, motion, last.converged);
    watch.lap("judgement");
    return finish(motion);
}

MotionPoints TrajectoryEstimator::all() const {
    MotionPoints out;
    for (const MotionPoint& p : points_) out.push_back(&p);
    return out;
}

// What backprojection adds up at pixels of a region; where a motion is given, along the path moved by it.
std::vector<MotionPoint> TrajectoryEstimator::histories(std::size_t region, const std::vector<Place>& places, const MotionModel* model,
                                                        const Coefficients* motion) {
    const auto n_point = static_cast<std::ptrdiff_t>(places.size());
    const auto n_pulse = static_cast<std::ptrdiff_t>(n_pulse_);
    std::vector<MotionPoint> out(places.size());
    Array<double, 2> xyz({n_point, 3});
    for (std::size_t c = 0; c < places.size(); ++c) {
        out[c].position = regions_[region].position(places[c].i, places[c].j);
        std::copy(out[c].position.begin(), out[c].position.end(), xyz.data() + 3 * c);
        out[c].terms.resize(centres_.size());
        out[c].range.resize(centres_.size());
    }
    Array<cfloat, 2> terms({n_point, n_pulse});
    for (std::size_t n = 0; n < n_channel_; ++n) {
        std::vector<Vector3> path(n_pulse_);
        for (std::size_t k = 0; k < n_pulse_; ++k) {
            path[k] = centres_[k * n_channel_ + n];
            if (motion != nullptr) path[k] = path[k] + model->displacement(*motion, k);
            for (std::size_t c = 0; c < places.size(); ++c) out[c].range[k * n_channel_ + n] = norm(path[k] - out[c].position);
        }
        take_terms(n, path, xyz, terms.view());
        for (std::size_t c = 0; c < places.size(); ++c)
            for (std::size_t k = 0; k < n_pulse_; ++k)
                out[c].terms[k * n_channel_ + n] = cdouble(terms(static_cast<std::ptrdiff_t>(c), static_cast<std::ptrdiff_t>(k)));
    }
    for (MotionPoint& p : out) {
        double total = 0.0;
        for (const cdouble& t : p.terms) total += std::abs(t);
        for (cdouble& t : p.terms) t *= total > 0.0 ? 1.0 / total : 0.0;
    }
    return out;
}

// The brightest pixel of every region as it stands, azimuth cells, and whether the geometry tells the unknowns.
void TrajectoryEstimator::prepare() {
    for (std::size_t r = 0; r < regions_.size(); ++r) {
        const auto shape = regions_[r].shape();
        const std::ptrdiff_t pixels = regions_[r].size();
        std::vector<double> energy(static_cast<std::size_t>(pixels));
        std::vector<Place> places;
        for (std::ptrdiff_t i = 0; i < shape[0]; ++i)
            for (std::ptrdiff_t j = 0; j < shape[1]; ++j) places.push_back({static_cast<double>(i), static_cast<double>(j)});
        const std::size_t batch = std::max<std::size_t>(1, (1U << 21) / centres_.size());
        std::vector<double> bright(places.size());
        for (std::size_t begin = 0; begin < places.size(); begin += batch) {
            const std::vector<Place> some(places.begin() + static_cast<std::ptrdiff_t>(begin),
                                          places.begin() + static_cast<std::ptrdiff_t>(std::min(places.size(), begin + batch)));
            collect(r, some, begin, energy, bright);
        }
        const double most = *std::max_element(energy.begin(), energy.end());
        if (!(most > 0.0)) {
            result_.empty_region = static_cast<int>(r);
            result_.reason = "region " + std::to_string(r) + " holds no echo";
            return;
        }
        power_.push_back(most / static_cast<double>(centres_.size()));
        std::size_t best = 0;
        double level = -1.0;
        for (std::size_t c = 0; c < places.size(); ++c)
            if (energy[c] >= 0.7 * most && bright[c] > level) {
                level = bright[c];
                best = c;
            }
        places_.push_back(places[best]);
        points_.push_back(histories(r, {places_.back()}).front());
        cell_.push_back(azimuth_cell(r));
        range_cell_.push_back(range_cell(r));
    }
    brightest_ = places_;
    observability();
}

void TrajectoryEstimator::collect(std::size_t region, const std::vector<Place>& places, std::size_t begin, std::vector<double>& energy,
                                  std::vector<double>& bright) {
    const auto n_pulse = static_cast<std::ptrdiff_t>(n_pulse_);
    const auto n_point = static_cast<std::ptrdiff_t>(places.size());
    Array<double, 2> xyz({n_point, 3});
    for (std::size_t c = 0; c < places.size(); ++c) {
        const Vector3 p = regions_[region].position(places[c].i, places[c].j);
        std::copy(p.begin(), p.end(), xyz.data() + 3 * c);
    }
    Array<cfloat, 2> terms({n_point, n_pulse});
    std::vector<cdouble> sums(places.size());
    for (std::size_t n = 0; n < n_channel_; ++n) {
        std::vector<Vector3> path(n_pulse_);
        for (std::size_t k = 0; k < n_pulse_; ++k) path[k] = centres_[k * n_channel_ + n];
        take_terms(n, path, xyz, terms.view());
        for (std::size_t c = 0; c < places.size(); ++c)
            for (std::ptrdiff_t k = 0; k < n_pulse; ++k) {
                const cdouble term(terms(static_cast<std::ptrdiff_t>(c), k));
                sums[c] += term;
                energy[begin + c] += std::norm(term);
            }
    }
    for (std::size_t c = 0; c < places.size(); ++c) bright[begin + c] = std::abs(sums[c]);
}

// The terms of backprojection of one channel at points, its phase centres along a path.
void TrajectoryEstimator::take_terms(std::size_t channel, const std::vector<Vector3>& path, const Array<double, 2>& xyz,
                                     MutableImageView terms) const {
    const auto n_pulse = static_cast<std::ptrdiff_t>(n_pulse_);
    Vector3 half{};
    for (std::size_t a = 0; a < 3 && !echoes_.baselines.empty(); ++a)
        half[a] = 0.5 * echoes_.baselines(static_cast<std::ptrdiff_t>(channel), static_cast<std::ptrdiff_t>(a));
    const bool apart = norm(half) > 0.0;
    Array<double, 2> transmit({n_pulse, 3});
    Array<double, 2> receive({apart ? n_pulse : 0, 3});
    for (std::size_t k = 0; k < n_pulse_; ++k)
        for (std::size_t a = 0; a < 3; ++a) {
            transmit.data()[3 * k + a] = path[k][a] - half[a];
            if (apart) receive.data()[3 * k + a] = path[k][a] + half[a];
        }
    std::vector<double> start;
    focus::BackprojectOptions how;
    how.execution.threads = options_.execution.threads;
    focus::backproject_histories(near(channel, path, xyz, start),
                                 apart ? geometry::PhaseCentres(transmit.view(), receive.view())
                                       : geometry::PhaseCentres(ArrayView<const double, 2>(transmit.view())),
                                 ArrayView<const double, 2>(xyz.view()), terms, how);
    for (std::ptrdiff_t c = 0; c < xyz.extent(0) && options_.aspect.limited(); ++c)
        for (std::ptrdiff_t k = 0; k < n_pulse; ++k)
            if (!options_.aspect.sees(path[static_cast<std::size_t>(k)], {xyz(c, 0), xyz(c, 1), xyz(c, 2)})) terms(c, k) = {};
}

// The samples of a channel about the points. What ends behind `guard` samples of a profile sampled above its Nyquist rate is felt by
// 1 / (pi guard), -58 dB of a scatterer there as strong as the points.
focus::RangeProfiles TrajectoryEstimator::near(std::size_t channel, const std::vector<Vector3>& path, const Array<double, 2>& xyz,
                                               std::vector<double>& start) const {
    constexpr double guard = 256.0;
    const RangeProfiles& all = echoes_.channels[channel];
    double low = std::numeric_limits<double>::infinity();
    double high = -low;
    for (std::size_t k = 0; k < n_pulse_; ++k)
        for (std::ptrdiff_t c = 0; c < xyz.extent(0); ++c) {
            const double range = norm(path[k] - Vector3{xyz(c, 0), xyz(c, 1), xyz(c, 2)});
            const double sample = (range - all.first_range(static_cast<std::ptrdiff_t>(k))) / all.range_spacing;
            low = std::min(low, sample);
            high = std::max(high, sample);
        }
    const auto last = static_cast<double>(all.data.extent(1) - 1);
    const auto first = static_cast<std::ptrdiff_t>(std::clamp(std::floor(low) - guard, 0.0, last));
    const auto end = static_cast<std::ptrdiff_t>(std::clamp(std::ceil(high) + guard, static_cast<double>(first), last));
    for (std::ptrdiff_t k = 0; k < all.range_start.extent(0); ++k)
        start.push_back(all.range_start(k) + static_cast<double>(first) * all.range_spacing);
    RangeProfiles out = all;
    out.data = all.data.slice(1, first, end + 1 - first);
    out.range_start = ArrayView<const double, 1>(start.data(), {static_cast<std::ptrdiff_t>(start.size())});
    return out;
}

// Resolution along the first index, pixels: lambda / 2 over the spread of the direction cosine along it.
double TrajectoryEstimator::azimuth_cell(std::size_t r) const {
    const MotionPoint& p = points_[r];
    const Vector3 step = regions_[r].position(places_[r].i + 1.0, places_[r].j) - p.position;
    double weight = 0.0;
    double mean = 0.0;
    double square = 0.0;
    for (std::size_t i = 0; i < centres_.size(); ++i) {
        const double w = std::abs(p.terms[i]);
        const double cosine = dot(p.position - centres_[i], step) / p.range[i];
        weight += w;
        mean += w * cosine;
        square += w * cosine * cosine;
    }
    mean /= weight;
    const double span = std::sqrt(12.0 * std::max(square / weight - mean * mean, 0.0));
    return span > 0.0 ? 0.5 * wavelength_ / span : static_cast<double>(regions_[r].shape()[0]);
}

double TrajectoryEstimator::range_cell(std::size_t r) const {
    const Vector3& centre = centres_[centres_.size() / 2];
    const double change = norm(regions_[r].position(places_[r].i, places_[r].j + 1.0) - centre) - norm(points_[r].position - centre);
    const auto columns = static_cast<double>(regions_[r].shape()[1]);
    return std::abs(change) > 0.0 ? std::clamp(echoes_.channels.front().range_spacing / std::abs(change), 0.5, columns) : columns;
}

// Singular values of the rates at which the ranges of the regions change with the unknowns; of the height also against a phase that all
// regions share, because only that tells a displacement from it and shows which pixel is right.
void TrajectoryEstimator::observability() {
    const std::size_t n = axes_.size();
    const bool free = options_.knots == 0;
    result_.by_construction = options_.exactly_determined && free && n == 2 && regions_.size() == 2;
    const std::size_t least_regions = free && !result_.by_construction ? n + 1 : 2;
    if (regions_.size() < least_regions) {
        result_.determined = false;
        result_.reason = "expected at least " + std::to_string(least_regions) + " regions for " + std::to_string(n) +
                         (free ? " free" : "") + " unknown(s) of a pulse, got " + std::to_string(regions_.size());
        return;
    }
    double steepest = 0.0;
    const auto size = static_cast<Eigen::Index>(n);
    Eigen::MatrixXd gram = Eigen::MatrixXd::Zero(size, size);
    double least = std::numeric_limits<double>::infinity();
    double most = -least;
    for (const MotionPoint& p : points_) {
        double mean = 0.0;
        for (std::size_t i = 0; i < centres_.size(); ++i) {
            Eigen::VectorXd rate(size);
            for (std::size_t a = 0; a < n; ++a) rate(static_cast<Eigen::Index>(a)) = dot(centres_[i] - p.position, axes_[a]) / p.range[i];
            gram += rate * rate.transpose() / static_cast<double>(centres_.size());
            steepest = std::max(steepest, rate.norm());
            mean += rate(0) / static_cast<double>(centres_.size());
        }
        least = std::min(least, mean);
        most = std::max(most, mean);
    }
    search_ = options_.search > 0.0 ? options_.search : 0.25 * wavelength_ / std::max(steepest, 1e-3);
    if (n == 1) {
        result_.condition =
            most > least ? std::max(std::abs(most), std::abs(least)) / (most - least) : std::numeric_limits<double>::infinity();
    } else {
        const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(gram);
        const double small = solver.eigenvalues()(0);
        result_.condition = small > 0.0 ? std::sqrt(solver.eigenvalues()(size - 1) / small) : std::numeric_limits<double>::infinity();
        const double middle = solver.eigenvalues()(1);
        if (n == 3 && !(result_.condition < worst_condition) && middle > 0.0) {
            std::vector<Vector3> seen(2, Vector3{});
            for (std::size_t a = 0; a < 2; ++a)
                for (std::size_t b = 0; b < n; ++b)
                    seen[a] = seen[a] + solver.eigenvectors()(static_cast<Eigen::Index>(b), static_cast<Eigen::Index>(2 - a)) * axes_[b];
            axes_ = std::move(seen);
            dropped_ = true;
            result_.condition = std::sqrt(solver.eigenvalues()(size - 1) / middle);
        }
    }
    result_.determined = result_.condition < worst_condition;
    if (!result_.determined)
        result_.reason = n == 1 ? "all regions see the height under one angle: a displacement can't be told from a phase of the pulse or "
                                  "from a wrong pixel; choose regions at different ranges"
                                : "the regions lie in one direction: displacements perpendicular to it can't be told apart; choose regions "
                                  "at different ranges";
}

double TrajectoryEstimator::farthest(const MotionModel& model, const Coefficients& motion) {
    double out = 0.0;
    for (std::size_t k = 0; k < model.n_pulse(); ++k) out = std::max(out, norm(model.displacement(motion, k)));
    return out;
}

Trajectory TrajectoryEstimator::finish(const Coefficients& motion) {
    const auto n_pulse = static_cast<std::ptrdiff_t>(n_pulse_);
    result_.motion = Array<double, 2>({n_pulse, 3});
    result_.motion_std = Array<double, 2>({n_pulse, 3});
    result_.estimate = Array<double, 2>({n_pulse, 3});
    const bool use = result_.status != TrajectoryStatus::not_improved;
    for (std::size_t k = 0; k < n_pulse_; ++k)
        for (std::size_t x = 0; x < 3; ++x) {
            double value = initial_[k][x];
            double variance = 0.0;
            for (std::size_t a = 0; a < axes_.size(); ++a) {
                value += motion[k * axes_.size() + a] * axes_[a][x];
                const double part = std_.empty() ? not_a_number : std_[k * axes_.size() + a] * axes_[a][x];
                variance += part * part;
            }
            const auto row = static_cast<std::ptrdiff_t>(k);
            const auto column = static_cast<std::ptrdiff_t>(x);
            result_.estimate(row, column) = value;
            result_.motion(row, column) = use ? value : 0.0;
            result_.motion_std(row, column) = std::sqrt(variance);
        }
    return std::move(result_);
}

}  // namespace sarfocus::autofocus::detail
