// Phase, constants and linear terms of all points together: Gauss-Newton on the likelihood of the dechirped lines, with the prior of a
// cubic smoothing spline whose weight has the largest evidence.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>

#include <sarfocus/autofocus/phase_estimate.hpp>
#include <sarfocus/core/constants.hpp>
#include <sarfocus/core/error.hpp>

#include "strip_lines.hpp"

namespace sarfocus::autofocus::detail {
namespace {

using Vector = Eigen::VectorXd;
using Matrix = Eigen::SparseMatrix<double>;
using Eigen::Index;

constexpr int inner_steps = 2;                   // Gauss-Newton steps between two looks at the samples
constexpr std::ptrdiff_t deviation_knots = 128;  // at most about so many knots get a posterior deviation; between them it is interpolated
constexpr double clean = 1e-3;                   // no line is believed to have less noise than this share of its signal in a knot

// A point's line, averaged over the knots it reaches, with the current phase and linear term taken out.
struct BinnedLine {
    std::ptrdiff_t point = 0;
    std::ptrdiff_t first = 0;    // knot
    std::vector<cdouble> sum;    // of root weight times whitened sample
    std::vector<double> weight;  // sum of weights
    std::vector<double> offset;  // (slow time of the knot less that of the point) / half aperture
    double half_aperture = 1.0;
    cdouble amplitude;
    double noise = 0.0;  // of a sample of weight 1
};

// Natural cubic spline through values at knots 0, 1, …, continued as lines.
class Spline {
public:
    explicit Spline(const std::vector<double>& values) : y_(values), m_(values.size(), 0.0) {
        const auto n = static_cast<std::ptrdiff_t>(values.size());
        if (n < 3) return;
        std::vector<double> c(values.size(), 0.0);
        for (std::ptrdiff_t i = 1; i < n - 1; ++i) {
            const double right = 6.0 * (y_[at(i + 1)] - 2.0 * y_[at(i)] + y_[at(i - 1)]);
            const double pivot = 4.0 - c[at(i - 1)];
            c[at(i)] = 1.0 / pivot;
            m_[at(i)] = (right - m_[at(i - 1)]) / pivot;
        }
        for (std::ptrdiff_t i = n - 3; i > 0; --i) m_[at(i)] -= c[at(i)] * m_[at(i + 1)];
    }

    [[nodiscard]] double operator()(double x) const {
        const auto n = static_cast<std::ptrdiff_t>(y_.size());
        if (n == 1) return y_[0];
        const auto i = std::clamp<std::ptrdiff_t>(static_cast<std::ptrdiff_t>(std::floor(x)), 0, n - 2);
        const double t = x - static_cast<double>(i);
        const double y0 = y_[at(i)];
        const double y1 = y_[at(i + 1)];
        if (t < 0.0) return y0 + t * (y1 - y0 - m_[at(i + 1)] / 6.0);
        if (t > 1.0) return y1 + (t - 1.0) * (y1 - y0 + m_[at(i)] / 6.0);
        const double u = 1.0 - t;
        return u * y0 + t * y1 + ((u * u * u - u) * m_[at(i)] + (t * t * t - t) * m_[at(i + 1)]) / 6.0;
    }

private:
    std::vector<double> y_;
    std::vector<double> m_;  // second derivatives
};

class SegmentRefinement {
public:
    SegmentRefinement(const Apertures& apertures, std::vector<std::ptrdiff_t> points, const SegmentSpan& span, double knot,
                      const StripRefineOptions& options)
        : apertures_(apertures), points_(std::move(points)), span_(span), knot_(knot), options_(options) {
        n_ = static_cast<std::ptrdiff_t>(std::ceil(static_cast<double>(span.end - span.begin) / knot_));
    }

