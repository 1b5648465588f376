#pragma once

#include <functional>
#include <vector>

#include <sarfocus/autofocus/pga_2d.hpp>
#include <sarfocus/core/array_view.hpp>
#include <sarfocus/core/execution.hpp>

namespace sarfocus::autofocus::detail {

struct BandwidthRatio {
    double ratio = 0.0;  ///< 0 where `gain` is not above three times `noise`
    double best = 0.0;   ///< the sharpest
    double gain = 0.0;   ///< nat, mean gain in log sharpness of one half of the stripes with the other half's ratio, over no migration
    double noise = 0.0;  ///< nat, what chance would give
};

/// The ratio with which the strongest range stripes are sharpest after correct_two_dimensional, of those from -largest to largest.
[[nodiscard]] BandwidthRatio find_bandwidth_ratio(const ImageView& image, const std::vector<double>& phase, MigrationModel model,
                                                  double largest, const Execution& execution);

}  // namespace sarfocus::autofocus::detail
