// The errors of factorised backprojection that hang on the geometry, found before any data are seen by trying out sample tiles.
#pragma once

#include <cstddef>
#include <vector>

#include "focus/factorized_plan.hpp"

namespace sarfocus::focus::detail {

/// RMS error of a term, of amplitude 1, for pulses [begin, end) brought onto `track`, over pixels of tiles of rows x columns pixels.
/// roots: those left to the exact sum are not looked at. highest: cycles a metre of range at the upper end of the band; spacing: of the
/// data's samples, m.
[[nodiscard]] double track_error(const PixelFrame& frame, const std::vector<RootTile>& roots, const geometry::PhaseCentres& centres,
                                 std::ptrdiff_t begin, std::ptrdiff_t end, const VirtualTrack& track, std::ptrdiff_t rows,
                                 std::ptrdiff_t columns, double highest, double spacing);

/// Mean squared error of a term, of amplitude 1, from the track, from the kernels along it and from the expansions within the smallest
/// tiles.
[[nodiscard]] double geometric_error(const Plan& plan, const Piece& piece, const geometry::PhaseCentres& centres, double highest,
                                     double spacing);

}  // namespace sarfocus::focus::detail
