#pragma once

#include <cstddef>
#include <vector>

#include <sarfocus/autofocus/strip.hpp>
#include <sarfocus/core/array_view.hpp>
#include <sarfocus/core/execution.hpp>

namespace sarfocus::autofocus::detail {

/// Sections of azimuth, each some pixels long, with one candidate a gate.
struct Sections {
    std::ptrdiff_t length = 1;
    std::ptrdiff_t count = 1;
    Sections(std::ptrdiff_t n_azimuth, double aperture);
};

struct BoxOptions {
    std::vector<int> extents;  ///< lengths of the boxes, pixels
    double cell = 1.0;         ///< azimuth pixels of a resolution cell
    std::size_t most = 1;      ///< boxes of a section
    Execution execution;
};

/// Of every section the most striking boxes of azimuth pixels, one a gate at most, the most striking first. What a box stands out of is
/// the clutter of its gate: the median over pieces of azimuth of their mean intensity, which points do not reach. The image is read once.
/// Throws NumericalError where the energy of a gate is not finite.
[[nodiscard]] std::vector<std::vector<StripPoint>> strongest_boxes(const ImageView& image, const Sections& sections,
                                                                   const BoxOptions& options);

}  // namespace sarfocus::autofocus::detail
