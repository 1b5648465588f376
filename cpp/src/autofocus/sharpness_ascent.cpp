#include "sharpness_ascent.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <Eigen/Dense>

#include <sarfocus/autofocus/phase_estimate.hpp>
#include <sarfocus/core/constants.hpp>

#include "sharpness_weights.hpp"

namespace sarfocus::autofocus::detail {
namespace {

using Phase = std::vector<double>;

struct BlockSums {
    double weighted = 0.0;      // sum of J w
    std::vector<cdouble> pull;  // [n_azimuth]
};

double dot(const Phase& a, const Phase& b) {
    double sum = 0.0;
    for (std::size_t k = 0; k < a.size(); ++k) sum += a[k] * b[k];
    return sum;
}

double rms(const Phase& a) {
    return std::sqrt(dot(a, a) / static_cast<double>(a.size()));
}

Phase plus(const Phase& a, double step, const Phase& b) {
    Phase out(a.size());
    for (std::size_t k = 0; k < a.size(); ++k) out[k] = a[k] + step * b[k];
    return out;
}

// Legendre polynomial of the pulses, -1 to 1 over the aperture.
Phase legendre(std::ptrdiff_t n, int order) {
    Phase out;
    for (std::ptrdiff_t k = 0; k < n; ++k)
        out.push_back(std::legendre(static_cast<unsigned>(order), (2.0 * static_cast<double>(k) + 1.0) / static_cast<double>(n) - 1.0));
    return out;
}

// Directions that raise the measure: of smooth phases only, or of every pulse by itself.
class Directions {
public:
    // cosines 1 to `order`; 0: free.
    Directions(std::ptrdiff_t n, int order) : basis_(n, order) {
        for (int m = 0; m < order; ++m)
            for (std::ptrdiff_t k = 0; k < n; ++k)
                basis_(k, m) = std::cos(pi * (m + 1) * (static_cast<double>(k) + 0.5) / static_cast<double>(n));
    }

    // Free: the fixed-point step itself. Smooth: its least-squares fit, pulses weighted by how strongly they are pulled.
    [[nodiscard]] Phase of(const Sharpness& now) const {
        const auto n = static_cast<Eigen::Index>(now.pull.size());
        Phase out(now.pull.size());
        if (basis_.cols() == 0) {
            for (std::size_t k = 0; k < out.size(); ++k) out[k] = now.pull[k] != cdouble{} ? std::arg(now.pull[k]) : 0.0;
            return out;
        }
        Eigen::VectorXd gradient(n);
        Eigen::VectorXd weight(n);
        for (Eigen::Index k = 0; k < n; ++k) {
            gradient(k) = now.pull[static_cast<std::size_t>(k)].imag();
            weight(k) = std::abs(now.pull[static_cast<std::size_t>(k)]);
        }
        Eigen::MatrixXd normal = basis_.transpose() * weight.asDiagonal() * basis_;
        normal.diagonal().array() += 1e-6 * normal.trace() / static_cast<double>(basis_.cols());
        const Eigen::VectorXd fit = basis_ * normal.ldlt().solve(basis_.transpose() * gradient);
        for (Eigen::Index k = 0; k < n; ++k) out[static_cast<std::size_t>(k)] = fit(k);
        return out;
    }

private:
    Eigen::MatrixXd basis_;
};

Phase gradient_of(const Sharpness& now) {
    Phase out;
    for (const cdouble& p : now.pull) out.push_back(now.slope_scale * p.imag());
    return out;
}

class Climb {
public:
    Climb(const PulseSet& pulses, Measure measure, const SharpnessOptions& options)
        : pulses_(pulses), measure_(measure), options_(options) {}

    [[nodiscard]] Sharpness look(const Phase& phase, bool with_pull) const {
        return sharpness_of(pulses_, phase, measure_, with_pull, options_.execution);
    }

