#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include <sarfocus/core/array_view.hpp>
#include <sarfocus/core/export.hpp>

namespace sarfocus::quality {

/// Distance in azimuth, samples, at which the first azimuth ambiguity of a target appears: prf * wavelength * R / (2 v) metres along the
/// track, v / prf metres a sample. The k-th lies k times as far, on either side. All arguments > 0 (Hz, m, m/s, m); throws ValueError.
[[nodiscard]] SARFOCUS_API double azimuth_ambiguity_offset(double prf, double wavelength, double velocity, double slant_range);

enum class AmbiguityMeasure {
    peak,   ///< strongest pixel of the box; pixels of a critically sampled image miss a peak by up to 3.9 dB along each axis
    energy  ///< sum of the intensity over the box
};

struct AmbiguityOptions {
    AmbiguityMeasure measure = AmbiguityMeasure::peak;
    /// The boxes about the target and about its ambiguities reach so far, pixels: an ambiguity is defocused along azimuth and displaced in
    /// range by its migration.
    std::array<std::ptrdiff_t, 2> half_width{8, 8};
};

struct AmbiguityRatio {
    double highest_db = 0.0;       ///< of all
    std::vector<double> ratio_db;  ///< over the target, in the order of the offsets; NaN where the box does not lie inside the image
};

/// Strength of the ambiguities of the target at `position` (azimuth, range; fractions are rounded), relative to the target, 20 log10 of
/// amplitudes (10 log10 of energies). `offsets`: azimuth samples from the target, either sign. -infinity for boxes of zeros.
/// Throws ValueError (the target's box or every ambiguity outside the image, an offset whose box overlaps the target's), NumericalError
/// (NaN or infinity in a box, a target of zeros).
[[nodiscard]] SARFOCUS_API AmbiguityRatio azimuth_ambiguity_ratio(const ImageView& image, std::array<double, 2> position,
                                                                  const std::vector<double>& offsets, const AmbiguityOptions& options = {});

}  // namespace sarfocus::quality
