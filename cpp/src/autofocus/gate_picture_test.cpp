#include "gate_picture.hpp"

#include <cmath>
#include <memory>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include <sarfocus/autofocus/adaptive.hpp>
#include <sarfocus/core/array.hpp>
#include <sarfocus/core/constants.hpp>

#include "score.hpp"

namespace sarfocus::autofocus::detail {
namespace {

constexpr std::ptrdiff_t n_azimuth = 300;
constexpr std::ptrdiff_t n_range = 90;

// Points between the pixels of a band of 80 % in speckle, so that a cell has 1.25 pixels along azimuth.
Array<cfloat, 2> scene() {
    std::mt19937 bits(5);
    std::normal_distribution<float> noise;
    std::uniform_real_distribution<double> uniform(0.0, 1.0);
    Array<cfloat, 2> out({n_azimuth, n_range});
    for (cfloat& x : out) x = {noise(bits), noise(bits)};
    for (std::ptrdiff_t j = 2; j < n_range; j += 5) {
        const double place = 10.0 + 280.0 * uniform(bits);
        for (std::ptrdiff_t i = 0; i < n_azimuth; ++i) {
            const double x = pi * 0.8 * (static_cast<double>(i) - place);
            out(i, j) += static_cast<float>(x == 0.0 ? 40.0 : 40.0 * std::sin(x) / x);
        }
    }
    return out;
}

std::vector<double> bent(std::ptrdiff_t n, double peak) {
    std::vector<double> out;
    for (std::ptrdiff_t k = 0; k < n; ++k) out.push_back(peak * std::pow(2.0 * static_cast<double>(k) / static_cast<double>(n) - 1.0, 2));
    return out;
}

class GatePictureTest : public testing::Test {
protected:
    GatePictureTest() : image_(scene()), source_(image_.view(), {}), whole_(source_, execution_), gates_(source_, 64, execution_) {
        whole_.focus(std::vector<double>(static_cast<std::size_t>(source_.n_pulse()), 0.0), {});
        cell_ = whole_.cell_size();
        halves_ = std::make_unique<Halves>(source_, cell_);
        whole_.split(*halves_);
        gates_.split(*halves_);
    }

    void focus(const Look& look, double peak) {
        whole_.focus(bent(source_.n_pulse(), peak), look);
        gates_.focus(bent(source_.n_pulse(), peak), look);
    }

    // Single precision: one part in 1e5 of intensities, a thousandth of a pixel.
    static void expect_same(const std::vector<Pixel>& a, const std::vector<Pixel>& b) {
        ASSERT_EQ(a.size(), b.size());
        for (std::size_t n = 0; n < a.size(); ++n) {
            EXPECT_NEAR(a[n].azimuth, b[n].azimuth, 1e-3) << n;
            EXPECT_EQ(a[n].column, b[n].column) << n;
        }
    }

    Execution execution_;
    Array<cfloat, 2> image_;
    SpectrumSource source_;
    WholePicture whole_;
    GatePicture gates_;
    CellSize cell_;
    std::unique_ptr<Halves> halves_;
};

TEST_F(GatePictureTest, SaysOfAnImageWhatTheWholeImageSays) {
    for (const double peak : {0.0, 6.0}) {
        focus({}, peak);
        for (const Portion part : {Portion::everywhere, Portion::first_half, Portion::second_half}) {
            const HalfSums a = whole_.sums(part);
            const HalfSums b = gates_.sums(part);
            EXPECT_EQ(a.pixels, b.pixels);
            EXPECT_NEAR(b.power, a.power, 1e-5 * a.power);
            EXPECT_NEAR(b.square, a.square, 1e-5 * a.square);
            expect_same(whole_.strongest(8, {3.0, 2.0}, part), gates_.strongest(8, {3.0, 2.0}, part));
        }
        EXPECT_NEAR(gates_.background(), whole_.background(), 0.05 * whole_.background());  // of different samples
        focus({Portion::everywhere, Purpose::entropy}, peak);
        EXPECT_NEAR(gates_.entropy(), whole_.entropy(), 1e-5 * whole_.entropy());
    }
    EXPECT_NEAR(gates_.cell_size().azimuth, cell_.azimuth, 1e-3);
    EXPECT_NEAR(gates_.cell_size().range, cell_.range, 1e-3);
}

TEST_F(GatePictureTest, ChoosesTheSamePointsOfSubApertures) {
    PartColumns parts{sub_apertures(n_azimuth, 128), {}, 30};
    for (std::size_t s = 0; s < parts.parts.size(); ++s) parts.columns.push_back({2, 7, 12, 27, 42, 87});
    focus({}, 4.0);
    for (const Portion part : {Portion::everywhere, Portion::second_half})
        expect_same(whole_.strongest_of(parts, {6.0, 1.0}, part), gates_.strongest_of(parts, {6.0, 1.0}, part));
}

TEST_F(GatePictureTest, IsTheSameToTheBitForAnyThreads) {
    const Execution one{1, {}};
    const Execution three{3, {}};
    GatePicture a(source_, 64, one);
    GatePicture b(source_, 64, three);
    for (GatePicture* picture : {&a, &b}) picture->focus(bent(source_.n_pulse(), 6.0), {});
    EXPECT_EQ(a.sums(Portion::everywhere).square, b.sums(Portion::everywhere).square);
    EXPECT_EQ(a.background(), b.background());
    EXPECT_EQ(a.cell_size().azimuth, b.cell_size().azimuth);
    const std::vector<Pixel> of_a = a.strongest(50, {2.0, 1.0}, Portion::everywhere);
    const std::vector<Pixel> of_b = b.strongest(50, {2.0, 1.0}, Portion::everywhere);
    ASSERT_EQ(of_a.size(), of_b.size());
    for (std::size_t n = 0; n < of_a.size(); ++n) EXPECT_EQ(of_a[n].azimuth, of_b[n].azimuth);
}

}  // namespace
}  // namespace sarfocus::autofocus::detail
