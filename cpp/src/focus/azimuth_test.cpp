#include <sarfocus/focus/azimuth.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <sarfocus/core/array.hpp>
#include <sarfocus/core/constants.hpp>
#include <sarfocus/core/error.hpp>

namespace sarfocus::focus {
namespace {

using Image = Array<cfloat, 2>;

geometry::StripmapGeometry strip_geometry(std::ptrdiff_t n_range, double doppler_centroid = 0.0) {
    geometry::StripmapGeometry out;
    out.wavelength = 0.03;
    out.prf = 400.0;
    out.velocity = 120.0;
    for (std::ptrdiff_t j = 0; j < n_range; ++j) out.slant_range.push_back(8000.0 + 700.0 * static_cast<double>(j * j));
    out.doppler_bandwidth = 300.0;
    out.doppler_centroid = doppler_centroid;
    return out;
}

Image pattern(std::ptrdiff_t rows, std::ptrdiff_t columns, double seed) {
    Image out({rows, columns});
    for (std::ptrdiff_t i = 0; i < out.size(); ++i) {
        const double x = static_cast<double>(i) + seed;
        out.data()[i] = cfloat(static_cast<float>(std::sin(1.7 * x * x)), static_cast<float>(std::cos(2.3 * x * x + seed)));
    }
    return out;
}

cdouble inner(const Image& a, const Image& b) {
    cdouble sum = 0.0;
    for (std::ptrdiff_t i = 0; i < a.size(); ++i) sum += cdouble(a.data()[i]) * std::conj(cdouble(b.data()[i]));
    return sum;
}

double difference(const Image& a, const Image& b) {
    double sum = 0.0;
    for (std::ptrdiff_t i = 0; i < a.size(); ++i) sum += std::norm(cdouble(a.data()[i]) - cdouble(b.data()[i]));
    return std::sqrt(sum);
}

bool same_bits(const Image& a, const Image& b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end());
}

TEST(Azimuth, AgreesWithTheExplicitSum) {
    // x'[i] = 1/n sum_k exp(2j pi k i / n) exp(-j pi (f_k - fdc)^2 / K) sum_m x[m] exp(-2j pi k m / n), f_k found by search among the
    // aliases.
    constexpr std::ptrdiff_t n = 30, n_range = 3;
    for (const double centroid : {0.0, 1234.5, -390.0}) {
        const auto geometry = strip_geometry(n_range, centroid);
        const Image raw = pattern(n, n_range, 0.25);
        Image image({n, n_range});
        azimuth_compress(raw.view(), geometry, image.view());
        for (std::ptrdiff_t j = 0; j < n_range; ++j) {
            const double rate = 2.0 * 120.0 * 120.0 / (0.03 * geometry.slant_range[static_cast<std::size_t>(j)]);
            for (std::ptrdiff_t i = 0; i < n; ++i) {
                cdouble expected = 0.0;
                for (std::ptrdiff_t k = 0; k < n; ++k) {
                    double f = 400.0 * static_cast<double>(k) / n - 40 * 400.0;
                    while (f < centroid - 200.0) f += 400.0;
                    cdouble spectrum = 0.0;
                    for (std::ptrdiff_t m = 0; m < n; ++m)
                        spectrum += cdouble(raw(m, j)) * std::polar(1.0, -two_pi * static_cast<double>(k * m) / n);
                    expected += spectrum *
                                std::polar(1.0 / n, two_pi * static_cast<double>(k * i) / n - pi * (f - centroid) * (f - centroid) / rate);
                }
                EXPECT_LT(std::abs(cdouble(image(i, j)) - expected), 3e-6);  // single precision, size 1.4, two transforms and the phase
            }
        }
    }
}

TEST(Azimuth, PairIsInverseAdjointAndUnitary) {
    // 1e-6: the promise of the header. n: odd, a prime above the block of phases, one sample, longer than a tile.
    for (const std::ptrdiff_t n : {1, 2, 45, 521, 1200}) {
        const std::ptrdiff_t n_range = 19;
        const auto geometry = strip_geometry(n_range, 77.0);
        const Image x = pattern(n, n_range, 0.1), y = pattern(n, n_range, 5.3);
        Image ax({n, n_range}), back({n, n_range}), ahy({n, n_range});
        azimuth_compress(x.view(), geometry, ax.view());
        azimuth_decompress(ax.view(), geometry, back.view());
        azimuth_decompress(y.view(), geometry, ahy.view());
        const double norm_x = std::sqrt(inner(x, x).real());
        EXPECT_LT(difference(back, x), 1e-6 * norm_x) << n;
        EXPECT_LT(std::abs(std::sqrt(inner(ax, ax).real()) - norm_x), 1e-6 * norm_x) << n;
        EXPECT_LT(std::abs(inner(ax, y) - inner(x, ahy)), 1e-6 * norm_x * std::sqrt(inner(y, y).real())) << n;
    }
}

TEST(Azimuth, BitsDependOnNeitherThreadsNorStridesNorPlace) {
    constexpr std::ptrdiff_t n = 300, n_range = 70;
    const auto geometry = strip_geometry(n_range, -150.0);
    const Image raw = pattern(n, n_range, 0.9);
    Image reference({n, n_range});
    AzimuthOptions one;
    one.execution.threads = 1;
    azimuth_compress(raw.view(), geometry, reference.view(), one);
    for (const int threads : {2, 3, 0}) {
        Image image({n, n_range});
        AzimuthOptions options;
        options.execution.threads = threads;
        azimuth_compress(raw.view(), geometry, image.view(), options);
        EXPECT_TRUE(same_bits(image, reference)) << threads;
    }

    Image turned({n_range, n}), turned_out({n_range, n});
    const MutableImageView in(turned.data() + (n - 1), {n, n_range}, {-1, n});
    const MutableImageView out(turned_out.data(), {n, n_range}, {1, n});
    for (std::ptrdiff_t i = 0; i < n; ++i)
        for (std::ptrdiff_t j = 0; j < n_range; ++j) in(i, j) = raw(i, j);
    azimuth_compress(in, geometry, out);
    Image collected({n, n_range});
    for (std::ptrdiff_t i = 0; i < n; ++i)
        for (std::ptrdiff_t j = 0; j < n_range; ++j) collected(i, j) = out(i, j);
    EXPECT_TRUE(same_bits(collected, reference));

    Image place = raw.copy();
    azimuth_compress(ImageView(place.view()), geometry, place.view());
    EXPECT_TRUE(same_bits(place, reference));
}

TEST(Azimuth, GatherNeedsNoFiniteInputElsewhere) {
    // A view into a larger image whose other samples are NaN.
    constexpr std::ptrdiff_t n = 16;
    Image wide({n, 9});
    std::fill(wide.begin(), wide.end(), cfloat(std::numeric_limits<float>::quiet_NaN(), 0.0f));
    const auto part = wide.view().slice(1, 3, 2);
    for (std::ptrdiff_t i = 0; i < n; ++i)
        for (std::ptrdiff_t j = 0; j < 2; ++j) part(i, j) = cfloat(1.0f, static_cast<float>(i));
    Image image({n, 2});
    EXPECT_NO_THROW(azimuth_compress(part, strip_geometry(2), image.view()));
}

TEST(Azimuth, RefusesHostileInput) {
    Image raw = pattern(32, 4, 0.0), image({32, 4}), narrow({32, 3});
    EXPECT_THROW(azimuth_compress(raw.view(), strip_geometry(5), image.view()), ShapeError);
    EXPECT_THROW(azimuth_compress(raw.view(), strip_geometry(4), narrow.view()), ShapeError);
    EXPECT_THROW(azimuth_compress({raw.data(), {0, 4}}, strip_geometry(4), {image.data(), {0, 4}}), ShapeError);
    auto bad = strip_geometry(4);
    bad.slant_range[2] = -1.0;
    EXPECT_THROW(azimuth_compress(raw.view(), bad, image.view()), ValueError);
    raw(7, 2) = cfloat(0.0f, std::numeric_limits<float>::infinity());
    try {
        azimuth_decompress(ImageView(raw.view()), strip_geometry(4), image.view());
        FAIL();
    } catch (const NumericalError& error) {
        EXPECT_NE(std::string(error.what()).find("image: expected finite samples"), std::string::npos);
        EXPECT_NE(std::string(error.what()).find("[7, 2]"), std::string::npos);
    }
    std::fill(raw.begin(), raw.end(), cfloat(3e38f, 0.0f));
    EXPECT_THROW(azimuth_compress(ImageView(raw.view()), strip_geometry(4), image.view()), NumericalError);
}

Array<double, 2> phases(std::ptrdiff_t blocks, std::ptrdiff_t n) {
    Array<double, 2> out({blocks, n});
    for (std::ptrdiff_t b = 0; b < blocks; ++b)
        for (std::ptrdiff_t k = 0; k < n; ++k)
            out(b, k) = (3.0 + static_cast<double>(b)) * std::sin(0.05 * static_cast<double>(k * (b + 1))) + 40.0 * static_cast<double>(b);
    return out;
}

TEST(AzimuthCorrect, IsDecompressionTheFactorAndCompression) {
    for (const std::ptrdiff_t n : {1, 45, 521, 1200}) {
        constexpr std::ptrdiff_t n_range = 19;
        const auto geometry = strip_geometry(n_range, 77.0);
        const Image image = pattern(n, n_range, 0.4);
        const Array<double, 2> phase = phases(3, n);
        const std::vector<double> centres = {2.5, 6.0, 15.0};
        Image corrected({n, n_range}), expected({n, n_range});
        azimuth_correct(image.view(), geometry, phase.view(), centres, corrected.view());
        azimuth_decompress(image.view(), geometry, expected.view());
        for (std::ptrdiff_t j = 0; j < n_range; ++j)
            for (std::ptrdiff_t k = 0; k < n; ++k) {
                const double g = std::clamp(static_cast<double>(j), 2.5, 15.0);
                const std::ptrdiff_t b = g < 6.0 ? 0 : 1;
                const double t = (g - centres[static_cast<std::size_t>(b)]) /
                                 (centres[static_cast<std::size_t>(b) + 1] - centres[static_cast<std::size_t>(b)]);
                expected(k, j) = cfloat(cdouble(expected(k, j)) * std::polar(1.0, -(1.0 - t) * phase(b, k) - t * phase(b + 1, k)));
            }
        azimuth_compress(ImageView(expected.view()), geometry, expected.view());
        // Single precision, four transforms on either side: twice what the header allows a pair of them.
        EXPECT_LT(difference(corrected, expected), 2e-6 * std::sqrt(inner(image, image).real())) << n;
        EXPECT_NEAR(inner(corrected, corrected).real() / inner(image, image).real(), 1.0, 2e-6);

        Array<double, 2> back({1, n});
        const Array<double, 2> one = phases(1, n);
        for (std::ptrdiff_t k = 0; k < n; ++k) back(0, k) = -one(0, k);
        azimuth_correct(image.view(), geometry, one.view(), {0.0}, corrected.view());
        azimuth_correct(ImageView(corrected.view()), geometry, std::as_const(back).view(), {7.0}, corrected.view());
        EXPECT_LT(difference(corrected, image), 2e-6 * std::sqrt(inner(image, image).real())) << n;
    }
}

TEST(AzimuthCorrect, BitsDependOnNeitherThreadsNorStridesNorPlace) {
    constexpr std::ptrdiff_t n = 300, n_range = 70;
    const auto geometry = strip_geometry(n_range, -150.0);
    const Image image = pattern(n, n_range, 0.9);
    const Array<double, 2> phase = phases(2, n);
    const std::vector<double> centres = {10.0, 50.5};
    Image reference({n, n_range});
    AzimuthCorrectOptions options;
    options.execution.threads = 1;
    azimuth_correct(image.view(), geometry, phase.view(), centres, reference.view(), options);
    Array<double, 2> wide({n, 3});
    for (std::ptrdiff_t k = 0; k < n; ++k) {
        wide(k, 0) = phase(0, k);
        wide(k, 2) = phase(1, k);
    }
    const ArrayView<const double, 2> strided(wide.data(), {2, n}, {2, 3});
    for (const int threads : {2, 3, 5}) {
        options.execution.threads = threads;
        Image turned({n_range, n});
        const MutableImageView out(turned.data() + (n - 1), {n, n_range}, {-1, n});
        azimuth_correct(image.view(), geometry, threads == 3 ? strided : ArrayView<const double, 2>(phase.view()), centres, out, options);
        Image collected({n, n_range});
        for (std::ptrdiff_t i = 0; i < n; ++i)
            for (std::ptrdiff_t j = 0; j < n_range; ++j) collected(i, j) = out(i, j);
        EXPECT_TRUE(same_bits(collected, reference)) << threads;
    }
    Image place = image.copy();
    azimuth_correct(ImageView(place.view()), geometry, phase.view(), centres, place.view());
    EXPECT_TRUE(same_bits(place, reference));
}

TEST(AzimuthCorrect, RefusesHostileInput) {
    constexpr std::ptrdiff_t n = 32;
    Image image = pattern(n, 4, 0.0), corrected({n, 4});
    Array<double, 2> phase = phases(2, n);
    const auto correct = [&](const ArrayView<const double, 2>& p, const std::vector<double>& centres) {
        azimuth_correct(ImageView(image.view()), strip_geometry(4), p, centres, corrected.view());
    };
    const ArrayView<const double, 2> good = std::as_const(phase).view();
    EXPECT_NO_THROW(correct(good, {-3.0, 9.0}));  // beyond the gates there are
    EXPECT_THROW(correct(good, {1.0}), ShapeError);
    EXPECT_THROW(correct(good.slice(1, 0, n - 1), {1.0, 2.0}), ShapeError);
    EXPECT_THROW(correct(good.slice(0, 0, 0), {}), ShapeError);
    EXPECT_THROW(correct(good, {2.0, 1.0}), ValueError);
    EXPECT_THROW(correct(good, {1.0, 1.0}), ValueError);
    EXPECT_THROW(correct(good, {1.0, std::numeric_limits<double>::quiet_NaN()}), std::exception);
    phase(1, 5) = std::numeric_limits<double>::infinity();
    EXPECT_THROW(correct(good, {1.0, 2.0}), NumericalError);
    phase(1, 5) = 0.0;
    image(7, 2) = cfloat(std::numeric_limits<float>::quiet_NaN(), 0.0f);
    try {
        correct(good, {1.0, 2.0});
        FAIL();
    } catch (const NumericalError& error) {
        EXPECT_NE(std::string(error.what()).find("[7, 2]"), std::string::npos) << error.what();
    }
    image(7, 2) = {};
    AzimuthCorrectOptions options;
    options.execution.progress = [](const ProgressUpdate&) { return false; };
    EXPECT_THROW(azimuth_correct(ImageView(image.view()), strip_geometry(4), good, {1.0, 2.0}, corrected.view(), options), Cancelled);
}

TEST(AzimuthCorrect, ShowsEveryGateBeforeAndAfter) {
    constexpr std::ptrdiff_t n = 48, n_range = 21;
    const auto geometry = strip_geometry(n_range, 40.0);
    const Image image = pattern(n, n_range, 0.4);
    const Array<double, 2> phase = phases(1, n);
    Image corrected({n, n_range}), before({n_range, n}), after({n_range, n});
    AzimuthCorrectOptions options;
    options.execution.threads = 3;
    options.before = [&](std::ptrdiff_t gate, const cfloat* samples) { std::copy_n(samples, n, &before(gate, 0)); };
    options.after = [&](std::ptrdiff_t gate, const cfloat* samples) { std::copy_n(samples, n, &after(gate, 0)); };
    azimuth_correct(image.view(), geometry, phase.view(), {0.0}, corrected.view(), options);
    for (std::ptrdiff_t i = 0; i < n; ++i)
        for (std::ptrdiff_t j = 0; j < n_range; ++j) {
            EXPECT_EQ(before(j, i), image(i, j));
            EXPECT_EQ(after(j, i), corrected(i, j));
        }
}

TEST(Azimuth, StopsWhenAskedTo) {
    const Image raw = pattern(64, 8, 0.0);
    Image image({64, 8});
    AzimuthOptions options;
    options.execution.progress = [](const ProgressUpdate&) { return false; };
    EXPECT_THROW(azimuth_compress(raw.view(), strip_geometry(8), image.view(), options), Cancelled);
}

}  // namespace
}  // namespace sarfocus::focus
