#include <sarfocus/quality/ambiguity.hpp>

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include <sarfocus/core/array.hpp>
#include <sarfocus/core/error.hpp>

namespace sarfocus::quality {
namespace {

Array<cfloat, 2> scene() {
    Array<cfloat, 2> image({400, 60});
    image(200, 30) = {0.0F, 10.0F};
    image(203, 31) = 10.0F;
    image(97, 28) = 0.1F;    // left ambiguity, three samples nearer than expected
    image(300, 30) = 0.02F;  // right ambiguity
    image(300, 50) = 5.0F;   // something else, outside the boxes
    return image;
}

TEST(Ambiguity, PeakAndEnergy) {
    const auto image = scene();
    const auto peak = azimuth_ambiguity_ratio(image.view(), {200.2, 29.9}, {-100.0, 100.0, 250.0});
    EXPECT_NEAR(peak.ratio_db[0], -40.0, 1e-5);  // 0.1 in float32
    EXPECT_NEAR(peak.ratio_db[1], 20.0 * std::log10(0.002), 1e-5);
    EXPECT_TRUE(std::isnan(peak.ratio_db[2]));
    EXPECT_EQ(peak.highest_db, peak.ratio_db[0]);
    const auto energy =
        azimuth_ambiguity_ratio(image.view(), {200, 30}, {-100.0}, {.measure = AmbiguityMeasure::energy, .half_width = {8, 8}});
    EXPECT_NEAR(energy.highest_db, -40.0 - 10.0 * std::log10(2.0), 1e-5);
    const auto none = azimuth_ambiguity_ratio(image.view(), {200, 30}, {60.0});
    EXPECT_EQ(none.highest_db, -std::numeric_limits<double>::infinity());
}

TEST(Ambiguity, OffsetIsPrfSquaredOverTheRate) {
    // K = 2 v^2 / (lambda R): the offset in time is prf / K, in samples prf^2 / K.
    const double rate = 2.0 * 150.0 * 150.0 / (0.03 * 20000.0);
    EXPECT_NEAR(azimuth_ambiguity_offset(400.0, 0.03, 150.0, 20000.0), 400.0 * 400.0 / rate, 1e-9);
    EXPECT_THROW((void)azimuth_ambiguity_offset(0.0, 0.03, 150.0, 20000.0), ValueError);
    EXPECT_THROW((void)azimuth_ambiguity_offset(400.0, 0.03, std::nan(""), 20000.0), ValueError);
}

TEST(Ambiguity, Refuses) {
    auto image = scene();
    EXPECT_THROW((void)azimuth_ambiguity_ratio(image.view(), {200, 30}, {}), ValueError);
    EXPECT_THROW((void)azimuth_ambiguity_ratio(image.view(), {200, 30}, {16.0}), ValueError);
    EXPECT_THROW((void)azimuth_ambiguity_ratio(image.view(), {200, 30}, {1e300, -300.0}), ValueError);
    EXPECT_THROW((void)azimuth_ambiguity_ratio(image.view(), {200, 30}, {std::nan("")}), ValueError);
    EXPECT_THROW((void)azimuth_ambiguity_ratio(image.view(), {200, 55}, {100.0}), ValueError);
    EXPECT_THROW((void)azimuth_ambiguity_ratio(image.view(), {std::nan(""), 30}, {100.0}), ValueError);
    EXPECT_THROW((void)azimuth_ambiguity_ratio(image.view(), {50, 30}, {100.0}), NumericalError);
    image(300, 30) = std::numeric_limits<float>::infinity();
    EXPECT_THROW((void)azimuth_ambiguity_ratio(image.view(), {200, 30}, {100.0}), NumericalError);
    EXPECT_NO_THROW((void)azimuth_ambiguity_ratio(image.view(), {200, 30}, {-100.0}));
}

}  // namespace
}  // namespace sarfocus::quality
