#include "point_engine.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <numeric>
#include <utility>

#include <sarfocus/core/array.hpp>
#include <sarfocus/core/complex_product.hpp>
#include <sarfocus/fft/plan.hpp>

#include "line_sums.hpp"
#include "phase_smoothing.hpp"
#include "picture.hpp"
#include "score.hpp"
#include "stopwatch.hpp"
#include "strong_points.hpp"

namespace sarfocus::autofocus::detail {
namespace {

using Phase = std::vector<double>;

constexpr double negligible = 0.02;  // rad RMS: the peaks lose two thousandths of a decibel
constexpr double focused = 0.35;     // rad RMS: the peaks lose half a decibel, and the next round starts from next to nothing

double rms(const Phase& values) {
    double sum = 0.0;
    for (const double v : values) sum += v * v;
    return std::sqrt(sum / static_cast<double>(values.size()));
}

Phase difference(const Phase& a, const Phase& b) {
    Phase out(a.size());
    for (std::size_t k = 0; k < a.size(); ++k) out[k] = a[k] - b[k];
    remove_gauge(out);
    return out;
}

void add(Phase& phase, const Phase& update) {
    for (std::size_t k = 0; k < phase.size(); ++k) phase[k] += update[k];
    remove_gauge(phase);
}

void take_out(const Phase& phase, const MutableImageView& lines) {
    std::vector<cfloat> rotation(phase.size());
    for (std::size_t k = 0; k < phase.size(); ++k) rotation[k] = cfloat(std::polar(1.0, -phase[k]));
    for (std::ptrdiff_t n = 0; n < lines.extent(0); ++n) {
        cfloat* line = &lines(n, 0);
        for (std::ptrdiff_t k = 0; k < lines.extent(1); ++k) line[k] = product(line[k], rotation[static_cast<std::size_t>(k)]);
    }
}

// Keeps what changes by at most `share` of the pulse rate over the aperture: in the image, a window round the point.
void low_pass(const MutableImageView& lines, double share, const Execution& execution) {
    const std::ptrdiff_t n_pulse = lines.extent(1);
    const std::ptrdiff_t length = fft::good_size(2 * n_pulse);  // zeros behind, so that the two ends do not leak into each other
    const fft::Plan<float> forward(length, fft::Direction::forward);
    const fft::Plan<float> inverse(length, fft::Direction::inverse);
    const auto keep = static_cast<std::ptrdiff_t>(std::lround(share * static_cast<double>(length)));
    const float scale = 1.0f / static_cast<float>(length);
    parallel_for(execution, "window", lines.extent(0), [&](std::int64_t n) {
        Array<cfloat, 1> line({length});
        std::copy_n(&lines(n, 0), n_pulse, line.data());
        forward.execute(line.data());
        for (std::ptrdiff_t f = keep + 1; f < length - keep; ++f) line(f) = {};
        inverse.execute(line.data());
        for (std::ptrdiff_t k = 0; k < n_pulse; ++k) lines(n, k) = line(k) * scale;
    });
}

// Power of a history's sum with the phase taken out, and the sum of its powers: equal for noise on average.
struct SumPower {
    double coherent = 0.0;
    double incoherent = 0.0;
};

// rotation: exp(j phase).
SumPower sum_power(const cfloat* line, const std::vector<cdouble>& rotation) {
    const auto n = static_cast<std::ptrdiff_t>(rotation.size());
    return {std::norm(line_sum(line, rotation.data(), n, 0.0, 0.0)), line_power(line, n).sum};
}

double median(std::vector<double> values) {
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

// Highest power of the image along azimuth near each point: the peak of the zero-padded periodogram of its history within an eighth of the
// bandwidth to each side, between the samples by a parabola, so that it does not matter where the peak falls among the pixels.
std::vector<double> peak_powers(const ImageView& lines, const Phase& phase, const Execution& execution) {
    const std::ptrdiff_t length = fft::good_size(4 * lines.extent(1));
    const fft::Plan<float> plan(length, fft::Direction::forward);
    std::vector<cfloat> rotation;
    for (const double p : phase) rotation.emplace_back(std::polar(1.0, -p));
    std::vector<double> out(static_cast<std::size_t>(lines.extent(0)));
    parallel_for(execution, "peaks", lines.extent(0), [&](std::int64_t n) {
        Array<cfloat, 1> line({length});
        for (std::ptrdiff_t k = 0; k < lines.extent(1); ++k) line(k) = product(lines(n, k), rotation[static_cast<std::size_t>(k)]);
        plan.execute(line.data());
        const auto power = [&](std::ptrdiff_t f) { return std::norm(cdouble(line((f + length) % length))); };
        std::ptrdiff_t peak = 0;
        for (std::ptrdiff_t f = -length / 8; f <= length / 8; ++f)
            if (power(f) > power(peak)) peak = f;
        const double left = power(peak - 1);
        const double right = power(peak + 1);
        const double curvature = left - 2.0 * power(peak) + right;
        out[static_cast<std::size_t>(n)] = power(peak) - (curvature < 0.0 ? 0.125 * (left - right) * (left - right) / curvature : 0.0);
    });
    return out;
}

template <class View>
View first(const View& lines, std::size_t count) {
    return lines.slice(0, 0, static_cast<std::ptrdiff_t>(count));
}

// Histories that the fine estimate rests on, with what is needed to judge it.
struct FineLines {
    std::vector<Pixel> points;
    std::vector<double> contrast;
    Array<cfloat, 2> lines;  // of the points, and room behind them

    [[nodiscard]] ImageView of_points() const { return first(lines.view(), points.size()); }
};

// What a run of all rounds ends with.
struct Estimate {
    Phase phase;
    FineLines fine;
    PhaseEstimate last;
    bool settled = false;
    bool quick = false;  // with less of everything
};

class Engine {
public:
    Engine(PointSource& source, const PointOptions& options, const PointPlan& plan, Result& result)
        : source_(source),
          options_(options),
          plan_(plan),
          result_(result),
          watch_(result.timings),
          picture_(source.picture(plan.picture, options.execution)) {}

    // A large source is first treated the quick way; what that does not improve, it has not understood.
    void run() {
        focus(no_phase(), {});
        cell_ = picture_->cell_size();
        watch_.lap("cell size");
        quick_ = source_.is_large() && !plan_.coarse_only;
        attempt();
        if (!quick_ || !result_.input_returned()) return;
        quick_ = false;
        passes_of_all_ = 1;
        result_.rounds.clear();
        result_.points.clear();
        result_.score = {};
        attempt();
    }

private:
    void attempt() {
        Estimate all = estimate(Portion::everywhere);
        result_.estimate = all.phase;
        result_.phase_std = all.last.phase_std;
        list_points(all);
        if (all.fine.points.empty()) {
            result_.score.reason = "no strong point was found";
            result_.status = Status::no_strong_points;
            return;
        }
        if (options_.do_no_harm)
            judge_on_halves(all);
        else
            result_.score.reason = "applied without judging, as asked";
        const bool applied = result_.score.improved || !options_.do_no_harm;
        result_.status = !applied ? Status::not_improved : (all.settled ? Status::converged : Status::max_iterations);
    }

    void focus(const Phase& phase, const Look& look) {
        if (!source_.is_large()) spare_ = {};  // forming all of an image takes memory of its own; fresh pages cost little here
        picture_->focus(phase, look);
        watch_.lap("form");
    }

    // All rounds, with the points of one half of the scene or of all of it.
    [[nodiscard]] Estimate estimate(Portion half) {
        Estimate out = guess(no_phase(), plan_.coarse ? &*plan_.coarse : nullptr, half);
        if (plan_.coarse_only) return out;
        if (plan_.compare_starts) {
            Estimate other = guess(no_phase(), nullptr, half);
            if (log_sharpness(other.phase, half) > log_sharpness(out.phase, half)) out = std::move(other);
        }
        fine_rounds(out, half);
        const int passes = half == Portion::everywhere ? plan_.passes : passes_of_all_;
        double sharpness = passes > 1 && !out.settled ? log_sharpness(out.phase, half) : 0.0;
        int pass = 1;
        for (; pass < passes && !out.settled; ++pass) {
            Estimate next = guess(out.phase, nullptr, half);
            fine_rounds(next, half);
            const double now = log_sharpness(next.phase, half);
            constexpr double worth_it = 1e-4;  // nat, about what another fine round makes
            if (!(now > sharpness + worth_it)) break;
            sharpness = now;
            out = std::move(next);
        }
        if (half == Portion::everywhere) passes_of_all_ = pass;
        return out;
    }

    [[nodiscard]] Phase no_phase() const { return Phase(static_cast<std::size_t>(source_.n_pulse()), 0.0); }

    [[nodiscard]] Estimate coarse_rounds(const Phase& start, const PartColumns* parts, Portion half) {
        Estimate out;
        out.phase = start;
        for (const double window : options_.coarse_windows) coarse_round(out, window, parts, half);
        return out;
    }

    // The same with few points and iterations, until a round changes little. Where none does: all rounds after all; of a half, that is left
    // to the second attempt, for the other half's pixels tell.
    [[nodiscard]] Estimate quick_coarse_rounds(const Phase& start, const PartColumns* parts, Portion half) {
        Estimate out;
        out.phase = start;
        out.quick = true;
        for (const double window : options_.coarse_windows)
            if (coarse_round(out, window, parts, half) < focused) return out;
        if (half == Portion::everywhere) return coarse_rounds(start, parts, half);
        return out;
    }

    [[nodiscard]] Estimate guess(const Phase& start, const PartColumns* parts, Portion half) {
        return quick_ ? quick_coarse_rounds(start, parts, half) : coarse_rounds(start, parts, half);
    }

    void fine_rounds(Estimate& so_far, Portion half) {
        const int rounds = half == Portion::everywhere ? options_.fine_rounds : std::min(options_.fine_rounds, plan_.fine_rounds_of_halves);
        so_far.settled = false;
        for (int round = 0; round < rounds && !so_far.settled; ++round)
            fine_round(so_far, half, so_far.quick && half == Portion::everywhere && round == 0 && rounds > 1);
    }

    // Of the pixels that the estimate may use.
    [[nodiscard]] double log_sharpness(const Phase& phase, Portion half) {
        focus(phase, {half, Purpose::sums});
        const double out = picture_->sums(half).log_sharpness();
        watch_.lap("sharpness");
        return out;
    }

    [[nodiscard]] CellSize cells(double separation) const { return {separation * cell_.azimuth, separation * cell_.range}; }

    [[nodiscard]] std::vector<Pixel> choose_coarse(const Phase& phase, const PartColumns* parts, Portion half, bool quick) {
        focus(phase, {half, quick && parts == nullptr ? Purpose::some_points : Purpose::points});
        const int count = quick ? std::min(options_.coarse_points, half == Portion::everywhere ? 64 : 32) : options_.coarse_points;
        std::vector<Pixel> points = parts != nullptr ? picture_->strongest_of(*parts, cells(options_.coarse_separation), half)
                                                     : picture_->strongest(count, cells(options_.coarse_separation), half);
        watch_.lap("choose points");
        return points;
    }

    // some: enough of them for a round that another one will follow.
    [[nodiscard]] std::vector<Pixel> choose_fine(const Phase& phase, Portion half, bool some) {
        focus(phase, {half, some ? Purpose::some_points : Purpose::points});
        // Of a large source no more histories than that are worth their memory; those of a bright field among them focus nothing.
        const int gates = std::max(512, static_cast<int>(source_.shape()[1]));
        const int most = some ? 128 : (quick_ ? 1 : 2) * gates / (half == Portion::everywhere ? 1 : 2);
        const int count = source_.is_large() ? std::min(options_.fine_points, most) : options_.fine_points;
        std::vector<Pixel> points = picture_->strongest(count, cells(options_.fine_separation), half);
        watch_.lap("choose points");
        return points;
    }

    // In the first lines of what is returned; behind them may be room.
    [[nodiscard]] Array<cfloat, 2> histories(const std::vector<Pixel>& points) {
        const auto count = static_cast<std::ptrdiff_t>(points.size());
        Array<cfloat, 2> lines = std::move(spare_);
        if (lines.empty() || lines.extent(0) < count) {
            lines = {};  // its memory first
            lines = Array<cfloat, 2>({count, source_.n_pulse()});
        }
        source_.histories(points, first(lines.view(), points.size()), options_.execution);
        watch_.lap("histories");
        return lines;
    }

    // Change of the phase that ends the fine rounds.
    [[nodiscard]] double tolerance(bool quick, Portion half) const {
        if (!quick) return options_.tolerance;
        return std::max(options_.tolerance, half == Portion::everywhere ? negligible : focused);
    }

    void note(Portion half, Round round) {
        if (half == Portion::everywhere) result_.rounds.push_back(std::move(round));
    }

    // Returns the change of the phase.
    double coarse_round(Estimate& so_far, double window, const PartColumns* parts, Portion half) {
        const std::vector<Pixel> points = choose_coarse(so_far.phase, parts, half, so_far.quick);
        if (points.empty()) return std::numeric_limits<double>::infinity();
        if (plan_.coarse_only) spare_ = std::move(so_far.fine.lines);  // of the round before
        Array<cfloat, 2> memory = histories(points);
        const MutableImageView lines = first(memory.view(), points.size());
        take_out(so_far.phase, lines);
        low_pass(lines, window, options_.execution);
        PhaseEstimateOptions how;
        how.estimator = options_.estimator;
        how.max_iterations = so_far.quick ? 2 : plan_.coarse_iterations;
        how.tolerance = 1e-3;
        if (so_far.quick && window < options_.coarse_windows.front()) how.initial_phase = no_phase();  // the points are in place by now
        how.noise_floor = options_.coarse_noise_floor;
        how.execution = options_.execution;
        PhaseEstimate update = estimate_phase(lines, how);
        const double change = rms(update.phase);
        note(half, {"coarse", window, static_cast<int>(points.size()), update.iterations, change});
        if (plan_.coarse_only) {
            so_far.settled = change < options_.tolerance;
            so_far.fine = lines_as_they_are(points, lines, so_far.phase);
            so_far.fine.lines = std::move(memory);
        } else {
            spare_ = std::move(memory);
        }
        if (so_far.quick)
            std::transform(update.phase.begin(), update.phase.end(), so_far.phase.begin(), so_far.phase.begin(), std::plus<>());
        else
            add(so_far.phase, update.phase);
        so_far.last = std::move(update);
        watch_.lap("estimate");
        return change;
    }

    // The points of a coarse round, windowed, with the phase taken out put back.
    [[nodiscard]] FineLines lines_as_they_are(const std::vector<Pixel>& points, const MutableImageView& lines, const Phase& phase) const {
        FineLines out;
        out.points = points;
        Phase back(phase.size());
        std::transform(phase.begin(), phase.end(), back.begin(), [](double p) { return -p; });
        take_out(back, lines);
        out.contrast = contrasts_of(sum_powers(lines, phase));
        return out;
    }

    void fine_round(Estimate& so_far, Portion half, bool first_of_some) {
        spare_ = std::move(so_far.fine.lines);
        so_far.fine = fine_lines(so_far.phase, half, first_of_some);
        so_far.settled = so_far.fine.points.empty();
        if (so_far.settled) return;
        PhaseEstimateOptions how;
        how.estimator = options_.estimator;
        how.max_iterations = so_far.quick ? 1 : plan_.fine_iterations;
        how.tolerance = 1e-3;
        how.linear_terms = false;  // the points are placed to a fraction of a pixel in every round
        how.noise_floor = options_.fine_noise_floor;
        if (options_.estimator == Estimator::maximum_likelihood) how.initial_phase = so_far.phase;
        how.execution = options_.execution;
        so_far.last = estimate_phase(so_far.fine.of_points(), how);
        if (source_.is_large() && options_.estimator == Estimator::maximum_likelihood) smooth(so_far.last);
        const Phase update = difference(so_far.last.phase, so_far.phase);
        if (so_far.quick)
            so_far.phase = so_far.last.phase;
        else
            add(so_far.phase, update);
        so_far.settled = !first_of_some && rms(update) < tolerance(so_far.quick, half);
        note(half, {"fine", 1.0, static_cast<int>(so_far.fine.points.size()), so_far.last.iterations, rms(update)});
        watch_.lap("estimate");
    }

    static void smooth(PhaseEstimate& estimate) {
        SmoothedPhase less = smoothed(estimate.phase, estimate.phase_std);
        estimate.phase = std::move(less.phase);
        for (double& std : estimate.phase_std) std *= std::sqrt(less.variance_share);
    }

    // The histories of the points that stand out, the strongest maxima first asked. Most of these are speckle: all are looked at, a part of
    // them at a time, and only what is kept is made once more.
    [[nodiscard]] FineLines fine_lines(const Phase& phase, Portion half, bool some) {
        FineLines out;
        const std::vector<Pixel> points = choose_fine(phase, half, some);
        if (points.empty()) return out;
        const std::vector<double> contrast = contrasts_of(sum_powers(points, phase));
        std::vector<std::size_t> order(points.size());
        std::iota(order.begin(), order.end(), std::size_t{0});
        std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return contrast[a] > contrast[b]; });
        const auto strong = std::count_if(contrast.begin(), contrast.end(), [&](double c) { return c >= options_.minimum_contrast; });
        order.resize(
            std::min(points.size(), std::max(static_cast<std::size_t>(strong), static_cast<std::size_t>(options_.minimum_points))));
        std::sort(order.begin(), order.end());
        for (const std::size_t n : order) {
            out.points.push_back(points[n]);
            out.contrast.push_back(contrast[n]);
        }
        watch_.lap("choose points");
        out.lines = histories(out.points);
        return out;
    }

