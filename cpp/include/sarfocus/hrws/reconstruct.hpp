#pragma once

#include <cstddef>

#include <sarfocus/core/array_view.hpp>
#include <sarfocus/core/execution.hpp>
#include <sarfocus/core/export.hpp>
#include <sarfocus/geometry/image_grid.hpp>
#include <sarfocus/hrws/echo.hpp>
#include <sarfocus/hrws/weights.hpp>

namespace sarfocus::hrws {

enum class Reconstruction {
    folded,    ///< backprojection of every channel with weights by local Doppler frequency: the cost of plain backprojection
    sub_image  ///< the sub-images of the paper, summed term by term: (2 half_width + 1) n_channel products for every term of `folded`
};

struct ReconstructOptions {
    Reconstruction reconstruction = Reconstruction::folded;
    BandOptions band;
    std::ptrdiff_t half_width = 8;  ///< sub_image: pulses on either side that an evenly spaced sample is made of (the paper's L / 2)
    Execution execution;
};

/// The checks of the arguments that `reconstruct` makes first.
SARFOCUS_API void require_reconstructible(const Echo& echo, const geometry::ImageGrid& grid, const ArrayView<const double, 2>& motion,
                                          MutableImageView image, const ReconstructOptions& options = {});

/// Image free of azimuth ambiguities from the channels of a radar whose pulse rate alone is too low for its Doppler bandwidth.
///
/// folded [methods, 5]: by stationary phase the reconstruction of a pixel acts at one frequency in each pulse, the local Doppler frequency
/// f = 2 velocity sin(angle from broadside) / wavelength; so every term of plain backprojection is multiplied by w_n(f) of
/// `channel_weights`. Terms outside the Doppler bandwidth are left out. sub_image [Zhou2022, eq. 11-13, 16]: the samples of all channels,
/// taken along the range history of the pixel and freed of the phase of the motion, are interpolated to even spacing on the straight line
/// of `sampling` and then summed with its phases. Both sum, for evenly spaced channels, to plain backprojection.
///
/// motion: [n_pulse, 3], m, added to the phase centres of every channel, or empty; image: [grid.shape], overwritten. Throws ShapeError,
/// ValueError, NumericalError, MemoryEstimateError, Cancelled.
SARFOCUS_API void reconstruct(const Echo& echo, const geometry::ImageGrid& grid, const ArrayView<const double, 2>& motion,
                              MutableImageView image, const ReconstructOptions& options = {});

}  // namespace sarfocus::hrws
