#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include <sarfocus/core/array_view.hpp>
#include <sarfocus/core/execution.hpp>
#include <sarfocus/core/export.hpp>
#include <sarfocus/detect/point.hpp>

namespace sarfocus::detect {

struct LocalMaximaOptions {
    std::array<std::ptrdiff_t, 2> half_width{1, 1};  ///< the neighbourhood reaches so far in azimuth and range
    double minimum = 0.0;                            ///< intensities up to this are no maxima
    std::ptrdiff_t count = 0;                        ///< the strongest so many; 0: all
    Execution execution;
};

/// Pixels as strong as every other of their neighbourhood (what exists of it), the strongest first. Of equal neighbours the first in index
/// order counts. `mask`: same shape, false where nothing is to be found; an empty view: everywhere.
/// Throws ShapeError, ValueError, NumericalError (NaN or infinity; negative intensities).
[[nodiscard]] SARFOCUS_API std::vector<Point> local_maxima(const ImageView& image, const LocalMaximaOptions& options = {},
                                                           const ArrayView<const bool, 2>& mask = {});
[[nodiscard]] SARFOCUS_API std::vector<Point> local_maxima(const IntensityView& intensity, const LocalMaximaOptions& options = {},
                                                           const ArrayView<const bool, 2>& mask = {});

/// The `count` largest samples of every range gate [Luo2025, section 2.2.1], gate after gate, the strongest of each first; zeros never.
[[nodiscard]] SARFOCUS_API std::vector<Point> strongest_samples(const ImageView& image, std::ptrdiff_t count = 5,
                                                                const Execution& execution = {});

/// Two-dimensional coalescence [Luo2025, section 2.2.1]: a scatterer and its side lobes count once. From the strongest point downwards,
/// every point that lies within `half_width` (azimuth and range, both) of one already kept goes. The strongest first. Throws ValueError.
[[nodiscard]] SARFOCUS_API std::vector<Point> coalesce(std::vector<Point> points, std::array<std::ptrdiff_t, 2> half_width = {4, 4});

}  // namespace sarfocus::detect