    [[nodiscard]] std::vector<SumPower> sum_powers(const std::vector<Pixel>& points, const Phase& phase) {
        const std::size_t step = source_.points_at_once();
        std::vector<SumPower> out;
        for (std::size_t begin = 0; begin < points.size(); begin += step) {
            const auto from = points.begin() + static_cast<std::ptrdiff_t>(begin);
            const std::vector<Pixel> some(from, from + static_cast<std::ptrdiff_t>(std::min(step, points.size() - begin)));
            Array<cfloat, 2> memory = histories(some);
            const std::vector<SumPower> powers = sum_powers(first(std::as_const(memory).view(), some.size()), phase);
            out.insert(out.end(), powers.begin(), powers.end());
            spare_ = std::move(memory);
        }
        return out;
    }

    [[nodiscard]] std::vector<SumPower> sum_powers(const ImageView& lines, const Phase& phase) const {
        std::vector<SumPower> out(static_cast<std::size_t>(lines.extent(0)));
        std::vector<cdouble> rotation;
        for (const double p : phase) rotation.push_back(std::polar(1.0, p));
        parallel_for(options_.execution, "weigh points", lines.extent(0),
                     [&](std::int64_t n) { out[static_cast<std::size_t>(n)] = sum_power(&lines(n, 0), rotation); });
        return out;
    }