    // Conjugate directions, each of which starts from the step of the majorisation; every step's length by a parabola, halved until the
    // measure rises.
    bool rise(Phase& phase, const Directions& directions, int rounds, Round& told) const {
        Sharpness now = look(phase, true);
        const Phase start = phase;
        Phase gradient;
        Phase fixed;
        Phase way;
        double step = 1.0;
        int small = 0;
        for (int round = 0; round < rounds && small < 2; ++round) {
            const Phase fresh_gradient = gradient_of(now);
            const Phase fresh = directions.of(now);
            double keep = 0.0;
            if (!way.empty()) {
                const double before = dot(gradient, fixed);
                keep = before > 0.0 ? std::max((dot(fresh_gradient, fresh) - dot(gradient, fresh)) / before, 0.0) : 0.0;
            }
            Phase next = keep > 0.0 ? plus(fresh, keep, way) : fresh;
            double slope = dot(fresh_gradient, next);
            if (!(slope > 0.0)) {
                next = fresh;
                slope = dot(fresh_gradient, next);
            }
            if (!(slope > 0.0)) return true;
            gradient = fresh_gradient;
            fixed = fresh;
            way = std::move(next);
            const double gain = advance(phase, now, way, slope, step);
            ++told.iterations;
            small = gain < options_.tolerance ? small + 1 : 0;
            if (gain <= 0.0) {
                if (keep == 0.0) break;
                way.clear();
            }
        }
        told.update_rms = rms(plus(phase, -1.0, start));
        return small > 0;
    }

private:
    // Returns what was gained, 0 where no step raises the measure.
    double advance(Phase& phase, Sharpness& now, const Phase& way, double slope, double& step) const {
        constexpr int halvings = 8;
        constexpr double longest = 2.0;  // rad that any pulse may turn at once
        double most = 0.0;
        for (const double w : way) most = std::max(most, std::abs(w));
        step = std::min(step, longest / std::max(most, 1e-12));
        for (int trial = 0; trial < halvings; ++trial) {
            const Phase there = plus(phase, step, way);
            Sharpness found = look(there, true);
            const double gain = found.value - now.value;
            // gain(s) = slope s - bend s^2: its top is the next step to try, not far from this one.
            const double bend = (slope * step - gain) / (step * step);
            const double top = bend > 0.0 ? 0.5 * slope / bend : 2.0 * step;
            if (gain > 0.0) {
                phase = there;
                now = std::move(found);
                step = std::clamp(top, 0.5 * step, 2.0 * step);
                return gain;
            }
            step *= std::clamp(top / step, 0.1, 0.5);
        }
        step = 1.0;
        return 0.0;
    }