    void run(const CoherentPhase& start, StripPhase& out) {
        sample_start(start);
        slope_.clear();
        for (const std::ptrdiff_t p : points_) slope_.push_back(start.slope[at(p)]);
        for (int round = 0; round < options_.rounds; ++round) {
            take_lines();
            const double change = settle(round);
            if (change < options_.tolerance && round > 0) break;
        }
        take_lines();
        assemble();
        factorise(lambda_);
        finish(out);
    }

private:
    [[nodiscard]] double centre(std::ptrdiff_t m) const {
        return static_cast<double>(span_.begin) + knot_ * (static_cast<double>(m) + 0.5) - 0.5;
    }
    [[nodiscard]] std::ptrdiff_t knot_of(std::ptrdiff_t k) const {
        return std::clamp<std::ptrdiff_t>(static_cast<std::ptrdiff_t>((static_cast<double>(k - span_.begin) + 0.5) / knot_), 0, n_ - 1);
    }

    // Knot values of the coherent phase; beyond the apertures a line.
    void sample_start(const CoherentPhase& start) {
        phase_.assign(at(n_), 0.0);
        std::vector<double> count(at(n_), 0.0);
        for (std::ptrdiff_t k = span_.begin; k < span_.end; ++k) {
            if (!start.reached[at(k)]) continue;
            phase_[at(knot_of(k))] += start.phase[at(k)];
            count[at(knot_of(k))] += 1.0;
        }
        std::ptrdiff_t first = n_;
        std::ptrdiff_t last = -1;
        for (std::ptrdiff_t m = 0; m < n_; ++m)
            if (count[at(m)] > 0.0) {
                phase_[at(m)] /= count[at(m)];
                first = std::min(first, m);
                last = m;
            }
        // Only the ends can be without samples: the apertures of a segment hang together.
        const std::ptrdiff_t reach = std::clamp<std::ptrdiff_t>((last - first) / 4, 1, 8);
        const auto line = [&](std::ptrdiff_t from, std::ptrdiff_t to) {
            return last > first ? (phase_[at(to)] - phase_[at(from)]) / static_cast<double>(std::max<std::ptrdiff_t>(to - from, 1)) : 0.0;
        };
        const double before = line(first, std::min(first + reach, last));
        const double behind = line(std::max(last - reach, first), last);
        for (std::ptrdiff_t m = 0; m < first && first < n_; ++m)
            phase_[at(m)] = phase_[at(first)] + before * static_cast<double>(m - first);
        for (std::ptrdiff_t m = last + 1; m < n_ && last >= 0; ++m)
            phase_[at(m)] = phase_[at(last)] + behind * static_cast<double>(m - last);
        for (std::ptrdiff_t m = first + 1; m < last; ++m)
            if (count[at(m)] == 0.0) phase_[at(m)] = phase_[at(m - 1)];
    }

    [[nodiscard]] std::vector<double> samples() const {
        const Spline spline(phase_);
        std::vector<double> out(at(apertures_.n_azimuth), 0.0);
        for (std::ptrdiff_t k = span_.begin; k < span_.end; ++k) out[at(k)] = spline((static_cast<double>(k) - centre(0)) / knot_);
        return out;
    }

    void take_lines() {
        const std::vector<cdouble> rotation = rotation_of(samples());
        lines_.assign(points_.size(), {});
        parallel_for(options_.execution, "refine", static_cast<std::int64_t>(points_.size()), [&](std::int64_t i) {
            const std::ptrdiff_t p = points_[at(i)];
            const std::vector<cdouble> line = whitened_line(apertures_, p, rotation, slope_[at(i)]);
            const std::ptrdiff_t start = apertures_.start[at(p)];
            BinnedLine out;
            out.point = p;
            const std::ptrdiff_t begin = std::max(start, span_.begin);
            const std::ptrdiff_t end = std::min(start + apertures_.count[at(p)], span_.end);
            if (end <= begin) return;
            out.first = knot_of(begin);
            const auto knots = static_cast<std::size_t>(knot_of(end - 1) - out.first + 1);
            out.sum.assign(knots, cdouble{});
            out.weight.assign(knots, 0.0);
            out.half_aperture = 0.5 * static_cast<double>(apertures_.count[at(p)]);
            for (std::ptrdiff_t k = begin; k < end; ++k) {
                const auto w = static_cast<double>(apertures_.weight(p, k - start));
                out.sum[at(knot_of(k) - out.first)] += std::sqrt(w) * line[at(k - start)];
                out.weight[at(knot_of(k) - out.first)] += w;
            }
            for (std::size_t m = 0; m < knots; ++m)
                out.offset.push_back(
                    (centre(out.first + static_cast<std::ptrdiff_t>(m)) - static_cast<double>(apertures_.points[at(p)].azimuth)) /
                    out.half_aperture);
            lines_[at(i)] = std::move(out);
        });
        step_ = Vector::Zero(n_);
        turn_.assign(points_.size(), {0.0, 0.0});
    }