    // Peak power over that of the speckle that would lie there: the power of the point's history, spread as the image's background is. A
    // scene that fills only a part of what the pulses resolve gathers its speckle in that part.
    [[nodiscard]] std::vector<double> contrasts_of(const std::vector<SumPower>& powers) const {
        double filling = 1.0;
        if (!source_.is_list()) {
            std::vector<double> weaker;  // points come strongest first
            for (std::size_t n = powers.size() / 2; n < powers.size(); ++n) weaker.push_back(powers[n].incoherent);
            const double typical = median(std::move(weaker));
            if (typical > 0.0) filling = std::max(picture_->background() * source_.sum_scale() / typical, 1.0);
        }
        std::vector<double> out;
        for (const SumPower& p : powers) out.push_back(p.incoherent > 0.0 ? p.coherent / (p.incoherent * filling) : 0.0);
        return out;
    }

    void list_points(const Estimate& all) {
        std::vector<double> information;
        double total = 0.0;
        for (std::size_t n = 0; n < all.fine.points.size(); ++n) {
            const double signal = all.last.signal_power[n];
            const double noise = std::max(all.last.noise_power[n], options_.fine_noise_floor * (all.last.noise_power[n] + signal));
            information.push_back(noise > 0.0 ? signal / noise : 0.0);
            total += information.back();
        }
        for (std::size_t n = 0; n < all.fine.points.size(); ++n) {
            const Pixel& p = all.fine.points[n];
            const double range = source_.fractional_columns() ? p.column : static_cast<double>(source_.range_gate(std::lround(p.column)));
            result_.points.push_back({p.azimuth, range, 0.0, total > 0.0 ? information[n] / total : 0.0, all.fine.contrast[n]});
        }
    }

