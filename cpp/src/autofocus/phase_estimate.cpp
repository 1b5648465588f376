#include <sarfocus/autofocus/phase_estimate.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include <omp.h>

#include <sarfocus/core/array.hpp>
#include <sarfocus/core/checks.hpp>
#include <sarfocus/core/complex_product.hpp>
#include <sarfocus/core/constants.hpp>
#include <sarfocus/core/error.hpp>
#include <sarfocus/fft/plan.hpp>

#include "line_sums.hpp"

namespace sarfocus::autofocus {
namespace {

constexpr std::ptrdiff_t most_pulses_per_task = 512;
constexpr std::ptrdiff_t smoothing_half_width = 7;  // pulses over which phase_std is averaged to each side

std::size_t at(std::ptrdiff_t i) {
    return static_cast<std::size_t>(i);
}

// A task sets out along every line anew, which costs as much as some hundred pulses: long lines are cut into longer pieces.
std::ptrdiff_t pulses_of_a_task(std::ptrdiff_t n_pulse) {
    constexpr std::ptrdiff_t least = 64;
    constexpr std::ptrdiff_t pieces = 16;
    return std::clamp(n_pulse / (pieces * least) * least, least, most_pulses_per_task);
}

// exp(j b (k - middle)) for consecutive k, by recurrence.
class Ramp {
public:
    Ramp(double slope, double first_offset) : value_(std::polar(1.0, slope * first_offset)), step_(std::polar(1.0, slope)) {}
    cdouble next() {
        const cdouble out = value_;
        value_ = product(value_, step_);
        return out;
    }

private:
    cdouble value_;
    cdouble step_;
};

// lines: contiguous along the pulses.
class Alternation {
public:
    Alternation(const ImageView& lines, const PhaseEstimateOptions& options)
        : options_(options),
          threads_(resolve_threads(options.execution.threads)),
          n_line_(lines.extent(0)),
          n_pulse_(lines.extent(1)),
          middle_(0.5 * static_cast<double>(n_pulse_ - 1)),
          pulses_per_task_(pulses_of_a_task(n_pulse_)),
          tasks_((n_pulse_ + pulses_per_task_ - 1) / pulses_per_task_),
          lines_(lines),
          power_(at(n_line_), 0.0),
          samples_(at(n_line_), 0.0),
          phase_(at(n_pulse_), 0.0),
          rotation_(at(n_pulse_), cdouble{1.0, 0.0}),
          slope_(at(n_line_), 0.0),
          amplitude_(at(n_line_), cdouble{}),
          signal_(at(n_line_), 0.0),
          noise_(at(n_line_), 0.0),
          weight_(at(n_line_), 0.0) {
#pragma omp parallel for schedule(static) num_threads(threads_) if (threads_ > 1 && worth_threads())
        for (std::ptrdiff_t n = 0; n < n_line_; ++n) {
            const detail::LinePower power = detail::line_power(line(n), n_pulse_);
            samples_[at(n)] = static_cast<double>(power.samples);
            power_[at(n)] = power.samples > 0 ? power.sum / samples_[at(n)] : 0.0;
        }
        if (std::none_of(power_.begin(), power_.end(), [](double power) { return power > 0.0; }))
            throw NumericalError("lines: expected samples other than zero, got all zero");
    }

    void start_from(const std::vector<double>& phase) {
        phase_ = phase;
        set_rotation();
    }