    // Fits amplitude and noise of a line that has been turned by the current steps.
    void fit(BinnedLine& line, const std::array<double, 2>& turn) const {
        cdouble sum{};
        double weights = 0.0;
        std::vector<cdouble> turned(line.sum.size());
        for (std::size_t m = 0; m < line.sum.size(); ++m) {
            turned[m] = line.sum[m] * std::polar(1.0, -step_(line.first + static_cast<Index>(m)) - turn[0] - turn[1] * line.offset[m]);
            sum += turned[m];
            weights += line.weight[m];
        }
        line.amplitude = weights > 0.0 ? sum / weights : cdouble{};
        // The common phase follows the noise a little and takes it out of the residual, but not out of its part along the signal.
        const cdouble back = line.amplitude != cdouble{} ? std::conj(line.amplitude) / std::abs(line.amplitude) : cdouble{1.0, 0.0};
        double noise = 0.0;
        double along = 0.0;
        double count = 0.0;
        for (std::size_t m = 0; m < line.sum.size(); ++m) {
            if (line.weight[m] < 0.05 * knot_) continue;
            const cdouble residual = back * turned[m] - std::abs(line.amplitude) * line.weight[m];
            noise += std::norm(residual) / line.weight[m];
            along += 2.0 * residual.real() * residual.real() / line.weight[m];
            count += 1.0;
        }
        noise /= std::max(count - 1.5, 1.0);  // amplitude, constant and slope: three real unknowns
        along /= std::max(count - 1.0, 1.0);
        line.noise = std::max({noise, along, clean * std::norm(line.amplitude)});
    }

    // The normal equations of the likelihood: information and score of knots and of constant and slope of every point.
    void assemble() {
        information_.assign(at(n_), 0.0);
        score_ = Vector::Zero(unknowns());
        entries_.clear();
        std::size_t best = 0;
        double most = -1.0;
        std::vector<double> total(lines_.size(), 0.0);
        for (std::size_t i = 0; i < lines_.size(); ++i) {
            if (lines_[i].sum.empty()) continue;
            fit(lines_[i], turn_[i]);
            double weights = 0.0;
            for (const double w : lines_[i].weight) weights += w;
            total[i] = lines_[i].noise > 0.0 ? std::norm(lines_[i].amplitude) / lines_[i].noise * weights : 0.0;
            if (total[i] > most) {
                most = total[i];
                best = i;
            }
        }
        if (!holding_) held_ = best;  // the strongest, and the same all along
        holding_ = true;
        for (std::size_t i = 0; i < lines_.size(); ++i) add_line(i);
    }

