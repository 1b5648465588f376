#include <sarfocus/autofocus/phase_estimate.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include <sarfocus/core/array.hpp>
#include <sarfocus/core/constants.hpp>
#include <sarfocus/core/error.hpp>

#include "line_sums.hpp"

namespace sarfocus::autofocus {
namespace {

using Lines = Array<cfloat, 2>;

std::vector<double> rough_phase(std::ptrdiff_t n, unsigned seed) {
    std::mt19937 bits(seed);
    std::normal_distribution<double> step(0.0, 0.3);
    std::vector<double> out;
    double sum = 0.0;
    for (std::ptrdiff_t k = 0; k < n; ++k) out.push_back(sum += step(bits));
    remove_linear(out);
    return out;
}

Lines make_lines(const std::vector<double>& phase, std::ptrdiff_t n_line, double snr_db, double slope, unsigned seed) {
    std::mt19937 bits(seed);
    std::normal_distribution<double> noise(0.0, std::sqrt(0.5 * std::pow(10.0, -snr_db / 10.0)));
    std::uniform_real_distribution<double> turn(-1.0, 1.0);
    Lines out({n_line, static_cast<std::ptrdiff_t>(phase.size())});
    for (std::ptrdiff_t n = 0; n < n_line; ++n) {
        const double own = pi * turn(bits);
        const double b = slope * turn(bits);
        for (std::size_t k = 0; k < phase.size(); ++k)
            out(n, k) = cfloat(std::polar(1.0, own + phase[k] + b * static_cast<double>(k)) + cdouble(noise(bits), noise(bits)));
    }
    return out;
}

double rmse(const std::vector<double>& a, const std::vector<double>& b) {
    std::vector<double> d(a.size());
    for (std::size_t k = 0; k < a.size(); ++k) d[k] = a[k] - b[k];
    remove_linear(d);
    double sum = 0.0;
    for (const double x : d) sum += x * x;
    return std::sqrt(sum / static_cast<double>(d.size()));
}

// Against the sums written out, over lengths about those of a register; the recurrence of the turns keeps its precision over long lines.
TEST(LineSums, AreThoseOfTheirDefinition) {
    std::mt19937 bits(11);
    std::normal_distribution<double> normal;
    for (const std::ptrdiff_t length : {0, 1, 7, 8, 9, 30, 64, 65, 20000}) {
        std::vector<cfloat> line;
        std::vector<cdouble> rotation;
        for (std::ptrdiff_t k = 0; k < length; ++k) {
            line.emplace_back(static_cast<float>(normal(bits)), static_cast<float>(normal(bits)));
            rotation.push_back(std::polar(1.0, normal(bits)));
        }
        double power = 0.0;
        double square = 0.0;
        for (const cfloat& sample : line) {
            power += std::norm(cdouble(sample));
            square += std::norm(cdouble(sample)) * std::norm(cdouble(sample));
        }
        const detail::LineIntensity intensity = detail::line_intensity(line.data(), length);
        EXPECT_NEAR(intensity.sum, power, 1e-12 * power);
        EXPECT_NEAR(intensity.square, square, 1e-12 * square);
        for (const double slope : {0.0, 0.3, -2.9}) {
            const double middle = 0.5 * static_cast<double>(length - 1);
            const cdouble gain(0.7, -1.3);
            constexpr double share = 0.4;
            std::vector<cdouble> sum(line.size(), cdouble(2.0, 1.0));
            std::vector<double> own(line.size(), 3.0);
            detail::add_line(line.data(), length, gain, slope, middle, share, sum.data(), own.data());
            cdouble zeroth;
            cdouble first;
            cdouble second;
            for (std::size_t k = 0; k < line.size(); ++k) {
                const double x = static_cast<double>(k) - middle;
                const cdouble turned = cdouble(line[k]) * std::polar(1.0, -slope * x);
                const cdouble z = turned * std::conj(rotation[k]);
                zeroth += z;
                first += x * z;
                second += x * x * z;
                EXPECT_LT(std::abs(sum[k] - cdouble(2.0, 1.0) - gain * turned), 1e-10);
                EXPECT_NEAR(own[k], 3.0 + share * std::norm(cdouble(line[k])), 1e-12);
            }
            const double half = std::max(middle, 1.0);
            const double root = std::sqrt(static_cast<double>(length) + 1.0);
            const detail::LineMoments moments = detail::line_moments(line.data(), rotation.data(), length, slope, middle);
            EXPECT_LT(std::abs(moments.zeroth - zeroth), 1e-10 * root);
            EXPECT_LT(std::abs(moments.first - first), 1e-10 * root * half);
            EXPECT_LT(std::abs(moments.second - second), 1e-10 * root * half * half);
            for (const std::ptrdiff_t bytes : {16, 32, 64})
                EXPECT_LT(std::abs(detail::line_sum(line.data(), rotation.data(), length, slope, middle, bytes) - zeroth), 1e-10 * root);
        }
    }
}

TEST(PhaseEstimate, ReachesTheCramerRaoBoundAndSaysSo) {
    // 16 lines of 512 pulses: sqrt(1 / (2 M SNR)) [methods 3]. One draw of 512 pulses scatters by 3 %, ten draws by 1 %.
    for (const double snr_db : {5.0, 10.0, 20.0}) {
        double square = 0.0;
        double stated = 0.0;
        for (unsigned draw = 0; draw < 10; ++draw) {
            const auto phase = rough_phase(512, draw);
            const auto estimate = estimate_phase(make_lines(phase, 16, snr_db, 0.5 * pi / 512.0, 100 + draw).view());
            square += std::pow(rmse(estimate.phase, phase), 2) / 10.0;
            for (const double s : estimate.phase_std) stated += s * s / 5120.0;
        }
        const double bound = std::sqrt(1.0 / (32.0 * std::pow(10.0, snr_db / 10.0)));
        EXPECT_NEAR(std::sqrt(square) / bound, 1.0, 0.05) << snr_db;
        EXPECT_NEAR(std::sqrt(stated) / bound, 1.0, 0.07) << snr_db;
    }
}

TEST(PhaseEstimate, GradientIsWorseAndSaysSo) {
    const auto phase = rough_phase(512, 3);
    PhaseEstimateOptions options;
    options.estimator = Estimator::gradient;
    const Lines lines = make_lines(phase, 16, 5.0, 0.0, 4);
    const auto estimate = estimate_phase(lines.view(), options);
    const double error = rmse(estimate.phase, phase);
    EXPECT_GT(error, 1.5 * rmse(estimate_phase(lines.view()).phase, phase));
    double stated = 0.0;
    for (const double s : estimate.phase_std) stated += s * s / 512.0;
    EXPECT_NEAR(std::sqrt(stated) / error, 1.0, 0.2);
}

TEST(PhaseEstimate, FindsEveryLinesOwnSlope) {
    const auto phase = rough_phase(300, 8);
    std::vector<double> slopes;
    Lines lines({6, 300});
    for (std::ptrdiff_t n = 0; n < 6; ++n) {
        slopes.push_back(0.004 * static_cast<double>(n - 2));
        for (std::size_t k = 0; k < 300; ++k)
            lines(n, k) = cfloat(std::polar(1.0 + 0.2 * static_cast<double>(n), phase[k] + slopes.back() * static_cast<double>(k)));
    }
    const auto estimate = estimate_phase(lines.view());
    EXPECT_LT(rmse(estimate.phase, phase), 1e-4);  // the tolerance at which the alternation ends
    for (std::size_t n = 1; n < 6; ++n) EXPECT_NEAR(estimate.linear_terms[n] - estimate.linear_terms[0], slopes[n] - slopes[0], 1e-6);
}

TEST(PhaseEstimate, IsBlindToScaleGlobalPhaseAndCommonSlope) {
    const auto phase = rough_phase(200, 5);
    Lines lines = make_lines(phase, 5, 15.0, 0.0, 6);
    const auto before = estimate_phase(lines.view());
    for (std::ptrdiff_t n = 0; n < 5; ++n)
        for (std::ptrdiff_t k = 0; k < 200; ++k) lines(n, k) *= cfloat(std::polar(0.25, 1.0 + 0.01 * static_cast<double>(k)));
    EXPECT_LT(rmse(estimate_phase(lines.view()).phase, before.phase), 1e-3);  // ten times the tolerance
}

TEST(PhaseEstimate, BitsDependNeitherOnThreadsNorOnStrides) {
    const auto phase = rough_phase(333, 5);
    const Lines lines = make_lines(phase, 7, 10.0, 0.01, 6);
    PhaseEstimateOptions options;
    options.execution.threads = 1;
    const auto expected = estimate_phase(lines.view(), options);
    options.execution.threads = 3;
    EXPECT_EQ(estimate_phase(lines.view(), options).phase, expected.phase);
    Lines turned({333, 7});
    for (std::ptrdiff_t n = 0; n < 7; ++n)
        for (std::ptrdiff_t k = 0; k < 333; ++k) turned(k, n) = lines(n, k);
    const auto strided = estimate_phase(ImageView(turned.data(), {7, 333}, {1, 7}), options);
    EXPECT_EQ(strided.phase, expected.phase);
    EXPECT_EQ(strided.phase_std, expected.phase_std);
}

TEST(PhaseEstimate, LeavesOutWhatHasNoData) {
    const auto phase = rough_phase(200, 11);
    Lines lines = make_lines(phase, 9, 20.0, 0.0, 12);
    for (std::ptrdiff_t n = 0; n < 9; ++n)
        for (std::ptrdiff_t k = 120; k < 130; ++k) lines(n, k) = {};
    for (std::ptrdiff_t k = 0; k < 200; ++k) lines(4, k) = {};
    const auto estimate = estimate_phase(lines.view());
    for (std::size_t k = 0; k < 200; ++k) EXPECT_EQ(std::isnan(estimate.phase_std[k]), k >= 120 && k < 130) << k;
    std::vector<double> error;
    for (std::size_t k = 0; k < 200; ++k)
        if (k < 120 || k >= 130) error.push_back(estimate.phase[k] - phase[k]);
    double sum = 0.0;
    remove_linear(error);
    for (const double x : error) sum += x * x / 190.0;
    EXPECT_LT(std::sqrt(sum), 2.0 * std::sqrt(1.0 / (2.0 * 8.0 * 100.0)));  // eight lines at 20 dB, twice the bound
}

TEST(RemoveGauge, ABadPulseDoesNotTiltASmallPhase) {
    // A tilt of 0.9 rad a pulse with one slip of a turn and one pulse of noise: the line of the unwrapped phase would be off by a pixel.
    std::vector<double> phase;
    for (std::size_t k = 0; k < 400; ++k)
        phase.push_back(0.3 * std::sin(0.05 * static_cast<double>(k)) + 0.9 * static_cast<double>(k) + (k > 150 ? two_pi : 0.0));
    phase[77] += 3.0;
    std::vector<double> expected;
    for (std::size_t k = 0; k < 400; ++k) expected.push_back(0.3 * std::sin(0.05 * static_cast<double>(k)));
    expected[77] += 3.0;
    remove_gauge(phase);
    remove_linear(expected);
    for (std::size_t k = 0; k < 400; ++k) EXPECT_NEAR(phase[k], expected[k], 1e-9);
}

TEST(RemoveGauge, UnwrapsALargePhaseAndKeepsWhatIsNotKnown) {
    std::vector<double> truth;
    std::vector<double> phase;
    for (std::size_t k = 0; k < 400; ++k) {
        const double t = static_cast<double>(k) / 200.0 - 1.0;
        truth.push_back(60.0 * t * t);
        phase.push_back(std::remainder(truth.back() + 1.1 * static_cast<double>(k), two_pi));
    }
    phase[31] = truth[31] = std::numeric_limits<double>::quiet_NaN();
    remove_gauge(phase);
    remove_linear(truth);
    for (std::size_t k = 0; k < 400; ++k) {
        if (k == 31) continue;
        EXPECT_NEAR(phase[k], truth[k], 1e-9);
    }
    EXPECT_TRUE(std::isnan(phase[31]));
}

TEST(PhaseEstimate, RefusesWhatMakesNoSense) {
    Lines zeros({3, 20});
    EXPECT_THROW((void)estimate_phase(zeros.view()), NumericalError);
    Lines lines = make_lines(rough_phase(20, 1), 3, 20.0, 0.0, 2);
    EXPECT_THROW((void)estimate_phase(lines.view().slice(1, 0, 2)), ShapeError);
    PhaseEstimateOptions options;
    options.max_iterations = 0;
    EXPECT_THROW((void)estimate_phase(lines.view(), options), ValueError);
    options = {};
    options.initial_phase.assign(19, 0.0);
    EXPECT_THROW((void)estimate_phase(lines.view(), options), ShapeError);
    lines(1, 2) = {std::numeric_limits<float>::quiet_NaN(), 0.0F};
    EXPECT_THROW((void)estimate_phase(lines.view()), NumericalError);
}

}  // namespace
}  // namespace sarfocus::autofocus
