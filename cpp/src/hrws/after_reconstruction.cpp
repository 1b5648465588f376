#include <sarfocus/hrws/after_reconstruction.hpp>

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <string>
#include <utility>

#include <sarfocus/autofocus/gpga.hpp>
#include <sarfocus/core/checks.hpp>
#include <sarfocus/core/constants.hpp>
#include <sarfocus/core/error.hpp>
#include <sarfocus/geometry/phase_centres.hpp>

#include "beam.hpp"
#include "laps.hpp"

namespace sarfocus::hrws {
namespace {

using geometry::ImageGrid;
using geometry::PhaseCentres;

double squared_baseline(const Echo& echo, std::ptrdiff_t channel) {
    double out = 0.0;
    for (std::ptrdiff_t a = 0; a < 3 && !echo.baselines.empty(); ++a) out += echo.baselines(channel, a) * echo.baselines(channel, a);
    return out;
}

// Takes off the part of the path that the phase centre midway does not account for: [n_channel, n_range].
Array<cfloat, 2> legs(const Echo& echo) {
    Array<cfloat, 2> out({echo.n_channel(), echo.data.extent(2)});
    for (std::ptrdiff_t n = 0; n < out.extent(0); ++n)
        for (std::ptrdiff_t i = 0; i < out.extent(1); ++i) {
            const double range = echo.range_start(0) + static_cast<double>(i) * echo.range_spacing;
            out(n, i) = cfloat(std::polar(1.0, 4.0 * pi / echo.wavelength * squared_baseline(echo, n) / (8.0 * range)));
        }
    return out;
}

PhaseCentres centres_of(const EvenEcho& even) {
    return PhaseCentres(even.positions.view());
}

// The samples about a region: all that its estimate needs. What lies `guard` samples behind the ends is felt by 1 / (pi guard).
class Part {
public:
    Part(const EvenEcho& even, const ImageGrid& region) : profiles_(even.profiles()), start_({1}) {
        constexpr double guard = 256.0;
        const PhaseCentres centres = centres_of(even);
        double low = std::numeric_limits<double>::infinity();
        double high = 0.0;
        for (std::ptrdiff_t i = 0; i < region.shape()[0]; ++i)
            for (std::ptrdiff_t j = 0; j < region.shape()[1]; ++j)
                for (const std::ptrdiff_t k : {std::ptrdiff_t{0}, centres.n_pulse() / 2, centres.n_pulse() - 1}) {
                    const double range = centres.range(k, region.position(static_cast<double>(i), static_cast<double>(j)));
                    low = std::min(low, range);
                    high = std::max(high, range);
                }
        const auto last = static_cast<double>(even.data.extent(1) - 1);
        const auto sample = [&](double range) { return (range - even.range_start(0)) / even.range_spacing; };
        const auto first = static_cast<std::ptrdiff_t>(std::clamp(std::floor(sample(low)) - guard, 0.0, last));
        const auto end = static_cast<std::ptrdiff_t>(std::clamp(std::ceil(sample(high)) + guard, static_cast<double>(first), last));
        start_(0) = even.range_start(0) + static_cast<double>(first) * even.range_spacing;
        profiles_.data = profiles_.data.slice(1, first, end + 1 - first);
        profiles_.range_start = start_.view();
    }

