#include "point_engine.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <utility>

#include <sarfocus/core/array.hpp>
#include <sarfocus/fft/plan.hpp>

#include "score.hpp"
#include "stopwatch.hpp"
#include "strong_points.hpp"

namespace sarfocus::autofocus::detail {
namespace {

using Phase = std::vector<double>;

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

void take_out(const Phase& phase, Array<cfloat, 2>& lines) {
    std::vector<cfloat> rotation(phase.size());
    for (std::size_t k = 0; k < phase.size(); ++k) rotation[k] = cfloat(std::polar(1.0, -phase[k]));
    for (std::ptrdiff_t n = 0; n < lines.extent(0); ++n)
        for (std::ptrdiff_t k = 0; k < lines.extent(1); ++k) lines(n, k) *= rotation[static_cast<std::size_t>(k)];
}

// Keeps what changes by at most `share` of the pulse rate over the aperture: in the image, a window round the point.
void low_pass(Array<cfloat, 2>& lines, double share, const Execution& execution) {
    const std::ptrdiff_t n_pulse = lines.extent(1);
    const std::ptrdiff_t length = fft::good_size(2 * n_pulse);  // zeros behind, so that the two ends do not leak into each other
    const fft::Plan<float> forward(length, fft::Direction::forward);
    const fft::Plan<float> inverse(length, fft::Direction::inverse);
    const auto keep = static_cast<std::ptrdiff_t>(std::lround(share * static_cast<double>(length)));
    const float scale = 1.0f / static_cast<float>(length);
    parallel_for(execution, "window", lines.extent(0), [&](std::int64_t n) {
        Array<cfloat, 1> line({length});
        std::copy_n(lines.data() + n * n_pulse, n_pulse, line.data());
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

SumPower sum_power(const cfloat* line, const std::vector<cdouble>& rotation) {
    cdouble sum{};
    SumPower out;
    for (std::size_t k = 0; k < rotation.size(); ++k) {
        sum += cdouble(line[k]) * rotation[k];
        out.incoherent += std::norm(cdouble(line[k]));
    }
    out.coherent = std::norm(sum);
    return out;
}

double median(std::vector<double> values) {
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

// Mean power of what lies between the strong points: speckle's median is ln 2 of its mean.
double background_power(const ImageView& image) {
    constexpr std::ptrdiff_t at_most = 65536;
    const std::ptrdiff_t step = std::max<std::ptrdiff_t>(image.size() / at_most, 1);
    std::vector<double> powers;
    for (std::ptrdiff_t k = 0; k < image.size(); k += step)
        powers.push_back(std::norm(cdouble(image(k / image.extent(1), k % image.extent(1)))));
    return median(std::move(powers)) / std::log(2.0);
}

// Highest power of the image along azimuth near each point: the peak of the zero-padded periodogram of its history within an eighth of the
// bandwidth to each side, between the samples by a parabola, so that it does not matter where the peak falls among the pixels.
std::vector<double> peak_powers(const Array<cfloat, 2>& lines, const Phase& phase, const Execution& execution) {
    const std::ptrdiff_t length = fft::good_size(4 * lines.extent(1));
    const fft::Plan<float> plan(length, fft::Direction::forward);
    std::vector<cfloat> rotation;
    for (const double p : phase) rotation.emplace_back(std::polar(1.0, -p));
    std::vector<double> out(static_cast<std::size_t>(lines.extent(0)));
    parallel_for(execution, "peaks", lines.extent(0), [&](std::int64_t n) {
        Array<cfloat, 1> line({length});
        for (std::ptrdiff_t k = 0; k < lines.extent(1); ++k) line(k) = lines(n, k) * rotation[static_cast<std::size_t>(k)];
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

// Histories that the fine estimate rests on, with what is needed to judge it.
struct FineLines {
    std::vector<Pixel> points;
    std::vector<double> contrast;
    Array<cfloat, 2> lines;
};

// What a run of all rounds ends with.
struct Estimate {
    Phase phase;
    FineLines fine;
    PhaseEstimate last;
    bool settled = false;
};

class Engine {
public:
    Engine(PointSource& source, const PointOptions& options, const PointPlan& plan, Result& result)
        : source_(source),
          options_(options),
          plan_(plan),
          result_(result),
          watch_(result.timings),
          image_({source.shape()[0], source.shape()[1]}) {}

    void run() {
        source_.form(Phase(static_cast<std::size_t>(source_.n_pulse()), 0.0), image_.view(), options_.execution);
        watch_.lap("form");
        cell_ = cell_size(image_.view(), source_);
        const Estimate all = estimate(everywhere);
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

private:
    static constexpr int everywhere = -1;

    // All rounds, with the points of one half of the scene or of all of it.
    [[nodiscard]] Estimate estimate(int half) {
        Estimate out = coarse_rounds(no_phase(), plan_.coarse, half);
        if (plan_.coarse_only) return out;
        if (plan_.compare_starts) {
            Estimate other = coarse_rounds(no_phase(), {}, half);
            if (log_sharpness(other.phase, half) > log_sharpness(out.phase, half)) out = std::move(other);
        }
        fine_rounds(out, half);
        const int passes = half == everywhere ? plan_.passes : passes_of_all_;
        double sharpness = passes > 1 && !out.settled ? log_sharpness(out.phase, half) : 0.0;
        int pass = 1;
        for (; pass < passes && !out.settled; ++pass) {
            Estimate next = coarse_rounds(out.phase, {}, half);
            fine_rounds(next, half);
            const double now = log_sharpness(next.phase, half);
            constexpr double worth_it = 1e-4;  // nat, about what another fine round makes
            if (!(now > sharpness + worth_it)) break;
            sharpness = now;
            out = std::move(next);
        }
        if (half == everywhere) passes_of_all_ = pass;
        return out;
    }

    [[nodiscard]] Phase no_phase() const { return Phase(static_cast<std::size_t>(source_.n_pulse()), 0.0); }

    [[nodiscard]] Estimate coarse_rounds(const Phase& start, const PointChooser& chooser, int half) {
        Estimate out;
        out.phase = start;
        for (const double window : options_.coarse_windows) coarse_round(out, window, chooser, half);
        return out;
    }

    void fine_rounds(Estimate& so_far, int half) {
        const int rounds = half == everywhere ? options_.fine_rounds : std::min(options_.fine_rounds, plan_.fine_rounds_of_halves);
        so_far.settled = false;
        for (int round = 0; round < rounds && !so_far.settled; ++round) fine_round(so_far, half);
    }

    // Of the pixels that the estimate may use.
    [[nodiscard]] double log_sharpness(const Phase& phase, int half) {
        source_.form(phase, image_.view(), options_.execution);
        watch_.lap("form");
        const ArrayView<const bool, 2> own = wanted(half);
        HalfSums sums;
        for (std::ptrdiff_t i = 0; i < image_.extent(0); ++i)
            for (std::ptrdiff_t j = 0; j < image_.extent(1); ++j) {
                if (own.data() != nullptr && !own(i, j)) continue;
                const double intensity = std::norm(cdouble(image_(i, j)));
                sums.power += intensity;
                sums.square += intensity * intensity;
            }
        watch_.lap("sharpness");
        return sums.log_sharpness();
    }

    [[nodiscard]] ArrayView<const bool, 2> wanted(int half) const {
        return half == everywhere ? ArrayView<const bool, 2>{} : masks_[static_cast<std::size_t>(half)].view();
    }

    [[nodiscard]] std::vector<Pixel> strongest(int count, double separation_cells, int half) {
        return strongest_points(image_.view(), source_, count, {separation_cells * cell_.azimuth, separation_cells * cell_.range},
                                wanted(half), options_.execution);
    }

    [[nodiscard]] std::vector<Pixel> choose_coarse(const Phase& phase, const PointChooser& chooser, int half) {
        source_.form(phase, image_.view(), options_.execution);
        watch_.lap("form");
        std::vector<Pixel> points = chooser ? chooser(std::as_const(image_).view(), cell_, wanted(half))
                                            : strongest(options_.coarse_points, options_.coarse_separation, half);
        watch_.lap("choose points");
        return points;
    }

    [[nodiscard]] std::vector<Pixel> choose_fine(const Phase& phase, int half) {
        source_.form(phase, image_.view(), options_.execution);
        watch_.lap("form");
        std::vector<Pixel> points = strongest(options_.fine_points, options_.fine_separation, half);
        watch_.lap("choose points");
        return points;
    }

    [[nodiscard]] Array<cfloat, 2> histories(const std::vector<Pixel>& points) {
        Array<cfloat, 2> lines({static_cast<std::ptrdiff_t>(points.size()), source_.n_pulse()});
        source_.histories(points, lines.view(), options_.execution);
        watch_.lap("histories");
        return lines;
    }

    void note(int half, Round round) {
        if (half == everywhere) result_.rounds.push_back(std::move(round));
    }

    void coarse_round(Estimate& so_far, double window, const PointChooser& chooser, int half) {
        const std::vector<Pixel> points = choose_coarse(so_far.phase, chooser, half);
        if (points.empty()) return;
        Array<cfloat, 2> lines = histories(points);
        take_out(so_far.phase, lines);
        low_pass(lines, window, options_.execution);
        PhaseEstimateOptions how;
        how.estimator = options_.estimator;
        how.max_iterations = plan_.coarse_iterations;
        how.tolerance = 1e-3;
        how.noise_floor = options_.coarse_noise_floor;
        how.execution = options_.execution;
        PhaseEstimate update = estimate_phase(lines.view(), how);
        note(half, {"coarse", window, static_cast<int>(points.size()), update.iterations, rms(update.phase)});
        if (plan_.coarse_only) {
            so_far.settled = rms(update.phase) < options_.tolerance;
            so_far.fine = lines_as_they_are(points, lines, so_far.phase);
        }
        add(so_far.phase, update.phase);
        so_far.last = std::move(update);
        watch_.lap("estimate");
    }

    // The points of a coarse round, windowed, with the phase taken out put back.
    [[nodiscard]] FineLines lines_as_they_are(const std::vector<Pixel>& points, Array<cfloat, 2>& lines, const Phase& phase) const {
        FineLines out;
        out.points = points;
        Phase back(phase.size());
        std::transform(phase.begin(), phase.end(), back.begin(), [](double p) { return -p; });
        take_out(back, lines);
        out.contrast = contrasts(lines, phase);
        out.lines = std::move(lines);
        return out;
    }

    void fine_round(Estimate& so_far, int half) {
        so_far.fine = fine_lines(so_far.phase, half);
        so_far.settled = so_far.fine.points.empty();
        if (so_far.settled) return;
        PhaseEstimateOptions how;
        how.estimator = options_.estimator;
        how.max_iterations = plan_.fine_iterations;
        how.tolerance = 1e-3;
        how.linear_terms = false;  // the points are placed to a fraction of a pixel in every round
        how.noise_floor = options_.fine_noise_floor;
        if (options_.estimator == Estimator::maximum_likelihood) how.initial_phase = so_far.phase;
        how.execution = options_.execution;
        so_far.last = estimate_phase(so_far.fine.lines.view(), how);
        const Phase update = difference(so_far.last.phase, so_far.phase);
        add(so_far.phase, update);
        so_far.settled = rms(update) < options_.tolerance;
        note(half, {"fine", 1.0, static_cast<int>(so_far.fine.points.size()), so_far.last.iterations, rms(update)});
        watch_.lap("estimate");
    }

    // The histories of the points that stand out, the strongest maxima first asked.
    [[nodiscard]] FineLines fine_lines(const Phase& phase, int half) {
        FineLines out;
        const std::vector<Pixel> points = choose_fine(phase, half);
        if (points.empty()) return out;
        const Array<cfloat, 2> all = histories(points);
        const std::vector<double> contrast = contrasts(all, phase);
        std::vector<std::size_t> order(points.size());
        std::iota(order.begin(), order.end(), std::size_t{0});
        std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return contrast[a] > contrast[b]; });
        const auto strong = std::count_if(contrast.begin(), contrast.end(), [&](double c) { return c >= options_.minimum_contrast; });
        order.resize(
            std::min(points.size(), std::max(static_cast<std::size_t>(strong), static_cast<std::size_t>(options_.minimum_points))));
        std::sort(order.begin(), order.end());
        out.lines = Array<cfloat, 2>({static_cast<std::ptrdiff_t>(order.size()), all.extent(1)});
        for (std::size_t n = 0; n < order.size(); ++n) {
            out.points.push_back(points[order[n]]);
            out.contrast.push_back(contrast[order[n]]);
            std::copy_n(all.data() + static_cast<std::ptrdiff_t>(order[n]) * all.extent(1), all.extent(1),
                        out.lines.data() + static_cast<std::ptrdiff_t>(n) * all.extent(1));
        }
        watch_.lap("choose points");
        return out;
    }

    // Peak power over that of the speckle that would lie there: the power of the point's history, spread as the image's background is. A
    // scene that fills only a part of what the pulses resolve gathers its speckle in that part.
    [[nodiscard]] std::vector<double> contrasts(const Array<cfloat, 2>& lines, const Phase& phase) const {
        std::vector<SumPower> powers(static_cast<std::size_t>(lines.extent(0)));
        std::vector<cdouble> rotation;
        for (const double p : phase) rotation.push_back(std::polar(1.0, -p));
        parallel_for(options_.execution, "weigh points", lines.extent(0), [&](std::int64_t n) {
            powers[static_cast<std::size_t>(n)] = sum_power(lines.data() + n * lines.extent(1), rotation);
        });
        double filling = 1.0;
        if (!source_.is_list()) {
            std::vector<double> weaker;  // points come strongest first
            for (std::size_t n = powers.size() / 2; n < powers.size(); ++n) weaker.push_back(powers[n].incoherent);
            const double typical = median(std::move(weaker));
            if (typical > 0.0) filling = std::max(background_power(image_.view()) * source_.sum_scale() / typical, 1.0);
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
        const std::vector<double> before = peak_powers(all.fine.lines, Phase(all.phase.size(), 0.0), options_.execution);
        const std::vector<double> after = peak_powers(all.fine.lines, all.phase, options_.execution);
        for (std::size_t n = 0; n < before.size(); ++n)
            out.gain_db.push_back(before[n] > 0.0 ? 10.0 * std::log10(after[n] / before[n]) : 0.0);
        double count = 0.0;
        for (const double std : all.last.phase_std)
            if (std::isfinite(std)) {
                out.mean_variance += std * std;
                count += 1.0;
            }
        if (count > 0.0) out.mean_variance /= count;
        return out;
    }

    // Each half of the scene is judged with the phase that the other half's points gave, from the first round on.
    void judge_on_halves(const Estimate& all) {
        const auto shape = source_.shape();
        const Halves halves(source_, cell_);
        Array<cfloat, 2> before({shape[0], shape[1]});
        source_.form(Phase(all.phase.size(), 0.0), before.view(), options_.execution);
        source_.form(all.phase, image_.view(), options_.execution);
        const Evidence found = evidence(all);
        const bool decided = judged_without_halves(before.view(), image_.view(), halves, found, options_.execution, result_.score);
        watch_.lap("judge");
        if (decided) return;
        for (const int half : {0, 1}) masks_[static_cast<std::size_t>(half)] = halves.mask(half);
        Array<cfloat, 2> from_first({shape[0], shape[1]});
        Array<cfloat, 2> from_second({shape[0], shape[1]});
        source_.form(estimate(0).phase, from_first.view(), options_.execution);
        source_.form(estimate(1).phase, from_second.view(), options_.execution);
        source_.form(all.phase, image_.view(), options_.execution);
        result_.score =
            judge({before.view(), image_.view(), from_first.view(), from_second.view()}, halves, cell_, found, options_.execution);
        watch_.lap("judge");
    }

    PointSource& source_;
    const PointOptions& options_;
    const PointPlan& plan_;
    Result& result_;
    Stopwatch watch_;
    Array<cfloat, 2> image_;
    CellSize cell_;
    std::array<Array<bool, 2>, 2> masks_;  // of the halves, filled when they are needed
    int passes_of_all_ = 1;                // that the estimate from everywhere made
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
