#pragma once

#include <sarfocus/autofocus/adaptive.hpp>

#include "adaptive_scan.hpp"

namespace sarfocus::autofocus::detail {

/// `cfar_gate` of an image that has been scanned with the gate's extents and number of cells. cell: pixels of azimuth that share what one
/// independent pixel tells.
[[nodiscard]] CfarGate gate_of(const ImageView& image, const Scan& scan, double cell, const CfarGateOptions& options);

/// Pixels of azimuth a resolution cell is wide, from the correlation of neighbours in some of the range gates.
[[nodiscard]] double azimuth_cell(const ImageView& image);

/// The extents that are tested: with mu given, single pixels.
[[nodiscard]] std::vector<int> tested_extents(const CfarGateOptions& options);

}  // namespace sarfocus::autofocus::detail
