#pragma once

#include <cstddef>
#include <functional>

#include <sarfocus/core/array_view.hpp>
#include <sarfocus/core/execution.hpp>

#include "point_source.hpp"
#include "score.hpp"
#include "strong_points.hpp"

namespace sarfocus::autofocus::detail {

struct EvidenceOptions {
    std::ptrdiff_t first_bin = 0;   ///< transform bin of the lowest frequency of the azimuth spectrum, where its one piece begins
    std::ptrdiff_t neighbours = 0;  ///< columns to each side in which a point's peak may lie before the correction
    std::ptrdiff_t window = 0;      ///< azimuth samples to each side that hold the energy of a point's history; 0: all
    Execution execution;
};

/// Writes a column of an image, n_azimuth samples, aligned; from several threads at once.
using ColumnWriter = std::function<void(std::ptrdiff_t column, cfloat* line)>;

/// What the strong points of two images of the same scene tell of the correction between them, for methods that estimate without points.
/// A history's coherence is the peak's power over the energy of its gate, both after the correction.
[[nodiscard]] Evidence image_evidence(const ColumnWriter& before, const ImageView& after, const PixelLayout& layout, const CellSize& cell,
                                      const EvidenceOptions& options);
[[nodiscard]] Evidence image_evidence(const ImageView& before, const ImageView& after, const PixelLayout& layout, const CellSize& cell,
                                      const EvidenceOptions& options);

}  // namespace sarfocus::autofocus::detail
