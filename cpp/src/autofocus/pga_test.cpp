#include <sarfocus/autofocus/pga.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include <sarfocus/core/array.hpp>
#include <sarfocus/core/constants.hpp>
#include <sarfocus/core/error.hpp>
#include <sarfocus/fft/plan.hpp>

namespace sarfocus::autofocus {
namespace {

using Image = Array<cfloat, 2>;
constexpr std::ptrdiff_t n = 128;

// Points in speckle whose azimuth spectrum fills the share `occupied` round `centre` (in turns a sample).
Image scene(int points, double peak_db, unsigned seed, double occupied = 1.0, double centre = 0.0) {
    std::mt19937 bits(seed);
    std::normal_distribution<double> noise(0.0, std::sqrt(0.5 * static_cast<double>(n)));
    std::uniform_real_distribution<double> uniform(0.0, 1.0);
    Array<cdouble, 2> spectrum({n, n});
    for (cdouble& s : spectrum) s = {noise(bits), noise(bits)};
    std::vector<double> frequency;
    for (std::ptrdiff_t k = 0; k < n; ++k) {
        const double f = static_cast<double>(k) / static_cast<double>(n);
        frequency.push_back(f - std::floor(f - centre + 0.5));
    }
    for (int p = 0; p < points; ++p) {
        const double place = (0.1 + 0.8 * uniform(bits)) * static_cast<double>(n);
        const auto gate = static_cast<std::ptrdiff_t>(uniform(bits) * static_cast<double>(n));
        const cdouble a = std::polar(std::pow(10.0, peak_db / 20.0), two_pi * uniform(bits));
        for (std::ptrdiff_t k = 0; k < n; ++k)
            spectrum(k, gate) += a * std::polar(1.0, -two_pi * place * frequency[static_cast<std::size_t>(k)]);
    }
    const fft::Plan<float> inverse(n, fft::Direction::inverse);
    Image out({n, n});
    for (std::ptrdiff_t j = 0; j < n; ++j) {
        Array<cfloat, 1> line({n});
        for (std::ptrdiff_t k = 0; k < n; ++k)
            if (std::abs(frequency[static_cast<std::size_t>(k)] - centre) < 0.5 * occupied)
                line(k) = cfloat(spectrum(k, j) / static_cast<double>(n));
        inverse.execute(line.data());
        for (std::ptrdiff_t i = 0; i < n; ++i) out(i, j) = line(i);
    }
    return out;
}

std::vector<double> quadratic(double peak) {
    std::vector<double> out;
    for (std::ptrdiff_t k = 0; k < n; ++k) out.push_back(peak * std::pow(2.0 * static_cast<double>(k) / static_cast<double>(n) - 1.0, 2));
    return out;
}

Image defocused(const Image& image, std::vector<double> phase) {
    for (double& p : phase) p = -p;
    Image out({n, n});
    correct_azimuth_spectrum(image.view(), phase, out.view());
    return out;
}

double residual(const Result& result, const std::vector<double>& truth) {
    std::vector<double> error;
    for (std::size_t k = 0; k < truth.size(); ++k)
        error.push_back(std::isfinite(result.phase_std[k]) ? result.phase_error[k] - truth[k] : std::numeric_limits<double>::quiet_NaN());
    remove_linear(error);
    double sum = 0.0;
    double count = 0.0;
    for (const double e : error)
        if (std::isfinite(e)) {
            sum += e * e;
            count += 1.0;
        }
    return std::sqrt(sum / count);
}

bool same_bits(const Image& a, const Image& b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end());
}

TEST(Pga, FindsWhatWasInjected) {
    const Image focused = scene(30, 35.0, 1);
    for (const double peak : {3.0, 15.0, 60.0}) {
        const auto truth = quadratic(peak);
        const Image blurred = defocused(focused, truth);
        Image out({n, n});
        const Result result = pga(blurred.view(), out.view());
        EXPECT_EQ(result.status, Status::converged) << peak;
        // 30 points, 35 dB over clutter of power one: 14 dB a sample; the bound is 0.026 rad, of which twice is allowed.
        EXPECT_LT(residual(result, truth), 0.052) << peak;
        EXPECT_LT(result.score.entropy_after, result.score.entropy_before);
        double weights = 0.0;
        for (const StrongPoint& p : result.points) weights += p.weight;
        EXPECT_NEAR(weights, 1.0, 1e-9);
    }
}

TEST(Pga, WorksWhereTheSpectrumIsPartlyEmptyAndFoldedRoundTheEnd) {
    const auto image = scene(40, 35.0, 2, 0.7, 0.4);
    std::vector<double> truth(static_cast<std::size_t>(n));
    for (std::size_t k = 0; k < truth.size(); ++k)
        truth[k] = 3.0 * std::sin(two_pi * 3.0 * static_cast<double>(k) / static_cast<double>(n));
    Image out({n, n});
    const Result result = pga(defocused(image, truth).view(), out.view());
    EXPECT_EQ(result.status, Status::converged);
    std::ptrdiff_t empty = 0;
    for (const double s : result.phase_std) empty += std::isnan(s);
    EXPECT_NEAR(static_cast<double>(empty), 0.3 * static_cast<double>(n), 2.0);  // one sample at each edge
    // The error is periodic, so it is judged in the spectrum's own order, where the support is one piece.
    std::vector<double> error;
    const auto start = static_cast<std::ptrdiff_t>(std::lround((0.5 + 0.4 - 0.35) * static_cast<double>(n)));
    for (std::ptrdiff_t k = 0; k < n; ++k) {
        const auto i = static_cast<std::size_t>((start + k) % n);
        if (std::isfinite(result.phase_std[i])) error.push_back(result.phase_error[i] - truth[i]);
    }
    for (std::size_t k = 1; k < error.size(); ++k) error[k] = error[k - 1] + std::remainder(error[k] - error[k - 1], two_pi);
    remove_linear(error);
    double sum = 0.0;
    for (const double e : error) sum += e * e / static_cast<double>(error.size());
    EXPECT_LT(std::sqrt(sum), 0.06);  // as above, 40 points at 14 dB a sample: bound 0.022
}

TEST(Pga, FocusesASinglePoint) {
    const Image focused = scene(1, 40.0, 3);
    const Image blurred = defocused(focused, quadratic(10.0));
    Image out({n, n});
    const Result result = pga(blurred.view(), out.view());
    EXPECT_FALSE(result.input_returned()) << result.score.reason;
    EXPECT_LT(residual(result, quadratic(10.0)), 2.0 * std::sqrt(1.0 / (2.0 * 78.0)));  // 40 dB over a clutter of 128 samples: 19 dB
}

TEST(Pga, HandsBackTheInputWhereNothingIsWrong) {
    for (const int points : {0, 1, 6, 40}) {
        const Image image = scene(points, 35.0, 10 + static_cast<unsigned>(points));
        Image out({n, n});
        const Result result = pga(image.view(), out.view());
        EXPECT_TRUE(result.input_returned()) << points << " points: " << result.score.reason;
        EXPECT_TRUE(same_bits(out, image));
        for (const double p : result.phase_error) EXPECT_EQ(p, 0.0);
        EXPECT_FALSE(result.score.reason.empty());
    }
}

TEST(Pga, AppliesWithoutJudgingWhereAsked) {
    const Image image = scene(40, 35.0, 50);
    Image out({n, n});
    PointOptions options;
    options.do_no_harm = false;
    EXPECT_FALSE(pga(image.view(), out.view(), options).input_returned());
    EXPECT_FALSE(same_bits(out, image));
}

TEST(Pga, BitsDependNeitherOnThreadsNorOnStridesNorOnThePlaceOfTheOutput) {
    const Image blurred = defocused(scene(30, 35.0, 4), quadratic(12.0));
    Image expected({n, n});
    PointOptions options;
    options.execution.threads = 1;
    const Result first = pga(blurred.view(), expected.view(), options);
    options.execution.threads = 3;
    Image turned({n, n});
    for (std::ptrdiff_t i = 0; i < n; ++i)
        for (std::ptrdiff_t j = 0; j < n; ++j) turned(j, i) = blurred(i, j);
    Image out({n, n});
    const Result second = pga(ImageView(turned.data(), {n, n}, {1, n}), out.view(), options);
    EXPECT_EQ(first.phase_error, second.phase_error);
    EXPECT_TRUE(same_bits(out, expected));
    Image in_place = blurred.copy();
    (void)pga(in_place.view(), in_place.view(), options);
    EXPECT_TRUE(same_bits(in_place, expected));
}

TEST(Pga, RefusesWhatMakesNoSense) {
    Image image({n, n});
    Image out({n, n});
    EXPECT_THROW((void)pga(image.view(), out.view()), NumericalError);
    image = scene(3, 30.0, 1);
    image(5, 6) = {std::numeric_limits<float>::quiet_NaN(), 0.0F};
    EXPECT_THROW((void)pga(image.view(), out.view()), NumericalError);
    image = scene(3, 30.0, 1);
    Image small({n, n - 1});
    EXPECT_THROW((void)pga(image.view(), small.view()), ShapeError);
    EXPECT_THROW((void)pga(image.view().slice(0, 0, 8), out.view().slice(0, 0, 8)), ShapeError);
    PointOptions options;
    options.coarse_windows = {0.7};
    EXPECT_THROW((void)pga(image.view(), out.view(), options), ValueError);
}

}  // namespace
}  // namespace sarfocus::autofocus
