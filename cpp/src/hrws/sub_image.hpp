#pragma once

#include <sarfocus/hrws/reconstruct.hpp>

namespace sarfocus::hrws::detail {

/// The literal reconstruction; arguments checked.
void reconstruct_sub_images(const Echo& echo, const geometry::ImageGrid& grid, const ArrayView<const double, 2>& motion,
                            MutableImageView image, const ReconstructOptions& options);

/// `whole` as seen by part `part` of `parts` equal ones: progress goes on where the part before ended.
[[nodiscard]] Execution part_of(const Execution& whole, std::int64_t part, std::int64_t parts);

}  // namespace sarfocus::hrws::detail
