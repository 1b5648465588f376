#pragma once

#include <cstddef>
#include <vector>

#include <sarfocus/core/array_view.hpp>
#include <sarfocus/core/execution.hpp>
#include <sarfocus/core/export.hpp>
#include <sarfocus/core/vector3.hpp>
#include <sarfocus/geometry/image_grid.hpp>
#include <sarfocus/geometry/phase_centres.hpp>

namespace sarfocus::focus {

/// Range-compressed echoes with the carrier phase kept: a scatterer at range R contributes exp(-4j pi R / wavelength) times the
/// pulse response centred at R. Views, owned by the caller.
struct RangeProfiles {
    ImageView data;                          ///< [n_pulse, n_range], at or above the Nyquist rate of the pulse's bandwidth
    ArrayView<const double, 1> range_start;  ///< m, range of sample 0: one value for all pulses, or [n_pulse]
    double range_spacing = 0.0;              ///< m
    double wavelength = 0.0;                 ///< m

    [[nodiscard]] double first_range(std::ptrdiff_t pulse) const {
        return range_start.extent(0) == 1 ? range_start(0) : range_start(pulse);
    }
    /// Shapes, signs, NaN. Throws ShapeError, ValueError, NumericalError.
    SARFOCUS_API void validate(int threads = 0) const;
};

/// Between the samples a profile is the trigonometric interpolant of the record with zeros behind it (at least 32, up to a length that
/// transforms fast), evaluated by a cubic in each half sample (the Legendre expansion of every spectral component). Outside the record a
/// profile is zero. Error, RMS over RMS against the band-limited echo itself, of noise that fills a share of the band sampled and fades
/// towards both ends of the record over 32 samples or more: -80 dB for a share of 0.7, -73 for 1 / 1.2, -68 for 0.9, -55 for 0.95. Noise up
/// to the Nyquist frequency has no value between the samples but by convention: -30 dB against the echo, -68 against the interpolant.
/// Where a record ends abruptly, the interpolant rings: share of 1 / 1.2, full strength up to the ends, -40 dB over the whole record, -51
/// without 16 samples at each end, -57 without 64. So record a little more than the grid needs, or fade the ends.
///
/// Ranges are those of float64 at the centre of every tile of 16 x 32 pixels, with a series in single precision across it. A bound on the
/// phase error anywhere on the tile, below 5e-4 rad (-66 dB) for every pulse, chooses between a series of the third order on plane grids,
/// one of the fourth order on any pixels, smaller tiles, and the range of every pixel in float64.
struct BackprojectOptions {
    Execution execution;
};

/// Exact backprojection [methods: B(p) = sum over pulses of s(pulse, R(p)) exp(+4j pi R(p) / wavelength)], any grid, mono- or bistatic.
/// Every pixel sums its pulses in the same order whatever the number of threads.
///
/// image: [grid.shape], overwritten. Throws ShapeError, ValueError (no pixel of the grid within the recorded ranges),
/// NumericalError (NaN or infinity in the data), MemoryEstimateError, Cancelled.
SARFOCUS_API void backproject(const RangeProfiles& profiles, const geometry::PhaseCentres& centres, const geometry::ImageGrid& grid,
                              MutableImageView image, const BackprojectOptions& options = {});

/// The same of pulses times a factor each, such as exp(-j phase error): [n_pulse]. The pulses themselves are not copied.
SARFOCUS_API void backproject_turned(const RangeProfiles& profiles, const geometry::PhaseCentres& centres, const geometry::ImageGrid& grid,
                                     const std::vector<cfloat>& factors, MutableImageView image, const BackprojectOptions& options = {});

/// A factor for every term of that sum by the direction in which the antenna sees the pixel: by the sine of the angle from broadside, the
/// component along `axis` of the unit vector from the antenna (bistatic: midway between both) to the pixel. On a straight track the local
/// Doppler frequency is 2 velocity sine / wavelength.
struct AspectWeights {
    Vector3 axis{};           ///< along the track, of length 1
    double sine_start = 0.0;  ///< where entry 0 begins
    double sine_stop = 0.0;   ///< where the last one ends
    /// Of equal parts of that interval; terms outside it have weight 0. Pixels near one another may share an entry, where the entries that
    /// they would have differ from it by no more than -50 dB of the greatest of all.
    std::vector<cfloat> table;

    /// Throws ValueError, NumericalError.
    SARFOCUS_API void validate() const;
};

/// Directions within which an antenna sees: sines as above. Without an axis all do.
struct Aspect {
    Vector3 axis{};  ///< of length 1, or zero
    double sine_start = -1.0;
    double sine_stop = 1.0;

    [[nodiscard]] bool limited() const { return norm(axis) > 0.0; }
    [[nodiscard]] bool sees(const Vector3& antenna, const Vector3& pixel) const {
        const Vector3 sight = pixel - antenna;
        const double along = dot(sight, axis);
        const double range = norm(sight);
        return !limited() || (along >= sine_start * range && along <= sine_stop * range);
    }
};

/// image += the sum of `backproject` with its terms weighted. Pixels that no pulse sees within the table's interval cost little.
SARFOCUS_API void backproject_weighted(const RangeProfiles& profiles, const geometry::PhaseCentres& centres,
                                       const geometry::ImageGrid& grid, const AspectWeights& weights, MutableImageView image,
                                       const BackprojectOptions& options = {});

/// The terms of the sum of `backproject`, one by one: the dechirped history of every point.
/// points: [n_point, 3] m; histories: [n_point, n_pulse], overwritten; zero where a pulse did not record the point.
SARFOCUS_API void backproject_histories(const RangeProfiles& profiles, const geometry::PhaseCentres& centres,
                                        const ArrayView<const double, 2>& points, MutableImageView histories,
                                        const BackprojectOptions& options = {});

/// The adjoint of `backproject`, with the range of every pixel in float64: <backproject(x), y> = <x, project(y)> but for the error of the
/// series that `backproject` uses. Echo of a scene, up to the pulse's spectrum.
/// scene: [grid.shape]; profiles.data gives the extents only; data: [n_pulse, n_range], overwritten. aspect: of the beam; a pulse
/// illuminates only the pixels within it.
SARFOCUS_API void project(const ImageView& scene, const geometry::ImageGrid& grid, const geometry::PhaseCentres& centres,
                          const RangeProfiles& profiles, MutableImageView data, const BackprojectOptions& options = {},
                          const Aspect& aspect = {});

}  // namespace sarfocus::focus
