#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include <sarfocus/core/checks.hpp>
#include <sarfocus/core/constants.hpp>
#include <sarfocus/sim/stripmap.hpp>

#include "sim/echo_line.hpp"
#include "sim/stripmap_arguments.hpp"

namespace sarfocus::sim {
namespace {

using geometry::StripmapGeometry;

// Spacing of the slant ranges, which must be even to a thousandth of a sample over the whole swath.
double range_spacing_of(const StripmapGeometry& geometry, double bandwidth) {
    const auto& ranges = geometry.slant_range;
    const double resolution = speed_of_light / (2.0 * bandwidth);
    if (ranges.size() == 1) return resolution;
    const double spacing = (ranges.back() - ranges.front()) / static_cast<double>(ranges.size() - 1);
    if (!(spacing > 0.0)) throw ValueError("slant_range", "ascending ranges", "a mean spacing of " + number_text(spacing) + " m");
    for (std::size_t i = 0; i < ranges.size(); ++i)
        if (std::abs(ranges[i] - ranges.front() - spacing * static_cast<double>(i)) > 1e-3 * spacing)
            throw ValueError("slant_range[" + std::to_string(i) + "]", "ranges evenly spaced by " + number_text(spacing) + " m",
                             number_text(ranges[i]));
    if (spacing > resolution * (1.0 + 1e-9))
        throw ValueError("range_bandwidth",
                         "at most c / (2 spacing of the slant ranges) = " + number_text(speed_of_light / (2.0 * spacing)) + " Hz",
                         number_text(bandwidth));
    return spacing;
}

}  // namespace

void stripmap_echo(const StripmapGeometry& geometry, const StripmapTargets& targets, const MutableImageView& out,
                   const StripmapEchoOptions& options) {
    require_strip(geometry, targets, options.effects, out);
    require_positive(options.range_bandwidth, "range_bandwidth");
    const double spacing = range_spacing_of(geometry, options.range_bandwidth);
    const double start = geometry.slant_range.front();
    const std::ptrdiff_t n_target = targets.reflectivity.extent(0);
    for (std::ptrdiff_t t = 0; t < n_target; ++t)
        if (!(start + spacing * targets.pixels(t, 1) > 0.0))
            throw ValueError("targets[" + std::to_string(t) + ", 1]", "a range gate at a range > 0 m", number_text(targets.pixels(t, 1)));
    const EchoLine echo(spacing, geometry.wavelength, options.range_bandwidth, options.window, std::numeric_limits<double>::infinity());

    parallel_for(options.execution, "stripmap_echo", out.extent(0), [&](std::int64_t pulse) {
        std::vector<cdouble> line(static_cast<std::size_t>(out.extent(1)));
        for (std::ptrdiff_t t = 0; t < n_target; ++t) {
            const double closest = start + spacing * targets.pixels(t, 1);
            const double along = geometry.velocity * (static_cast<double>(pulse) - targets.pixels(t, 0)) / geometry.prf;
            const double range = std::hypot(closest, along);
            const double doppler = -2.0 * geometry.velocity * along / (geometry.wavelength * range);
            if (std::abs(doppler - geometry.doppler_centroid) <= 0.5 * geometry.doppler_bandwidth)
                echo.add(targets.reflectivity(t), range, start, line);
        }
        const cdouble error = phase_error_factor(options.effects, pulse);
        for (cdouble& value : line) value *= error;
        add_noise(line, options.effects.noise_power, options.effects.seed, pulse);
        for (std::ptrdiff_t j = 0; j < out.extent(1); ++j) out(pulse, j) = cfloat(line[static_cast<std::size_t>(j)]);
    });
}

}  // namespace sarfocus::sim
