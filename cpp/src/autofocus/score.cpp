#include "score.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

#include <sarfocus/quality/image_measures.hpp>

namespace sarfocus::autofocus::detail {
namespace {

std::string sentence(const char* format, double a, double b) {
    char text[200];
    std::snprintf(text, sizeof text, format, a, b);
    return text;
}

}  // namespace

Halves::Halves(const PixelLayout& layout, const CellSize& cell) : n_azimuth_(layout.shape()[0]) {
    const auto shape = layout.shape();
    for (std::ptrdiff_t j = 0; j < shape[1]; ++j) gate_.push_back(layout.range_gate(j));
    constexpr double cells_per_piece = 24.0;  // wider than a point's response with its sidelobes, many pieces in any image worth the name
    range_piece_ = std::max<std::ptrdiff_t>(std::lround(layout.fractional_columns() ? cells_per_piece * cell.range : 4.0 * cell.range), 1);
    azimuth_piece_ = layout.fractional_columns() ? std::max<std::ptrdiff_t>(std::lround(cells_per_piece * cell.azimuth), 1) : shape[0];
}

int Halves::of(std::ptrdiff_t azimuth, std::ptrdiff_t column) const {
    return static_cast<int>((azimuth / azimuth_piece_ + gate_[static_cast<std::size_t>(column)] / range_piece_) % 2);
}

Array<bool, 2> Halves::mask(int half) const {
    Array<bool, 2> out({n_azimuth_, static_cast<std::ptrdiff_t>(gate_.size())});
    for (std::ptrdiff_t i = 0; i < out.extent(0); ++i)
        for (std::ptrdiff_t j = 0; j < out.extent(1); ++j) out(i, j) = of(i, j) == half;
    return out;
}

double HalfSums::log_sharpness() const {
    return square > 0.0 ? std::log(square) - 2.0 * std::log(power) : 0.0;
}

HalfSums sums_of(const ImageView& image, const Halves& halves, int half) {
    HalfSums out;
    for (std::ptrdiff_t i = 0; i < image.extent(0); ++i)
        for (std::ptrdiff_t j = 0; j < image.extent(1); ++j) {
            if (halves.of(i, j) != half) continue;
            out.add(std::norm(cdouble(image(i, j))));
        }
    return out;
}

namespace {

constexpr double sigmas = 3.0;

// Gain in log sharpness of each half with the other half's phase; returns the smaller of the two.
double held_out(const TrialSums& trial, const CellSize& cell, Score& score) {
    double worst = std::numeric_limits<double>::infinity();
    double variance = 0.0;
    for (const std::size_t half : {0U, 1U}) {
        const HalfSums& before = trial.before[half];
        const HalfSums& after = trial.held_out[half];
        const double gain = after.log_sharpness() - before.log_sharpness();
        score.held_out_gain += 0.5 * gain;
        worst = std::min(worst, gain);
        // The log sharpness of n cells of speckle scatters by 1 / sqrt(n); a difference of two by sqrt(2) of that.
        const double cells = std::max(before.pixels / (cell.azimuth * cell.range), 1.0);
        variance += 0.25 * 2.0 / cells;
    }
    score.held_out_noise = std::sqrt(variance);
    return worst;
}

double weighted_mean(const std::vector<double>& values, const std::vector<double>& weights) {
    double sum = 0.0;
    for (std::size_t n = 0; n < values.size(); ++n) sum += weights[n] * values[n];
    return sum;
}

// Judged by the points themselves, because the other half has none to speak of.
void judge_alone(const Evidence& evidence, Score& score) {
    const double coherence = weighted_mean(evidence.coherence, evidence.weight);
    // Noise of any phase history reaches pi / 4 when every pulse is turned to the same phase; 0.9 is a signal 10 dB above its noise.
    constexpr double steady = 0.9;
    // Turning every pulse to the noise's phase raises a peak by the variance of that phase, (1 - c) / 2c for a single point of coherence c.
    const double variance = std::max(evidence.mean_variance, (1.0 - coherence) / (2.0 * coherence));
    const double explained_db = 10.0 * std::log10(1.0 + sigmas * variance);
    if (!(coherence >= steady))
        score.reason =
            sentence("the few strong points are unsteady (coherence %.2f, %.2f needed) and no other part of the scene confirms them",
                     coherence, steady);
    else if (!(score.point_gain_db > explained_db))
        score.reason =
            sentence("the strong points gained %.3f dB, fitting their noise explains %.3f dB", score.point_gain_db, explained_db);
    else {
        score.improved = true;
        score.reason = sentence("the few strong points, steady (coherence %.2f), gained %.2f dB", coherence, score.point_gain_db);
    }
}

}  // namespace

bool one_sided(const Halves& halves, const Evidence& evidence) {
    double share = 0.0;
    for (std::size_t n = 0; n < evidence.points.size(); ++n)
        if (halves.of(std::lround(evidence.points[n].azimuth), std::lround(evidence.points[n].column)) == 0) share += evidence.weight[n];
    constexpr double too_little = 0.1;
    return std::min(share, 1.0 - share) < too_little;
}

bool judged_without_halves(const TrialSums& trial, const Halves& halves, const Evidence& evidence, Score& score) {
    score.entropy_before = trial.entropy_before;
    score.entropy_after = trial.entropy_after;
    score.point_gain_db = weighted_mean(evidence.gain_db, evidence.weight);
    if (!(score.entropy_after < score.entropy_before))
        score.reason = sentence("entropy did not fall: %.4f before, %.4f nat after", score.entropy_before, score.entropy_after);
    else if (one_sided(halves, evidence))
        judge_alone(evidence, score);
    else if (!(score.point_gain_db >= 0.0))
        score.reason = sentence("the strong points lost %.3f dB on average, though entropy fell by %.4f nat", -score.point_gain_db,
                                score.entropy_before - score.entropy_after);
    return !score.reason.empty();
}

void judge_held_out(const TrialSums& trial, const CellSize& cell, Score& score) {
    const double worst = held_out(trial, cell, score);
    if (!(score.held_out_gain > sigmas * score.held_out_noise))
        score.reason = sentence("held-out sharpness changed by %+.4f nat, not above three times its noise of %.4f", score.held_out_gain,
                                score.held_out_noise);
    else if (!(worst > -sigmas * score.held_out_noise))
        score.reason = sentence("one half of the scene lost %.4f nat of sharpness (noise %.4f)", -worst, score.held_out_noise);
    else {
        score.improved = true;
        score.reason = sentence("held-out sharpness rose by %.4f nat (noise %.4f)", score.held_out_gain, score.held_out_noise);
    }
}

Score judge(const Trial& trial, const Halves& halves, const CellSize& cell, const Evidence& evidence, const Execution& execution) {
    Score score;
    TrialSums sums;
    sums.entropy_before = quality::entropy(trial.before, execution);
    sums.entropy_after = quality::entropy(trial.after, execution);
    if (judged_without_halves(sums, halves, evidence, score)) return score;
    sums.before = {sums_of(trial.before, halves, 0), sums_of(trial.before, halves, 1)};
    sums.held_out = {sums_of(trial.from_second, halves, 0), sums_of(trial.from_first, halves, 1)};
    judge_held_out(sums, cell, score);
    return score;
}

}  // namespace sarfocus::autofocus::detail