    [[nodiscard]] Evidence evidence(const Estimate& all) const {
        Evidence out;
        out.points = all.fine.points;
        for (std::size_t n = 0; n < out.points.size(); ++n) {
            out.weight.push_back(result_.points[n].weight);
            const double power = all.last.signal_power[n] + all.last.noise_power[n];
            out.coherence.push_back(power > 0.0 ? all.last.signal_power[n] / power : 0.0);
        }
        out.gain_db = peak_gains(all, out.weight);
        double count = 0.0;
        for (const double std : all.last.phase_std)
            if (std::isfinite(std)) {
                out.mean_variance += std * std;
                count += 1.0;
            }
        if (count > 0.0) out.mean_variance /= count;
        return out;
    }

    // dB, of the points' peaks; of many points of a large source some, spread over all strengths, stand for the others by their mean.
    [[nodiscard]] std::vector<double> peak_gains(const Estimate& all, const std::vector<double>& weight) const {
        constexpr std::size_t some = 64;
        const std::size_t step = source_.is_large() ? std::max<std::size_t>(weight.size() / some, 1) : 1;
        const ImageView lines = all.fine.of_points();
        const auto count = static_cast<std::ptrdiff_t>((weight.size() + step - 1) / step);
        const ImageView sample(lines.data(), {count, lines.extent(1)}, {static_cast<std::ptrdiff_t>(step) * lines.extent(1), 1});
        const std::vector<double> before = peak_powers(sample, Phase(all.phase.size(), 0.0), options_.execution);
        const std::vector<double> after = peak_powers(sample, all.phase, options_.execution);
        double sum = 0.0;
        double weights = 0.0;
        std::vector<double> gains;
        for (std::size_t n = 0; n < before.size(); ++n) {
            gains.push_back(before[n] > 0.0 ? 10.0 * std::log10(after[n] / before[n]) : 0.0);
            sum += weight[n * step] * gains.back();
            weights += weight[n * step];
        }
        if (step == 1) return gains;
        return std::vector<double>(weight.size(), weights > 0.0 ? sum / weights : 0.0);
    }

