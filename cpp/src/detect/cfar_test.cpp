#include <sarfocus/detect/cfar.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include <gtest/gtest.h>

#include <sarfocus/core/array.hpp>
#include <sarfocus/core/error.hpp>

namespace sarfocus::detect {
namespace {

constexpr CfarMethod methods[] = {CfarMethod::cell_averaging, CfarMethod::greatest_of, CfarMethod::ordered_statistic};

Array<cfloat, 2> speckle(std::ptrdiff_t rows, std::ptrdiff_t columns, unsigned seed) {
    std::mt19937 generator(seed);
    std::normal_distribution<float> normal;
    Array<cfloat, 2> out({rows, columns});
    for (cfloat& x : out) x = {normal(generator), normal(generator)};
    return out;
}

Array<bool, 2> mask_of(const ImageView& image, const CfarOptions& options, bool two_dimensional = true) {
    Array<bool, 2> mask(image.extents());
    two_dimensional ? cfar_2d(image, mask.view(), options) : cfar_1d(image, mask.view(), options);
    return mask;
}

/// P(x > mu * estimate) for exponential x by quadrature over the distribution of the larger of two gamma means.
double greatest_of_rate(int n1, int n2, double mu) {
    const auto gamma_cdf = [](int n, double x) {  // P(mean of n unit exponentials < x)
        double term = std::exp(-n * x);
        double below = term;
        for (int k = 1; k < n; ++k) below += term *= n * x / k;
        return 1.0 - below;
    };
    // E exp(-mu M) = integral of mu exp(-mu m) P(M < m) dm
    const double step = 1e-4;
    double sum = 0.0;
    for (double m = 0.5 * step; m < 12.0; m += step) sum += mu * std::exp(-mu * m) * gamma_cdf(n1, m) * gamma_cdf(n2, m) * step;
    return sum;
}

TEST(CfarFactors, HoldTheirEquations) {
    for (const double p : {1e-1, 1e-3, 1e-6}) {
        for (const int n : {1, 2, 16, 500}) EXPECT_NEAR(std::pow(1.0 + cell_averaging_factor(n, p) / n, -n) / p, 1.0, 1e-10);
        for (const auto [n, k] : {std::array{1, 1}, std::array{16, 12}, std::array{480, 360}}) {
            const double mu = ordered_statistic_factor(n, k, p);
            double rate = 1.0;
            for (int i = 0; i < k; ++i) rate *= (n - i) / (n - i + mu);
            EXPECT_NEAR(rate / p, 1.0, 1e-9);
        }
        // Midpoint rule with steps of 1e-4 on functions that vary over 1e-1: relative error below 1e-5.
        for (const auto [n1, n2] : {std::array{1, 1}, std::array{8, 8}, std::array{3, 8}, std::array{40, 2}})
            EXPECT_NEAR(greatest_of_rate(n1, n2, greatest_of_factor(n1, n2, p)) / p, 1.0, 1e-4);
    }
    EXPECT_NEAR(greatest_of_factor(8, 3, 1e-4), greatest_of_factor(3, 8, 1e-4), 1e-10);
    EXPECT_NEAR(cell_averaging_factor(16, 1e-6), 16.0 * (std::pow(1e-6, -1.0 / 16.0) - 1.0), 1e-10);
    // Many cells: all tend to the factor of a known clutter power, -ln p (the ordered one over the quantile, -ln(1 - k/N)).
    EXPECT_NEAR(greatest_of_factor(20000, 20000, 1e-6), -std::log(1e-6), 0.15);
    EXPECT_NEAR(ordered_statistic_factor(100000, 75000, 1e-6), -std::log(1e-6) / std::log(4.0), 0.01);
}

/// P(x > mu y) for x, y means of `looks` and looks * cells unit exponentials (gamma distributions), by quadrature over t = ln(x / y), whose
/// density is that of a logistic variable raised to powers.
double multi_look_rate(double looks, double cells, double mu) {
    const double a = looks;
    const double b = looks * cells;
    const double log_beta = std::lgamma(a) + std::lgamma(b) - std::lgamma(a + b);
    const double step = 1e-3;
    double sum = 0.0;
    for (double t = std::log(mu) + 0.5 * step; t < 60.0; t += step) {
        const double z = t - std::log(cells);  // x / y = (X / a) / (Y / b), X / Y = exp(z)
        const double log_density = a * z - (a + b) * (z > 0.0 ? z + std::log1p(std::exp(-z)) : std::log1p(std::exp(z))) - log_beta;
        sum += std::exp(log_density) * step;
    }
    return sum;
}

TEST(CfarFactors, MultiLookIsTheQuantileOfF) {
    // The quadrature itself, against the closed form of one look and quantiles of F of 2 looks and 2 looks cells degrees of freedom
    // (scipy.stats.f.isf).
    EXPECT_NEAR(multi_look_rate(1.0, 16.0, cell_averaging_factor(16, 1e-4)) / 1e-4, 1.0, 1e-5);
    EXPECT_NEAR(multi_look_rate(1.5, 16.0, 14.1218867) / 1e-6, 1.0, 1e-5);
    EXPECT_NEAR(multi_look_rate(13.3, 100.0, 2.07596447) / 1e-3, 1.0, 1e-5);
    EXPECT_NEAR(multi_look_rate(50.0, 4.0, 1.21426293) / 1e-1, 1.0, 1e-5);
    // Within what the header says of the exact factor: the rate at a factor smaller by so much is too high, at a larger one too low.
    for (const auto& [looks, error] :
         {std::pair{1.0, 0.1}, std::pair{2.0, 0.06}, std::pair{4.0, 0.03}, std::pair{10.0, 0.015}, std::pair{64.0, 0.003}})
        for (const std::ptrdiff_t cells : {8, 24, 100, 480})
            for (const double p : {0.3, 1e-2, 1e-4, 1e-6}) {
                const double mu = multi_look_factor(looks, cells, p);
                EXPECT_LT(multi_look_rate(looks, static_cast<double>(cells), mu * (1.0 + error)), p) << looks << ' ' << cells << ' ' << p;
                EXPECT_GT(multi_look_rate(looks, static_cast<double>(cells), mu / (1.0 + error)), p) << looks << ' ' << cells << ' ' << p;
            }
    // Few cells: on the safe side, and more of anything never needs a larger factor.
    EXPECT_LT(multi_look_rate(1.0, 4.0, multi_look_factor(1.0, 4, 1e-4)), 1e-4);
    EXPECT_TRUE(std::isinf(multi_look_factor(1.0, 1, 1e-6)));
    for (const std::ptrdiff_t cells : {8, 100}) {
        EXPECT_GT(multi_look_factor(2.0, cells, 1e-4), multi_look_factor(4.0, cells, 1e-4));
        EXPECT_GT(multi_look_factor(2.0, cells, 1e-4), multi_look_factor(2.0, cells + 1, 1e-4));
        EXPECT_GT(multi_look_factor(2.0, cells, 1e-5), multi_look_factor(2.0, cells, 1e-4));
        EXPECT_LT(multi_look_factor(2.0, cells, 0.9), 1.0);
    }
    EXPECT_THROW((void)multi_look_factor(0.5, 8, 0.1), ValueError);
    EXPECT_THROW((void)multi_look_factor(std::nan(""), 8, 0.1), ValueError);
    EXPECT_THROW((void)multi_look_factor(2.0, 0, 0.1), ValueError);
    EXPECT_THROW((void)multi_look_factor(2.0, 8, 1.0), ValueError);
}

TEST(Cfar, AveragedCellsKeepTheirFalseAlarmRate) {
    // Cells that are means of four speckle intensities, as roots so that the test squares them back.
    constexpr std::ptrdiff_t rows = 300;
    constexpr std::ptrdiff_t columns = 200;
    const Array<cfloat, 2> looks = speckle(4 * rows, columns, 21);
    Array<cfloat, 2> image({rows, columns});
    for (std::ptrdiff_t i = 0; i < rows; ++i)
        for (std::ptrdiff_t j = 0; j < columns; ++j) {
            float sum = 0.0F;
            for (std::ptrdiff_t l = 0; l < 4; ++l) sum += std::norm(looks(4 * i + l, j));
            image(i, j) = std::sqrt(0.25F * sum);
        }
    CfarOptions options;
    options.looks = 4.0;
    for (const double p : {1e-1, 1e-2}) {
        options.false_alarm_probability = p;
        const Array<bool, 2> mask = mask_of(image.view(), options);
        const auto hits = static_cast<double>(std::count(mask.begin(), mask.end(), true));
        const double expected = p * static_cast<double>(rows * columns);
        // Five standard deviations, and the factor's own 1 % or so, which moves the rate by some 6 %.
        EXPECT_NEAR(hits, expected, 5.0 * std::sqrt(expected) + 0.06 * expected) << p;
    }
    options.looks = 0.5;
    EXPECT_THROW((void)mask_of(image.view(), options), ValueError);
}

TEST(CfarFactors, RefuseWhatHasNoFactor) {
    EXPECT_THROW((void)cell_averaging_factor(0, 0.1), ValueError);
    EXPECT_THROW((void)cell_averaging_factor(4, 0.0), ValueError);
    EXPECT_THROW((void)cell_averaging_factor(4, 1.0), ValueError);
    EXPECT_THROW((void)greatest_of_factor(4, 0, 0.1), ValueError);
    EXPECT_THROW((void)ordered_statistic_factor(4, 5, 0.1), ValueError);
    EXPECT_THROW((void)ordered_statistic_factor(4, 0, 0.1), ValueError);
}

/// Five standard deviations of a binomial count: a correct rate fails once in two million draws, and the seeds are fixed.
void expect_rate(std::ptrdiff_t hits, std::ptrdiff_t trials, double p) {
    const double expected = static_cast<double>(trials) * p;
    EXPECT_NEAR(static_cast<double>(hits), expected, 5.0 * std::sqrt(expected * (1.0 - p))) << trials << " trials";
}

TEST(Cfar, FalseAlarmRateInOneDimension) {
    // Range gates are independent, and so are the cells of one row: the counts are binomial.
    const auto image = speckle(23, 100000, 7);
    for (const CfarMethod method : methods) {
        SCOPED_TRACE(static_cast<int>(method));
        CfarOptions options;
        options.method = method;
        options.false_alarm_probability = 5e-3;
        const auto mask = mask_of(image.view(), options, false);
        for (const std::ptrdiff_t row : {0, 2, 5, 11, 18, 22}) {  // no cells before, some missing, all there, none behind
            std::ptrdiff_t hits = 0;
            for (std::ptrdiff_t j = 0; j < image.extent(1); ++j) hits += mask(row, j);
            expect_rate(hits, image.extent(1), options.false_alarm_probability);
        }
    }
}

TEST(Cfar, FalseAlarmRateInTwoDimensions) {
    // Windows of 11 x 11 that do not overlap: independent trials. The outermost cells of the image are the corners and edges of tiles of
    // their own.
    const std::ptrdiff_t tile = 11;
    const std::ptrdiff_t tiles = 90;
    const auto image = speckle(tile * tiles, tile * tiles, 8);
    for (const CfarMethod method : methods) {
        SCOPED_TRACE(static_cast<int>(method));
        CfarOptions options;
        options.method = method;
        options.false_alarm_probability = 2e-2;
        options.reference = {3, 4};
        options.guard = {2, 1};
        const auto mask = mask_of(image.view(), options);
        std::ptrdiff_t inside = 0;
        std::ptrdiff_t edge = 0;
        for (std::ptrdiff_t a = 0; a < tiles; ++a) {
            for (std::ptrdiff_t r = 0; r < tiles; ++r) inside += mask(a * tile + 5, r * tile + 5);
            edge += mask(0, a * tile + 5) + mask(tile * tiles - 1, a * tile + 5);
            edge += a == 0 || a == tiles - 1 ? 0 : mask(a * tile + 5, 0) + mask(a * tile + 5, tile * tiles - 1);
        }
        expect_rate(inside, tiles * tiles, options.false_alarm_probability);
        expect_rate(edge, 4 * tiles - 4, options.false_alarm_probability);
    }
}

TEST(Cfar, MasksAgreeWithPlainSums) {
    const auto image = speckle(150, 41, 9);
    for (const CfarMethod method : methods)
        for (const bool two_dimensional : {false, true}) {
            CfarOptions options;
            options.method = method;
            options.false_alarm_probability = 0.05;
            options.reference = {5, 3};
            options.guard = {1, 2};
            const auto mask = mask_of(image.view(), options, two_dimensional);
            std::vector<std::array<std::ptrdiff_t, 2>> cells;
            for (std::ptrdiff_t i = 0; i < 150; ++i)
                for (std::ptrdiff_t j = 0; j < 41; ++j) cells.push_back({i, j});
            const auto tested = two_dimensional ? cfar_2d_at(image.view(), cells, options) : cfar_1d_at(image.view(), cells, options);
            for (std::size_t k = 0; k < cells.size(); ++k) {
                // The two orders of summation may differ where the intensity is the threshold to a part in 1e12.
                if (std::abs(tested[k].intensity / tested[k].threshold - 1.0) < 1e-12) continue;
                ASSERT_EQ(mask(cells[k][0], cells[k][1]), tested[k].detected) << cells[k][0] << ", " << cells[k][1];
            }
        }
}

TEST(Cfar, BrightTargetDoesNotSpoilTheSumsElsewhere) {
    // 200 dB above the clutter: a summed-area table in float64 holds no digit of the clutter behind it.
    auto image = speckle(64, 64, 10);
    CfarOptions options;
    options.false_alarm_probability = 0.05;
    options.reference = {4, 4};
    const auto expected = mask_of(image.view(), options);
    image(20, 20) = 1e10F;
    const auto actual = mask_of(image.view(), options);
    EXPECT_TRUE(actual(20, 20));
    for (std::ptrdiff_t i = 0; i < 64; ++i)
        for (std::ptrdiff_t j = 0; j < 64; ++j)
            if (std::abs(i - 20) > 7 || std::abs(j - 20) > 7) ASSERT_EQ(actual(i, j), expected(i, j)) << i << ", " << j;
}

TEST(Cfar, MethodsDoWhatTheyAreFor) {
    Array<cfloat, 2> image({64, 1});
    for (std::ptrdiff_t i = 0; i < 64; ++i) image(i, 0) = i < 32 ? 1.0F : 10.0F;  // a clutter edge of 20 dB
    CfarOptions options;
    options.false_alarm_probability = 0.3;
    const auto at = [&](std::ptrdiff_t i) { return cfar_1d_at(image.view(), {{i, 0}}, options)[0]; };
    options.method = CfarMethod::greatest_of;
    EXPECT_DOUBLE_EQ(at(33).clutter, 100.0);
    options.method = CfarMethod::cell_averaging;
    EXPECT_DOUBLE_EQ(at(33).clutter, (8.0 * 100.0 + 8.0 * 1.0) / 16.0);
    // Two strong neighbours among 16 cells.
    for (std::ptrdiff_t i = 0; i < 64; ++i) image(i, 0) = 1.0F;
    image(20, 0) = image(26, 0) = 100.0F;
    image(30, 0) = 100.0F;
    options.false_alarm_probability = 1e-4;
    EXPECT_FALSE(at(26).detected);
    options.method = CfarMethod::ordered_statistic;
    EXPECT_DOUBLE_EQ(at(26).clutter, 1.0);
    EXPECT_TRUE(at(26).detected);
}

TEST(Cfar, SameBitsForAnyThreadsAndStrides) {
    const auto image = speckle(200, 90, 11);
    Array<cfloat, 2> transposed({90, 200});
    Array<float, 2> intensity({200, 90});
    for (std::ptrdiff_t i = 0; i < 200; ++i)
        for (std::ptrdiff_t j = 0; j < 90; ++j) {
            transposed(j, i) = image(i, j);
            intensity(i, j) = std::norm(image(i, j));
        }
    for (const CfarMethod method : methods) {
        CfarOptions options;
        options.method = method;
        options.false_alarm_probability = 0.01;
        options.execution.threads = 1;
        const auto once = mask_of(image.view(), options);
        options.execution.threads = 3;
        const auto again = mask_of(ImageView(transposed.data(), {200, 90}, {1, 200}), options);
        EXPECT_TRUE(std::equal(once.begin(), once.end(), again.begin()));
        Array<bool, 2> real({200, 90});
        cfar_2d(intensity.view(), real.view(), options);
        EXPECT_TRUE(
            std::equal(once.begin(), once.end(), real.begin()));  // float32 intensities: no cell of this image sits that near its threshold
    }
}

TEST(Cfar, ImagesSmallerThanTheWindow) {
    const auto image = speckle(5, 3, 12);
    for (const CfarMethod method : methods) {
        CfarOptions options;
        options.method = method;
        const auto mask = mask_of(image.view(), options);  // guard cells cover the image in range, leave row 4 for row 0
        EXPECT_FALSE(mask(2, 1));
        options.guard = {50, 50};
        const auto none = mask_of(image.view(), options);
        EXPECT_EQ(std::count(none.begin(), none.end(), true), 0);
        EXPECT_EQ(cfar_2d_at(image.view(), {{0, 0}}, options)[0].threshold, std::numeric_limits<double>::infinity());
        options.guard = {std::numeric_limits<std::ptrdiff_t>::max(), 0};
        options.reference = {std::numeric_limits<std::ptrdiff_t>::max(), std::numeric_limits<std::ptrdiff_t>::max()};
        (void)mask_of(image.view(), options);
    }
}

TEST(Cfar, RefusesHostileInput) {
    auto image = speckle(8, 8, 13);
    Array<bool, 2> mask({8, 8});
    const auto refused = [&](auto change) {
        CfarOptions options;
        change(options);
        EXPECT_THROW(cfar_2d(image.view(), mask.view(), options), ValueError);
        EXPECT_THROW((void)cfar_2d_at(image.view(), {{1, 1}}, options), ValueError);
    };
    refused([](CfarOptions& o) { o.false_alarm_probability = std::numeric_limits<double>::quiet_NaN(); });
    refused([](CfarOptions& o) { o.reference = {-1, 2}; });
    refused([](CfarOptions& o) { o.reference = {0, 0}; });
    refused([](CfarOptions& o) { o.guard = {0, -1}; });
    refused([](CfarOptions& o) { o.rank = 0.0; });
    refused([](CfarOptions& o) { o.method = CfarMethod::greatest_of, o.reference = {0, 4}; });
    EXPECT_THROW((void)cfar_1d_at(image.view(), {{8, 0}}), ValueError);
    EXPECT_THROW(cfar_2d(image.view(), Array<bool, 2>({8, 7}).view()), ShapeError);
    Array<float, 2> negative({8, 8});
    negative(3, 4) = -1.0F;
    EXPECT_THROW(cfar_2d(negative.view(), mask.view()), NumericalError);
    image(7, 7) = {0.0F, std::numeric_limits<float>::infinity()};
    EXPECT_THROW(cfar_2d(image.view(), mask.view()), NumericalError);
    EXPECT_NO_THROW((void)cfar_1d_at(image.view(), {{1, 1}}));  // only its own range gate counts
    EXPECT_THROW((void)cfar_1d_at(image.view(), {{1, 7}}), NumericalError);
}

TEST(Cfar, StopsWhenAskedTo) {
    const auto image = speckle(512, 64, 14);
    Array<bool, 2> mask({512, 64});
    CfarOptions options;
    options.execution.progress = [](const ProgressUpdate&) { return false; };
    EXPECT_THROW(cfar_2d(image.view(), mask.view(), options), Cancelled);
}

}  // namespace
}  // namespace sarfocus::detect
