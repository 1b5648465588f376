#include <sarfocus/autofocus/strip.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <string>

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>

#include <sarfocus/core/constants.hpp>
#include <sarfocus/core/error.hpp>

#include "strip_lines.hpp"

namespace sarfocus::autofocus {
namespace {

using detail::at;

constexpr double detectable = 10.0;  // peak of a periodogram over its mean: noise of some hundred cells reaches about 6
constexpr int rounds = 25;

double looks_of(const Apertures& a, const Seam& seam) {
    return static_cast<double>(seam.overlap) / std::max(a.samples_per_look(seam.first), a.samples_per_look(seam.second));
}

// Points joined by seams in use, numbered in the order of their first point.
class Segments {
public:
    explicit Segments(std::size_t n) : parent_(n) { std::iota(parent_.begin(), parent_.end(), std::size_t{0}); }
    void join(std::size_t a, std::size_t b) {
        const std::size_t x = root(a);
        const std::size_t y = root(b);
        parent_[std::max(x, y)] = std::min(x, y);
    }
    std::size_t root(std::size_t i) {
        while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
        return i;
    }

private:
    std::vector<std::size_t> parent_;
};

void number_segments(Stitching& out, const std::vector<bool>& use) {
    const std::size_t n = out.slope.size();
    Segments segments(n);
    for (const Seam& seam : out.seams)
        if (seam.weight > 0.0) segments.join(static_cast<std::size_t>(seam.first), static_cast<std::size_t>(seam.second));
    out.segment.assign(n, -1);
    out.segments = 0;
    for (std::size_t i = 0; i < n; ++i) {
        if (!use[i]) continue;
        const std::size_t root = segments.root(i);
        out.segment[i] = root == i ? out.segments++ : out.segment[root];
    }
}

// Least squares for b over r = b_first - b_second; the first point of every segment is held at zero.
Eigen::VectorXd solve(const Stitching& stitching, const std::vector<double>& weight) {
    const auto n = static_cast<Eigen::Index>(stitching.slope.size());
    std::vector<bool> held(static_cast<std::size_t>(stitching.segments), false);
    std::vector<Eigen::Triplet<double>> entries;
    Eigen::VectorXd right = Eigen::VectorXd::Zero(n);
    const double scale = *std::max_element(weight.begin(), weight.end());
    for (std::size_t s = 0; s < weight.size(); ++s) {
        if (!(weight[s] > 0.0)) continue;
        const Seam& seam = stitching.seams[s];
        const double w = std::max(weight[s] / scale, 1e-9);  // a seam outvoted by all others still holds its points together
        const auto i = static_cast<Eigen::Index>(seam.first);
        const auto j = static_cast<Eigen::Index>(seam.second);
        entries.emplace_back(i, i, w);
        entries.emplace_back(j, j, w);
        entries.emplace_back(std::max(i, j), std::min(i, j), -w);
        right(i) += w * seam.slope;
        right(j) -= w * seam.slope;
    }
    for (Eigen::Index i = 0; i < n; ++i) {
        const int segment = stitching.segment[static_cast<std::size_t>(i)];
        const bool hold = segment < 0 || !held[static_cast<std::size_t>(segment)];
        if (segment >= 0) held[static_cast<std::size_t>(segment)] = true;
        entries.emplace_back(i, i, hold ? 1e3 : 0.0);
    }
    Eigen::SparseMatrix<double> matrix(n, n);
    matrix.setFromTriplets(entries.begin(), entries.end());
    const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factor(matrix);
    return factor.solve(right);
}

// A segment that lies mostly within the apertures of one with more points is no part of the strip that hangs on its own, but points that
// fit nothing: they go (-1), and the others are numbered anew.
void drop_misfits(const Apertures& apertures, Stitching& out) {
    std::vector<std::ptrdiff_t> size(static_cast<std::size_t>(out.segments), 0);
    std::vector<std::vector<bool>> covered(size.size(), std::vector<bool>(at(apertures.n_azimuth), false));
    for (std::size_t n = 0; n < out.segment.size(); ++n) {
        if (out.segment[n] < 0) continue;
        const auto s = static_cast<std::size_t>(out.segment[n]);
        ++size[s];
        for (std::ptrdiff_t k = 0; k < apertures.count[n]; ++k) covered[s][at(apertures.start[n] + k)] = true;
    }
    std::vector<std::size_t> order(size.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return size[a] > size[b]; });
    std::vector<bool> taken(at(apertures.n_azimuth), false);
    std::vector<bool> kept(size.size(), false);
    for (const std::size_t s : order) {
        std::ptrdiff_t reach = 0;
        std::ptrdiff_t shared = 0;
        for (std::size_t k = 0; k < taken.size(); ++k) {
            reach += covered[s][k] ? 1 : 0;
            shared += covered[s][k] && taken[k] ? 1 : 0;
        }
        kept[s] = 2 * shared <= reach;
        for (std::size_t k = 0; kept[s] && k < taken.size(); ++k)
            if (covered[s][k]) taken[k] = true;
    }
    std::vector<int> number(size.size(), -1);
    out.segments = 0;
    for (std::size_t n = 0; n < out.segment.size(); ++n) {
        if (out.segment[n] < 0) continue;
        const auto s = static_cast<std::size_t>(out.segment[n]);
        if (kept[s] && number[s] < 0) number[s] = out.segments++;
        out.segment[n] = number[s];
    }
}

}  // namespace