    // Sum of the phase steps between neighbouring pulses. `background`: power a line has without a point, which earns it no weight.
    void start_from_gradient(double background) {
        for (std::size_t n = 0; n < power_.size(); ++n)
            weight_[n] = power_[n] > background ? (1.0 - background / power_[n]) / power_[n] : 0.0;
        std::fill(slope_.begin(), slope_.end(), 0.0);
        std::fill(phase_.begin(), phase_.end(), 0.0);
        std::vector<cdouble> steps(at(n_pulse_));
#pragma omp parallel for schedule(static) num_threads(threads_) if (threads_ > 1 && worth_threads())
        for (std::ptrdiff_t task = 0; task < tasks_; ++task) {
            const std::ptrdiff_t begin = std::max<std::ptrdiff_t>(task * pulses_per_task_, 1);
            const std::ptrdiff_t end = std::min((task + 1) * pulses_per_task_, n_pulse_);
            for (std::ptrdiff_t n = 0; n < n_line_; ++n) {
                const cfloat* d = line(n);
                for (std::ptrdiff_t k = begin; k < end; ++k)
                    steps[at(k)] += product(weight_[at(n)] * cdouble(d[k]), std::conj(cdouble(d[k - 1])));
            }
        }
        double sum = 0.0;
        for (std::ptrdiff_t k = 1; k < n_pulse_; ++k) {
            if (steps[at(k)] != cdouble{}) sum += std::arg(steps[at(k)]);
            phase_[at(k)] = sum;
        }
        remove_linear(phase_);
        set_rotation();
        if (options_.linear_terms) find_slopes();
    }

    [[nodiscard]] double median_power() const {
        std::vector<double> sorted = power_;
        std::nth_element(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2), sorted.end());
        return sorted[sorted.size() / 2];
    }

    // Of the fitted lines, up to a constant.
    [[nodiscard]] double log_likelihood() const {
        double sum = 0.0;
        for (std::size_t n = 0; n < power_.size(); ++n)
            if (power_[n] > 0.0) sum -= samples_[n] * std::log(std::max(noise_[n] / power_[n], 1e-3));  // 30 dB: rounding, not noise, below
        return sum;
    }

    // [methods 3]: A_n and b_n, then phi(k); returns the largest change of phi.
    double iterate() {
        fit_lines();
        std::vector<double> change(at(tasks_));
#pragma omp parallel for schedule(static) num_threads(threads_) if (threads_ > 1 && worth_threads())
        for (std::ptrdiff_t task = 0; task < tasks_; ++task)
            change[at(task)] = update_pulses(task * pulses_per_task_, std::min(pulses_per_task_, n_pulse_ - task * pulses_per_task_));
        return *std::max_element(change.begin(), change.end());
    }

    void fit_lines() {
#pragma omp parallel for schedule(static) num_threads(threads_) if (threads_ > 1 && worth_threads())
        for (std::ptrdiff_t n = 0; n < n_line_; ++n)
            if (samples_[at(n)] > 0.0) fit_line(n);
        if (options_.linear_terms) centre_slopes();
    }

    // With the lines fitted to the phase.
    PhaseEstimate finish() {
        PhaseEstimate out;
        out.phase_std = standard_deviation();
        for (std::size_t k = 0; k < phase_.size(); ++k)
            if (std::isnan(out.phase_std[k])) phase_[k] = std::numeric_limits<double>::quiet_NaN();
        remove_gauge(phase_);
        for (double& phase : phase_)
            if (std::isnan(phase)) phase = 0.0;  // nothing to correct where there is nothing
        out.phase = phase_;
        out.linear_terms = slope_;
        out.amplitude = amplitude_;
        out.signal_power = signal_;
        out.noise_power = noise_;
        return out;
    }

private:
    // A pass over fewer samples takes less time than threads need to meet.
    [[nodiscard]] bool worth_threads() const { return n_line_ * n_pulse_ >= 100000; }

