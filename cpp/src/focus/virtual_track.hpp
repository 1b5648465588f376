#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include <sarfocus/core/vector3.hpp>
#include <sarfocus/geometry/phase_centres.hpp>

namespace sarfocus::focus::detail {

/// Where both antennas are, or how fast they move along a virtual track (m per m of its parameter).
struct Antennas {
    Vector3 tx;
    Vector3 rx;
};

/// The smooth curve on which factorised backprojection lays the phase centres of its sub-apertures. Parameter: metres along the chord of
/// the true path. Each coordinate is a polynomial fitted to the phase centres by least squares, with a small penalty on its curvature that
/// keeps it calm beyond both ends, where the outermost centres of the sub-apertures lie.
class VirtualTrack {
public:
    /// Pulses [begin, begin + count) of `centres`.
    VirtualTrack(const geometry::PhaseCentres& centres, std::ptrdiff_t begin, std::ptrdiff_t count, std::ptrdiff_t degree);

    [[nodiscard]] double begin() const { return begin_; }  ///< smallest parameter of a pulse
    [[nodiscard]] double end() const { return end_; }      ///< largest
    /// Parameter of a point: along the chord.
    [[nodiscard]] double along(const Vector3& p) const { return dot(p - origin_, chord_); }
    [[nodiscard]] Antennas at(double t) const { return evaluate(t, false); }
    [[nodiscard]] Antennas rate(double t) const { return evaluate(t, true); }
    /// RMS distance of the phase centres from the track, m.
    [[nodiscard]] double deviation() const { return deviation_; }

private:
    [[nodiscard]] Antennas evaluate(double t, bool derivative) const;

    Vector3 origin_{};
    Vector3 chord_{};
    double begin_ = 0.0;
    double end_ = 0.0;
    double middle_ = 0.0;
    double half_ = 1.0;  // of the interval on which the polynomials are defined, a third longer than the track at each end
    double deviation_ = 0.0;
    std::vector<std::array<double, 6>> coefficients_;  // of the Chebyshev polynomials: tx and rx
};

/// Middle of transmitter and receiver of a pulse.
[[nodiscard]] Vector3 middle_of(const geometry::PhaseCentres& centres, std::ptrdiff_t pulse);

/// Cuts the path into pieces of which none turns by much more than 60 degrees: first pulse of each, and the number of pulses at the end.
/// Empty where there is none of at least 64 pulses (an antenna that stands still, a path that is all corners).
[[nodiscard]] std::vector<std::ptrdiff_t> pieces_of_path(const geometry::PhaseCentres& centres);

}  // namespace sarfocus::focus::detail
