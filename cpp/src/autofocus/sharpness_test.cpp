#include <sarfocus/autofocus/sharpness.hpp>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include <sarfocus/autofocus/pga.hpp>
#include <sarfocus/autofocus/phase_estimate.hpp>
#include <sarfocus/core/array.hpp>
#include <sarfocus/core/constants.hpp>
#include <sarfocus/core/error.hpp>
#include <sarfocus/focus/azimuth.hpp>
#include <sarfocus/geometry/stripmap_geometry.hpp>
#include <sarfocus/quality/image_measures.hpp>

#include "pulse_set.hpp"
#include "sharpness_ascent.hpp"
#include "sharpness_weights.hpp"

namespace sarfocus::autofocus {
namespace {

using Image = Array<cfloat, 2>;
constexpr std::ptrdiff_t n = 96;

Image scene(int points, unsigned seed) {
    std::mt19937 bits(seed);
    std::normal_distribution<float> noise(0.0F, std::sqrt(0.5F));
    std::uniform_real_distribution<double> uniform(0.0, 1.0);
    Image out({n, n});
    for (cfloat& s : out) s = {noise(bits), noise(bits)};
    for (int p = 0; p < points; ++p)
        out(static_cast<std::ptrdiff_t>(uniform(bits) * n), static_cast<std::ptrdiff_t>(uniform(bits) * n)) +=
            cfloat(std::polar(50.0, two_pi * uniform(bits)));
    return out;
}

Image defocused(const Image& image, double peak) {
    std::vector<double> phase;
    for (std::ptrdiff_t k = 0; k < n; ++k) phase.push_back(-peak * std::pow(2.0 * static_cast<double>(k) / n - 1.0, 2));
    remove_linear(phase);  // points at whole pixels are to stay there
    Image out({n, n});
    correct_azimuth_spectrum(image.view(), phase, out.view());
    return out;
}

geometry::StripmapGeometry strip_geometry() {
    geometry::StripmapGeometry out;
    out.wavelength = 0.03125;
    out.prf = 240.0;
    out.velocity = 120.0;
    out.doppler_bandwidth = 200.0;
    out.doppler_centroid = 30.0;
    for (std::ptrdiff_t g = 0; g < n; ++g) out.slant_range.push_back(1000.0 + 2.0 * static_cast<double>(g));
    return out;
}

// The slope of the measure along each phase is what the pull says, by differences.
void expect_gradient(const detail::PulseSet& pulses) {
    std::vector<double> phase(static_cast<std::size_t>(pulses.n_pulse()), 0.0);
    for (const auto measure : {detail::Measure::entropy, detail::Measure::contrast}) {
        const detail::Sharpness here = detail::sharpness_of(pulses, phase, measure, true, {});
        for (const std::size_t k : {std::size_t{3}, std::size_t{40}, std::size_t{90}}) {
            constexpr double step = 0.05;
            phase[k] = step;
            const double above = detail::sharpness_of(pulses, phase, measure, false, {}).value;
            phase[k] = -step;
            const double below = detail::sharpness_of(pulses, phase, measure, false, {}).value;
            phase[k] = 0.0;
            const double slope = here.slope_scale * here.pull[k].imag();
            // Single precision leaves 1e-7 nat of the measure, third order a thousandth.
            EXPECT_NEAR((above - below) / (2.0 * step), slope, 1e-5 + 0.01 * std::abs(slope));
        }
    }
}

TEST(Sharpness, PullIsTheGradientOfTheMeasure) {
    const Image image = defocused(scene(10, 1), 3.0);
    expect_gradient(detail::PulseSet(image.view(), {}));
    expect_gradient(detail::PulseSet(image.view(), strip_geometry(), {}));
}

TEST(Sharpness, PulsesOfAStripAreThoseOfAzimuthDecompression) {
    const Image image = scene(10, 4);
    const geometry::StripmapGeometry geometry = strip_geometry();
    const detail::PulseSet pulses(image.view(), geometry, {});
    ASSERT_EQ(pulses.n_gate(), n);
    Image raw({n, n});
    focus::azimuth_decompress(image.view(), geometry, raw.view());
    Image back({pulses.n_gate(), pulses.line_length()});
    pulses.form(std::vector<double>(n, 0.0), back, {});
    double energy = 0.0;
    for (std::ptrdiff_t g = 0; g < n; ++g)
        for (std::ptrdiff_t i = 0; i < n; ++i) {
            // Points of 50: single precision.
            EXPECT_LT(std::abs(pulses.pulses(g)[i] - raw(i, g)), 1e-4) << g << " " << i;
            EXPECT_LT(std::abs(back(g, i) - image(i, g)), 1e-4) << g << " " << i;
            energy += std::norm(cdouble(image(i, g)));
        }
    EXPECT_NEAR(pulses.energy(), energy, 1e-5 * energy);
    const detail::PulseSet part = pulses.subset({5, 60});
    Image two({part.n_gate(), part.line_length()});
    part.form(std::vector<double>(n, 0.0), two, {});
    for (std::ptrdiff_t i = 0; i < n; ++i) EXPECT_EQ(two(1, i), back(60, i));
}

// Against the definitions, in double precision, over lengths about those of a register.
TEST(Sharpness, WeightsAreThoseOfTheirDefinition) {
    std::mt19937 bits(8);
    std::normal_distribution<float> normal;
    constexpr float scale = 0.37F;
    for (std::ptrdiff_t length = 0; length < 70; ++length) {
        std::vector<cfloat> line;
        for (std::ptrdiff_t i = 0; i < length; ++i) {
            const float size = std::pow(10.0F, 2.0F * normal(bits));  // 8 decades of intensity within two deviations
            line.push_back(i % 7 == 3 ? cfloat{} : cfloat{size * normal(bits), size * normal(bits)});
        }
        for (const bool logarithm : {true, false}) {
            const auto weigh = logarithm ? detail::weigh_by_logarithm : detail::weigh_by_intensity;
            std::vector<cfloat> weighed = line;
            const double sum = weigh(weighed.data(), length, scale, true);
            double expected = 0.0;
            double size = 0.0;
            for (std::size_t i = 0; i < line.size(); ++i) {
                const double intensity = std::norm(cdouble(line[i])) * static_cast<double>(scale);
                const double w = !logarithm ? intensity : intensity > 0.0 ? std::log(intensity) : 0.0;
                expected += intensity * w;
                size += intensity * std::max(std::abs(w), 1.0);
                // The logarithm's own error and a product in single precision.
                EXPECT_LE(std::abs(cdouble(weighed[i]) - cdouble(line[i]) * w), 1e-6 * std::abs(line[i]) * std::max(std::abs(w), 1.0));
            }
            EXPECT_NEAR(sum, expected, 1e-6 * size);
            std::vector<cfloat> left = line;
            EXPECT_EQ(weigh(left.data(), length, scale, false), sum);
            EXPECT_EQ(left, line);
        }
        std::vector<cdouble> products(line.size(), cdouble(1.0, -2.0));
        std::vector<cfloat> turned = line;
        std::reverse(turned.begin(), turned.end());
        detail::add_products(line.data(), turned.data(), length, products.data());
        for (std::size_t i = 0; i < line.size(); ++i) {
            const cdouble product = cdouble(line[i]) * std::conj(cdouble(turned[i]));
            EXPECT_LT(std::abs(products[i] - cdouble(1.0, -2.0) - product), 1e-15 + 1e-6 * std::abs(product));
        }
    }
}

TEST(Sharpness, MeasuresAreThoseOfTheImage) {
    const Image image = scene(10, 2);
    const detail::PulseSet pulses(image.view(), {});
    const std::vector<double> none(static_cast<std::size_t>(pulses.n_pulse()), 0.0);
    EXPECT_NEAR(-detail::sharpness_of(pulses, none, detail::Measure::entropy, false, {}).value, quality::entropy(image.view()), 1e-5);
    EXPECT_NEAR(detail::sharpness_of(pulses, none, detail::Measure::contrast, false, {}).value, std::log(quality::sharpness(image.view())),
                1e-5);
}

TEST(Sharpness, FocusesAndHandsBack) {
    const Image focused = scene(40, 3);
    for (const bool entropy : {true, false}) {
        const auto method = [&](const Image& from, Image& to) {
            return entropy ? minimum_entropy(from.view(), to.view()) : maximum_contrast(from.view(), to.view());
        };
        Image out({n, n});
        const Result result = method(defocused(focused, 15.0), out);
        EXPECT_FALSE(result.input_returned()) << result.score.reason;
        EXPECT_LT(quality::entropy(out.view()), quality::entropy(focused.view()) + 0.05);
        for (const int points : {0, 2, 40}) {
            const Image image = scene(points, 30 + static_cast<unsigned>(points));
            EXPECT_TRUE(method(image, out).input_returned()) << points;
            EXPECT_TRUE(std::equal(out.begin(), out.end(), image.begin()));
        }
    }
}

TEST(Sharpness, BitsDependNeitherOnThreadsNorOnThePlaceOfTheOutput) {
    const Image blurred = defocused(scene(30, 5), 6.0);
    SharpnessOptions options;
    options.execution.threads = 1;
    Image expected({n, n});
    const Result first = minimum_entropy(blurred.view(), expected.view(), options);
    options.execution.threads = 3;
    Image in_place = blurred.copy();
    const Result second = minimum_entropy(in_place.view(), in_place.view(), options);
    EXPECT_EQ(first.phase_error, second.phase_error);
    EXPECT_TRUE(std::equal(expected.begin(), expected.end(), in_place.begin()));
}

TEST(Sharpness, RefusesWhatMakesNoSense) {
    Image image({n, n});
    Image out({n, n});
    EXPECT_THROW((void)minimum_entropy(image.view(), out.view()), NumericalError);
    image = scene(3, 1);
    EXPECT_THROW((void)minimum_entropy(image.view().slice(0, 0, 8), out.view().slice(0, 0, 8)), ShapeError);
    SharpnessOptions options;
    options.polynomial = 40;
    EXPECT_THROW((void)maximum_contrast(image.view(), out.view(), options), ValueError);
}

}  // namespace
}  // namespace sarfocus::autofocus
