#include <sarfocus/autofocus/trajectory.hpp>

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstdint>
#include <cstdio>
#include <limits>
#include <numbers>
#include <random>
#include <utility>

#include <Eigen/Core>
#include <Eigen/Eigenvalues>

#include <sarfocus/core/checks.hpp>
#include <sarfocus/core/error.hpp>
#include <sarfocus/geometry/phase_centres.hpp>

#include "stopwatch.hpp"
#include "trajectory_model.hpp"

namespace sarfocus::autofocus {
namespace {

using detail::Coefficients;
using detail::MotionModel;
using detail::MotionPoint;
using detail::MotionPoints;
using focus::RangeProfiles;
using geometry::ImageGrid;

constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();
constexpr int most_coefficients = 1200;
constexpr std::ptrdiff_t most_pixels = 1 << 16;
constexpr double worst_condition = 1e3;

std::vector<Vector3> axes_of(const ArrayView<const double, 3>& positions, const TrajectoryOptions& options) {
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

// A pixel of a region by fractional indices.
struct Place {
    double i = 0.0;
    double j = 0.0;
};

class Estimator {
public:
    Estimator(const RangeProfiles& profiles, const ArrayView<const double, 3>& positions, const std::vector<ImageGrid>& regions,
              const TrajectoryOptions& options, const ArrayView<const double, 2>& initial)
        : profiles_(profiles),
          regions_(regions),
          options_(options),
          n_channel_(static_cast<std::size_t>(positions.extent(0))),
          n_pulse_(static_cast<std::size_t>(positions.extent(1))),
          axes_(axes_of(positions, options)),
          initial_(n_pulse_, Vector3{}) {
        for (std::size_t k = 0; k < n_pulse_; ++k) {
            if (!initial.empty())
                for (std::size_t a = 0; a < 3; ++a)
                    initial_[k][a] = initial(static_cast<std::ptrdiff_t>(k), static_cast<std::ptrdiff_t>(a));
            for (std::size_t n = 0; n < n_channel_; ++n) {
                Vector3 p = initial_[k];
                for (std::size_t a = 0; a < 3; ++a)
                    p[a] += positions(static_cast<std::ptrdiff_t>(n), static_cast<std::ptrdiff_t>(k), static_cast<std::ptrdiff_t>(a));
                centres_.push_back(p);
            }
        }
    }

    Trajectory run() {
        detail::Stopwatch watch(result_.timings);
        prepare();
        watch.lap("histories");
        if (!result_.reason.empty()) return finish(Coefficients(n_pulse_ * axes_.size(), 0.0));
        const MotionModel model(centres_, n_channel_, axes_, profiles_.wavelength, options_.knots, search_);
        Coefficients motion = choose(model);
        watch.lap("pixels");
        refine(model, motion);
        for (result_.rounds = 1; result_.rounds < options_.rounds && farthest(model, motion) > 0.25 * profiles_.range_spacing;
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

private:
    [[nodiscard]] MotionPoints all() const {
        MotionPoints out;
        for (const MotionPoint& p : points_) out.push_back(&p);
        return out;
    }

    // What backprojection adds up at pixels of a region; where a motion is given, along the path moved by it.
    std::vector<MotionPoint> histories(std::size_t region, const std::vector<Place>& places, const MotionModel* model = nullptr,
                                       const Coefficients* motion = nullptr) {
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
        Array<double, 2> path({n_pulse, 3});
        Array<cfloat, 2> terms({n_point, n_pulse});
        for (std::size_t n = 0; n < n_channel_; ++n) {
            for (std::size_t k = 0; k < n_pulse_; ++k) {
                Vector3 p = centres_[k * n_channel_ + n];
                if (motion != nullptr) p = p + model->displacement(*motion, k);
                std::copy(p.begin(), p.end(), path.data() + 3 * k);
                for (std::size_t c = 0; c < places.size(); ++c) out[c].range[k * n_channel_ + n] = norm(p - out[c].position);
            }
            const RangeProfiles own = channel(n);
            focus::BackprojectOptions how;
            how.execution.threads = options_.execution.threads;
            focus::backproject_histories(own, geometry::PhaseCentres(ArrayView<const double, 2>(path.view())),
                                         ArrayView<const double, 2>(xyz.view()), terms.view(), how);
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
    void prepare() {
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
                result_.reason = "region " + std::to_string(r) + " holds no echo";
                return;
            }
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
        }
        observability();
    }

    void collect(std::size_t region, const std::vector<Place>& places, std::size_t begin, std::vector<double>& energy,
                 std::vector<double>& bright) {
        const auto n_pulse = static_cast<std::ptrdiff_t>(n_pulse_);
        const auto n_point = static_cast<std::ptrdiff_t>(places.size());
        Array<double, 2> xyz({n_point, 3});
        for (std::size_t c = 0; c < places.size(); ++c) {
            const Vector3 p = regions_[region].position(places[c].i, places[c].j);
            std::copy(p.begin(), p.end(), xyz.data() + 3 * c);
        }
        Array<double, 2> path({n_pulse, 3});
        Array<cfloat, 2> terms({n_point, n_pulse});
        std::vector<cdouble> sums(places.size());
        for (std::size_t n = 0; n < n_channel_; ++n) {
            for (std::size_t k = 0; k < n_pulse_; ++k)
                std::copy(centres_[k * n_channel_ + n].begin(), centres_[k * n_channel_ + n].end(), path.data() + 3 * k);
            RangeProfiles own = channel(n);
            focus::BackprojectOptions how;
            how.execution.threads = options_.execution.threads;
            focus::backproject_histories(own, geometry::PhaseCentres(ArrayView<const double, 2>(path.view())),
                                         ArrayView<const double, 2>(xyz.view()), terms.view(), how);
            for (std::size_t c = 0; c < places.size(); ++c)
                for (std::ptrdiff_t k = 0; k < n_pulse; ++k) {
                    const cdouble term(terms(static_cast<std::ptrdiff_t>(c), k));
                    sums[c] += term;
                    energy[begin + c] += std::norm(term);
                }
        }
        for (std::size_t c = 0; c < places.size(); ++c) bright[begin + c] = std::abs(sums[c]);
    }

    [[nodiscard]] RangeProfiles channel(std::size_t n) const {
        const auto n_pulse = static_cast<std::ptrdiff_t>(n_pulse_);
        const std::ptrdiff_t first = static_cast<std::ptrdiff_t>(n) * n_pulse;
        RangeProfiles own = profiles_;
        own.data = ImageView(&profiles_.data(first, 0), {n_pulse, profiles_.data.extent(1)}, profiles_.data.strides());
        if (own.range_start.extent(0) > 1)
            own.range_start = ArrayView<const double, 1>(&profiles_.range_start(first), {n_pulse}, profiles_.range_start.strides());
        return own;
    }

    // Resolution along the first index, pixels: lambda / 2 over the spread of the direction cosine along it.
    [[nodiscard]] double azimuth_cell(std::size_t r) const {
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
        return span > 0.0 ? 0.5 * profiles_.wavelength / span : static_cast<double>(regions_[r].shape()[0]);
    }

    // Singular values of the rates at which the ranges of the regions change with the unknowns; of the height also against a phase that all
    // regions share, because only that tells a displacement from it and shows which pixel is right.
    void observability() {
        const std::size_t n = axes_.size();
        if (regions_.size() < 2 || (options_.knots == 0 && regions_.size() <= n)) {
            result_.reason = "expected at least " + std::to_string(std::max<std::size_t>(2, options_.knots == 0 ? n + 1 : 2)) +
                             " regions for " + std::to_string(n) + (options_.knots == 0 ? " free" : "") + " unknown(s) of a pulse, got " +
                             std::to_string(regions_.size());
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
                for (std::size_t a = 0; a < n; ++a)
                    rate(static_cast<Eigen::Index>(a)) = dot(centres_[i] - p.position, axes_[a]) / p.range[i];
                gram += rate * rate.transpose() / static_cast<double>(centres_.size());
                steepest = std::max(steepest, rate.norm());
                mean += rate(0) / static_cast<double>(centres_.size());
            }
            least = std::min(least, mean);
            most = std::max(most, mean);
        }
        search_ = options_.search > 0.0 ? options_.search : 0.25 * profiles_.wavelength / std::max(steepest, 1e-3);
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
                        seen[a] =
                            seen[a] + solver.eigenvectors()(static_cast<Eigen::Index>(b), static_cast<Eigen::Index>(2 - a)) * axes_[b];
                axes_ = std::move(seen);
                dropped_ = true;
                result_.condition = std::sqrt(solver.eigenvalues()(size - 1) / middle);
            }
        }
        if (!(result_.condition < worst_condition))
            result_.reason =
                n == 1 ? "all regions see the height under one angle: a displacement can't be told from a phase of the pulse or "
                         "from a wrong pixel; choose regions at different ranges"
                       : "the regions lie in one direction: displacements perpendicular to it can't be told apart; choose regions "
                         "at different ranges";
    }

    // One region after the other: the pixel that together with those chosen can be made most coherent.
    Coefficients choose(const MotionModel& model) {
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

    // A common shift of all points and a constant are a line over the pulses, which may take free displacements beyond the search and
    // there to the next turn of the phase; tried again with others.
    void centre(const MotionModel& model, Coefficients& motion) {
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
            const double shift = unit * static_cast<double>(static_cast<int>(job) / (2 * constants + 1) - shifts);
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
    [[nodiscard]] double preference(const MotionModel& model, const Coefficients& motion) const {
        constexpr double reluctance = 0.02;
        const Coefficients flat = without_line(motion);
        double square = 0.0;
        for (const double x : flat) square += x * x / static_cast<double>(n_pulse_);
        return model.objective(all(), motion) / static_cast<double>(regions_.size()) - reluctance * square / (search_ * search_);
    }

    [[nodiscard]] std::vector<Place> candidates(std::size_t m) const {
        constexpr double apart = 0.5;  // cells
        constexpr int most = 96;
        const auto last = static_cast<double>(regions_[m].shape()[0] - 1);
        const double step = std::max(apart * cell_[m], (last + 2.0 * cell_[m]) / most);
        std::vector<Place> out;
        if (regions_[m].kind() == ImageGrid::Kind::points) {
            const auto pixels = std::min<std::ptrdiff_t>(regions_[m].size(), most);
            for (std::ptrdiff_t c = 0; c < pixels; ++c) {
                const std::ptrdiff_t at = c * regions_[m].size() / pixels;
                out.push_back({static_cast<double>(at / regions_[m].shape()[1]), static_cast<double>(at % regions_[m].shape()[1])});
            }
            return out;
        }
        const double centre = places_[m].i;
        const auto before = static_cast<int>(std::ceil((centre + cell_[m]) / step));
        const auto behind = static_cast<int>(std::ceil((last - centre + cell_[m]) / step));
        for (int s = -before; s <= behind; ++s) out.push_back({centre + s * step, places_[m].j});
        return out;
    }

    // Places to a small fraction of a cell, by steps along both indices that are halved, the motion following.
    void refine(const MotionModel& model, Coefficients& motion) {
        constexpr int levels = 9;
        constexpr int iterations = 8;
        double best = model.alternate(all(), motion, options_.iterations, 1e-7, true).objective;
        double share = 0.25;
        for (int level = 0; level < levels; ++level, share *= 0.5) {
            bool better = true;
            for (int pass = 0; pass < 4 && better; ++pass) {
                better = false;
                for (std::size_t m = 0; m < regions_.size(); ++m) {
                    if (regions_[m].kind() == ImageGrid::Kind::points) continue;
                    for (const bool along : {true, false}) {
                        if (along && m == 0) continue;
                        for (const double sign : {-1.0, 1.0}) {
                            const Place old = places_[m];
                            const Vector3 at = points_[m].position;
                            (along ? places_[m].i : places_[m].j) += sign * share * (along ? cell_[m] : 1.0);
                            points_[m].position = regions_[m].position(places_[m].i, places_[m].j);
                            Coefficients trial = motion;
                            const double now = model.alternate(all(), trial, iterations, 1e-9, false).objective;
                            if (now > best * (1.0 + 1e-9)) {
                                best = now;
                                motion = std::move(trial);
                                better = true;
                                break;
                            }
                            places_[m] = old;
                            points_[m].position = at;
                        }
                    }
                }
            }
        }
        model.alternate(all(), motion, options_.iterations, options_.tolerance, true);
    }

    [[nodiscard]] static double farthest(const MotionModel& model, const Coefficients& motion) {
        double out = 0.0;
        for (std::size_t k = 0; k < model.n_pulse(); ++k) out = std::max(out, norm(model.displacement(motion, k)));
        return out;
    }

    // The greatest coherence of a region near its place for a given motion, and that place.
    double brightest(const MotionModel& model, const Coefficients& motion, std::size_t m, Vector3* where = nullptr) const {
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

    void judge(const MotionModel& model, Coefficients& motion, bool converged) {
        constexpr int draws = 8;
        constexpr double sigmas = 5.0;
        const auto regions = static_cast<double>(regions_.size());
        const Coefficients none = model.zero();
        result_.points.resize(regions_.size());
        double held_gain = 0.0;
        bool held = true;
        for (std::size_t m = 0; m < regions_.size(); ++m) {
            TrajectoryPoint& p = result_.points[m];
            p.position = points_[m].position;
            p.coherence_before = brightest(model, none, m);
            p.coherence = std::norm(model.sum(points_[m], motion));
            result_.coherence_before += p.coherence_before / regions;
            result_.coherence += p.coherence / regions;
            p.held_out_before = p.held_out = not_a_number;
            if (model.free() && regions_.size() - 1 < axes_.size()) {
                held = false;
                continue;
            }
            MotionPoints others;
            for (std::size_t o = 0; o < regions_.size(); ++o)
                if (o != m) others.push_back(&points_[o]);
            Coefficients own = none;
            model.alternate(others, own, 60, 1e-8, true);
            p.held_out_before = p.coherence_before;
            p.held_out = brightest(model, own, m);
            held_gain += (p.held_out - p.held_out_before) / regions;
        }
        std::array<double, draws> chance{};
        parallel_for(options_.execution, "chance", draws, [&](std::int64_t draw) {
            std::mt19937_64 random(static_cast<std::uint64_t>(draw) + 1);
            std::vector<MotionPoint> mixed = points_;
            MotionPoints points;
            for (MotionPoint& p : mixed) {
                for (cdouble& t : p.terms)
                    t = std::polar(std::abs(t), 2.0 * std::numbers::pi * static_cast<double>(random() >> 11U) * 0x1p-53);
                points.push_back(&p);
            }
            Coefficients own = none;
            chance[static_cast<std::size_t>(draw)] = model.alternate(points, own, 30, 1e-5, true).objective / regions;
        });
        for (const double c : chance) result_.coherence_by_chance += c / draws;
        double spread = 0.0;
        for (const double c : chance) spread += (c - result_.coherence_by_chance) * (c - result_.coherence_by_chance) / (draws - 1);
        result_.chance_std = std::sqrt(spread);
        const double bar = result_.coherence_by_chance + sigmas * result_.chance_std + 0.02;
        std_ = model.deviation(all(), motion);
        char text[240];
        bool improved = false;
        if (!(result_.coherence > bar)) {
            std::snprintf(text, sizeof text, "coherence %.4f of the regions is no more than random phases reach (%.4f)", result_.coherence,
                          bar);
        } else if (!(result_.coherence > result_.coherence_before)) {
            std::snprintf(text, sizeof text, "the regions were as coherent before (%.4f)", result_.coherence_before);
        } else if (held && result_.coherence_before > 0.5 && !(held_gain > 0.0)) {
            std::snprintf(text, sizeof text, "held-out coherence changed by %+.4f", held_gain);
        } else {
            improved = true;
            std::snprintf(text, sizeof text, "coherence rose from %.4f to %.4f; random phases reach %.4f", result_.coherence_before,
                          result_.coherence, bar);
        }
        result_.reason = text;
        if (dropped_) result_.reason += "; the direction that all regions see at a right angle can't be told and was left alone";
        if (improved || !options_.do_no_harm) result_.status = converged ? TrajectoryStatus::converged : TrajectoryStatus::max_iterations;
        remove_line(model, motion);
    }

    [[nodiscard]] Coefficients without_line(const Coefficients& motion) const {
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

    void remove_line(const MotionModel& model, Coefficients& motion) {
        constexpr double loss = 1e-4;
        Coefficients flat = without_line(motion);
        std::vector<Vector3> at(regions_.size());
        double coherence = 0.0;
        for (std::size_t m = 0; m < regions_.size(); ++m)
            coherence += brightest(model, flat, m, &at[m]) / static_cast<double>(regions_.size());
        if (!(coherence > (1.0 - loss) * result_.coherence)) return;
        motion = std::move(flat);
        result_.line_removed = true;
        for (std::size_t m = 0; m < regions_.size(); ++m) result_.points[m].position = at[m];
    }

    Trajectory finish(const Coefficients& motion) {
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

    const RangeProfiles& profiles_;
    const std::vector<ImageGrid>& regions_;
    const TrajectoryOptions& options_;
    std::size_t n_channel_;
    std::size_t n_pulse_;
    std::vector<Vector3> axes_;
    std::vector<Vector3> initial_;
    std::vector<Vector3> centres_;  // pulse by pulse, all channels of each
    std::vector<Place> places_;
    std::vector<MotionPoint> points_;
    std::vector<double> cell_;  // pixels along the first index
    double search_ = 0.0;
    bool dropped_ = false;  // a direction that no region sees
    Coefficients std_;
    Trajectory result_;
};

void require_arguments(const RangeProfiles& profiles, const ArrayView<const double, 3>& positions, const std::vector<ImageGrid>& regions,
                       const TrajectoryOptions& options, const ArrayView<const double, 2>& initial) {
    options.validate();
    profiles.validate(options.execution.threads);
    if (positions.extent(2) != 3 || positions.extent(0) * positions.extent(1) != profiles.data.extent(0))
        throw ShapeError("positions", "three coordinates for each of " + std::to_string(profiles.data.extent(0)) + " echoes",
                         shape_text(positions.extents()));
    if (positions.extent(1) < 8) throw ShapeError("positions", "at least 8 pulses", shape_text(positions.extents()));
    for (std::ptrdiff_t n = 0; n < positions.extent(0); ++n)
        require_finite(
            ArrayView<const double, 2>(&positions(n, 0, 0), {positions.extent(1), 3}, {positions.strides()[1], positions.strides()[2]}),
            "positions");
    if (regions.empty()) throw ValueError("regions", "two or more", "none");
    for (const ImageGrid& region : regions)
        if (region.size() > most_pixels)
            throw ValueError("regions", "chips of at most " + std::to_string(most_pixels) + " pixels", std::to_string(region.size()));
    if (!initial.empty()) {
        if (initial.extent(0) != positions.extent(1) || initial.extent(1) != 3)
            throw ShapeError("initial", "(" + std::to_string(positions.extent(1)) + ", 3)", shape_text(initial.extents()));
        require_finite(initial, "initial");
    }
    if (options.knots > 0 && 3 * positions.extent(1) / options.knots > most_coefficients)
        throw ValueError("knots", "at least " + std::to_string(3 * positions.extent(1) / most_coefficients + 1) + " pulses",
                         std::to_string(options.knots));
}

}  // namespace

const char* status_text(TrajectoryStatus status) {
    switch (status) {
        case TrajectoryStatus::converged:
            return "converged";
        case TrajectoryStatus::max_iterations:
            return "max_iterations";
        case TrajectoryStatus::not_improved:
            return "not_improved";
    }
    return "unknown";
}

void TrajectoryOptions::validate() const {
    if (knots < 0) throw ValueError("knots", "a number of pulses, or 0 for a free displacement", std::to_string(knots));
    for (const double x : up) require_finite_value(x, "up");
    if (!(norm(up) > 0.0)) throw ValueError("up", "a direction", "zero");
    if (!(search >= 0.0) || !std::isfinite(search)) throw ValueError("search", "a length >= 0 m", number_text(search));
    if (rounds < 1) throw ValueError("rounds", "at least 1", std::to_string(rounds));
    if (iterations < 1) throw ValueError("iterations", "at least 1", std::to_string(iterations));
    require_positive(tolerance, "tolerance");
    (void)resolve_threads(execution.threads);
}

Trajectory estimate_trajectory(const RangeProfiles& profiles, const ArrayView<const double, 3>& positions,
                               const std::vector<ImageGrid>& regions, const TrajectoryOptions& options,
                               const ArrayView<const double, 2>& initial) {
    require_arguments(profiles, positions, regions, options, initial);
    return Estimator(profiles, positions, regions, options, initial).run();
}

Trajectory estimate_trajectory(const RangeProfiles& profiles, const ArrayView<const double, 2>& positions,
                               const std::vector<ImageGrid>& regions, const TrajectoryOptions& options,
                               const ArrayView<const double, 2>& initial) {
    const ArrayView<const double, 3> one(positions.data(), {1, positions.extent(0), positions.extent(1)},
                                         {0, positions.strides()[0], positions.strides()[1]});
    return estimate_trajectory(profiles, one, regions, options, initial);
}

std::vector<double> sharpest_phase(const RangeProfiles& profiles, const ArrayView<const double, 2>& positions, const ImageGrid& region,
                                   const SharpestPhaseOptions& options) {
    if (options.iterations < 1) throw ValueError("iterations", "at least 1", std::to_string(options.iterations));
    require_positive(options.tolerance, "tolerance");
    profiles.validate(options.execution.threads);
    const geometry::PhaseCentres centres(positions);
    centres.validate(profiles.data.extent(0));
    const std::ptrdiff_t n_pulse = profiles.data.extent(0);
    const auto shape = region.shape();
    require_memory(static_cast<std::uint64_t>(region.size() * n_pulse) * sizeof(cfloat), "sharpest_phase");
    Array<double, 2> xyz({region.size(), 3});
    for (std::ptrdiff_t i = 0; i < shape[0]; ++i) region.row_positions(i, xyz.data() + 3 * i * shape[1]);
    Array<cfloat, 2> terms({region.size(), n_pulse});
    focus::BackprojectOptions how;
    how.execution = options.execution;
    focus::backproject_histories(profiles, centres, ArrayView<const double, 2>(xyz.view()), terms.view(), how);
    std::vector<double> phase(static_cast<std::size_t>(n_pulse));
    double before = 0.0;
    for (int round = 0; round < options.iterations; ++round) {
        std::vector<cdouble> turn(phase.size());
        for (std::size_t k = 0; k < phase.size(); ++k) turn[k] = std::polar(1.0, -phase[k]);
        std::vector<cdouble> slope(phase.size());
        double sharpness = 0.0;
        for (std::ptrdiff_t p = 0; p < region.size(); ++p) {
            cdouble pixel{};
            for (std::ptrdiff_t k = 0; k < n_pulse; ++k) pixel += cdouble(terms(p, k)) * turn[static_cast<std::size_t>(k)];
            sharpness += std::norm(pixel) * std::norm(pixel);
            const cdouble weight = std::norm(pixel) * std::conj(pixel);
            for (std::ptrdiff_t k = 0; k < n_pulse; ++k) slope[static_cast<std::size_t>(k)] += weight * cdouble(terms(p, k));
        }
        if (!(sharpness - before > options.tolerance * sharpness)) break;
        before = sharpness;
        for (std::size_t k = 0; k < phase.size(); ++k) phase[k] = std::arg(slope[k]);
    }
    return phase;
}

}  // namespace sarfocus::autofocus
