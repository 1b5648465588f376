#include <sarfocus/geometry/trajectory.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <string>

#include <sarfocus/core/checks.hpp>
#include <sarfocus/core/error.hpp>
#include <sarfocus/core/vector3.hpp>

namespace sarfocus::geometry {
namespace {

using Extents = std::array<std::ptrdiff_t, 2>;

// The last sample that is not later than `at`, and never the last of all.
std::ptrdiff_t sample_before(const ArrayView<const double, 1>& time, double at) {
    std::ptrdiff_t low = 0;
    std::ptrdiff_t high = time.extent(0) - 1;
    while (high - low > 1) {
        const std::ptrdiff_t middle = low + (high - low) / 2;
        (time(middle) <= at ? low : high) = middle;
    }
    return low;
}

Vector3 point(const ArrayView<const double, 2>& positions, std::ptrdiff_t i) {
    return {positions(i, 0), positions(i, 1), positions(i, 2)};
}

}  // namespace

void Track::validate() const {
    const std::ptrdiff_t n = time.extent(0);
    if (n < 2) throw ShapeError("track time", "at least 2 samples", shape_text(time.extents()));
    if (position.extents() != Extents{n, 3})
        throw ShapeError("track position", "(" + std::to_string(n) + ", 3), one for each time", shape_text(position.extents()));
    require_finite(time, "track time");
    require_finite(position, "track position");
    for (std::ptrdiff_t i = 1; i < n; ++i)
        if (!(time(i) > time(i - 1)))
            throw ValueError("track time", "increasing values",
                             number_text(time(i)) + " s behind " + number_text(time(i - 1)) + " s at [" + std::to_string(i) + "]");
}

void interpolate_track(const Track& track, const ArrayView<const double, 1>& at, const ArrayView<double, 2>& out) {
    track.validate();
    require_finite(at, "at");
    if (out.extents() != Extents{at.extent(0), 3}) throw ShapeError("out", shape_text(Extents{at.extent(0), 3}), shape_text(out.extents()));
    const double first = track.time(0);
    const double last = track.time(track.time.extent(0) - 1);
    for (std::ptrdiff_t i = 0; i < at.extent(0); ++i)
        if (at(i) < first || at(i) > last)
            throw ValueError("at", "times within the track, " + number_text(first) + " to " + number_text(last) + " s",
                             number_text(at(i)) + " s at [" + std::to_string(i) + "]");
    for (std::ptrdiff_t i = 0; i < at.extent(0); ++i) {
        const std::ptrdiff_t k = sample_before(track.time, at(i));
        const double share = (at(i) - track.time(k)) / (track.time(k + 1) - track.time(k));
        for (std::ptrdiff_t axis = 0; axis < 3; ++axis)
            out(i, axis) = (1.0 - share) * track.position(k, axis) + share * track.position(k + 1, axis);
    }
}

void path_weights(const ArrayView<const double, 2>& positions, double minimum_step, const ArrayView<double, 1>& out) {
    const std::ptrdiff_t n = positions.extent(0);
    if (n < 2 || positions.extent(1) != 3) throw ShapeError("positions", "(n, 3) with at least 2 pulses", shape_text(positions.extents()));
    if (out.extent(0) != n) throw ShapeError("out", "(" + std::to_string(n) + ",)", shape_text(out.extents()));
    require_finite(positions, "positions");
    if (!(minimum_step >= 0.0)) throw ValueError("minimum_step", "a length >= 0 m", number_text(minimum_step));
    double sum = 0.0;
    double moving = 0.0;
    for (std::ptrdiff_t i = 0; i < n; ++i) {
        const std::ptrdiff_t before = std::max<std::ptrdiff_t>(i - 1, 0);
        const std::ptrdiff_t behind = std::min(i + 1, n - 1);
        const double step = norm(point(positions, behind) - point(positions, before)) / static_cast<double>(behind - before);
        out(i) = step > minimum_step ? step : 0.0;
        sum += out(i);
        moving += out(i) > 0.0 ? 1.0 : 0.0;
    }
    if (moving == 0.0)
        throw ValueError("positions", "a platform that moves by more than " + number_text(minimum_step) + " m from pulse to pulse",
                         "one that rests throughout");
    for (std::ptrdiff_t i = 0; i < n; ++i) out(i) *= moving / sum;
}

}  // namespace sarfocus::geometry