    // Each half of the scene is judged with the phase that the other half's points gave, from the first round on.
    void judge_on_halves(Estimate& all) {
        const Halves halves(source_, cell_);
        picture_->split(halves);
        TrialSums trial;
        focus(no_phase(), {Portion::everywhere, Purpose::entropy});
        trial.entropy_before = picture_->entropy();
        trial.before = {picture_->sums(Portion::first_half), picture_->sums(Portion::second_half)};
        focus(all.phase, {Portion::everywhere, Purpose::entropy});
        trial.entropy_after = picture_->entropy();
        const Evidence found = evidence(all);
        spare_ = std::move(all.fine.lines);
        const bool decided = judged_without_halves(trial, halves, found, result_.score);
        watch_.lap("judge");
        if (decided) return;
        trial.held_out[1] = held_out(Portion::first_half, Portion::second_half);
        trial.held_out[0] = held_out(Portion::second_half, Portion::first_half);
        judge_held_out(trial, cell_, result_.score);
        watch_.lap("judge");
    }

    [[nodiscard]] HalfSums held_out(Portion from, Portion judged) {
        const Phase phase = estimate(from).phase;
        focus(phase, {judged, Purpose::sums});
        return picture_->sums(judged);
    }

    PointSource& source_;
    const PointOptions& options_;
    const PointPlan& plan_;
    Result& result_;
    Stopwatch watch_;
    std::unique_ptr<Picture> picture_;
    CellSize cell_;
    Array<cfloat, 2> spare_;  // memory of histories no longer needed
    bool quick_ = false;
    int passes_of_all_ = 1;  // that the estimate from everywhere made
};

}  // namespace

Result estimate_from_points(PointSource& source, const PointOptions& options, const PointPlan& plan) {
    options.validate();
    Result result;
    result.threads = resolve_threads(options.execution.threads);
    Engine(source, options, plan, result).run();
    return result;
}

}  // namespace sarfocus::autofocus::detail
