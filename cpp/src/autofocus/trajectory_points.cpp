#include "trajectory_points.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstdio>
#include <limits>
#include <numbers>
#include <string>
#include <utility>

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>

#include <sarfocus/core/checks.hpp>
#include <sarfocus/core/error.hpp>
#include <sarfocus/geometry/phase_centres.hpp>

#include "stopwatch.hpp"
#include "trajectory_estimator.hpp"

namespace sarfocus::autofocus::detail {
namespace {

using geometry::ImageGrid;

constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();
constexpr double worst_condition = 1e3;

cdouble turn(double phase) {
    return {std::cos(phase), std::sin(phase)};
}

// Where a parabola through three neighbours has its top, -0.5 to 0.5.
double top(double before, double here, double behind) {
    const double bend = before - 2.0 * here + behind;
    return bend < 0.0 ? std::clamp(0.5 * (before - behind) / bend, -0.5, 0.5) : 0.0;
}

// The place of the greatest of the powers of a region's pixels, row by row, between pixels where the grid has them.
Vector3 peak_of(const ImageGrid& region, const double* power) {
    const auto rows = region.shape()[0];
    const auto columns = region.shape()[1];
    const std::ptrdiff_t best = std::max_element(power, power + region.size()) - power;
    const std::ptrdiff_t i = best / columns;
    const std::ptrdiff_t j = best % columns;
    double down = 0.0;
    double right = 0.0;
    if (region.kind() != ImageGrid::Kind::points) {
        if (i > 0 && i + 1 < rows) down = top(power[best - columns], power[best], power[best + columns]);
        if (j > 0 && j + 1 < columns) right = top(power[best - 1], power[best], power[best + 1]);
    }
    return region.position(static_cast<double>(i) + down, static_cast<double>(j) + right);
}

}  // namespace

PointTrajectory::PointTrajectory(const TrajectoryEchoes& echoes, const std::vector<ImageGrid>& regions, const TrajectoryOptions& options,
                                 const ArrayView<const double, 2>& initial)
    : echoes_(echoes),
      regions_(regions),
      options_(options),
      n_channel_(static_cast<std::size_t>(echoes.positions.extent(0))),
      n_pulse_(static_cast<std::size_t>(echoes.positions.extent(1))),
      axes_(motion_axes(echoes.positions, options)),
      initial_(n_pulse_, Vector3{}),
      wavenumber_(4.0 * std::numbers::pi / echoes.channels.front().wavelength),
      motion_(n_pulse_, Vector3{}) {
    for (std::size_t k = 0; k < n_pulse_ && !initial.empty(); ++k)
        for (std::size_t a = 0; a < 3; ++a) initial_[k][a] = initial(static_cast<std::ptrdiff_t>(k), static_cast<std::ptrdiff_t>(a));
    for (const ImageGrid& region : regions)
        middles_.push_back(
            region.position(0.5 * static_cast<double>(region.shape()[0] - 1), 0.5 * static_cast<double>(region.shape()[1] - 1)));
}

Trajectory PointTrajectory::run() {
    constexpr double coarse = 1e-7;
    detail::Stopwatch watch(result_.timings);
    bool converged = false;
    const std::vector<bool> all(regions_.size(), true);
    for (result_.rounds = 1; result_.rounds <= options_.rounds; ++result_.rounds) {
        const bool first = result_.rounds == 1;
        const bool last = result_.rounds == options_.rounds;
        find_peaks(all);
        watch.lap("pixels");
        collect_terms();
        if (first && result_.reason.empty()) observability();
        watch.lap("histories");
        if (!result_.reason.empty()) return finish();
        const Displacements still(n_pulse_, Vector3{});
        if (first) {
            result_.points.resize(regions_.size());
            const std::vector<cdouble> before = sums(still);
            for (std::size_t m = 0; m < before.size(); ++m) result_.points[m].coherence_before = std::norm(before[m]);
            for (const bool half : {false, true}) halves_.push_back(alternate(still, half_of(half), coarse, true, nullptr));
        }
        const Displacements found = alternate(still, std::vector<bool>(regions_.size(), true), last ? options_.tolerance : coarse, first,
                                              &result_.objective, &converged);
        for (std::size_t k = 0; k < n_pulse_; ++k) motion_[k] = motion_[k] + found[k];
        for (std::size_t k = 0; k < n_pulse_; ++k)
            for (Term& term : terms_[k]) term.value *= turn(dot(term.rate, found[k]));
        watch.lap("alternation");
    }
    --result_.rounds;
    deviation();
    const Displacements found = motion_;
    hold_out();
    motion_ = found;
    judge(converged);
    watch.lap("judgement");
    return finish();
}

Vector3 PointTrajectory::place(std::size_t pulse, std::size_t channel) const {
    Vector3 out = initial_[pulse];
    for (std::size_t a = 0; a < 3; ++a)
        out[a] +=
            echoes_.positions(static_cast<std::ptrdiff_t>(channel), static_cast<std::ptrdiff_t>(pulse), static_cast<std::ptrdiff_t>(a));
    for (std::size_t a = 0; a < axes_.size(); ++a) out = out + motion_[pulse][a] * axes_[a];
    return out;
}

// take(pulse, point, term) for all terms of all channels from pulses that see the middle of the point's region.
template <class Take>
void PointTrajectory::gather(const std::vector<Vector3>& points, const std::vector<std::size_t>& region, const char* phase,
                             const Take& take) const {
    constexpr std::size_t most_pulses = 64;
    constexpr std::size_t most_terms = std::size_t{1} << 23U;
    const std::size_t batch = std::clamp<std::size_t>(most_terms / points.size(), 1, most_pulses);
    const std::size_t batches = (n_pulse_ + batch - 1) / batch;
    focus::BackprojectOptions how;
    how.execution.threads = options_.execution.threads;
    Monitor monitor(options_.execution, phase, static_cast<std::int64_t>(batches * n_channel_));
    for (std::size_t job = 0; job < batches * n_channel_ && !monitor.stopped(); ++job) {
        const std::size_t n = job % n_channel_;
        const std::size_t begin = job / n_channel_ * batch;
        const std::size_t count = std::min(batch, n_pulse_ - begin);
        Vector3 half{};
        for (std::size_t a = 0; a < 3 && !echoes_.baselines.empty(); ++a)
            half[a] = 0.5 * echoes_.baselines(static_cast<std::ptrdiff_t>(n), static_cast<std::ptrdiff_t>(a));
        const bool apart = norm(half) > 0.0;
        Array<double, 2> transmit({static_cast<std::ptrdiff_t>(count), 3});
        Array<double, 2> receive({apart ? static_cast<std::ptrdiff_t>(count) : 0, 3});
        std::vector<char> seen(count * regions_.size());
        std::vector<char> any(regions_.size());
        for (std::size_t k = 0; k < count; ++k) {
            const Vector3 at = place(begin + k, n);
            for (std::size_t a = 0; a < 3; ++a) {
                transmit.data()[3 * k + a] = at[a] - half[a];
                if (apart) receive.data()[3 * k + a] = at[a] + half[a];
            }
            for (std::size_t r = 0; r < regions_.size(); ++r)
                if (options_.aspect.sees(at, middles_[r])) seen[k * regions_.size() + r] = any[r] = 1;
        }
        std::vector<std::size_t> chosen;
        for (std::size_t c = 0; c < points.size(); ++c)
            if (any[region[c]] != 0) chosen.push_back(c);
        if (!chosen.empty()) {
            Array<double, 2> xyz({static_cast<std::ptrdiff_t>(chosen.size()), 3});
            for (std::size_t c = 0; c < chosen.size(); ++c)
                std::copy(points[chosen[c]].begin(), points[chosen[c]].end(), xyz.data() + 3 * c);
            focus::RangeProfiles profiles = echoes_.channels[n];
            const auto first = static_cast<std::ptrdiff_t>(begin);
            const auto pulses = static_cast<std::ptrdiff_t>(count);
            profiles.data = profiles.data.slice(0, first, pulses);
            if (profiles.range_start.extent(0) > 1) profiles.range_start = profiles.range_start.slice(0, first, pulses);
            Array<cfloat, 2> terms({xyz.extent(0), pulses});
            focus::backproject_histories(profiles,
                                         apart ? geometry::PhaseCentres(transmit.view(), receive.view())
                                               : geometry::PhaseCentres(ArrayView<const double, 2>(transmit.view())),
                                         ArrayView<const double, 2>(xyz.view()), terms.view(), how);
            for (std::size_t c = 0; c < chosen.size(); ++c)
                for (std::size_t k = 0; k < count; ++k)
                    if (seen[k * regions_.size() + region[chosen[c]]] != 0)
                        take(begin + k, chosen[c], cdouble(terms(static_cast<std::ptrdiff_t>(c), static_cast<std::ptrdiff_t>(k))));
        }
        monitor.advance();
    }
    monitor.finish();
}

// Of the wanted regions, under the motion.
void PointTrajectory::find_peaks(const std::vector<bool>& wanted) {
    std::vector<Vector3> pixels;
    std::vector<std::size_t> region;
    for (std::size_t r = 0; r < regions_.size(); ++r)
        for (std::ptrdiff_t i = 0; wanted[r] && i < regions_[r].shape()[0]; ++i)
            for (std::ptrdiff_t j = 0; j < regions_[r].shape()[1]; ++j) {
                pixels.push_back(regions_[r].position(static_cast<double>(i), static_cast<double>(j)));
                region.push_back(r);
            }
    std::vector<cdouble> sum(pixels.size());
    gather(pixels, region, "pixels", [&](std::size_t, std::size_t pixel, cdouble term) { sum[pixel] += term; });
    std::vector<double> power(sum.size());
    std::transform(sum.begin(), sum.end(), power.begin(), [](cdouble s) { return std::norm(s); });
    peaks_.resize(regions_.size());
    const double* first = power.data();
    for (std::size_t r = 0; r < regions_.size(); ++r) {
        if (!wanted[r]) continue;
        peaks_[r] = peak_of(regions_[r], first);
        first += regions_[r].size();
    }
}

void PointTrajectory::collect_terms() {
    const std::size_t n = peaks_.size();
    std::vector<std::size_t> region(n);
    for (std::size_t m = 0; m < n; ++m) region[m] = m;
    require_memory(n_pulse_ * n * (sizeof(cdouble) + sizeof(Term)), "histories of the strong points");
    std::vector<cdouble> value(n_pulse_ * n);
    std::vector<double> energy(n);
    std::vector<double> count(n);
    std::vector<double> pulses(n);
    gather(peaks_, region, "histories", [&](std::size_t k, std::size_t m, cdouble term) {
        value[k * n + m] += term;
        energy[m] += std::norm(term);
        count[m] += 1.0;
    });
    std::vector<double> total(n);  // number of pulses times energy
    for (std::size_t k = 0; k < n_pulse_; ++k)
        for (std::size_t m = 0; m < n; ++m) {
            total[m] += std::norm(value[k * n + m]);
            pulses[m] += std::norm(value[k * n + m]) > 0.0 ? 1.0 : 0.0;
        }
    for (std::size_t m = 0; m < n; ++m) total[m] *= pulses[m];
    power_.assign(n, 0.0);
    for (std::size_t m = 0; m < n; ++m) {
        if (total[m] > 0.0) {
            power_[m] = energy[m] / count[m];
        } else if (result_.reason.empty()) {
            result_.empty_region = static_cast<int>(m);
            result_.reason = "region " + std::to_string(m) + " holds no echo";
        }
    }
    chance_.assign(n, 0.0);
    terms_.assign(n_pulse_, {});
    for (std::size_t k = 0; k < n_pulse_; ++k) {
        const Vector3 at = place(k, n_channel_ / 2);
        for (std::size_t m = 0; m < n; ++m) {
            if (!(std::abs(value[k * n + m]) > 0.0)) continue;
            Term term{m, value[k * n + m] / std::sqrt(total[m]), {}};
            const Vector3 sight = at - peaks_[m];
            for (std::size_t a = 0; a < axes_.size(); ++a) term.rate[a] = wavenumber_ * dot(sight, axes_[a]) / norm(sight);
            terms_[k].push_back(term);
            chance_[m] += std::norm(term.value);
        }
    }
}

// As of a few regions: the height needs regions at different ranges, a plane regions in different directions.
void PointTrajectory::observability() {
    const std::size_t n = axes_.size();
    if (regions_.size() < n + 1) {
        result_.determined = false;
        result_.reason = "expected at least " + std::to_string(n + 1) + " regions for " + std::to_string(n) +
                         " free unknown(s) of a pulse, got " + std::to_string(regions_.size());
        return;
    }
    const auto size = static_cast<Eigen::Index>(n);
    Eigen::MatrixXd gram = Eigen::MatrixXd::Zero(size, size);
    std::vector<double> mean(regions_.size());
    std::vector<double> count(regions_.size());
    double steepest = 0.0;
    for (const std::vector<Term>& pulse : terms_)
        for (const Term& term : pulse) {
            Eigen::VectorXd rate(size);
            for (std::size_t a = 0; a < n; ++a) rate(static_cast<Eigen::Index>(a)) = term.rate[a] / wavenumber_;
            gram += rate * rate.transpose();
            steepest = std::max(steepest, rate.norm());
            mean[term.point] += rate(0);
            count[term.point] += 1.0;
        }
    for (std::size_t m = 0; m < mean.size(); ++m) mean[m] /= std::max(count[m], 1.0);
    search_ = options_.search > 0.0 ? options_.search : std::numbers::pi / wavenumber_ / std::max(steepest, 1e-3);
    if (n == 1) {
        const auto [least, most] = std::minmax_element(mean.begin(), mean.end());
        result_.condition =
            *most > *least ? std::max(std::abs(*most), std::abs(*least)) / (*most - *least) : std::numeric_limits<double>::infinity();
    } else {
        const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(gram);
        const double small = solver.eigenvalues()(0);
        result_.condition = small > 0.0 ? std::sqrt(solver.eigenvalues()(size - 1) / small) : std::numeric_limits<double>::infinity();
    }
    result_.determined = result_.condition < worst_condition;
    if (!result_.determined)
        result_.reason =
            "the regions see the displacement under one angle: it can't be told from a phase of the pulse; choose regions at "
            "different ranges";
}

std::vector<cdouble> PointTrajectory::sums(const Displacements& d) const {
    std::vector<cdouble> out(regions_.size());
    for (std::size_t k = 0; k < n_pulse_; ++k)
        for (const Term& term : terms_[k]) out[term.point] += term.value * turn(dot(term.rate, d[k]));
    return out;
}

// Raises Re sum conj(B_m) b_km exp(j rate d) of one pulse; `scan`: over the search about the centre first.
void PointTrajectory::climb(const std::vector<Term>& terms, const std::vector<cdouble>& sums, const Vector3& centre, bool scan,
                            Vector3& d) const {
    constexpr int newton_steps = 6;
    constexpr int halvings = 8;
    constexpr double steps_of_turn = 12.0;
    std::vector<Term> weighted;
    for (const Term& term : terms)
        if (std::norm(sums[term.point]) > 0.0) weighted.push_back({term.point, std::conj(sums[term.point]) * term.value, term.rate});
    const auto level = [&](const Vector3& at) {
        double out = 0.0;
        for (const Term& term : weighted) {
            const double phase = dot(term.rate, at);
            out += term.value.real() * std::cos(phase) - term.value.imag() * std::sin(phase);
        }
        return out;
    };
    double best = level(d);
    const auto reach = static_cast<int>(std::ceil(search_ * wavenumber_ / (2.0 * std::numbers::pi) * steps_of_turn));
    for (std::size_t a = 0; a < axes_.size() && scan; ++a) {
        Vector3 trial = d;
        for (int s = -reach; s <= reach; ++s) {
            trial[a] = centre[a] + search_ * s / reach;
            const double now = level(trial);
            if (!(now > best)) continue;
            best = now;
            d[a] = trial[a];
        }
    }
    const auto size = static_cast<Eigen::Index>(axes_.size());
    for (int step = 0; step < newton_steps; ++step) {
        Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
        Eigen::Matrix3d curvature = Eigen::Matrix3d::Zero();
        Eigen::Matrix3d bound = Eigen::Matrix3d::Zero();
        for (const Term& term : weighted) {
            const Eigen::Vector3d rate(term.rate[0], term.rate[1], term.rate[2]);
            const cdouble value = term.value * turn(dot(term.rate, d));
            gradient -= value.imag() * rate;
            curvature += value.real() * rate * rate.transpose();
            bound += std::abs(value) * rate * rate.transpose();
        }
        const double ridge = 1e-9 * bound.trace();
        if (!(ridge > 0.0)) return;
        Eigen::MatrixXd matrix = curvature.topLeftCorner(size, size);
        Eigen::LLT<Eigen::MatrixXd> solver(matrix);
        if (solver.info() != Eigen::Success || matrix.diagonal().minCoeff() < ridge) {
            matrix = bound.topLeftCorner(size, size);
            matrix.diagonal().array() += ridge;
            solver.compute(matrix);
        }
        Eigen::VectorXd move = solver.solve(gradient.head(size));
        bool moved = false;
        for (int h = 0; h < halvings && !moved; ++h, move *= 0.5) {
            Vector3 trial = d;
            for (std::size_t a = 0; a < axes_.size(); ++a) trial[a] += move(static_cast<Eigen::Index>(a));
            const double now = level(trial);
            if (!(now > best)) continue;
            best = now;
            d = trial;
            moved = true;
        }
        if (!moved || move.norm() * wavenumber_ < 1e-4) return;
    }
}

// The sums of the points taken, each over the share of its energy that is clutter, others zero; and the likelihood, -sum log(1 -
// coherence), whose slope they are.
std::pair<std::vector<cdouble>, double> PointTrajectory::objective(const Displacements& d, const std::vector<bool>& taken) const {
    constexpr double least_clutter = 1e-3;
    std::pair<std::vector<cdouble>, double> out{sums(d), 0.0};
    for (std::size_t m = 0; m < taken.size(); ++m) {
        const double clutter = std::max(1.0 - std::norm(out.first[m]), 0.0) + least_clutter;
        out.first[m] *= taken[m] ? 1.0 / clutter : 0.0;
        out.second -= taken[m] ? std::log(clutter / (1.0 + least_clutter)) : 0.0;
    }
    return out;
}

PointTrajectory::Displacements PointTrajectory::climbed(Displacements d, const std::vector<cdouble>& sums, bool scan) const {
    parallel_for(options_.execution, "alternation", static_cast<std::int64_t>(n_pulse_), [&](std::int64_t job) {
        const auto k = static_cast<std::size_t>(job);
        climb(terms_[k], sums, -1.0 * motion_[k], scan, d[k]);
    });
    return d;
}

// In turn the sums of the points taken and every pulse's displacement. Displacements that change slowly from pulse to pulse converge
// slowly: two steps are continued as far as their difference tells [Varadhan2008], where the likelihood does not become less by
// it.
PointTrajectory::Displacements PointTrajectory::alternate(Displacements d, const std::vector<bool>& taken, double tolerance, bool scan,
                                                          std::vector<double>* steps, bool* converged) const {
    constexpr int scans = 3;
    if (steps != nullptr) steps->clear();
    if (converged != nullptr) *converged = false;
    auto [own, reached] = objective(d, taken);
    for (int i = 0; i < options_.iterations; ++i) {
        if (steps != nullptr) steps->push_back(reached);
        const Displacements one = climbed(d, own, scan && i < scans);
        const Displacements two = climbed(one, objective(one, taken).first, scan && i < scans);
        auto [then, now] = objective(two, taken);
        double first = 0.0;
        double bend = 0.0;
        for (std::size_t k = 0; k < n_pulse_; ++k) {
            const Vector3 r = one[k] - d[k];
            const Vector3 v = two[k] - one[k] - r;
            first += dot(r, r);
            bend += dot(v, v);
        }
        const double stretch = bend > 0.0 ? std::sqrt(first / bend) : 1.0;
        Displacements far = two;
        for (std::size_t k = 0; k < n_pulse_ && stretch > 1.0; ++k) {
            const Vector3 r = one[k] - d[k];
            far[k] = d[k] + 2.0 * stretch * r + stretch * stretch * (two[k] - one[k] - r);
        }
        d = two;
        if (stretch > 1.0) {
            auto [there, more] = objective(far, taken);
            if (more > now) {
                d = std::move(far);
                then = std::move(there);
                now = more;
            }
        }
        const double gain = now - reached;
        own = std::move(then);
        reached = now;
        if (gain <= tolerance * now) {
            if (converged != nullptr) *converged = true;
            break;
        }
    }
    if (steps != nullptr) steps->push_back(reached);
    return d;
}

std::vector<bool> PointTrajectory::half_of(bool second) const {
    std::vector<bool> out(regions_.size());
    for (std::size_t m = second ? 1 : 0; m < out.size(); m += 2) out[m] = true;
    return out;
}

// What every half of the points says under the motion that the other half gave by itself, each at its brightest pixel then. Motion,
// peaks and terms are those of the last half afterwards.
void PointTrajectory::hold_out() {
    const std::vector<cdouble> all = sums(Displacements(n_pulse_, Vector3{}));
    for (std::size_t m = 0; m < all.size(); ++m) {
        TrajectoryPoint& p = result_.points[m];
        p.position = peaks_[m];
        p.power = power_[m];
        p.coherence = std::norm(all[m]);
        p.held_out_before = p.coherence_before;
        const double trials = std::log(static_cast<double>(regions_[m].size())) + std::numbers::egamma;  // the brightest of so many
        result_.coherence_by_chance += trials * chance_[m] / static_cast<double>(all.size());
    }
    for (const bool half : {false, true}) {
        const std::vector<bool> others = half_of(!half);
        motion_ = halves_[half ? 1 : 0];
        find_peaks(others);
        collect_terms();
        const std::vector<cdouble> other = sums(Displacements(n_pulse_, Vector3{}));
        std::vector<double> weight(regions_.size());
        std::vector<double> square(regions_.size());
        for (const std::vector<Term>& pulse : terms_)
            for (const Term& term : pulse) {
                const double angle = std::arg(std::conj(other[term.point]) * term.value);
                weight[term.point] += std::abs(term.value);
                square[term.point] += std::abs(term.value) * angle * angle;
            }
        for (std::size_t m = 0; m < others.size(); ++m) {
            if (!others[m]) continue;
            result_.points[m].held_out = std::norm(other[m]);
            result_.points[m].spread = std::sqrt(square[m] / weight[m]) / wavenumber_;
        }
    }
}

void PointTrajectory::judge(bool converged) {
    constexpr double sigmas = 5.0;   // of random phases
    constexpr double certain = 3.0;  // of the gain, over which points differ in earnest
    const auto n = static_cast<double>(regions_.size());
    double held = 0.0;
    double gain = 0.0;
    double scatter = 0.0;
    for (std::size_t m = 0; m < regions_.size(); ++m) {
        const TrajectoryPoint& p = result_.points[m];
        result_.coherence_before += p.coherence_before / n;
        result_.coherence += p.coherence / n;
        held += p.held_out / n;
        gain += (p.held_out - p.held_out_before) / n;
    }
    for (const TrajectoryPoint& p : result_.points) scatter += std::pow((p.held_out - p.held_out_before - gain) / n, 2.0);
    result_.chance_std =
        result_.coherence_by_chance / std::sqrt(n);  // of a point's coherence, which is exponentially distributed, the mean
    const double bar = result_.coherence_by_chance + sigmas * result_.chance_std;
    char text[240];
    bool improved = false;
    if (!(held > bar)) {
        std::snprintf(text, sizeof text, "held-out coherence %.5f of the points is no more than random phases reach (%.5f)", held, bar);
    } else if (!(gain > certain * std::sqrt(scatter))) {
        std::snprintf(text, sizeof text, "held-out coherence changed by %+.5f, which may be chance", gain);
    } else {
        improved = true;
        std::snprintf(text, sizeof text, "coherence rose from %.5f to %.5f; of points held out to %.5f, random phases reach %.5f",
                      result_.coherence_before, result_.coherence, held, bar);
    }
    result_.reason = text;
    if (improved || !options_.do_no_harm) result_.status = converged ? TrajectoryStatus::converged : TrajectoryStatus::max_iterations;
}

// From the scatter of the slopes of a pulse's terms and the curvature of their sum.
void PointTrajectory::deviation() {
    const std::vector<cdouble> all = objective(Displacements(n_pulse_, Vector3{}), std::vector<bool>(regions_.size(), true)).first;
    const auto size = static_cast<Eigen::Index>(axes_.size());
    std_.assign(n_pulse_, Vector3{not_a_number, not_a_number, not_a_number});
    for (std::size_t k = 0; k < n_pulse_; ++k) {
        Eigen::Matrix3d curvature = Eigen::Matrix3d::Zero();
        Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
        for (const Term& term : terms_[k]) {
            const Eigen::Vector3d rate(term.rate[0], term.rate[1], term.rate[2]);
            const cdouble value = std::conj(all[term.point]) * term.value;
            curvature += value.real() * rate * rate.transpose();
            scatter += value.imag() * value.imag() * rate * rate.transpose();
        }
        const Eigen::FullPivLU<Eigen::MatrixXd> solver(Eigen::MatrixXd(curvature.topLeftCorner(size, size)));
        if (!solver.isInvertible()) continue;
        const Eigen::MatrixXd inverse = solver.inverse();
        const Eigen::MatrixXd covariance = inverse * scatter.topLeftCorner(size, size) * inverse.transpose();
        for (Eigen::Index a = 0; a < size; ++a) std_[k][static_cast<std::size_t>(a)] = std::sqrt(std::max(covariance(a, a), 0.0));
    }
}

Trajectory PointTrajectory::finish() {
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
                value += motion_[k][a] * axes_[a][x];
                const double part = std_.empty() ? not_a_number : std_[k][a] * axes_[a][x];
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
