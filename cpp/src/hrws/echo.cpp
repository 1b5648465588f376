#include <sarfocus/hrws/echo.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include <sarfocus/core/checks.hpp>
#include <sarfocus/core/error.hpp>

namespace sarfocus::hrws {
namespace {

constexpr double velocity_tolerance = 0.02;  // relative

Vector3 centre(const Echo& echo, std::ptrdiff_t channel, std::ptrdiff_t pulse) {
    return {echo.phase_centres(channel, pulse, 0), echo.phase_centres(channel, pulse, 1), echo.phase_centres(channel, pulse, 2)};
}

Vector3 mean_centre(const Echo& echo, std::ptrdiff_t pulse) {
    Vector3 sum{};
    for (std::ptrdiff_t n = 0; n < echo.n_channel(); ++n) sum = sum + centre(echo, n, pulse);
    return (1.0 / static_cast<double>(echo.n_channel())) * sum;
}

struct Line {
    Vector3 origin;
    Vector3 step;  // m, from pulse to pulse
};

Line fit_line(const Echo& echo) {
    const std::ptrdiff_t n_pulse = echo.n_pulse();
    const double middle = 0.5 * static_cast<double>(n_pulse - 1);
    Vector3 mean{};
    Vector3 moment{};
    double square = 0.0;
    for (std::ptrdiff_t k = 0; k < n_pulse; ++k) {
        const Vector3 p = mean_centre(echo, k);
        const double x = static_cast<double>(k) - middle;
        mean = mean + (1.0 / static_cast<double>(n_pulse)) * p;
        moment = moment + x * p;
        square += x * x;
    }
    const Vector3 step = (1.0 / square) * moment;
    return {mean - middle * step, step};
}

void require_centres(const Echo& echo) {
    const std::array<std::ptrdiff_t, 3> wanted{echo.n_channel(), echo.n_pulse(), 3};
    if (echo.phase_centres.extents() != wanted)
        throw ShapeError("phase_centres", shape_text(wanted) + ", one for each pulse of each channel",
                         shape_text(echo.phase_centres.extents()));
    for (std::ptrdiff_t n = 0; n < wanted[0]; ++n)
        for (std::ptrdiff_t k = 0; k < wanted[1]; ++k)
            for (std::ptrdiff_t d = 0; d < 3; ++d)
                if (!std::isfinite(echo.phase_centres(n, k, d)))
                    throw NumericalError("phase_centres: expected finite values, got " + number_text(echo.phase_centres(n, k, d)) +
                                         " at [" + std::to_string(n) + ", " + std::to_string(k) + ", " + std::to_string(d) + "]");
}

// The channel in front of the position that the check of one channel states.
void require_samples(const Echo& echo, std::ptrdiff_t channel, int threads) {
    const std::string name = "data[" + std::to_string(channel) + "]";
    const ImageView samples = echo.data.row(channel);
    require_finite(samples, name.c_str(), threads);
    for (std::ptrdiff_t k = 0; k < samples.extent(0); ++k)
        for (std::ptrdiff_t i = 0; i < samples.extent(1); ++i)
            if (samples(k, i) != cfloat{}) return;
    throw ValueError(name, "samples; leave a missing channel out of data and phase_centres", "zeros only");
}

}  // namespace

void Echo::validate(int threads) const {
    require_not_empty(data, "data");
    if (n_pulse() < 2) throw ShapeError("data", "at least two pulses", shape_text(data.extents()));
    require_positive(range_spacing, "range_spacing");
    require_positive(wavelength, "wavelength");
    require_positive(prf, "prf");
    require_positive(velocity, "velocity");
    if (range_start.extent(0) != 1 && range_start.extent(0) != n_pulse())
        throw ShapeError("range_start", "one value or " + std::to_string(n_pulse()) + ", one for each pulse",
                         shape_text(range_start.extents()));
    require_finite(range_start, "range_start");
    require_centres(*this);
    if (!baselines.empty()) {
        const std::array<std::ptrdiff_t, 2> wanted{n_channel(), 3};
        if (baselines.extents() != wanted) throw ShapeError("baselines", shape_text(wanted), shape_text(baselines.extents()));
        require_finite(baselines, "baselines");
    }
    const double found = norm(fit_line(*this).step) * prf;
    if (!(std::abs(found / velocity - 1.0) <= velocity_tolerance))
        throw ValueError("velocity", "that of the phase centres, " + number_text(found) + " m/s at this prf", number_text(velocity));
    for (std::ptrdiff_t n = 0; n < n_channel(); ++n) require_samples(*this, n, threads);
}

Sampling sampling(const Echo& echo) {
    const Line line = fit_line(echo);
    const std::ptrdiff_t n_channel = echo.n_channel();
    const std::ptrdiff_t n_pulse = echo.n_pulse();
    Sampling out;
    out.origin = line.origin;
    out.direction = (1.0 / norm(line.step)) * line.step;
    out.step = echo.velocity / echo.prf;
    out.offsets.assign(static_cast<std::size_t>(n_channel), 0.0);
    for (std::ptrdiff_t k = 0; k < n_pulse; ++k) {
        const Vector3 mean = mean_centre(echo, k);
        for (std::ptrdiff_t n = 0; n < n_channel; ++n)
            out.offsets[static_cast<std::size_t>(n)] += dot(centre(echo, n, k) - mean, out.direction) / static_cast<double>(n_pulse);
    }
    for (std::ptrdiff_t k = 0; k < n_pulse; ++k) {
        const Vector3 mean = mean_centre(echo, k);
        for (std::ptrdiff_t n = 0; n < n_channel; ++n) {
            const double offset = dot(centre(echo, n, k) - mean, out.direction);
            out.offset_spread = std::max(out.offset_spread, std::abs(offset - out.offsets[static_cast<std::size_t>(n)]));
        }
    }
    return out;
}

}  // namespace sarfocus::hrws