    // The peak of every line's periodogram, to half a cell: what the Newton steps start from.
    void find_slopes() {
        const std::ptrdiff_t length = fft::good_size(2 * n_pulse_);
        const fft::Plan<float> plan(length, fft::Direction::forward);
        std::vector<Array<cfloat, 1>> memory;
        for (int t = 0; t < threads_; ++t) memory.emplace_back(std::array<std::ptrdiff_t, 1>{length});
        std::vector<cfloat> turn;
        for (const cdouble& rotation : rotation_) turn.emplace_back(std::conj(rotation));
#pragma omp parallel for schedule(static) num_threads(threads_) if (threads_ > 1 && worth_threads())
        for (std::ptrdiff_t n = 0; n < n_line_; ++n) {
            cfloat* work = memory[at(omp_get_thread_num())].data();
            const cfloat* d = line(n);
            for (std::ptrdiff_t k = 0; k < n_pulse_; ++k) work[k] = product(d[k], turn[at(k)]);
            std::fill(work + n_pulse_, work + length, cfloat{});
            plan.execute(work);
            const std::ptrdiff_t peak = detail::strongest_sample(work, length);
            slope_[at(n)] = two_pi * static_cast<double>(2 * peak < length ? peak : peak - length) / static_cast<double>(length);
        }
    }

    void set_rotation() {
        for (std::size_t k = 0; k < phase_.size(); ++k) rotation_[k] = std::polar(1.0, phase_[k]);
    }

    [[nodiscard]] const cfloat* line(std::ptrdiff_t n) const { return &lines_(n, 0); }

    // One Newton step up the periodogram |sum z exp(-j b k)|^2, at most half a cell.
    void fit_slope(std::ptrdiff_t n) {
        const auto [s0, s1, s2] = detail::line_moments(line(n), rotation_.data(), n_pulse_, slope_[at(n)], middle_);
        const double gradient = 2.0 * std::imag(s1 * std::conj(s0));
        const double curvature = 2.0 * (std::norm(s1) - std::real(s2 * std::conj(s0)));
        const double limit = pi / static_cast<double>(n_pulse_);
        if (curvature < 0.0) slope_[at(n)] += std::clamp(-gradient / curvature, -limit, limit);
    }

    void fit_line(std::ptrdiff_t n) {
        if (options_.linear_terms) fit_slope(n);
        const double count = samples_[at(n)];
        amplitude_[at(n)] = detail::line_sum(line(n), rotation_.data(), n_pulse_, slope_[at(n)], middle_) / count;
        // |A|^2 without its share of noise: E|mean|^2 = |A|^2 + noise / count.
        signal_[at(n)] = count > 1.0 ? std::max((count * std::norm(amplitude_[at(n)]) - power_[at(n)]) / (count - 1.0), 0.0) : 0.0;
        // The common phase has taken 1 / (2 M) of the noise's freedom.
        noise_[at(n)] = std::max(power_[at(n)] - signal_[at(n)], 0.0) / (1.0 - 0.5 / static_cast<double>(n_line_));
        weight_[at(n)] = 1.0 / std::max(noise_[at(n)], options_.noise_floor * power_[at(n)]);
    }

    void centre_slopes() {
        double sum = 0.0;
        double weights = 0.0;
        for (std::ptrdiff_t n = 0; n < n_line_; ++n) {
            sum += weight_[at(n)] * signal_[at(n)] * slope_[at(n)];
            weights += weight_[at(n)] * signal_[at(n)];
        }
        if (!(weights > 0.0)) return;
        for (double& slope : slope_) slope -= sum / weights;
    }

    // Returns their largest change.
    double update_pulses(std::ptrdiff_t begin, std::ptrdiff_t count) {
        cdouble sum[most_pulses_per_task] = {};
        double own[most_pulses_per_task] = {};
        for (std::ptrdiff_t n = 0; n < n_line_; ++n) {
            if (!(samples_[at(n)] > 0.0)) continue;
            const cdouble gain = weight_[at(n)] * std::conj(amplitude_[at(n)]);
            const double share = weight_[at(n)] / samples_[at(n)];
            detail::add_line(line(n) + begin, count, gain, slope_[at(n)], middle_ - static_cast<double>(begin), share, sum, own);
        }
        double change = 0.0;
        for (std::ptrdiff_t k = 0; k < count; ++k) {
            double& phase = phase_[at(begin + k)];
            const double before = phase;
            const cdouble others = sum[k] - own[k] * rotation_[at(begin + k)];
            if (others != cdouble{}) phase = std::arg(others);
            rotation_[at(begin + k)] = std::polar(1.0, phase);
            change = std::max(change, std::abs(std::remainder(phase - before, two_pi)));
        }
        return change;
    }