    void add_line(std::size_t i) {
        const BinnedLine& line = lines_[i];
        const double amplitude = std::abs(line.amplitude);
        const bool held = i == held_;
        const Index row = n_ + 2 * static_cast<Index>(i);
        double h00 = 0.0;
        double h01 = 0.0;
        double h11 = 0.0;
        if (amplitude > 0.0 && line.noise > 0.0) {
            const cdouble back = std::conj(line.amplitude) / amplitude;
            for (std::size_t m = 0; m < line.sum.size(); ++m) {
                const Index knot = line.first + static_cast<Index>(m);
                const cdouble turned = back * line.sum[m] * std::polar(1.0, -step_(knot) - turn_[i][0] - turn_[i][1] * line.offset[m]);
                const double information = 2.0 * amplitude * amplitude * line.weight[m] / line.noise;
                const double score = 2.0 * amplitude * std::imag(turned) / line.noise;
                information_[at(knot)] += information;
                score_(knot) += score;
                if (held) continue;
                const double x = line.offset[m];
                h00 += information;
                h01 += information * x;
                h11 += information * x * x;
                score_(row) += score;
                score_(row + 1) += score * x;
                entries_.emplace_back(row, knot, information);
                entries_.emplace_back(row + 1, knot, information * x);
            }
        }
        // Held, or without a signal: out of the solution, without a say in the evidence.
        const bool idle = held || !(h00 > 0.0);
        entries_.emplace_back(row, row, idle ? 1.0 : h00);
        entries_.emplace_back(row + 1, row + 1, idle ? 1.0 : h11);
        if (!idle) entries_.emplace_back(row + 1, row, h01);
    }

    [[nodiscard]] Index unknowns() const { return n_ + 2 * static_cast<Index>(lines_.size()); }

    // Second differences, summed in squares: D' D times values.
    [[nodiscard]] Vector roughness_gradient(const Vector& values) const {
        Vector out = Vector::Zero(n_);
        for (Index m = 1; m + 1 < n_; ++m) {
            const double d = values(m - 1) - 2.0 * values(m) + values(m + 1);
            out(m - 1) += d;
            out(m) -= 2.0 * d;
            out(m + 1) += d;
        }
        return out;
    }

    void factorise(double lambda) {
        std::vector<Eigen::Triplet<double>> entries = entries_;
        for (Index m = 0; m < n_; ++m) entries.emplace_back(m, m, information_[at(m)]);
        for (Index m = 1; m + 1 < n_; ++m) {
            const std::array<double, 3> d = {1.0, -2.0, 1.0};
            for (Index a = 0; a < 3; ++a)
                for (Index b = 0; b <= a; ++b) entries.emplace_back(m - 1 + a, m - 1 + b, lambda * d[at(a)] * d[at(b)]);
        }
        Matrix matrix(unknowns(), unknowns());
        matrix.setFromTriplets(entries.begin(), entries.end());
        if (entries_.size() != analysed_) solver_.analyzePattern(matrix);
        analysed_ = entries_.size();
        solver_.factorize(matrix);
    }

    // Solves for the step at this prior weight and returns the log evidence, up to a constant.
    double solve(double lambda, Vector& step) {
        factorise(lambda);
        if (solver_.info() != Eigen::Success) return -std::numeric_limits<double>::infinity();
        const Vector values = Eigen::Map<const Vector>(phase_.data(), n_) + step_;
        const Vector rough = roughness_gradient(values);
        Vector right = score_;
        right.head(n_) -= lambda * rough;
        step = solver_.solve(right);
        double log_determinant = 0.0;
        const auto& d = solver_.vectorD();
        for (Index i = 0; i < d.size(); ++i) {
            if (!(d(i) > 0.0)) return -std::numeric_limits<double>::infinity();
            log_determinant += std::log(d(i));
        }
        return 0.5 * static_cast<double>(n_ - 2) * std::log(lambda) - 0.5 * log_determinant + 0.5 * right.dot(step) -
               0.5 * lambda * values.dot(rough);
    }

    // The weight of the prior that makes the data most likely, on a grid that narrows from round to round.
    void choose_lambda(int round) {
        std::vector<double> exponents;
        if (round == 0) {
            // Information per knot sets the scale: from a prior that says nothing to one that allows next to nothing.
            double mean = 0.0;
            for (const double f : information_) mean += f / static_cast<double>(n_);
            const double scale = std::log10(std::max(mean, 1e-12));
            for (int e = -6; e <= 8; ++e) exponents.push_back(scale + e);
        } else {
            const double about = std::log10(lambda_);
            for (const double e : {-1.0, -0.5, 0.0, 0.5, 1.0}) exponents.push_back(about + e);
        }
        double best = -std::numeric_limits<double>::infinity();
        Vector step;
        for (const double e : exponents) {
            const double evidence = solve(std::pow(10.0, e), step);
            if (evidence > best) {
                best = evidence;
                lambda_ = std::pow(10.0, e);
            }
        }
    }