namespace detail {

Stitching stitch_some(const Apertures& apertures, const std::vector<Seam>& seams, const std::vector<bool>& use) {
    Stitching out;
    out.seams = seams;
    out.slope.assign(at(apertures.size()), 0.0);
    std::vector<double> base(seams.size(), 0.0);
    for (std::size_t s = 0; s < seams.size(); ++s) {
        Seam& seam = out.seams[s];
        if (seam.first < 0 || seam.first >= apertures.size() || seam.second < 0 || seam.second >= apertures.size() ||
            seam.first == seam.second)
            throw ValueError("seams", "pairs of the " + std::to_string(apertures.size()) + " points",
                             std::to_string(seam.first) + ", " + std::to_string(seam.second));
        const bool used = use[at(seam.first)] && use[at(seam.second)] && seam.coherence * looks_of(apertures, seam) > detectable;
        if (used && seam.slope_std > 0.0) base[s] = 1.0 / (seam.slope_std * seam.slope_std);
        seam.weight = base[s];
        seam.residual = 0.0;
    }
    number_segments(out, use);
    std::vector<double> weight = base;
    for (int round = 0; round < rounds && std::any_of(base.begin(), base.end(), [](double w) { return w > 0.0; }); ++round) {
        const Eigen::VectorXd slope = solve(out, weight);
        for (std::size_t n = 0; n < out.slope.size(); ++n) out.slope[n] = slope(static_cast<Eigen::Index>(n));
        for (std::size_t s = 0; s < seams.size(); ++s) {
            if (!(base[s] > 0.0)) continue;
            Seam& seam = out.seams[s];
            seam.residual = seam.slope - (out.slope[at(seam.first)] - out.slope[at(seam.second)]);
            // Half a cell of the overlap's periodogram: a seam farther off sits on another peak.
            const double scale = std::max(pi / static_cast<double>(seam.overlap), 3.0 * seam.slope_std);
            const double x = seam.residual / scale;
            weight[s] = base[s] / ((1.0 + x * x) * (1.0 + x * x));
        }
    }
    drop_misfits(apertures, out);
    double total = 0.0;
    for (const double w : weight) total += w;
    for (std::size_t s = 0; s < seams.size(); ++s) out.seams[s].weight = total > 0.0 ? weight[s] / total : 0.0;
    for (int segment = 0; segment < out.segments; ++segment) {
        double sum = 0.0;
        double count = 0.0;
        for (std::size_t n = 0; n < out.slope.size(); ++n)
            if (out.segment[n] == segment) {
                sum += out.slope[n];
                count += 1.0;
            }
        for (std::size_t n = 0; n < out.slope.size(); ++n)
            if (out.segment[n] == segment) out.slope[n] -= sum / count;
    }
    return out;
}

}  // namespace detail

Stitching stitch(const Apertures& apertures, const std::vector<Seam>& seams) {
    return detail::stitch_some(apertures, seams, std::vector<bool>(at(apertures.size()), true));
}

}  // namespace sarfocus::autofocus