    [[nodiscard]] const focus::RangeProfiles& profiles() const { return profiles_; }

private:
    focus::RangeProfiles profiles_;
    Array<double, 1> start_;
};

// The image of the grid from samples turned by -phase, over the Doppler frequencies that `reconstruct` processes.
void form(const Echo& echo, const BandOptions& band, EvenEcho& even, const std::vector<double>& phase, const ImageGrid& grid,
          MutableImageView image, const Execution& execution) {
    for (std::ptrdiff_t k = 0; k < even.data.extent(0); ++k) {
        const cfloat turn(std::polar(1.0, -phase[static_cast<std::size_t>(k)]));
        for (std::ptrdiff_t i = 0; i < even.data.extent(1); ++i) even.data(k, i) *= turn;
    }
    for (std::ptrdiff_t i = 0; i < image.extent(0); ++i)
        for (std::ptrdiff_t j = 0; j < image.extent(1); ++j) image(i, j) = {};
    const double bandwidth = band.doppler_bandwidth > 0.0 ? band.doppler_bandwidth : static_cast<double>(echo.n_channel()) * echo.prf;
    const focus::Aspect seen = detail::beam_of(echo, band, 0.5 * (band.processed(echo.n_channel(), echo.prf) - bandwidth));
    focus::BackprojectOptions how;
    how.execution = execution;
    focus::backproject_weighted(even.profiles(), centres_of(even), grid, {seen.axis, seen.sine_start, seen.sine_stop, {{1.0f, 0.0f}}},
                                image, how);
}

void require_image(const ImageGrid& grid, MutableImageView image) {
    if (image.extents() != grid.shape())
        throw ShapeError("image", "the shape of the grid " + shape_text(grid.shape()), shape_text(image.extents()));
}

}  // namespace

EvenEcho even_echo(const Echo& echo, const BandOptions& band, std::ptrdiff_t half_width, const Execution& execution) {
    echo.validate(execution.threads);
    if (echo.range_start.extent(0) != 1)
        throw ShapeError("range_start", "one value for all pulses, because samples of different pulses are added up",
                         shape_text(echo.range_start.extents()));
    const Sampling sampled = sampling(echo);
    const auto psi = interpolation_coefficients(sampled.offsets, echo.prf, echo.velocity, half_width, band);
    const std::ptrdiff_t n_channel = echo.n_channel();
    const std::ptrdiff_t n_pulse = echo.n_pulse();
    const std::ptrdiff_t n_range = echo.data.extent(2);
    require_memory(static_cast<std::uint64_t>(n_channel * n_pulse * n_range) * sizeof(cfloat), "evenly spaced echo");
    EvenEcho out;
    out.data = Array<cfloat, 2>({n_channel * n_pulse, n_range});
    out.positions = Array<double, 2>({n_channel * n_pulse, 3});
    out.range_start = Array<double, 1>({1});
    out.range_start(0) = echo.range_start(0);
    out.range_spacing = echo.range_spacing;
    out.wavelength = echo.wavelength;
    const Array<cfloat, 2> turn = legs(echo);
    parallel_for(execution, "even spacing", n_channel * n_pulse, [&](std::int64_t row) {
        const std::ptrdiff_t k = row / n_channel;
        const std::ptrdiff_t i = row % n_channel;
        const double place =
            static_cast<double>(k) + (static_cast<double>(i) - 0.5 * static_cast<double>(n_channel - 1)) / static_cast<double>(n_channel);
        const Vector3 at = sampled.origin + place * sampled.step * sampled.direction;
        std::copy(at.begin(), at.end(), out.positions.data() + 3 * row);
        cfloat* line = &out.data(row, 0);
        for (std::ptrdiff_t l = -half_width; l <= half_width; ++l) {
            if (k + l < 0 || k + l >= n_pulse) continue;
            for (std::ptrdiff_t n = 0; n < n_channel; ++n) {
                const cfloat factor(psi(i, l + half_width, n));
                for (std::ptrdiff_t s = 0; s < n_range; ++s) line[s] += factor * turn(n, s) * echo.data(n, k + l, s);
            }
        }
    });
    return out;
}

PhaseCompensation bp_fmsa(const Echo& echo, const ImageGrid& grid, const ImageGrid& region, MutableImageView image,
                          const BpFmsaOptions& options) {
    require_image(grid, image);
    PhaseCompensation out;
    detail::Laps laps(out.timings);
    EvenEcho even = even_echo(echo, options.band, options.half_width, options.execution);
    laps.end("even spacing");
    autofocus::SharpestPhaseOptions how = options.estimate;
    how.execution = options.execution;
    how.aspect = detail::beam_of(echo, options.band);
    out.phase_error = autofocus::sharpest_phase(Part(even, region).profiles(), even.positions.view(), region, how);
    out.status = "applied";
    laps.end("estimate");
    form(echo, options.band, even, out.phase_error, grid, image, options.execution);
    laps.end("image");
    return out;
}

PhaseCompensation pga(const Echo& echo, const ImageGrid& grid, const ImageGrid& region, MutableImageView image, const PgaOptions& options) {
    require_image(grid, image);
    PhaseCompensation out;
    detail::Laps laps(out.timings);
    EvenEcho even = even_echo(echo, options.band, options.half_width, options.execution);
    laps.end("even spacing");
    autofocus::PointOptions how = options.estimate;
    how.execution = options.execution;
    Array<cfloat, 2> chip(region.shape());
    autofocus::Result found = autofocus::gpga(Part(even, region).profiles(), centres_of(even), region, chip.view(), how);
    out.phase_error = std::move(found.phase_error);
    out.status = autofocus::status_text(found.status);
    laps.end("estimate");
    form(echo, options.band, even, out.phase_error, grid, image, options.execution);
    laps.end("image");
    return out;
}

}  // namespace sarfocus::hrws
