// Compiled code, templates and exceptions of the library, used from outside it: a point spread over slow time and compressed again.
#include <algorithm>
#include <cmath>
#include <complex>
#include <cstddef>
#include <cstdio>
#include <exception>
#include <utility>

#include <sarfocus/autofocus/spga.hpp>
#include <sarfocus/core/array.hpp>
#include <sarfocus/core/error.hpp>
#include <sarfocus/focus/azimuth.hpp>
#include <sarfocus/geometry/image_grid.hpp>
#include <sarfocus/geometry/stripmap_geometry.hpp>

namespace {

using sarfocus::Array;
using sarfocus::cfloat;

// The image of one point at (row, gate), decompressed and compressed; the largest difference from the original.
double round_trip_error(const sarfocus::geometry::StripmapGeometry& geometry, std::ptrdiff_t n_azimuth) {
    const auto n_range = static_cast<std::ptrdiff_t>(geometry.slant_range.size());
    const std::ptrdiff_t row = n_azimuth / 3;
    const std::ptrdiff_t gate = n_range / 2;
    Array<cfloat, 2> image({n_azimuth, n_range});
    Array<cfloat, 2> echo({n_azimuth, n_range});
    image(row, gate) = {3.0f, -4.0f};
    sarfocus::focus::azimuth_decompress(image.view(), geometry, echo.view());
    if (std::abs(echo(row, gate)) > 1.0f) return 5.0;  // the point was not spread at all
    sarfocus::focus::azimuth_compress(echo.view(), geometry, echo.view());
    double worst = 0.0;
    for (std::ptrdiff_t i = 0; i < image.size(); ++i)
        worst = std::max(worst, static_cast<double>(std::abs(echo.data()[i] - image.data()[i])));
    return worst;
}

// Three points out of focus, their apertures overlapping, brought back: the sharpest pixel is brighter than before.
bool focuses(const sarfocus::geometry::StripmapGeometry& geometry) {
    Array<cfloat, 2> image({2048, 3});
    for (const std::ptrdiff_t i : {0, 1, 2}) image(700 + 250 * i, i) = 1.0f;
    Array<double, 2> error({1, 2048});
    for (std::ptrdiff_t k = 0; k < 2048; ++k) error(0, k) = 6.0 * std::sin(0.006 * static_cast<double>(k));
    sarfocus::focus::azimuth_correct(image.view(), geometry, std::as_const(error).view(), {0.0}, image.view());
    const auto brightest = [&] {
        return std::abs(*std::max_element(image.begin(), image.end(), [](cfloat a, cfloat b) { return std::abs(a) < std::abs(b); }));
    };
    const float before = brightest();
    const auto result = sarfocus::autofocus::spga_linear(image.view(), geometry, image.view());
    std::printf("%s\n", result.summary().c_str());
    return !result.input_returned() && brightest() > 1.1f * before;
}

// An exception thrown inside the library is caught by its type outside it: the type's identity crosses the library boundary.
bool refuses_parallel_steps() {
    try {
        (void)sarfocus::geometry::ImageGrid::plane({0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {4, 4});
    } catch (const sarfocus::ValueError&) {
        return true;
    }
    return false;
}

}  // namespace

int main() {
    try {
        sarfocus::geometry::StripmapGeometry geometry;
        geometry.wavelength = 0.03;
        geometry.prf = 1000.0;
        geometry.velocity = 100.0;
        geometry.slant_range = {999.0, 1000.0, 1001.0};
        geometry.doppler_bandwidth = 600.0;
        geometry.validate();
        const double error = round_trip_error(geometry, 2048);
        std::printf("aperture %.3f samples, round trip to %.1e\n", geometry.aperture_samples(1), error);
        // 600 Hz / (2 (100 m/s)^2 / (0.03 m 1 km)) at 1 kHz. Single precision, transforms of 2^11 samples: a few units of 6e-8 of |3 - 4j|
        // = 5.
        const bool right =
            std::abs(geometry.aperture_samples(1) - 900.0) < 1e-9 && error < 5e-6 && refuses_parallel_steps() && focuses(geometry);
        return right ? 0 : 1;
    } catch (const std::exception& error) {
        std::printf("%s\n", error.what());
        return 1;
    }
}
