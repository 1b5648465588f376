#include <sarfocus/sim/points.hpp>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include <sarfocus/core/array.hpp>
#include <sarfocus/core/checks.hpp>
#include <sarfocus/core/constants.hpp>

#include "sim/echo_line.hpp"
#include "sim/point_arguments.hpp"

namespace sarfocus::sim {
void validate(const PointEchoModel& model, std::ptrdiff_t n_pulse) {
    require_per_pulse(model.range_start, "range_start", n_pulse);
    require_positive(model.range_spacing, "range_spacing");
    require_positive(model.wavelength, "wavelength");
    require_positive(model.bandwidth, "bandwidth");
    if (!(model.support > 0.0)) throw ValueError("support", "a distance > 0 m", number_text(model.support));
    require_noise_power(model.noise_power);
    const double resolution = speed_of_light / (2.0 * model.bandwidth);
    if (model.range_spacing > resolution * (1.0 + 1e-9))
        throw ValueError("range_spacing", "at most c / (2 bandwidth) = " + number_text(resolution) + " m",
                         number_text(model.range_spacing));
}

void PointTargets::validate() const {
    const std::ptrdiff_t n = reflectivity.extent(0);
    if (n < 1) throw ShapeError("reflectivity", "at least one target", shape_text(reflectivity.extents()));
    if (positions.extents() != std::array<std::ptrdiff_t, 2>{n, 3})
        throw ShapeError("targets", "(" + std::to_string(n) + ", 3), a position for each reflectivity", shape_text(positions.extents()));
    require_finite(positions, "targets");
    require_finite(reflectivity, "reflectivity");
}

void points(const geometry::PhaseCentres& centres, const PointTargets& targets, const PointEchoModel& model, const MutableImageView& out,
            const PointOptions& options) {
    require_not_empty(out, "out");
    const std::ptrdiff_t n_pulse = out.extent(0);
    centres.validate(n_pulse);
    targets.validate();
    validate(model, n_pulse);
    const std::ptrdiff_t n_target = targets.reflectivity.extent(0);
    const EchoLine line_model(model.range_spacing, model.wavelength, model.bandwidth, model.window, model.support);
    parallel_for(options.execution, "points", n_pulse, [&](std::int64_t pulse) {
        std::vector<cdouble> line(static_cast<std::size_t>(out.extent(1)));
        const double start = model.range_start(model.range_start.extent(0) == 1 ? 0 : pulse);
        for (std::ptrdiff_t t = 0; t < n_target; ++t) {
            const Vector3 p{targets.positions(t, 0), targets.positions(t, 1), targets.positions(t, 2)};
            line_model.add(targets.reflectivity(t), centres.range(pulse, p), start, line);
        }
        add_noise(line, model.noise_power, model.seed, pulse);
        for (std::ptrdiff_t i = 0; i < out.extent(1); ++i) out(pulse, i) = cfloat(line[static_cast<std::size_t>(i)]);
    });
}

}  // namespace sarfocus::sim
