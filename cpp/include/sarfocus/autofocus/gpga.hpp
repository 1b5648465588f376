#pragma once

#include <sarfocus/autofocus/options.hpp>
#include <sarfocus/autofocus/result.hpp>
#include <sarfocus/core/array_view.hpp>
#include <sarfocus/focus/backproject.hpp>

namespace sarfocus::autofocus {

/// Phase gradient autofocus by backprojection: one phase per pulse, any path, any grid. The dechirped history of a strong point is what
/// backprojection adds up at its pixel, pulse by pulse; points are chosen again in the image formed with each round's phase.
///
/// image: [grid.shape], overwritten with the image formed from profiles.data * exp(-j phase_error). phase_error, phase_std: [n_pulse].
/// On a grid of single points (n_range = 1) every point is used. Throws as focus::backproject does.
SARFOCUS_API Result gpga(const focus::RangeProfiles& profiles, const geometry::PhaseCentres& centres, const geometry::ImageGrid& grid,
                         MutableImageView image, const PointOptions& options = {});

}  // namespace sarfocus::autofocus
