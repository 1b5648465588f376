#include <sarfocus/hrws/reconstruct.hpp>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <sarfocus/core/array.hpp>
#include <sarfocus/core/constants.hpp>
#include <sarfocus/core/error.hpp>
#include <sarfocus/sim/hrws.hpp>

namespace sarfocus::hrws {
namespace {

using geometry::ImageGrid;
using Image = Array<cfloat, 2>;

// A small radar: three channels, 40 m/s, a point in the middle of 161 pulses.
struct Scene {
    double prf = 60.0;
    double velocity = 40.0;
    double wavelength = 0.031;
    std::ptrdiff_t n_pulse = 161;
    Array<double, 2> positions{{161, 3}};
    Array<double, 2> channels{{3, 3}};
    Array<double, 3> centres{{3, 161, 3}};
    Array<double, 2> motion{{161, 3}};
    Array<double, 1> start{{1}};
    Array<double, 2> target{{1, 3}};
    Array<cdouble, 1> reflectivity{{1}};
    Array<cfloat, 3> data{{3, 161, 90}};

    explicit Scene(double spacing = 0.35, double shake = 0.0) {
        for (std::ptrdiff_t n = 0; n < 3; ++n) channels(n, 0) = spacing * static_cast<double>(n);
        for (std::ptrdiff_t k = 0; k < n_pulse; ++k) {
            positions(k, 0) = velocity / prf * (static_cast<double>(k) - 80.0);
            positions(k, 2) = 900.0;
            motion(k, 2) = shake * std::sin(1.7 * static_cast<double>(k * k));
            for (std::ptrdiff_t n = 0; n < 3; ++n)
                for (std::ptrdiff_t d = 0; d < 3; ++d) centres(n, k, d) = positions(k, d) + 0.5 * channels(n, d);
        }
        target(0, 1) = 1200.0;
        reflectivity(0) = 1.0;
        start(0) = 1480.0;
        sim::HrwsRadar radar{positions.view(), channels.view(), 0, true, motion.view(), {}, prf, 120.0, 0.0};
        sim::PointEchoModel model;
        model.range_start = start.view();
        model.range_spacing = 0.5;
        model.wavelength = wavelength;
        model.bandwidth = 250e6;
        sim::hrws(radar, {target.view(), reflectivity.view()}, model, data.view());
    }

    [[nodiscard]] Echo echo() const { return {data.view(), centres.view(), start.view(), 0.5, wavelength, prf, velocity, {}}; }
};

Image form(const Scene& scene, const ImageGrid& grid, const ReconstructOptions& options = {}, bool with_motion = false) {
    Image image({grid.shape()[0], grid.shape()[1]});
    const ArrayView<const double, 2> motion = with_motion ? ArrayView<const double, 2>(scene.motion.view()) : ArrayView<const double, 2>();
    reconstruct(scene.echo(), grid, motion, image.view(), options);
    return image;
}

ImageGrid patch() {
    return ImageGrid::plane({-4.0, 1195.0, 0.0}, {0.17, 0.0, 0.0}, {0.0, 0.6, 0.0}, {48, 17});
}

double difference_db(const Image& a, const Image& b) {
    double error = 0.0;
    double power = 0.0;
    for (std::ptrdiff_t i = 0; i < a.size(); ++i) {
        error += std::norm(a.data()[i] - b.data()[i]);
        power += std::norm(b.data()[i]);
    }
    return 10.0 * std::log10(error / power);
}

TEST(Reconstruct, IsPlainBackprojectionWhereTheChannelsAreEvenlySpaced) {
    const Scene scene(2.0 * 40.0 / 60.0 / 3.0);
    ReconstructOptions options;
    options.band.interpolation = Interpolation::yen;
    const Image folded = form(scene, patch(), options);
    Image plain({48, 17});
    focus::AspectWeights all{{1.0, 0.0, 0.0}, -1.0, 1.0, {cfloat(1.0f)}};
    for (std::ptrdiff_t n = 0; n < 3; ++n)
        focus::backproject_weighted(scene.echo().profiles(n), geometry::PhaseCentres(scene.echo().phase_centres.row(n)), patch(), all,
                                    plain.view());
    // The target is illuminated within two thirds of the processed band: all terms are there in both. Tiles that an end of the band crosses
    // are summed pixel by pixel in one of the two only: the error of the series, at most -66 dB of a term, in few of them.
    EXPECT_LT(difference_db(folded, plain), -85.0);
}

TEST(Reconstruct, BitsDoNotDependOnThreads) {
    const Scene scene;
    for (const Reconstruction way : {Reconstruction::folded, Reconstruction::sub_image}) {
        ReconstructOptions options;
        options.reconstruction = way;
        options.execution.threads = 1;
        const Image one = form(scene, patch(), options);
        options.execution.threads = 3;
        const Image three = form(scene, patch(), options);
        for (std::ptrdiff_t i = 0; i < one.size(); ++i) ASSERT_EQ(one.data()[i], three.data()[i]) << i;
    }
}

TEST(Reconstruct, MotionBringsBackTheImageWithoutIt) {
    const Scene still;
    const Scene shaken(0.35, 0.02);
    const Image wanted = form(still, patch());
    EXPECT_GT(difference_db(form(shaken, patch()), wanted), -3.0);
    // Ranges differ by up to 0.02 m times the cosine, 2 % of a cell: what the pulse response loses there is below -45 dB.
    EXPECT_LT(difference_db(form(shaken, patch(), {}, true), wanted), -45.0);
}

template <class Error>
std::string message_of(const Echo& echo, const ReconstructOptions& options = {}) {
    Image image({48, 17});
    try {
        reconstruct(echo, patch(), {}, image.view(), options);
    } catch (const Error& error) {
        return error.what();
    }
    return "nothing thrown";
}

TEST(Reconstruct, RefusesWhatItCannotDo) {
    Scene scene;
    Echo echo = scene.echo();
    echo.velocity = 45.0;
    EXPECT_NE(message_of<ValueError>(echo).find("velocity: expected that of the phase centres"), std::string::npos);
    echo = scene.echo();
    echo.phase_centres = echo.phase_centres.slice(0, 0, 2);
    EXPECT_NE(message_of<ShapeError>(echo).find("phase_centres: expected (3, 161, 3)"), std::string::npos);
    ReconstructOptions options;
    options.half_width = 0;
    options.reconstruction = Reconstruction::sub_image;
    EXPECT_NE(message_of<ValueError>(scene.echo(), options).find("half_width"), std::string::npos);
    const Scene coincident(2.0 * 40.0 / 60.0);
    EXPECT_NE(message_of<NumericalError>(coincident.echo()).find("channels 0 and 1 sample the same places"), std::string::npos);
    scene.data(2, 3, 4) = std::numeric_limits<float>::quiet_NaN();
    EXPECT_NE(message_of<NumericalError>(scene.echo()).find("data[2]"), std::string::npos);
    for (std::ptrdiff_t k = 0; k < 161; ++k)
        for (std::ptrdiff_t i = 0; i < 90; ++i) scene.data(2, k, i) = {};
    EXPECT_NE(message_of<ValueError>(scene.echo()).find("data[2]: expected samples; leave a missing channel out"), std::string::npos);
    scene.centres(1, 5, 2) = std::numeric_limits<double>::infinity();
    EXPECT_NE(message_of<NumericalError>(scene.echo()).find("at [1, 5, 2]"), std::string::npos);
}

}  // namespace
}  // namespace sarfocus::hrws
