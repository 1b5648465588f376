#include <sarfocus/focus/range_doppler.hpp>

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstddef>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <sarfocus/core/array.hpp>
#include <sarfocus/core/constants.hpp>
#include <sarfocus/core/error.hpp>
#include <sarfocus/fft/plan.hpp>
#include <sarfocus/focus/azimuth.hpp>
#include <sarfocus/focus/range_compress.hpp>
#include <sarfocus/signal/chirp.hpp>

namespace sarfocus::focus {
namespace {

using Image = Array<cfloat, 2>;

constexpr FastTime fast_time{3000.0, 60e6};
constexpr double spacing = speed_of_light / (2.0 * 60e6);

// At the Doppler edges, 200 Hz, the echo of 3 km lies 4.7 m, two samples, behind the closest range.
geometry::StripmapGeometry strip(std::ptrdiff_t n_range, double doppler_centroid = 0.0) {
    geometry::StripmapGeometry out;
    out.wavelength = 0.056;
    out.prf = 450.0;
    out.velocity = 100.0;
    for (std::ptrdiff_t j = 0; j < n_range; ++j) out.slant_range.push_back(3000.0 + spacing * (4.3 + 0.9 * static_cast<double>(j)));
    out.doppler_bandwidth = 400.0;
    out.doppler_centroid = doppler_centroid;
    return out;
}

Image pattern(std::ptrdiff_t rows, std::ptrdiff_t columns) {
    Image out({rows, columns});
    for (std::ptrdiff_t i = 0; i < out.size(); ++i) {
        const auto x = static_cast<double>(i);
        out.data()[i] = cfloat(static_cast<float>(std::sin(1.7e-2 * x * x)), static_cast<float>(std::cos(2.3e-3 * x * x + 0.4)));
    }
    return out;
}

bool same_bits(const Image& a, const Image& b) {
    return a.extents() == b.extents() && std::equal(a.begin(), a.end(), b.begin());
}

Image formed(const ImageView& echo, const geometry::StripmapGeometry& geometry, const RangeDopplerOptions& options = {}) {
    Image image({echo.extent(0), static_cast<std::ptrdiff_t>(geometry.slant_range.size())});
    form_stripmap(echo, geometry, fast_time, image.view(), options);
    return image;
}

TEST(RangeDoppler, WithoutMigrationOnTheSamplesItIsAzimuthCompression) {
    // A narrow aperture: the echo strays from the parabola by 1e-4 rad and from its gate by 1e-3 samples.
    constexpr std::ptrdiff_t n = 256, n_range = 24;
    auto geometry = strip(n_range);
    geometry.doppler_bandwidth = 4.0;
    for (std::ptrdiff_t j = 0; j < n_range; ++j)
        geometry.slant_range[static_cast<std::size_t>(j)] = 3000.0 + spacing * static_cast<double>(j);
    const Image echo = pattern(n, n_range);
    Image expected({n, n_range});
    azimuth_compress(echo.view(), geometry, expected.view());
    const fft::Plan<float> forward(n, fft::Direction::forward);
    const fft::Plan<float> inverse(n, fft::Direction::inverse);
    Array<cfloat, 1> line({n});
    const Image image = formed(echo.view(), geometry);
    for (std::ptrdiff_t j = 0; j < n_range; ++j) {
        for (std::ptrdiff_t i = 0; i < n; ++i) line(i) = expected(i, j);
        forward.execute(line.data());
        for (std::ptrdiff_t k = 0; k < n; ++k) {
            const double f = 450.0 * static_cast<double>(k < n / 2 ? k : k - n) / n;
            line(k) *= f >= -2.0 && f < 2.0 ? 1.0f / n : 0.0f;
        }
        inverse.execute(line.data());
        for (std::ptrdiff_t i = 0; i < n; ++i) EXPECT_LT(std::abs(image(i, j) - line(i)), 2e-3f) << i << " " << j;
    }
}

TEST(RangeDoppler, IsLimitedToTheBandAboutTheCentroid) {
    constexpr std::ptrdiff_t n = 90;
    const Image image = formed(pattern(n, 40).view(), strip(20, -130.0));
    for (std::ptrdiff_t k = 0; k < n; ++k) {
        double f = 450.0 * static_cast<double>(k) / n;
        while (f >= -130.0 + 225.0) f -= 450.0;
        double energy = 0.0;
        for (std::ptrdiff_t j = 0; j < 20; ++j) {
            cdouble sum = 0.0;
            for (std::ptrdiff_t i = 0; i < n; ++i)
                sum += cdouble(image(i, j)) * std::polar(1.0, -two_pi * static_cast<double>(i * k % n) / n);
            energy += std::norm(sum);
        }
        if (std::abs(f + 130.0) > 200.5)
            EXPECT_LT(energy, 1e-6) << f;  // 90 samples of size 1 rounded to 6e-8, squared
        else if (std::abs(f + 130.0) < 199.5)
            EXPECT_GT(energy, 1.0) << f;
    }
}

TEST(RangeDoppler, BitsDependOnNeitherThreadsNorStridesNorPlace) {
    constexpr std::ptrdiff_t n = 130, n_fast = 70, n_range = 50;
    for (const double centroid : {0.0, 321.0}) {
        const auto geometry = strip(n_range, centroid);
        const Image echo = pattern(n, n_fast);
        RangeDopplerOptions one;
        one.execution.threads = 1;
        const Image reference = formed(echo.view(), geometry, one);
        for (const int threads : {2, 3, 0}) {
            RangeDopplerOptions options;
            options.execution.threads = threads;
            EXPECT_TRUE(same_bits(formed(echo.view(), geometry, options), reference)) << threads;
        }
        Image turned({n_fast, n}), turned_out({n_range, n});
        const MutableImageView in(turned.data() + (n - 1), {n, n_fast}, {-1, n});
        const MutableImageView out(turned_out.data() + (n_range - 1) * n, {n, n_range}, {1, -n});
        for (std::ptrdiff_t i = 0; i < n; ++i)
            for (std::ptrdiff_t j = 0; j < n_fast; ++j) in(i, j) = echo(i, j);
        form_stripmap(in, geometry, fast_time, out);
        for (std::ptrdiff_t i = 0; i < n; ++i)
            for (std::ptrdiff_t j = 0; j < n_range; ++j) ASSERT_EQ(out(i, j), reference(i, j));

        // The image over the echo it comes from.
        Image shared = echo.copy();
        const MutableImageView over = shared.view().slice(1, 7, n_range);
        form_stripmap(ImageView(shared.view()), geometry, fast_time, over);
        for (std::ptrdiff_t i = 0; i < n; ++i)
            for (std::ptrdiff_t j = 0; j < n_range; ++j) ASSERT_EQ(over(i, j), reference(i, j));
    }
}

TEST(RangeDoppler, RawEchoesAreCompressedFirst) {
    const signal::Chirp chirp{50e6, 0.4e-6, 60e6, signal::ChirpDirection::up};
    const auto replica = chirp.samples();
    const Image raw = pattern(64, 90);
    RangeCompressOptions compress;
    compress.replica_origin = 11.5;
    compress.window.kind = signal::WindowKind::taylor;
    Image echo({64, 90});
    range_compress(raw.view(), replica.view(), echo.view(), compress);
    RangeDopplerOptions options;
    options.chirp = replica.view();
    options.replica_origin = compress.replica_origin;
    options.window = compress.window;
    EXPECT_TRUE(same_bits(formed(raw.view(), strip(60), options), formed(echo.view(), strip(60))));
}

TEST(RangeDoppler, OneGateOnePulseAndPrimesWork) {
    for (const std::ptrdiff_t n : {2, 7, 131}) {
        auto geometry = strip(1);
        geometry.doppler_bandwidth = 450.0;
        const Image image = formed(pattern(n, 37).view(), geometry);
        EXPECT_TRUE(std::all_of(image.begin(), image.end(), [](cfloat x) { return std::isfinite(x.real()) && std::isfinite(x.imag()); }));
        EXPECT_TRUE(std::any_of(image.begin(), image.end(), [](cfloat x) { return std::abs(x) > 0.1f; }));
    }
}

template <class Error>
void expect_refused(const std::string& text, const std::function<void()>& call) {
    try {
        call();
        ADD_FAILURE() << "nothing thrown, expected " << text;
    } catch (const Error& error) {
        EXPECT_NE(std::string(error.what()).find(text), std::string::npos) << error.what();
    }
}

TEST(RangeDoppler, RefusesHostileInput) {
    Image echo = pattern(32, 40);
    Image image({32, 20}), narrow({32, 19});
    const auto form = [&](const geometry::StripmapGeometry& geometry, const FastTime& time, const RangeDopplerOptions& options) {
        form_stripmap(ImageView(echo.view()), geometry, time, image.view(), options);
    };
    expect_refused<ShapeError>("image", [&] { form_stripmap(ImageView(echo.view()), strip(20), fast_time, narrow.view()); });
    expect_refused<ShapeError>("echo", [&] { form_stripmap({echo.data(), {32, 0}}, strip(20), fast_time, image.view()); });
    expect_refused<ValueError>("range_start", [&] { form(strip(20), {-1.0, 60e6}, {}); });
    expect_refused<ValueError>("range_sampling", [&] { form(strip(20), {3000.0, std::numeric_limits<double>::infinity()}, {}); });
    // lambda / 2 v is 2.8e-4 s: at 3571 Hz the echo comes from straight ahead.
    expect_refused<ValueError>("doppler_centroid", [&] { form(strip(20, -3400.0), fast_time, {}); });
    auto geometry = strip(20);
    geometry.slant_range[7] = geometry.slant_range[6];
    expect_refused<ValueError>("slant_range[7]", [&] { form(geometry, fast_time, {}); });
    geometry = strip(20);
    geometry.slant_range[19] = 3000.0 + 39.51 * spacing;
    expect_refused<ValueError>("slant_range[19]", [&] { form(geometry, fast_time, {}); });
    geometry.slant_range[19] = 3000.0 + 39.49 * spacing;
    EXPECT_NO_THROW(form(geometry, fast_time, {}));
    expect_refused<ValueError>("slant_range[0]", [&] { form(strip(20), {3500.0, 60e6}, {}); });
    geometry.doppler_bandwidth = 14.0;
    expect_refused<ValueError>("doppler_bandwidth", [&] { form(geometry, fast_time, {}); });
    RangeDopplerOptions options;
    options.replica_origin = 3.0;
    expect_refused<ValueError>("chirp", [&] { form(strip(20), fast_time, options); });
    options.replica_origin = 0.0;
    options.window.kind = signal::WindowKind::hann;
    expect_refused<ValueError>("chirp", [&] { form(strip(20), fast_time, options); });
    // A tenth of the carrier as bandwidth, thirty degrees, a swath of 35 km: secondary range compression varies by more than 12.7 rad.
    geometry = strip(20);
    geometry.wavelength = 0.5;
    for (std::size_t j = 0; j < 20; ++j) geometry.slant_range[j] = 3000.0 + 5.0 * static_cast<double>(j);
    geometry.doppler_bandwidth = 200.0;
    EXPECT_NO_THROW(form(geometry, fast_time, {}));
    Image wide_echo({32, 14000});
    for (std::size_t j = 0; j < 20; ++j) geometry.slant_range[j] = 3000.0 + 1800.0 * static_cast<double>(j);
    expect_refused<ValueError>("slant_range: expected a swath",
                               [&] { form_stripmap(ImageView(wide_echo.view()), geometry, fast_time, image.view()); });
}

TEST(RangeDoppler, NamesTheSampleAtFaultAndLeavesTheImageAlone) {
    Image echo = pattern(32, 40);
    echo(9, 31) = cfloat(0.0f, -std::numeric_limits<float>::infinity());
    Image image({32, 20});
    const auto replica = pattern(1, 5);
    for (const bool raw : {false, true}) {
        RangeDopplerOptions options;
        if (raw) options.chirp = replica.view().row(0);
        expect_refused<NumericalError>("echo: expected finite samples",
                                       [&] { form_stripmap(ImageView(echo.view()), strip(20), fast_time, image.view(), options); });
        expect_refused<NumericalError>("[9, 31]",
                                       [&] { form_stripmap(ImageView(echo.view()), strip(20), fast_time, image.view(), options); });
        EXPECT_TRUE(same_bits(image, Image({32, 20})));
    }
    std::fill(echo.begin(), echo.end(), cfloat(3e38f, 0.0f));
    EXPECT_THROW(form_stripmap(ImageView(echo.view()), strip(20), fast_time, image.view()), NumericalError);
}

TEST(RangeDoppler, AsksForMemoryBeforeItTakesAny) {
    cfloat sample(1.0f, 0.0f);
    const ImageView echo(&sample, {std::ptrdiff_t{1} << 42, 64}, {0, 0});
    const MutableImageView image(&sample, {std::ptrdiff_t{1} << 42, 20}, {0, 0});
    EXPECT_THROW(form_stripmap(echo, strip(20), fast_time, image), MemoryEstimateError);
}

TEST(RangeDoppler, StopsWhenAskedToInEveryPhase) {
    const Image echo = pattern(64, 40);
    const auto replica = pattern(1, 5);
    for (const std::string phase : {"range_compress", "azimuth_spectrum", "range_migration", "azimuth_image"}) {
        RangeDopplerOptions options;
        options.chirp = replica.view().row(0);
        options.execution.progress = [&](const ProgressUpdate& update) { return update.phase != phase; };
        EXPECT_THROW((void)formed(echo.view(), strip(20), options), Cancelled) << phase;
    }
}

}  // namespace
}  // namespace sarfocus::focus