    // With c_n(k) the weighted line n turned to the common phase, var phi(k) = sum (Im c_n)^2 / (sum w_n |A_n|^2)^2, whatever the noise is;
    // smoothed over a few pulses, because a handful of lines scatter by chance, and not below what the noise power of the lines implies.
    [[nodiscard]] std::vector<double> standard_deviation() const {
        std::vector<double> scatter(at(n_pulse_), 0.0);
        std::vector<double> information(at(n_pulse_), 0.0);
        std::vector<double> implied(at(n_pulse_), 0.0);
#pragma omp parallel for schedule(static) num_threads(threads_) if (threads_ > 1 && worth_threads())
        for (std::ptrdiff_t task = 0; task < tasks_; ++task) {
            const std::ptrdiff_t begin = task * pulses_per_task_;
            const std::ptrdiff_t end = std::min(begin + pulses_per_task_, n_pulse_);
            double of_all[2] = {};  // information and what is implied, of lines that have every pulse
            for (std::ptrdiff_t n = 0; n < n_line_; ++n) {
                const cdouble gain = weight_[at(n)] * std::conj(amplitude_[at(n)]);
                const double model = weight_[at(n)] * weight_[at(n)] * signal_[at(n)] * 0.5 * noise_[at(n)];
                const cfloat* d = line(n);
                const double own = weight_[at(n)] * signal_[at(n)];
                if (slope_[at(n)] == 0.0 && samples_[at(n)] == static_cast<double>(n_pulse_)) {
                    detail::add_scatter(d + begin, rotation_.data() + begin, end - begin, gain, scatter.data() + begin);
                    of_all[0] += own;
                    of_all[1] += model;
                    continue;
                }
                Ramp ramp(-slope_[at(n)], static_cast<double>(begin) - middle_);
                for (std::ptrdiff_t k = begin; k < end; ++k) {
                    const cdouble turn = ramp.next();
                    if (d[k] == cfloat{}) continue;
                    const double across = product(product(product(gain, cdouble(d[k])), std::conj(rotation_[at(k)])), turn).imag();
                    scatter[at(k)] += across * across;
                    information[at(k)] += own;
                    implied[at(k)] += model;
                }
            }
            for (std::ptrdiff_t k = begin; k < end; ++k) {
                information[at(k)] += of_all[0];
                implied[at(k)] += of_all[1];
            }
        }
        const double freedom = n_line_ > 1 ? static_cast<double>(n_line_) / static_cast<double>(n_line_ - 1) : 1.0;
        const double random = pi / std::sqrt(3.0);  // of a phase drawn from the whole circle: none is less certain
        for (std::ptrdiff_t k = 0; k < n_pulse_; ++k) {
            if (!(information[at(k)] > 0.0)) continue;
            scatter[at(k)] = freedom * scatter[at(k)] / (information[at(k)] * information[at(k)]);
            implied[at(k)] /= information[at(k)] * information[at(k)];
        }
        const std::ptrdiff_t half = std::min(smoothing_half_width, n_pulse_ / 8);
        std::vector<double> out(at(n_pulse_), std::numeric_limits<double>::quiet_NaN());
        for (std::ptrdiff_t k = 0; k < n_pulse_; ++k) {
            bool reached = false;
            for (std::ptrdiff_t n = 0; n < n_line_ && !reached; ++n) reached = lines_(n, k) != cfloat{};
            if (!reached) continue;
            double observed = 0.0;
            double expected = 0.0;
            int count = 0;
            for (std::ptrdiff_t i = std::max<std::ptrdiff_t>(k - half, 0); i <= std::min(k + half, n_pulse_ - 1); ++i) {
                if (!(information[at(i)] > 0.0)) continue;
                observed += scatter[at(i)];
                expected += implied[at(i)];
                ++count;
            }
            out[at(k)] = count > 0 ? std::min(std::sqrt(std::max(observed, expected) / count), random) : random;
        }
        return out;
    }

