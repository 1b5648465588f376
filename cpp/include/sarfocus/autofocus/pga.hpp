#pragma once

#include <sarfocus/autofocus/options.hpp>
#include <sarfocus/autofocus/result.hpp>
#include <sarfocus/core/array_view.hpp>

namespace sarfocus::autofocus {

/// Phase gradient autofocus of a spotlight image, with the maximum-likelihood estimator [methods 3] in place of the gradient.
///
/// image: [n_azimuth, n_range] complex64, focused up to a phase error that is common to all range gates and acts on the azimuth
/// spectrum. corrected: the same shape, written; may be `image` itself, must not overlap it otherwise. phase_error is over
/// fftshift(fft(image, axis 0)) [n_azimuth]. Throws ShapeError, ValueError, NumericalError (NaN, all zero), Cancelled.
///
/// An image of more than 2^20 pixels is estimated from the eighth of its range gates with the strongest points, 512 at least, of which no
/// image is kept, and the maximum-likelihood phase loses the noise that its own cosines do not need [Stein1981]. It is first tried with
/// fewer points and rounds than the options allow; where judging on held-out pixels does not confirm what comes of it, with all of them.
/// Peak memory beside image and corrected: three times those gates at most, all of the image where that has fewer.
SARFOCUS_API Result pga(const ImageView& image, MutableImageView corrected, const PointOptions& options = {});

/// corrected = the image whose shifted azimuth spectrum is multiplied by exp(-j phase). phase: [n_azimuth] rad. Same memory rule.
SARFOCUS_API void correct_azimuth_spectrum(const ImageView& image, const std::vector<double>& phase, MutableImageView corrected,
                                           const Execution& execution = {});

}  // namespace sarfocus::autofocus
