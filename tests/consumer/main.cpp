// Compiled code, templates and exceptions of the library, used from outside it: the spectrum of a tone peaks where it must.
#include <cmath>
#include <complex>
#include <cstddef>
#include <cstdio>
#include <exception>

#include <sarfocus/core/array.hpp>
#include <sarfocus/core/constants.hpp>
#include <sarfocus/core/error.hpp>
#include <sarfocus/fft/plan.hpp>
#include <sarfocus/geometry/image_grid.hpp>
#include <sarfocus/geometry/stripmap_geometry.hpp>

namespace {

using sarfocus::Array;
using sarfocus::cfloat;

std::ptrdiff_t peak_of_tone(std::ptrdiff_t n, std::ptrdiff_t bin) {
    Array<cfloat, 1> x({n});
    for (std::ptrdiff_t i = 0; i < n; ++i)
        x(i) = static_cast<cfloat>(std::polar(1.0, sarfocus::two_pi * static_cast<double>(bin * i) / static_cast<double>(n)));
    sarfocus::fft::Plan<float>(n, sarfocus::fft::Direction::forward).execute(x.data());
    std::ptrdiff_t peak = 0;
    for (std::ptrdiff_t i = 1; i < n; ++i)
        if (std::norm(x(i)) > std::norm(x(peak))) peak = i;
    return peak;
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
        geometry.slant_range = {10'000.0};
        geometry.doppler_bandwidth = 600.0;
        geometry.validate();
        const auto peak = peak_of_tone(1000, 137);
        std::printf("aperture %.3f samples, tone in bin %td\n", geometry.aperture_samples(0), peak);
        // 600 Hz / (2 (100 m/s)^2 / (0.03 m 10 km)) at 1 kHz.
        const bool right = std::abs(geometry.aperture_samples(0) - 9000.0) < 1e-6 && peak == 137 && refuses_parallel_steps();
        return right ? 0 : 1;
    } catch (const std::exception& error) {
        std::printf("%s\n", error.what());
        return 1;
    }
}