    const PhaseEstimateOptions& options_;
    int threads_;
    std::ptrdiff_t n_line_;
    std::ptrdiff_t n_pulse_;
    double middle_;
    std::ptrdiff_t pulses_per_task_;
    std::ptrdiff_t tasks_;
    ImageView lines_;
    std::vector<double> power_;
    std::vector<double> samples_;
    std::vector<double> phase_;
    std::vector<cdouble> rotation_;  // exp(j phi)
    std::vector<double> slope_;
    std::vector<cdouble> amplitude_;
    std::vector<double> signal_;
    std::vector<double> noise_;
    std::vector<double> weight_;
};

void unwrap_about_mean_step(std::vector<double>& phase) {
    cdouble sum{};
    for (std::size_t k = 1; k < phase.size(); ++k)
        if (std::isfinite(phase[k]) && std::isfinite(phase[k - 1])) sum += std::polar(1.0, phase[k] - phase[k - 1]);
    const double mean = std::arg(sum);
    std::size_t last = phase.size();
    for (std::size_t k = 0; k < phase.size(); ++k) {
        if (!std::isfinite(phase[k])) continue;
        if (last < phase.size()) {
            const double expected = phase[last] + mean * static_cast<double>(k - last);
            phase[k] = expected + std::remainder(phase[k] - expected, two_pi);
        }
        last = k;
    }
}

// Returns the number of iterations.
int alternate(Alternation& alternation, const PhaseEstimateOptions& options) {
    Monitor monitor(options.execution, "estimate", options.max_iterations);
    int iterations = 0;
    while (iterations < options.max_iterations && !monitor.stopped()) {
        ++iterations;
        const bool settled = alternation.iterate() < options.tolerance;
        monitor.advance();
        if (settled) break;
    }
    monitor.finish();
    alternation.fit_lines();
    return iterations;
}

PhaseEstimate finished(Alternation& alternation, int iterations) {
    PhaseEstimate out = alternation.finish();
    out.iterations = iterations;
    return out;
}

// The alternation's phase_std is that of its own phase; the gradient's walks away from it.
PhaseEstimate gradient_estimate(Alternation& alternation, const PhaseEstimateOptions& options) {
    alternation.start_from_gradient(0.0);
    alternation.fit_lines();
    PhaseEstimate out = alternation.finish();
    alternate(alternation, options);
    const PhaseEstimate reference = alternation.finish();
    double sum = 0.0;
    double count = 0.0;
    for (std::size_t k = 0; k < out.phase.size(); ++k)
        if (std::isfinite(reference.phase_std[k])) {
            const double difference = out.phase[k] - reference.phase[k];
            sum += difference * difference;
            count += 1.0;
        }
    for (std::size_t k = 0; k < out.phase.size(); ++k)
        out.phase_std[k] = std::sqrt(reference.phase_std[k] * reference.phase_std[k] + (count > 0.0 ? sum / count : 0.0));
    return out;
}

// All lines alike suits many points of one strength; what stands out of the median, a few points among many lines without one.
PhaseEstimate likelier_of_two_starts(Alternation& alike, const PhaseEstimateOptions& options) {
    Alternation standing_out = alike;
    alike.start_from_gradient(0.0);
    const int iterations = alternate(alike, options);
    standing_out.start_from_gradient(standing_out.median_power());
    const int others = alternate(standing_out, options);
    if (standing_out.log_likelihood() > alike.log_likelihood()) return finished(standing_out, others);
    return finished(alike, iterations);
}

Array<cfloat, 2> contiguous(const ImageView& lines) {
    Array<cfloat, 2> out(lines.extents());
    for (std::ptrdiff_t n = 0; n < lines.extent(0); ++n)
        for (std::ptrdiff_t k = 0; k < lines.extent(1); ++k) out(n, k) = lines(n, k);
    return out;
}

}  // namespace

