#include "ridge_search.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstdint>
#include <utility>

#include <sarfocus/core/constants.hpp>

namespace sarfocus::autofocus::detail {
namespace {

constexpr float blanked = -100.0f;
constexpr float unreachable = -1e30f;
constexpr std::uint8_t start_here = 0;

// How a state is reached: from the rate `rate_change` above, over a number of bins midway between both rates, rounded down or up.
struct Move {
    int rate_change;
    bool up;
};
constexpr Move moves[] = {{-1, false}, {-1, true}, {0, false}, {1, false}, {1, true}};
constexpr std::uint8_t n_move = 5;

std::ptrdiff_t bins_of(const Move& move, int rate) {
    const int twice = 2 * rate + move.rate_change;
    const int down = (twice >= 0 ? twice : twice - 1) / 2;
    return down + (move.up ? 1 : 0);
}

// One rate at one node: the sums over all bins.
class SlopeSum {
public:
    SlopeSum(const ImageView& samples, const RidgeGrid& grid)
        : samples_(samples), grid_(grid), window_(hann_weights(grid.half_window)), sum_(static_cast<std::size_t>(grid.n_bin)) {}

    void run(std::ptrdiff_t node, int rate, const ArrayView<float, 1>& out) {
        std::fill(sum_.begin(), sum_.end(), cfloat{});
        double squares = 0.0;
        const std::ptrdiff_t centre = node * grid_.hop;
        for (int k = -grid_.half_window; k <= grid_.half_window; ++k) {
            const std::ptrdiff_t pulse = centre + k;
            if (pulse < 0 || pulse >= samples_.extent(0)) continue;
            const double weight = window_[static_cast<std::size_t>(std::ptrdiff_t{k} + grid_.half_window)];
            squares += weight * weight;
            add(pulse, weight, static_cast<double>(rate * k) / grid_.hop);
        }
        for (std::ptrdiff_t bin = 0; bin < grid_.n_bin; ++bin)
            out(bin) = std::norm(sum_[static_cast<std::size_t>(bin)]) / static_cast<float>(squares);
    }

private:
    void add(std::ptrdiff_t pulse, double weight, double shift) {
        const auto whole = static_cast<std::ptrdiff_t>(std::floor(shift));
        const double rest = shift - static_cast<double>(whole);
        const cdouble turn = std::polar(weight, 4.0 * pi * shift * grid_.step / grid_.wavelength);
        const cfloat here((1.0 - rest) * turn);
        const cfloat next(rest * turn);
        const std::ptrdiff_t first = std::max<std::ptrdiff_t>(0, -whole);
        const std::ptrdiff_t last = std::min(grid_.n_bin, grid_.n_bin - 1 - whole);
        for (std::ptrdiff_t bin = first; bin < last; ++bin) {
            const cfloat a = samples_(pulse, bin + whole);
            const cfloat b = samples_(pulse, bin + whole + 1);
            sum_[static_cast<std::size_t>(bin)] +=
                cfloat(here.real() * a.real() - here.imag() * a.imag() + next.real() * b.real() - next.imag() * b.imag(),
                       here.real() * a.imag() + here.imag() * a.real() + next.real() * b.imag() + next.imag() * b.real());
        }
    }

    const ImageView& samples_;
    const RidgeGrid& grid_;
    std::vector<double> window_;
    std::vector<cfloat> sum_;
};

}  // namespace

std::vector<double> hann_weights(int half_width) {
    std::vector<double> out;
    for (int k = -half_width; k <= half_width; ++k) out.push_back(0.5 + 0.5 * std::cos(pi * k / (half_width + 1.0)));
    return out;
}

Array<float, 3> slope_power(const ImageView& samples, const RidgeGrid& grid, const Execution& execution) {
    Array<float, 3> out({grid.n_node, 2 * grid.rates + 1, grid.n_bin});
    parallel_for(execution, "slopes", grid.n_node, [&](std::int64_t node) {
        SlopeSum sum(samples, grid);
        for (int rate = -grid.rates; rate <= grid.rates; ++rate)
            sum.run(node, rate, {&out(node, rate + grid.rates, 0), std::array<std::ptrdiff_t, 1>{grid.n_bin}});
    });
    return out;
}

RidgeTrace best_trace(const ArrayView<const float, 3>& score) {
    const std::ptrdiff_t n_node = score.extent(0);
    const std::ptrdiff_t n_rate = score.extent(1);
    const std::ptrdiff_t n_bin = score.extent(2);
    const auto rates = static_cast<int>((n_rate - 1) / 2);
    Array<std::uint8_t, 3> came({n_node, n_rate, n_bin});
    Array<float, 2> before({n_rate, n_bin});
    Array<float, 2> now({n_rate, n_bin});
    std::fill(before.begin(), before.end(), unreachable);
    RidgeNode end{-1, 0, 0};
    float best = 0.0f;
    for (std::ptrdiff_t node = 0; node < n_node; ++node) {
        for (std::ptrdiff_t r = 0; r < n_rate; ++r) {
            const int rate = static_cast<int>(r) - rates;
            for (std::ptrdiff_t bin = 0; bin < n_bin; ++bin) now(r, bin) = 0.0f;
            for (std::uint8_t m = 0; m < n_move; ++m) {
                const std::ptrdiff_t other = r + moves[m].rate_change;
                if (other < 0 || other >= n_rate) continue;
                const std::ptrdiff_t bins = bins_of(moves[m], rate);
                const std::ptrdiff_t first = std::max<std::ptrdiff_t>(0, bins);
                const std::ptrdiff_t last = std::min(n_bin, n_bin + bins);
                for (std::ptrdiff_t bin = first; bin < last; ++bin)
                    if (before(other, bin - bins) > now(r, bin)) {
                        now(r, bin) = before(other, bin - bins);
                        came(node, r, bin) = static_cast<std::uint8_t>(m + 1);
                    }
            }
            for (std::ptrdiff_t bin = 0; bin < n_bin; ++bin) {
                now(r, bin) += score(node, r, bin);
                if (now(r, bin) > best) {
                    best = now(r, bin);
                    end = {node, bin, rate};
                }
            }
        }
        std::swap(before, now);
    }
    RidgeTrace out;
    if (end.node < 0) return out;
    out.score = best;
    for (RidgeNode at = end;;) {
        out.nodes.push_back(at);
        const std::uint8_t move = came(at.node, at.rate + rates, at.bin);
        if (move == start_here) break;
        const Move& how = moves[move - 1];
        at = {at.node - 1, at.bin - bins_of(how, at.rate), at.rate + how.rate_change};
    }
    std::reverse(out.nodes.begin(), out.nodes.end());
    return out;
}

void blank(const RidgeTrace& trace, std::ptrdiff_t bins, int rates, const ArrayView<float, 3>& score) {
    const auto middle = static_cast<int>((score.extent(1) - 1) / 2);
    for (const RidgeNode& at : trace.nodes) {
        const int low = std::max(0, at.rate + middle - rates);
        const int high = std::min(2 * middle, at.rate + middle + rates);
        for (int r = low; r <= high; ++r)
            for (std::ptrdiff_t bin = std::max<std::ptrdiff_t>(0, at.bin - bins); bin <= std::min(score.extent(2) - 1, at.bin + bins);
                 ++bin)
                score(at.node, r, bin) = blanked;
    }
}

}  // namespace sarfocus::autofocus::detail
