#include <sarfocus/autofocus/trajectory.hpp>

#include <array>
#include <cmath>
#include <string>

#include <sarfocus/core/checks.hpp>
#include <sarfocus/core/error.hpp>

#include "trajectory_estimator.hpp"
#include "trajectory_points.hpp"

namespace sarfocus::autofocus {
namespace {

using focus::RangeProfiles;
using geometry::ImageGrid;

constexpr int most_coefficients = 1200;
constexpr std::ptrdiff_t most_pixels = 1 << 16;

void require_arguments(const TrajectoryEchoes& echoes, const std::vector<ImageGrid>& regions, const TrajectoryOptions& options,
                       const ArrayView<const double, 2>& initial) {
    options.validate();
    const ArrayView<const double, 3>& positions = echoes.positions;
    const auto n_channel = static_cast<std::ptrdiff_t>(echoes.channels.size());
    if (n_channel == 0) throw ValueError("channels", "one or more", "none");
    for (const RangeProfiles& channel : echoes.channels) {
        channel.validate(options.execution.threads);
        if (channel.wavelength != echoes.channels.front().wavelength || channel.range_spacing != echoes.channels.front().range_spacing)
            throw ValueError("channels", "one wavelength and range spacing", "several");
        const std::array<std::ptrdiff_t, 3> wanted{n_channel, channel.data.extent(0), 3};
        if (positions.extents() != wanted) throw ShapeError("positions", shape_text(wanted), shape_text(positions.extents()));
    }
    if (!echoes.baselines.empty()) {
        const std::array<std::ptrdiff_t, 2> wanted{n_channel, 3};
        if (echoes.baselines.extents() != wanted) throw ShapeError("baselines", shape_text(wanted), shape_text(echoes.baselines.extents()));
        require_finite(echoes.baselines, "baselines");
    }
    if (positions.extent(1) < 8) throw ShapeError("positions", "at least 8 pulses", shape_text(positions.extents()));
    for (std::ptrdiff_t n = 0; n < positions.extent(0); ++n)
        require_finite(
            ArrayView<const double, 2>(&positions(n, 0, 0), {positions.extent(1), 3}, {positions.strides()[1], positions.strides()[2]}),
            "positions");
    if (regions.empty()) throw ValueError("regions", "two or more", "none");
    for (const ImageGrid& region : regions)
        if (region.size() > most_pixels)
            throw ValueError("regions", "chips of at most " + std::to_string(most_pixels) + " pixels", std::to_string(region.size()));
    if (!initial.empty()) {
        if (initial.extent(0) != positions.extent(1) || initial.extent(1) != 3)
            throw ShapeError("initial", "(" + std::to_string(positions.extent(1)) + ", 3)", shape_text(initial.extents()));
        require_finite(initial, "initial");
    }
    if (options.knots > 0 && 3 * positions.extent(1) / options.knots > most_coefficients)
        throw ValueError("knots", "at least " + std::to_string(3 * positions.extent(1) / most_coefficients + 1) + " pulses",
                         std::to_string(options.knots));
}

}  // namespace

const char* status_text(TrajectoryStatus status) {
    switch (status) {
        case TrajectoryStatus::converged:
            return "converged";
        case TrajectoryStatus::max_iterations:
            return "max_iterations";
        case TrajectoryStatus::not_improved:
            return "not_improved";
    }
    return "unknown";
}

void TrajectoryOptions::validate() const {
    if (knots < 0) throw ValueError("knots", "a number of pulses, or 0 for a free displacement", std::to_string(knots));
    for (const double x : up) require_finite_value(x, "up");
    if (!(norm(up) > 0.0)) throw ValueError("up", "a direction", "zero");
    if (!(search >= 0.0) || !std::isfinite(search)) throw ValueError("search", "a length >= 0 m", number_text(search));
    if (rounds < 1) throw ValueError("rounds", "at least 1", std::to_string(rounds));
    if (iterations < 1) throw ValueError("iterations", "at least 1", std::to_string(iterations));
    require_positive(tolerance, "tolerance");
    if (pixels == PixelChoice::brightest && knots > 0)
        throw ValueError("knots", "0, free displacements, with the brightest pixels", std::to_string(knots));
    if (aspect.limited() && !(std::abs(norm(aspect.axis) - 1.0) < 1e-6))
        throw ValueError("axis", "a vector of length 1 or 0", "one of length " + number_text(norm(aspect.axis)));
    (void)resolve_threads(execution.threads);
}

Trajectory estimate_trajectory(const TrajectoryEchoes& echoes, const std::vector<ImageGrid>& regions, const TrajectoryOptions& options,
                               const ArrayView<const double, 2>& initial) {
    require_arguments(echoes, regions, options, initial);
    if (options.pixels == PixelChoice::brightest) return detail::PointTrajectory(echoes, regions, options, initial).run();
    return detail::TrajectoryEstimator(echoes, regions, options, initial).run();
}

Trajectory estimate_trajectory(const RangeProfiles& profiles, const ArrayView<const double, 2>& positions,
                               const std::vector<ImageGrid>& regions, const TrajectoryOptions& options,
                               const ArrayView<const double, 2>& initial) {
    if (positions.extent(0) != profiles.data.extent(0) || positions.extent(1) != 3)
        throw ShapeError("positions", shape_text(std::array<std::ptrdiff_t, 2>{profiles.data.extent(0), 3}),
                         shape_text(positions.extents()));
    TrajectoryEchoes echoes;
    echoes.channels = {profiles};
    echoes.positions = ArrayView<const double, 3>(positions.data(), {1, positions.extent(0), positions.extent(1)},
                                                  {0, positions.strides()[0], positions.strides()[1]});
    return estimate_trajectory(echoes, regions, options, initial);
}

}  // namespace sarfocus::autofocus