    const PulseSet& pulses_;
    Measure measure_;
    const SharpnessOptions& options_;
};

// Coefficient of one polynomial with which the image is sharpest: a grid, then ever smaller steps about its best.
double search_coefficient(const Climb& climb, Phase& phase, const Phase& shape, double reach, double& value) {
    constexpr double grid = 1.5;  // rad: well inside the main peak of the sharpness
    const auto steps = static_cast<int>(std::ceil(reach / grid));
    double best = 0.0;
    const auto attempt = [&](double coefficient) {
        const double there = climb.look(plus(phase, coefficient, shape), false).value;
        if (there > value) {
            value = there;
            best = coefficient;
        }
    };
    for (int k = -steps; k <= steps; ++k)
        if (k != 0) attempt(reach * k / steps);
    for (double step = 0.5 * reach / steps; step > 0.05; step *= 0.5) {
        const double centre = best;
        attempt(centre - step);
        attempt(centre + step);
    }
    phase = plus(phase, best, shape);
    return best;
}

}  // namespace

Sharpness sharpness_of(const PulseSet& pulses, const std::vector<double>& phase, Measure measure, bool with_pull,
                       const Execution& execution) {
    constexpr std::ptrdiff_t block = 8;  // gates: one line each in the cache, sums of a block of its own
    const std::ptrdiff_t n = pulses.n_azimuth();
    const double mean = pulses.energy() / (static_cast<double>(n) * static_cast<double>(pulses.n_gate()));
    const auto scale = static_cast<float>(1.0 / mean);
    const auto weigh = measure == Measure::contrast ? weigh_by_intensity : weigh_by_logarithm;
    const std::vector<cfloat> factors = pulses.factors(phase);
    std::vector<BlockSums> sums(static_cast<std::size_t>((pulses.n_gate() + block - 1) / block));
    parallel_for(execution, "sharpness", static_cast<std::int64_t>(sums.size()), [&](std::int64_t b) {
        BlockSums& own = sums[static_cast<std::size_t>(b)];
        if (with_pull) own.pull.resize(static_cast<std::size_t>(n));
        Array<cfloat, 1> line({n});
        for (std::ptrdiff_t g = b * block; g < std::min((b + 1) * block, pulses.n_gate()); ++g) {
            pulses.form_line(g, factors, line.data());
            own.weighted += weigh(line.data(), n, scale, with_pull);
            if (!with_pull) continue;
            pulses.to_pulses(g, line.data());
            add_products(pulses.pulses(g), line.data(), n, own.pull.data());
        }
    });
    double weighted = 0.0;
    for (const BlockSums& s : sums) weighted += s.weighted;
    const double samples = pulses.energy() / mean;
    Sharpness out;
    // With J = I / mean: the entropy is ln(samples) - sum(J ln J) / samples; the log sharpness ln(sum J^2) - 2 ln(samples).
    out.value = measure == Measure::contrast ? std::log(weighted) - 2.0 * std::log(samples) : weighted / samples - std::log(samples);
    out.slope_scale = (measure == Measure::contrast ? 4.0 / weighted : 2.0 / samples) / mean;
    if (!with_pull) return out;
    out.pull.resize(static_cast<std::size_t>(pulses.n_pulse()));
    for (std::ptrdiff_t p = 0; p < pulses.n_pulse(); ++p) {
        cdouble sum;
        for (const BlockSums& s : sums) sum += s.pull[static_cast<std::size_t>(pulses.place(p))];
        out.pull[static_cast<std::size_t>(p)] = sum * std::polar(1.0, -phase[static_cast<std::size_t>(p)]);
    }
    return out;
}

Ascent ascend(const PulseSet& pulses, Measure measure, const SharpnessOptions& options) {
    constexpr std::ptrdiff_t few = 64;  // gates for the first, coarse stages
    const std::ptrdiff_t n = pulses.n_pulse();
    Ascent out;
    out.phase.assign(static_cast<std::size_t>(n), 0.0);
    const PulseSet strong = pulses.strongest(few, options.execution);
    const Climb coarse(strong, measure, options);
    double value = coarse.look(out.phase, false).value;
    for (int order = 2; order <= options.polynomial; ++order) {
        const Phase shape = legendre(n, order);
        const double coefficient = search_coefficient(coarse, out.phase, shape, options.search, value);
        out.rounds.push_back({"polynomial " + std::to_string(order), 1.0, 0, 1, std::abs(coefficient) * rms(shape)});
    }
    const Climb fine(pulses, measure, options);
    Phase zero(out.phase.size(), 0.0);
    if (!(fine.look(out.phase, false).value > fine.look(zero, false).value)) out.phase = zero;
    const auto most = static_cast<int>(std::min<std::ptrdiff_t>(n / 4, 64));
    for (int order = 4; order <= most; order *= 2) {
        Round round{"cosines " + std::to_string(order), 1.0, 0, 0, 0.0};
        (void)fine.rise(out.phase, Directions(n, order), options.smooth_rounds, round);
        out.rounds.push_back(round);
    }
    Round round{"free", 1.0, 0, 0, 0.0};
    out.settled = fine.rise(out.phase, Directions(n, 0), options.free_rounds, round);
    out.rounds.push_back(round);
    out.value = fine.look(out.phase, false).value;
    remove_gauge(out.phase);
    return out;
}

}  // namespace sarfocus::autofocus::detail
