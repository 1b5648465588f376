#pragma once

#include <cstddef>

#include <sarfocus/core/array_view.hpp>
#include <sarfocus/core/export.hpp>
#include <sarfocus/core/vector3.hpp>

namespace sarfocus::geometry {

/// Antenna positions of every pulse, m, in the frame of the image grid: [n_pulse, 3] each; views, owned by the caller.
struct PhaseCentres {
    ArrayView<const double, 2> transmit;
    ArrayView<const double, 2> receive;

    PhaseCentres() = default;
    /// Monostatic: one position per pulse.
    explicit PhaseCentres(const ArrayView<const double, 2>& positions) : transmit(positions), receive(positions) {}
    PhaseCentres(const ArrayView<const double, 2>& tx, const ArrayView<const double, 2>& rx) : transmit(tx), receive(rx) {}

    [[nodiscard]] std::ptrdiff_t n_pulse() const { return transmit.extent(0); }
    [[nodiscard]] bool monostatic() const { return transmit.data() == receive.data() && transmit.strides() == receive.strides(); }
    [[nodiscard]] Vector3 tx(std::ptrdiff_t pulse) const { return {transmit(pulse, 0), transmit(pulse, 1), transmit(pulse, 2)}; }
    [[nodiscard]] Vector3 rx(std::ptrdiff_t pulse) const { return {receive(pulse, 0), receive(pulse, 1), receive(pulse, 2)}; }

    /// Range of point p as the radar measures it: half the path transmitter - p - receiver, m.
    [[nodiscard]] double range(std::ptrdiff_t pulse, const Vector3& p) const {
        const double forth = norm(p - tx(pulse));
        return monostatic() ? forth : 0.5 * (forth + norm(p - rx(pulse)));
    }

    /// Shapes and finiteness; n_pulse as the data have it. Throws ShapeError, NumericalError.
    SARFOCUS_API void validate(std::ptrdiff_t n_pulse) const;
};

}  // namespace sarfocus::geometry
