#include "ridge_refine.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>

#include <sarfocus/core/constants.hpp>

namespace sarfocus::autofocus::detail {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double coherent = 0.3;  // below this the phase of a sum is more noise or neighbour than ridge
constexpr double sigma_of_median = 1.4826;

double median(std::vector<double> values) {
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

// A cubic through the nodes with their rates as slopes (Hermite), a line beyond them.
std::vector<double> through(const RidgeTrace& trace, int hop, std::ptrdiff_t first, std::ptrdiff_t last) {
    std::vector<double> out;
    const auto n = static_cast<std::ptrdiff_t>(trace.nodes.size());
    for (std::ptrdiff_t pulse = first; pulse <= last; ++pulse) {
        const double place = static_cast<double>(pulse) / hop - static_cast<double>(trace.nodes.front().node);
        const auto k = std::clamp<std::ptrdiff_t>(static_cast<std::ptrdiff_t>(place), 0, n - 1);
        const RidgeNode& a = trace.nodes[static_cast<std::size_t>(k)];
        const double t = place - static_cast<double>(k);
        const auto from = static_cast<double>(a.bin);
        if (k == n - 1) {
            out.push_back(from + t * a.rate);
            continue;
        }
        const RidgeNode& b = trace.nodes[static_cast<std::size_t>(k + 1)];
        const double rise = static_cast<double>(b.bin) - from;
        out.push_back(from + t * (a.rate + t * (3.0 * rise - 2.0 * a.rate - b.rate + t * (a.rate + b.rate - 2.0 * rise))));
    }
    return out;
}

class Refinement {
public:
    Refinement(const ImageView& samples, const RidgeGrid& grid, const RidgeTrace& trace, double resolution)
        : samples_(samples), half_wave_(0.5 * grid.wavelength / grid.step), resolution_(resolution) {
        first_ = trace.nodes.front().node * grid.hop;
        const std::ptrdiff_t last = std::min((trace.nodes.back().node + 1) * grid.hop, samples.extent(0)) - 1;
        bin_ = through(trace, grid.hop, first_, last);
    }

    // Takes the phase of the sums off, unwrapped along the ridge.
    void follow(int half_window) {
        sum(half_window);
        double turns = 0.0;
        double before = 0.0;
        for (std::size_t k = 0; k < bin_.size(); ++k) {
            const double phase = std::arg(sum_[k]) / (2.0 * pi);
            if (k > 0) turns -= std::round(phase + turns - before);
            before = phase + turns;
            bin_[k] -= before * half_wave_;
        }
    }

    RefinedRidge result(int half_window) {
        sum(half_window);
        const std::vector<double> offset = envelope(half_window);
        RefinedRidge out;
        out.bin.assign(static_cast<std::size_t>(samples_.extent(0)), nan);
        std::vector<double> whole;
        for (std::size_t begin = 0; begin < bin_.size();) {
            if (coherence_[begin] < coherent) {
                ++begin;
                continue;
            }
            std::size_t end = begin;
            while (end < bin_.size() && coherence_[end] >= coherent) ++end;
            if (static_cast<int>(end - begin) > half_window) piece(begin, end, offset, whole, out);
            begin = end;
        }
        finish(whole, out);
        return out;
    }

private:
    [[nodiscard]] cdouble sample(std::size_t k, double bin) const {
        if (!(bin >= 0.0 && bin < static_cast<double>(samples_.extent(1) - 1))) return {};
        const auto low = static_cast<std::ptrdiff_t>(bin);
        const double rest = bin - static_cast<double>(low);
        const auto pulse = first_ + static_cast<std::ptrdiff_t>(k);
        const cdouble value = (1.0 - rest) * cdouble(samples_(pulse, low)) + rest * cdouble(samples_(pulse, low + 1));
        return value * std::polar(1.0, 2.0 * pi * bin / half_wave_);
    }

    // Sums along the ridge, `shift` bins beside it.
    void sum(int half_window, double shift = 0.0) {
        const std::vector<double> window = hann_weights(half_window);
        const auto n = static_cast<std::ptrdiff_t>(bin_.size());
        std::vector<cdouble> line;
        for (std::size_t k = 0; k < bin_.size(); ++k) line.push_back(sample(k, bin_[k] + shift));
        sum_.assign(bin_.size(), {});
        coherence_.assign(bin_.size(), 0.0);
        for (std::ptrdiff_t k = 0; k < n; ++k) {
            cdouble total{};
            double power = 0.0;
            double weights = 0.0;
            for (std::ptrdiff_t j = std::max<std::ptrdiff_t>(0, k - half_window); j <= std::min(n - 1, k + half_window); ++j) {
                const double w = window[static_cast<std::size_t>(j - k + half_window)];
                total += w * line[static_cast<std::size_t>(j)];
                power += w * std::norm(line[static_cast<std::size_t>(j)]);
                weights += w;
            }
            sum_[static_cast<std::size_t>(k)] = total / weights;
            coherence_[static_cast<std::size_t>(k)] = power > 0.0 ? std::norm(total) / (weights * power) : 0.0;
        }
    }

    // Bins from the ridge to the peak of the envelope, within a range cell.
    std::vector<double> envelope(int half_window) {
        const auto reach = static_cast<int>(std::ceil(resolution_));
        const std::vector<cdouble> kept_sum = sum_;
        const std::vector<double> kept_coherence = coherence_;
        std::vector<std::vector<double>> level;
        for (int shift = -reach; shift <= reach; ++shift) {
            sum(half_window, shift);
            level.emplace_back();
            for (const cdouble& s : sum_) level.back().push_back(std::abs(s));
        }
        sum_ = kept_sum;
        coherence_ = kept_coherence;
        std::vector<double> out;
        for (std::size_t k = 0; k < bin_.size(); ++k) {
            std::size_t top = 0;
            for (std::size_t s = 1; s < level.size(); ++s)
                if (level[s][k] > level[top][k]) top = s;
            double peak = static_cast<double>(top) - reach;
            if (top > 0 && top + 1 < level.size()) {
                const double curvature = level[top - 1][k] - 2.0 * level[top][k] + level[top + 1][k];
                if (curvature < 0.0) peak += 0.5 * (level[top - 1][k] - level[top + 1][k]) / curvature;
            }
            out.push_back(peak);
        }
        return out;
    }

    // A stretch without interruption: shifted by whole half waves to where the envelope says the others are.
    void piece(std::size_t begin, std::size_t end, const std::vector<double>& offset, std::vector<double>& whole, RefinedRidge& out) {
        const std::vector<double> here(offset.begin() + static_cast<std::ptrdiff_t>(begin),
                                       offset.begin() + static_cast<std::ptrdiff_t>(end));
        const double slip = whole.empty() ? 0.0 : half_wave_ * std::round((median(here) - median(whole)) / half_wave_);
        for (std::size_t k = begin; k < end; ++k) {
            out.bin[static_cast<std::size_t>(first_) + k] = bin_[k] + slip;
            whole.push_back(offset[k] - slip);
            out.power += std::norm(sum_[k]);
            out.coherence += coherence_[k];
        }
    }

    static void finish(const std::vector<double>& whole, RefinedRidge& out) {
        if (whole.empty()) return;
        const auto n = static_cast<double>(whole.size());
        const double centre = median(whole);
        std::vector<double> away;
        for (const double value : whole) away.push_back(std::abs(value - centre));
        out.envelope_std = sigma_of_median * median(away);
        out.power /= n;
        out.coherence /= n;
        for (double& bin : out.bin) bin += centre;
    }

    const ImageView& samples_;
    double half_wave_;   // bins
    double resolution_;  // bins
    std::ptrdiff_t first_ = 0;
    std::vector<double> bin_;
    std::vector<cdouble> sum_;
    std::vector<double> coherence_;
};

}  // namespace

RefinedRidge refine(const ImageView& samples, const RidgeGrid& grid, const RidgeTrace& trace, double resolution) {
    Refinement refinement(samples, grid, trace, resolution);
    const int narrow = std::max(1, grid.half_window / 2);
    refinement.follow(grid.half_window);
    refinement.follow(narrow);
    refinement.follow(narrow);
    return refinement.result(narrow);
}

}  // namespace sarfocus::autofocus::detail