    // Gauss-Newton steps on the binned lines; returns the RMS change of the phase, constant and line removed.
    double settle(int round) {
        Vector step;
        for (int inner = 0; inner < inner_steps; ++inner) {
            assemble();
            if (inner == 0 && round < 4) choose_lambda(round);
            solve(lambda_, step);
            if (!step.allFinite()) break;
            step_ += step.head(n_);
            for (std::size_t i = 0; i < lines_.size(); ++i) {
                if (i == held_ || lines_[i].sum.empty()) continue;
                const Index row = n_ + 2 * static_cast<Index>(i);
                turn_[i][0] += step(row);
                turn_[i][1] += step(row + 1);
            }
        }
        std::vector<double> change(at(n_));
        for (std::ptrdiff_t m = 0; m < n_; ++m) {
            change[at(m)] = step_(m);
            phase_[at(m)] += step_(m);
        }
        for (std::size_t i = 0; i < lines_.size(); ++i)
            if (!lines_[i].sum.empty()) slope_[i] += turn_[i][1] / lines_[i].half_aperture;
        remove_linear(change);
        double sum = 0.0;
        for (const double c : change) sum += c * c;
        return std::sqrt(sum / static_cast<double>(n_));
    }

    // Posterior deviation of the phase at knots, constant and line over the covered knots removed: with the orthonormal columns Q of
    // those two, diag((1 - Q Q') C (1 - Q Q')).
    [[nodiscard]] std::vector<double> deviation() {
        const std::ptrdiff_t first = knot_of(span_.covered_begin);
        const std::ptrdiff_t last = knot_of(std::max(span_.covered_end - 1, span_.covered_begin));
        const std::ptrdiff_t n = last - first + 1;
        std::vector<double> out(at(n_), std::numeric_limits<double>::quiet_NaN());
        std::array<Vector, 2> q = {Vector::Zero(unknowns()), Vector::Zero(unknowns())};
        const double middle = 0.5 * static_cast<double>(first + last);
        for (std::ptrdiff_t m = first; m <= last; ++m) {
            q[0](m) = 1.0;
            q[1](m) = static_cast<double>(m) - middle;
        }
        for (Vector& v : q) v /= std::max(v.norm(), 1e-300);
        std::array<Vector, 2> cq = {solver_.solve(q[0]), solver_.solve(q[1])};
        std::array<std::array<double, 2>, 2> qcq{};
        for (const std::size_t a : {0U, 1U})
            for (const std::size_t b : {0U, 1U}) qcq[a][b] = q[a].dot(cq[b]);
        const std::ptrdiff_t stride = std::max<std::ptrdiff_t>(n / deviation_knots, 1);
        std::vector<std::ptrdiff_t> chosen;
        for (std::ptrdiff_t m = first; m < last; m += stride) chosen.push_back(m);
        chosen.push_back(last);
        parallel_for(options_.execution, "deviation", static_cast<std::int64_t>(chosen.size()), [&](std::int64_t c) {
            const std::ptrdiff_t m = chosen[at(c)];
            Vector unit = Vector::Zero(unknowns());
            unit(m) = 1.0;
            const Vector column = solver_.solve(unit);
            double variance = column(m);
            for (const std::size_t a : {0U, 1U}) {
                variance -= 2.0 * q[a](m) * cq[a](m);
                for (const std::size_t b : {0U, 1U}) variance += q[a](m) * qcq[a][b] * q[b](m);
            }
            out[at(m)] = std::sqrt(std::max(variance, 0.0));
        });
        for (std::size_t c = 0; c + 1 < chosen.size(); ++c)
            for (std::ptrdiff_t m = chosen[c] + 1; m < chosen[c + 1]; ++m) {
                const double t = static_cast<double>(m - chosen[c]) / static_cast<double>(chosen[c + 1] - chosen[c]);
                out[at(m)] = (1.0 - t) * out[at(chosen[c])] + t * out[at(chosen[c + 1])];
            }
        return out;
    }

