#include <sarfocus/sim/hrws.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include <sarfocus/core/checks.hpp>
#include <sarfocus/core/error.hpp>
#include <sarfocus/core/vector3.hpp>

#include "sim/echo_line.hpp"
#include "sim/point_arguments.hpp"

namespace sarfocus::sim {
namespace {

Vector3 row_of(const ArrayView<const double, 2>& rows, std::ptrdiff_t i) {
    return {rows(i, 0), rows(i, 1), rows(i, 2)};
}

// The antennas of one pulse, and which scatterers its beam holds.
struct Pulse {
    Vector3 nominal;   // the platform without motion error, moved to the middle of the equivalent centres
    Vector3 velocity;  // m/s
    Vector3 platform;
};

Pulse pulse_of(const HrwsRadar& radar, const Vector3& middle, std::ptrdiff_t k) {
    const std::ptrdiff_t before = std::max<std::ptrdiff_t>(k - 1, 0);
    const std::ptrdiff_t behind = std::min(k + 1, radar.positions.extent(0) - 1);
    const Vector3 platform = row_of(radar.positions, k);
    const Vector3 velocity =
        (radar.prf / static_cast<double>(behind - before)) * (row_of(radar.positions, behind) - row_of(radar.positions, before));
    return {platform + middle, velocity, radar.motion.empty() ? platform : platform + row_of(radar.motion, k)};
}

bool illuminated(const HrwsRadar& radar, const Pulse& pulse, double wavelength, const Vector3& scatterer) {
    if (radar.doppler_bandwidth == 0.0) return true;
    const Vector3 sight = scatterer - pulse.nominal;
    const double frequency = 2.0 * dot(pulse.velocity, sight) / (wavelength * norm(sight));
    return std::abs(frequency - radar.doppler_centroid) <= 0.5 * radar.doppler_bandwidth;
}

void require_rows(const ArrayView<const double, 2>& rows, const char* argument, std::ptrdiff_t count) {
    if (rows.extents() != std::array<std::ptrdiff_t, 2>{count, 3})
        throw ShapeError(argument, "(" + std::to_string(count) + ", 3)", shape_text(rows.extents()));
    require_finite(rows, argument);
}

}  // namespace

void HrwsRadar::validate() const {
    if (positions.extent(0) < 2) throw ShapeError("positions", "at least two pulses", shape_text(positions.extents()));
    require_rows(positions, "positions", positions.extent(0));
    require_not_empty(channels, "channels");
    require_rows(channels, "channels", channels.extent(0));
    if (transmitter < 0 || transmitter >= channels.extent(0))
        throw ValueError("transmitter", "the index of one of " + std::to_string(channels.extent(0)) + " channels",
                         std::to_string(transmitter));
    if (!motion.empty()) require_rows(motion, "motion", positions.extent(0));
    if (!imbalance.empty()) {
        if (imbalance.extent(0) != channels.extent(0))
            throw ShapeError("imbalance", "(" + std::to_string(channels.extent(0)) + ",)", shape_text(imbalance.extents()));
        require_finite(imbalance, "imbalance");
    }
    require_positive(prf, "prf");
    if (!(std::isfinite(doppler_bandwidth) && doppler_bandwidth >= 0.0))
        throw ValueError("doppler_bandwidth", "a finite number >= 0", number_text(doppler_bandwidth));
    require_finite_value(doppler_centroid, "doppler_centroid");
}

void hrws(const HrwsRadar& radar, const PointTargets& targets, const PointEchoModel& model, const ArrayView<cfloat, 3>& out,
          const PointOptions& options) {
    radar.validate();
    const std::ptrdiff_t n_channel = radar.channels.extent(0);
    const std::ptrdiff_t n_pulse = radar.positions.extent(0);
    require_not_empty(out, "out");
    if (out.extent(0) != n_channel || out.extent(1) != n_pulse)
        throw ShapeError("out", "(" + std::to_string(n_channel) + ", " + std::to_string(n_pulse) + ", n_range)", shape_text(out.extents()));
    targets.validate();
    validate(model, n_pulse);

    const Vector3 transmitter = row_of(radar.channels, radar.transmitter);
    Vector3 middle{};
    for (std::ptrdiff_t n = 0; n < n_channel; ++n)
        middle = middle + (0.5 / static_cast<double>(n_channel)) * (transmitter + row_of(radar.channels, n));
    const EchoLine line_model(model.range_spacing, model.wavelength, model.bandwidth, model.window, model.support);
    parallel_for(options.execution, "hrws echoes", n_channel * n_pulse, [&](std::int64_t index) {
        const std::ptrdiff_t n = index / n_pulse;
        const std::ptrdiff_t k = index % n_pulse;
        const Pulse pulse = pulse_of(radar, middle, k);
        const Vector3 tx = pulse.platform + transmitter;
        const Vector3 rx = pulse.platform + row_of(radar.channels, n);
        const Vector3 centre = 0.5 * (tx + rx);
        const cdouble factor = radar.imbalance.empty() ? cdouble(1.0) : radar.imbalance(n);
        const double start = model.range_start(model.range_start.extent(0) == 1 ? 0 : k);
        std::vector<cdouble> line(static_cast<std::size_t>(out.extent(2)));
        for (std::ptrdiff_t t = 0; t < targets.reflectivity.extent(0); ++t) {
            const Vector3 p = row_of(targets.positions, t);
            if (!illuminated(radar, pulse, model.wavelength, p)) continue;
            const double range = radar.equivalent ? norm(p - centre) : 0.5 * (norm(p - tx) + norm(p - rx));
            line_model.add(factor * targets.reflectivity(t), range, start, line);
        }
        add_noise(line, model.noise_power, model.seed, index);
        for (std::ptrdiff_t i = 0; i < out.extent(2); ++i) out(n, k, i) = cfloat(line[static_cast<std::size_t>(i)]);
    });
}

}  // namespace sarfocus::sim
