#include <sarfocus/focus/range_compress.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <sarfocus/core/array.hpp>
#include <sarfocus/core/constants.hpp>
#include <sarfocus/core/error.hpp>
#include <sarfocus/signal/chirp.hpp>

namespace sarfocus::focus {
namespace {

using Image = Array<cfloat, 2>;

signal::Chirp test_chirp() {
    return {80e6, 1.5e-6, 100e6, signal::ChirpDirection::down};
}

// Echo of one scatterer: the continuous pulse, delayed by any fraction of a sample; its middle is `centre` samples after the first of raw.
Image chirp_echo(const signal::Chirp& chirp, cdouble amplitude, double centre, std::ptrdiff_t n_pulse, std::ptrdiff_t n) {
    Image raw({n_pulse, n});
    for (std::ptrdiff_t p = 0; p < n_pulse; ++p)
        for (std::ptrdiff_t i = 0; i < n; ++i) {
            const double t = (static_cast<double>(i) - centre) / chirp.sampling_rate;
            if (std::abs(t) < 0.5 * chirp.duration)
                raw(p, i) = cfloat(amplitude * std::polar(1.0, -pi * chirp.bandwidth / chirp.duration * t * t));
        }
    return raw;
}

TEST(RangeCompress, IsTheCorrelationWithTheReplica) {
    constexpr std::ptrdiff_t n = 40, m = 7;
    Image raw({1, n}), out({1, n});
    for (std::ptrdiff_t i = 0; i < n; ++i)
        raw(0, i) = cfloat(static_cast<float>(std::sin(0.3 * i * i)), static_cast<float>(std::cos(1.1 * i)));
    Array<cfloat, 1> replica({m});
    for (std::ptrdiff_t i = 0; i < m; ++i) replica(i) = cfloat(static_cast<float>(i - 2), 0.5f * static_cast<float>(i));
    for (const std::ptrdiff_t origin : {0, 3, 6}) {
        RangeCompressOptions options;
        options.replica_origin = static_cast<double>(origin);
        options.window.kind = signal::WindowKind::hamming;
        range_compress(raw.view(), replica.view(), out.view(), options);
        const auto weights = signal::window_samples(options.window, m);
        for (std::ptrdiff_t i = 0; i < n; ++i) {
            cdouble sum = 0.0;
            double energy = 0.0;
            for (std::ptrdiff_t k = 0; k < m; ++k) {
                const double w = weights[static_cast<std::size_t>(k)];
                energy += w * std::norm(cdouble(replica(k)));
                const std::ptrdiff_t at = i + k - origin;
                if (at >= 0 && at < n) sum += w * cdouble(raw(0, at)) * std::conj(cdouble(replica(k)));
            }
            EXPECT_LT(std::abs(cdouble(out(0, i)) - sum / energy), 2e-6) << origin << " " << i;  // single precision, sums of size 1
        }
    }
}

TEST(RangeCompress, PutsThePeakAtTheRangeWithThePhaseOfTheEcho) {
    // The middle of the pulse is the time zero: an echo centred on sample 300 is at range_start + 300 range_spacing.
    const signal::Chirp chirp = test_chirp();
    const auto replica = chirp.samples();
    const cdouble amplitude = std::polar(0.7, 2.1);
    RangeCompressOptions options;
    options.replica_origin = 0.5 * static_cast<double>(replica.size() - 1);
    for (const double centre : {300.0, 299.5, 300.25}) {
        const Image raw = chirp_echo(chirp, amplitude, centre, 1, 600);
        Image out({1, 600});
        range_compress(raw.view(), replica.view(), out.view(), options);
        // 2 / 150: at either end of the truncated pulse one of its 150 samples enters or leaves with its fraction.
        const auto nearest = static_cast<std::ptrdiff_t>(std::lround(centre));
        if (centre == std::round(centre)) EXPECT_LT(std::abs(cdouble(out(0, nearest)) - amplitude), 0.7 * 2 / 150) << centre;
        double moment = 0.0, total = 0.0;
        for (std::ptrdiff_t i = nearest - 3; i <= nearest + 3; ++i) {
            moment += static_cast<double>(i) * std::norm(cdouble(out(0, i)));
            total += std::norm(cdouble(out(0, i)));
            // The main lobe of a rectangular band about zero is real: its samples carry the phase of the amplitude.
            if (std::abs(static_cast<double>(i) - centre) < 1.0)
                EXPECT_LT(std::abs(std::arg(cdouble(out(0, i)) / amplitude)), 0.02) << centre;
        }
        EXPECT_NEAR(moment / total, centre, 0.05) << centre;  // sidelobes cut off unevenly
    }
}

TEST(RangeCompress, SameBitsForThreadsAndStridesAndInPlace) {
    const auto replica = test_chirp().samples();
    const Image raw = chirp_echo(test_chirp(), 1.0, 110.3, 17, 333);
    Image reference({17, 333});
    RangeCompressOptions options;
    options.execution.threads = 1;
    range_compress(raw.view(), replica.view(), reference.view(), options);
    options.execution.threads = 2;
    Image place = raw.copy();
    range_compress(ImageView(place.view()), replica.view(), place.view(), options);
    EXPECT_TRUE(std::equal(place.begin(), place.end(), reference.begin()));
    Image turned({333, 17});
    const MutableImageView flipped(turned.data() + 16, {17, 333}, {-1, 17});
    for (std::ptrdiff_t p = 0; p < 17; ++p)
        for (std::ptrdiff_t i = 0; i < 333; ++i) flipped(p, i) = raw(p, i);
    range_compress(flipped, replica.view(), flipped, options);
    for (std::ptrdiff_t p = 0; p < 17; ++p)
        for (std::ptrdiff_t i = 0; i < 333; ++i) ASSERT_EQ(flipped(p, i), reference(p, i));
}

TEST(RangeCompress, RefusesHostileInput) {
    auto replica = test_chirp().samples();
    Image raw({2, 50}), out({2, 50}), wrong({2, 49});
    EXPECT_THROW(range_compress(raw.view(), replica.view(), wrong.view()), ShapeError);
    EXPECT_THROW(range_compress(raw.view(), {replica.data(), {0}}, out.view()), ShapeError);
    RangeCompressOptions options;
    options.replica_origin = 150.0;
    EXPECT_THROW(range_compress(raw.view(), replica.view(), out.view(), options), ValueError);
    raw(1, 49) = cfloat(std::numeric_limits<float>::quiet_NaN(), 0.0f);
    EXPECT_THROW(range_compress(raw.view(), replica.view(), out.view()), NumericalError);
    raw(1, 49) = 0.0f;
    std::fill(replica.begin(), replica.end(), cfloat());
    EXPECT_THROW(range_compress(raw.view(), replica.view(), out.view()), NumericalError);
}

struct Scene {
    double start = 9.288e9;
    double spacing = 1.47e6;
    std::ptrdiff_t n_frequency = 31;
    double reference_range = 10160.123;
    double range = 10171.9;
    cdouble amplitude{0.3, -0.8};
};

// Reduced to one turn in double precision: the sum of the model of the header, nothing else.
Image history_of(const Scene& scene, std::ptrdiff_t n_pulse) {
    Image out({n_pulse, scene.n_frequency});
    for (std::ptrdiff_t p = 0; p < n_pulse; ++p)
        for (std::ptrdiff_t m = 0; m < scene.n_frequency; ++m) {
            const double f = scene.start + static_cast<double>(m) * scene.spacing;
            const double turns = 2.0 * f * (scene.range - scene.reference_range) / speed_of_light;
            out(p, m) = cfloat(scene.amplitude * std::polar(1.0, -two_pi * turns));
        }
    return out;
}

TEST(CompressFrequency, KeepsTheConventionAtEverySample) {
    for (const std::ptrdiff_t n_frequency : {1, 30, 31})
        for (const double centre_frequency : {0.0, 9.31e9}) {
            Scene scene;
            scene.n_frequency = n_frequency;
            const Image history = history_of(scene, 1);
            FrequencyCompressOptions options;
            options.centre_frequency = centre_frequency;
            options.window.kind = signal::WindowKind::taylor;
            const auto axis = compressed_range(n_frequency, scene.start, scene.spacing, options);
            const double centre =
                centre_frequency > 0 ? centre_frequency : scene.start + 0.5 * scene.spacing * static_cast<double>(n_frequency - 1);
            EXPECT_NEAR(axis.wavelength * centre, speed_of_light, 1e-6);
            Image out({1, axis.n_range});
            std::vector<double> range_start(1);
            const std::vector<double> reference{scene.reference_range};
            compress_frequency(history.view(), scene.start, scene.spacing, {reference.data(), {1}}, out.view(), {range_start.data(), {1}},
                               options);
            const auto weights = signal::window_samples(options.window, n_frequency);
            for (std::ptrdiff_t i = 0; i < axis.n_range; ++i) {
                const double x = range_start[0] + static_cast<double>(i) * axis.range_spacing - scene.range;
                cdouble pulse = 0.0;
                double total = 0.0;
                for (std::ptrdiff_t m = 0; m < n_frequency; ++m) {
                    const double w = weights[static_cast<std::size_t>(m)];
                    const double offset = scene.start + static_cast<double>(m) * scene.spacing - centre;
                    pulse += w * std::polar(1.0, two_pi * 2.0 * offset * x / speed_of_light);
                    total += w;
                }
                const cdouble expected =
                    scene.amplitude * std::polar(1.0, -two_pi * std::remainder(2.0 * scene.range / axis.wavelength, 1.0)) * pulse / total;
                // Single-precision history and transform, amplitude 0.85; 1e4 m in double precision: 4e-9 rad.
                EXPECT_LT(std::abs(cdouble(out(0, i)) - expected), 1e-6) << n_frequency << " " << i;
            }
        }
}

TEST(CompressFrequency, CoversTheUnambiguousIntervalAndItsGuard) {
    FrequencyCompressOptions options;
    options.guard = 5;
    const auto axis = compressed_range(424, 9.288e9, 1.47e6, options);
    const double interval = speed_of_light / (2.0 * 1.47e6);
    EXPECT_GE(axis.n_range, 1.5 * 424 + 10);
    EXPECT_NEAR(axis.range_spacing * static_cast<double>(axis.n_range - 10), interval, 1e-9 * interval);
    EXPECT_LE(axis.range_offset + 5 * axis.range_spacing, -0.5 * interval + axis.range_spacing);
    EXPECT_GE(axis.range_offset + static_cast<double>(axis.n_range - 5) * axis.range_spacing, 0.5 * interval - axis.range_spacing);
}

TEST(CompressFrequency, EveryPulseHasItsOwnRangeAndBitsDoNotDependOnThreads) {
    Scene scene;
    const Image history = history_of(scene, 9);
    std::vector<double> reference(9), range_start(9), other_start(9);
    for (std::size_t p = 0; p < 9; ++p) reference[p] = 10160.0 + 0.731 * static_cast<double>(p);
    const auto axis = compressed_range(scene.n_frequency, scene.start, scene.spacing);
    Image out({9, axis.n_range}), other({9, axis.n_range});
    FrequencyCompressOptions options;
    options.execution.threads = 1;
    compress_frequency(history.view(), scene.start, scene.spacing, {reference.data(), {9}}, out.view(), {range_start.data(), {9}}, options);
    options.execution.threads = 2;
    compress_frequency(history.view(), scene.start, scene.spacing, {reference.data(), {9}}, other.view(), {other_start.data(), {9}},
                       options);
    EXPECT_TRUE(std::equal(out.begin(), out.end(), other.begin()));
    EXPECT_EQ(range_start, other_start);
    for (std::size_t p = 0; p < 9; ++p) EXPECT_EQ(range_start[p], reference[p] + axis.range_offset);
}

TEST(CompressFrequency, RefusesHostileInput) {
    Scene scene;
    Image history = history_of(scene, 2);
    const auto axis = compressed_range(scene.n_frequency, scene.start, scene.spacing);
    Image out({2, axis.n_range});
    std::vector<double> reference(2, 1e4), start(2);
    const auto run = [&](std::ptrdiff_t n_reference, std::ptrdiff_t n_range) {
        compress_frequency(ImageView(history.view()), scene.start, scene.spacing, {reference.data(), {n_reference}},
                           {out.data(), {2, n_range}}, {start.data(), {2}});
    };
    EXPECT_THROW(run(1, axis.n_range), ShapeError);
    EXPECT_THROW(run(2, axis.n_range - 1), ShapeError);
    reference[1] = std::numeric_limits<double>::infinity();
    EXPECT_THROW(run(2, axis.n_range), NumericalError);
    reference[1] = 1e4;
    history(1, 3) = cfloat(0.0f, std::numeric_limits<float>::quiet_NaN());
    EXPECT_THROW(run(2, axis.n_range), NumericalError);
    EXPECT_THROW((void)compressed_range(8, 9e9, -1e6), ValueError);
    FrequencyCompressOptions options;
    options.oversampling = 0.9;
    EXPECT_THROW((void)compressed_range(8, 9e9, 1e6, options), ValueError);
    options.oversampling = 1e12;
    EXPECT_THROW((void)compressed_range(8, 9e9, 1e6, options), ValueError);
}

}  // namespace
}  // namespace sarfocus::focus
