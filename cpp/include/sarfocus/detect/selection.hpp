#pragma once

#include <cstddef>
#include <vector>

#include <sarfocus/core/array_view.hpp>
#include <sarfocus/core/execution.hpp>
#include <sarfocus/core/export.hpp>
#include <sarfocus/detect/point.hpp>

namespace sarfocus::detect {

/// Q = 1 - mean(|S|)^2 / mean(|S|^2) of the decompressed signal of a point over its aperture [Xie2023, eq. 5]: 0 for the constant amplitude
/// of an ideal point, 1 - pi/4 = 0.215 for speckle, towards 1 the more uneven. Throws ShapeError, NumericalError (NaN, infinity, all zero).
[[nodiscard]] SARFOCUS_API double contrast(const ArrayView<const cfloat, 1>& signal);

/// The points with contrast <= maximum, in their order; those without one (NaN) go. Throws ValueError.
[[nodiscard]] SARFOCUS_API std::vector<Point> filter_contrast(std::vector<Point> points, double maximum);

enum class GateScore {
    energy,       ///< sum of the intensity over azimuth [Luo2025, eq. 9-11]
    peak_to_mean  ///< largest intensity over the mean: how much one scatterer stands out
};

struct RangeGate {
    std::ptrdiff_t range = 0;
    double score = 0.0;
};

struct GateOptions {
    std::ptrdiff_t count = 0;  ///< the best so many; 0: all
    GateScore score = GateScore::energy;
    Execution execution;
};

/// Range gates of image [n_azimuth, n_range], the highest score first (of equals the nearer). A gate of zeros scores 0.
[[nodiscard]] SARFOCUS_API std::vector<RangeGate> strongest_gates(const ImageView& image, const GateOptions& options = {});

enum class PointOrder {
    contrast,  ///< the smaller the better; points without one come last, then the stronger the better
    intensity  ///< the stronger the better
};

struct SpreadOptions {
    std::ptrdiff_t limit = 0;      ///< at most so many points; 0: `point_limit` for six iterations
    std::ptrdiff_t sections = 32;  ///< equal parts of the azimuth extent
    PointOrder order = PointOrder::intensity;
};

/// Points spread evenly along azimuth [Xie2023, section 3.1]: the best point of every section, then the second best of every section, and
/// so on up to the limit; of a round that no longer fits, its best points. Ordered by azimuth, then range. Throws ValueError (a point
/// outside [0, n_azimuth), options).
[[nodiscard]] SARFOCUS_API std::vector<Point> spread_evenly(const std::vector<Point>& points, std::ptrdiff_t n_azimuth,
                                                            const SpreadOptions& options = {});

/// K_up = floor(sqrt(2) iterations^(3/4) sqrt(n log2 n)), n = n_azimuth: with more points the iteration-free method costs more than so many
/// iterations of stripmap PGA [Xie2023, eq. 25]. At least 1. Throws ValueError.
[[nodiscard]] SARFOCUS_API std::ptrdiff_t point_limit(std::ptrdiff_t n_azimuth, std::ptrdiff_t iterations = 6);

}  // namespace sarfocus::detect