void PhaseEstimateOptions::validate() const {
    if (max_iterations < 1) throw ValueError("max_iterations", "at least 1", std::to_string(max_iterations));
    require_positive(tolerance, "tolerance");
    require_positive(noise_floor, "noise_floor");
    (void)resolve_threads(execution.threads);
}

PhaseEstimate estimate_phase(const ImageView& lines, const PhaseEstimateOptions& options) {
    options.validate();
    require_not_empty(lines, "lines");
    if (lines.extent(1) < 3) throw ShapeError("lines", "at least three pulses", shape_text(lines.extents()));
    require_finite(lines, "lines", options.execution.threads);
    if (!options.initial_phase.empty() && static_cast<std::ptrdiff_t>(options.initial_phase.size()) != lines.extent(1))
        throw ShapeError("initial_phase", std::to_string(lines.extent(1)) + " values, one for each pulse",
                         std::to_string(options.initial_phase.size()));

    const Array<cfloat, 2> copy = lines.stride(1) == 1 ? Array<cfloat, 2>() : contiguous(lines);
    Alternation alternation(copy.empty() ? lines : copy.view(), options);
    if (options.estimator == Estimator::gradient) return gradient_estimate(alternation, options);
    if (options.initial_phase.empty()) return likelier_of_two_starts(alternation, options);
    alternation.start_from(options.initial_phase);
    const int iterations = alternate(alternation, options);
    return finished(alternation, iterations);
}

void remove_linear(std::vector<double>& phase) {
    double n = 0.0;
    double sx = 0.0;
    double sy = 0.0;
    for (std::size_t k = 0; k < phase.size(); ++k)
        if (std::isfinite(phase[k])) {
            n += 1.0;
            sx += static_cast<double>(k);
            sy += phase[k];
        }
    if (n < 1.0) return;
    double sxx = 0.0;
    double sxy = 0.0;
    for (std::size_t k = 0; k < phase.size(); ++k)
        if (std::isfinite(phase[k])) {
            const double x = static_cast<double>(k) - sx / n;
            sxx += x * x;
            sxy += x * (phase[k] - sy / n);
        }
    const double slope = sxx > 0.0 ? sxy / sxx : 0.0;
    for (std::size_t k = 0; k < phase.size(); ++k)
        if (std::isfinite(phase[k])) phase[k] -= sy / n + slope * (static_cast<double>(k) - sx / n);
}

void remove_gauge(std::vector<double>& phase) {
    const auto n = static_cast<std::ptrdiff_t>(phase.size());
    const std::ptrdiff_t length = fft::good_size(8 * n);
    Array<cdouble, 1> spectrum({length});
    double known = 0.0;
    for (std::ptrdiff_t k = 0; k < n; ++k)
        if (std::isfinite(phase[at(k)])) {
            spectrum(k) = std::polar(1.0, phase[at(k)]);
            known += 1.0;
        }
    if (known == 0.0) return;
    fft::Plan<double>(length, fft::Direction::forward).execute(spectrum.data());
    std::ptrdiff_t peak = 0;
    for (std::ptrdiff_t f = 1; f < length; ++f)
        if (std::norm(spectrum(f)) > std::norm(spectrum(peak))) peak = f;
    const double coherence = std::norm(spectrum(peak)) / (known * known);
    constexpr double small = 0.6;  // about 0.7 rad RMS: only a bad pulse is more than half a turn away
    if (coherence >= small) {
        const double step = two_pi * static_cast<double>(2 * peak < length ? peak : peak - length) / static_cast<double>(length);
        const double constant = std::arg(spectrum(peak));
        for (std::ptrdiff_t k = 0; k < n; ++k)
            phase[at(k)] = std::remainder(phase[at(k)] - constant - step * static_cast<double>(k), two_pi);
    } else {
        unwrap_about_mean_step(phase);
    }
    remove_linear(phase);
}

}  // namespace sarfocus::autofocus