    void finish(StripPhase& out) {
        const std::vector<double> phase = samples();
        const std::vector<double> sigma = deviation();
        for (std::ptrdiff_t k = span_.begin; k < span_.end; ++k) {
            out.phase[at(k)] = phase[at(k)];
            if (k >= span_.covered_begin && k < span_.covered_end && out.coverage[at(k)] > 0.0)
                out.phase_std[at(k)] = sigma[at(knot_of(k))];
        }
        for (std::size_t i = 0; i < lines_.size(); ++i) {
            const BinnedLine& line = lines_[i];
            const std::size_t p = at(points_[i]);
            out.slope[p] = slope_[i];
            out.signal[p] = std::norm(line.amplitude);
            out.noise[p] = line.noise;
            double weights = 0.0;
            for (const double w : line.weight) weights += w;
            out.information[p] = line.noise > 0.0 ? out.signal[p] / line.noise * weights : 0.0;
        }
        out.smoothness.push_back(1.0 / std::sqrt(lambda_));
    }

    const Apertures& apertures_;
    std::vector<std::ptrdiff_t> points_;
    SegmentSpan span_;
    double knot_;
    const StripRefineOptions& options_;
    std::ptrdiff_t n_ = 0;  // knots

    std::vector<double> phase_;  // at knots
    std::vector<double> slope_;  // of every point, rad a sample
    std::vector<BinnedLine> lines_;
    Vector step_;                              // of the knots since the lines were taken
    std::vector<std::array<double, 2>> turn_;  // constant and slope of every point since then
    std::vector<double> information_;
    Vector score_;
    std::vector<Eigen::Triplet<double>> entries_;
    std::size_t held_ = 0;  // the point whose constant and slope stay: the gauge
    double lambda_ = 1.0;
    bool holding_ = false;
    std::size_t analysed_ = 0;  // entries of the pattern that has been analysed
    Eigen::SimplicialLDLT<Matrix> solver_;
};

// As fine as the windows let independent noise through, so that the noise of neighbouring knots is independent.
double knot_spacing(const Apertures& apertures) {
    double rate = 0.0;
    for (const double f : apertures.fm_rate) rate = std::max(rate, f);
    return std::max(std::ceil(1.0 / (1.6 * apertures.window * rate)), 1.0);
}

}  // namespace

StripPhase joint_refinement(const Apertures& apertures, const Stitching& stitching, const CoherentPhase& start,
                            const StripRefineOptions& options) {
    StripPhase out;
    const auto n = at(apertures.n_azimuth);
    const auto count = at(apertures.size());
    out.phase.assign(n, 0.0);
    out.phase_std.assign(n, std::numeric_limits<double>::quiet_NaN());
    out.coverage = coverage_of(apertures);
    out.slope = start.slope;
    out.segment = stitching.segment;
    out.signal.assign(count, 0.0);
    out.noise.assign(count, 0.0);
    out.information.assign(count, 0.0);
    out.knot = knot_spacing(apertures);
    const std::vector<SegmentSpan> spans = segment_spans(apertures, stitching.segment, stitching.segments);
    for (int s = 0; s < stitching.segments; ++s) {
        std::vector<std::ptrdiff_t> points;
        for (std::ptrdiff_t p = 0; p < apertures.size(); ++p)
            if (stitching.segment[at(p)] == s) points.push_back(p);
        const SegmentSpan& span = spans[static_cast<std::size_t>(s)];
        if (span.end - span.begin < 4 * static_cast<std::ptrdiff_t>(out.knot)) {
            out.smoothness.push_back(std::numeric_limits<double>::quiet_NaN());
            continue;
        }
        SegmentRefinement(apertures, std::move(points), span, out.knot, options).run(start, out);
    }
    double total = 0.0;
    for (const double i : out.information) total += i;
    for (double& i : out.information) i = total > 0.0 ? i / total : 0.0;
    return out;
}

}  // namespace sarfocus::autofocus::detail
