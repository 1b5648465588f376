#include <sarfocus/quality/point_response.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include <sarfocus/core/array.hpp>
#include <sarfocus/core/constants.hpp>
#include <sarfocus/core/error.hpp>

namespace sarfocus::quality {
namespace {

double sinc(double x) {
    return x == 0.0 ? 1.0 : std::sin(pi * x) / (pi * x);
}

struct Point {
    double azimuth = 0.0;
    double range = 0.0;
    cdouble amplitude = 1.0;
};

/// Adds the samples of the continuous response of an unweighted band, `cell` samples per resolution cell, centred at `band_centre`.
void add_point(Array<cfloat, 2>& image, const Point& point, double cell, std::array<double, 2> band_centre = {0.0, 0.0}) {
    for (std::ptrdiff_t i = 0; i < image.extent(0); ++i)
        for (std::ptrdiff_t j = 0; j < image.extent(1); ++j) {
            const double a = static_cast<double>(i) - point.azimuth;
            const double r = static_cast<double>(j) - point.range;
            const double carrier = two_pi * (band_centre[0] * a + band_centre[1] * r);
            image(i, j) += static_cast<cfloat>(point.amplitude * sinc(a / cell) * sinc(r / cell) * std::polar(1.0, carrier));
        }
}

Array<cfloat, 2> image_of(const Point& point, double cell, std::ptrdiff_t size = 255, std::array<double, 2> band_centre = {0.0, 0.0}) {
    Array<cfloat, 2> image({size, size});
    add_point(image, point, cell, band_centre);
    return image;
}

PointResponseOptions known(double cell) {
    PointResponseOptions out;
    out.azimuth.oversampling = out.range.oversampling = cell;
    return out;
}

// Closed forms for the unweighted band: sinc^2 = 1/2 at 0.44295 cells, the first side lobe at 1.4303 cells. Energy inside the nulls
// 0.902823, within 11 cells 0.990800 (quadrature of sinc^2).
constexpr double theory_irw = 0.885893;
constexpr double theory_pslr = -13.2615;
const double theory_islr_10 = 10.0 * std::log10((0.990800 - 0.902823) / 0.902823);

void expect_unweighted(const AxisResponse& axis, double position, double cell) {
    EXPECT_NEAR(axis.position, position, 0.002);
    EXPECT_NEAR(axis.irw_cells, theory_irw, 0.002);
    EXPECT_NEAR(axis.irw, theory_irw * cell, 0.002 * cell);
    // The worst case is critical sampling, where the chip's border cuts off tails that fall like 1/x: 0.017 dB for 255 pixels.
    EXPECT_NEAR(axis.pslr_db, theory_pslr, 0.02);
    EXPECT_NEAR(axis.islr_db, theory_islr_10, 0.03);
    EXPECT_NEAR(axis.theory_pslr_db, theory_pslr, 0.003);  // parabola on a grid of 1/32 cell
    EXPECT_NEAR(axis.theory_islr_db, theory_islr_10, 0.01);
    EXPECT_EQ(axis.verdict, Verdict::good);
}

TEST(PointResponse, UnweightedAtAnyOffsetAndOversampling) {
    for (const double cell : {1.0, 1.05, 1.2, 1.5, 2.0})
        for (const double offset : {0.0, 0.13, 0.25, 0.37, 0.5, 0.81}) {
            SCOPED_TRACE(testing::Message() << "cell " << cell << ", offset " << offset);
            const Point point{127.0 + offset, 120.0 - offset, std::polar(7.0, 1.1)};
            const auto image = image_of(point, cell);
            const auto response = point_response(image.view(), {127.0, 120.0}, known(cell));
            expect_unweighted(response.azimuth, point.azimuth, cell);
            expect_unweighted(response.range, point.range, cell);
            EXPECT_NEAR(response.amplitude, 7.0, 7.0 * 0.003);  // the same tails; 0.3 % is 0.03 dB
            EXPECT_NEAR(response.phase, 1.1, 0.003);
            EXPECT_EQ(response.verdict, Verdict::good);
        }
}

TEST(PointResponse, UnknownCellComesFromTheNulls) {
    const auto image = image_of({100.3, 90.6}, 1.4);
    const auto response = point_response(image.view(), {100, 91});
    for (const AxisResponse* axis : {&response.azimuth, &response.range}) {
        EXPECT_NEAR(axis->irw, theory_irw * 1.4, 0.003);
        EXPECT_TRUE(std::isnan(axis->irw_cells));
        EXPECT_NEAR(axis->nulls[0], 1.4, 0.003);
        EXPECT_NEAR(axis->nulls[1], 1.4, 0.003);
        EXPECT_NEAR(axis->islr_db, theory_islr_10, 0.03);
        EXPECT_EQ(axis->verdict, Verdict::good);
    }
}

TEST(PointResponse, FindsTheGapOfAShiftedSpectrum) {
    for (const double centre : {-0.45, -0.2, 0.31, 0.5}) {
        SCOPED_TRACE(centre);
        const auto image = image_of({127.4, 120.2}, 1.2, 255, {centre, -0.5 * centre});
        const auto response = point_response(image.view(), {127.0, 120.0}, known(1.2));
        expect_unweighted(response.azimuth, 127.4, 1.2);
        expect_unweighted(response.range, 120.2, 1.2);
        // At half a cycle either band is as good: they differ by a turn per pixel.
        if (centre != 0.5) EXPECT_NEAR(response.phase, 0.0, 0.003);
    }
}

TEST(PointResponse, GivenBandCentreServesACriticallySampledShiftedSpectrum) {
    const auto image = image_of({127.4, 120.2}, 1.0, 255, {0.3, 0.0});
    auto options = known(1.0);
    options.azimuth.band_centre = 0.3;
    const auto response = point_response(image.view(), {127.0, 120.0}, options);
    expect_unweighted(response.azimuth, 127.4, 1.0);
}

TEST(PointResponse, BrighterNeighbourDoesNotDisplaceTheMeasurement) {
    // 40 dB brighter, 30 cells off along both axes: its side lobes reach 100 / (pi 30)^2 = 0.011 of the target.
    Array<cfloat, 2> image({255, 255});
    add_point(image, {120.3, 118.4}, 1.2);
    add_point(image, {120.3 + 36.0, 118.4 + 36.0, 100.0}, 1.2);
    const auto response = point_response(image.view(), {120, 118}, known(1.2));
    EXPECT_NEAR(response.azimuth.position, 120.3, 0.02);
    EXPECT_NEAR(response.range.position, 118.4, 0.02);
    EXPECT_NEAR(response.amplitude, 1.0, 0.02);
    EXPECT_NEAR(response.azimuth.irw_cells, theory_irw, 0.02);
}

TEST(PointResponse, SlopeOfABrighterNeighbourIsNoTarget) {
    Array<cfloat, 2> image({255, 255});
    add_point(image, {100.0, 100.0}, 8.0);
    PointResponseOptions options;
    options.search = 1;
    EXPECT_THROW((void)point_response(image.view(), {104.0, 100.0}, options), NumericalError);
    options.search = 4;
    EXPECT_NEAR(point_response(image.view(), {104.0, 100.0}, options).azimuth.position, 100.0, 0.01);
}

TEST(PointResponse, NearTheEdge) {
    const auto image = image_of({5.3, 250.1}, 1.2, 256);
    const auto response = point_response(image.view(), {5, 250}, known(1.2));
    EXPECT_EQ(response.verdict, Verdict::clipped_by_edge);
    EXPECT_EQ(response.azimuth.verdict, Verdict::clipped_by_edge);
    EXPECT_NEAR(response.azimuth.extent[0], 5.3, 0.01);
    EXPECT_NEAR(response.azimuth.extent[1], 11.0 * 1.2, 0.01);
    EXPECT_NEAR(response.range.extent[1], 4.9, 0.01);
    // Half of the tails is missing and the tail at the border is 0.07 of the peak: an order of magnitude worse than inside.
    EXPECT_NEAR(response.azimuth.position, 5.3, 0.02);
    EXPECT_NEAR(response.azimuth.pslr_right_db, theory_pslr, 0.4);
}

TEST(PointResponse, ChipTooSmallForTheLobesIsRefused) {
    const auto image = image_of({127.0, 127.0}, 1.2);
    auto options = known(1.2);
    options.chip = 21;
    EXPECT_THROW((void)point_response(image.view(), {127, 127}, options), ValueError);
    options.lobes = 5;
    EXPECT_EQ(point_response(image.view(), {127, 127}, options).verdict, Verdict::good);
}

/// Response of a phase error over the band, azimuth only, by summing the band.
Array<cfloat, 2> with_phase(double (*phase)(double), double cell) {
    Array<cfloat, 2> image({255, 255});
    for (std::ptrdiff_t i = 0; i < 255; ++i) {
        cdouble line = 0.0;
        for (int k = 0; k < 400; ++k) {
            const double u = (k + 0.5) / 400.0 - 0.5;
            line += std::polar(1.0 / 400.0, two_pi * u * static_cast<double>(i - 127) / cell + phase(2.0 * u));
        }
        for (std::ptrdiff_t j = 0; j < 255; ++j) image(i, j) = static_cast<cfloat>(line * sinc(static_cast<double>(j - 127) / cell));
    }
    return image;
}

TEST(PointResponse, Verdicts) {
    const auto judged = [](double (*phase)(double)) {
        const auto image = with_phase(phase, 1.2);
        const auto response = point_response(image.view(), {127, 127}, known(1.2));
        EXPECT_EQ(response.range.verdict, Verdict::good);
        EXPECT_EQ(response.verdict, response.azimuth.verdict);
        return response.azimuth.verdict;
    };
    EXPECT_EQ(judged([](double) { return 0.4; }), Verdict::good);
    EXPECT_EQ(judged([](double u) { return 0.9 * pi * u * u; }), Verdict::broadened);
    EXPECT_EQ(judged([](double u) { return 0.15 * pi * (5.0 * u * u * u - 3.0 * u); }), Verdict::asymmetric);
    EXPECT_EQ(judged([](double u) { return 0.5 * std::cos(pi * 3.0 * u); }), Verdict::high_sidelobes);
}

TEST(PointResponse, WindowIsTheTheoryToCompareWith) {
    // A triangle over the band is sinc^2 of half the bandwidth: PSLR twice that of the sinc, nulls at 2 cells, IRW at sinc = 2^(-1/4).
    auto options = known(1.5);
    options.azimuth.window.resize(256);
    for (int k = 0; k < 256; ++k) options.azimuth.window[static_cast<std::size_t>(k)] = 1.0 - std::abs((k + 0.5) / 128.0 - 1.0);
    Array<cfloat, 2> image({255, 255});
    for (std::ptrdiff_t i = 0; i < 255; ++i)
        for (std::ptrdiff_t j = 0; j < 255; ++j) {
            const double a = sinc((static_cast<double>(i) - 127.3) / 3.0);
            image(i, j) = static_cast<float>(a * a * sinc((static_cast<double>(j) - 127.0) / 1.5));
        }
    const auto response = point_response(image.view(), {127, 127}, options);
    EXPECT_NEAR(response.azimuth.pslr_db, 2.0 * theory_pslr, 0.01);
    EXPECT_NEAR(response.azimuth.theory_pslr_db, 2.0 * theory_pslr, 0.01);  // steps of the sampled window: 256^-2
    EXPECT_NEAR(response.azimuth.islr_db, response.azimuth.theory_islr_db, 0.01);
    EXPECT_NEAR(response.azimuth.nulls[0] / 1.5, 2.0, 0.01);
    EXPECT_EQ(response.verdict, Verdict::good);
    options.azimuth.window.clear();
    EXPECT_EQ(point_response(image.view(), {127, 127}, options).azimuth.verdict, Verdict::broadened);
}

TEST(PointResponse, LayoutDoesNotMatter) {
    const auto image = image_of({60.3, 70.2}, 1.3, 128);
    Array<cfloat, 2> transposed({128, 128});
    for (std::ptrdiff_t i = 0; i < 128; ++i)
        for (std::ptrdiff_t j = 0; j < 128; ++j) transposed(j, i) = image(i, j);
    const auto a = point_response(image.view(), {60, 70});
    const auto b = point_response(ImageView(transposed.data(), {128, 128}, {1, 128}), {60, 70});
    EXPECT_EQ(a.azimuth.islr_db, b.azimuth.islr_db);
    EXPECT_EQ(a.range.pslr_db, b.range.pslr_db);
    EXPECT_EQ(a.azimuth.cut, b.azimuth.cut);
    EXPECT_EQ(a.phase, b.phase);
}

TEST(PointResponse, CutIsRelativeToThePeakAndPlaced) {
    const auto response = point_response(image_of({60.3, 70.2}, 1.3, 128).view(), {60, 70});
    const auto& axis = response.azimuth;
    const auto highest = std::max_element(axis.cut.begin(), axis.cut.end());
    EXPECT_NEAR(*highest, 1.0, 1e-3);  // the peak lies at most half of 1/32 pixel off the grid
    EXPECT_NEAR(axis.cut_start + static_cast<double>(highest - axis.cut.begin()) / 32.0, 60.3, 0.5 / 32.0 + 0.002);
}

TEST(PointResponse, RefusesWhatCannotBeMeasured) {
    auto image = image_of({60.0, 60.0}, 1.3, 128);
    EXPECT_THROW((void)point_response(Array<cfloat, 2>({64, 64}).view(), {10, 10}), NumericalError);
    EXPECT_THROW((void)point_response(Array<cfloat, 2>({7, 64}).view(), {1, 10}), ShapeError);
    EXPECT_THROW((void)point_response(image.view(), {-1.0, 3.0}), ValueError);
    EXPECT_THROW((void)point_response(image.view(), {3.0, 128.0}), ValueError);
    EXPECT_THROW((void)point_response(image.view(), {std::numeric_limits<double>::quiet_NaN(), 3.0}), ValueError);
    const auto refused = [&](auto change) {
        PointResponseOptions options;
        change(options);
        EXPECT_THROW((void)point_response(image.view(), {60, 60}, options), ValueError);
    };
    refused([](auto& o) { o.upsample = 4; });
    refused([](auto& o) { o.search = -1; });
    refused([](auto& o) { o.lobes = 0; });
    refused([](auto& o) { o.azimuth.oversampling = 0.9; });
    refused([](auto& o) { o.range.oversampling = std::numeric_limits<double>::quiet_NaN(); });
    refused([](auto& o) { o.range.window = {0.0, 0.0}; });
    refused([](auto& o) { o.range.window = {1.0, std::numeric_limits<double>::infinity()}; });
    image(100, 60) = {std::numeric_limits<float>::infinity(), 0.0F};
    EXPECT_THROW((void)point_response(image.view(), {60, 60}), NumericalError);
    Array<cfloat, 2> flat({64, 64});
    for (cfloat& x : flat) x = 1.0F;
    EXPECT_THROW((void)point_response(flat.view(), {30, 30}), NumericalError);
}

}  // namespace
}  // namespace sarfocus::quality
