#pragma once

#include <cstddef>
#include <vector>

#include <sarfocus/autofocus/adaptive.hpp>

#include "adaptive_scan.hpp"
#include "point_source.hpp"
#include "strong_points.hpp"

namespace sarfocus::autofocus::detail {

/// The range gates of every sub-aperture that points are taken from.
struct Selection {
    std::vector<std::vector<std::ptrdiff_t>> gates;  ///< [n_sub_aperture], ascending
    std::vector<int> k;                              ///< as the energy rule decided
    std::vector<double> mean_strong;
    std::vector<double> mean_rest;
};

/// By the energy rule [Luo2025, eq. 11-13]; where it skips every sub-aperture, the gates of the detected cells in all of them.
[[nodiscard]] Selection select_gates(const Scan& scan, const CfarGate& gate, int k, double eta);
/// The k strongest gates of each.
[[nodiscard]] Selection select_fixed(const Scan& scan, int k);
[[nodiscard]] Selection no_selection(std::size_t parts);

/// Range gates, ascending, whose spectrum an estimate works on: those selected (the strongest, where they are more than 512 and an eighth
/// of all), filled up to 512 by those with the strongest samples, which fine rounds and judging can use.
[[nodiscard]] std::vector<std::ptrdiff_t> gates_to_transform(const Scan& scan, const Selection& selection);

/// Sign of (1 + 2 cos w) / 3 for every bin of the unshifted transform, 1 in the two gates at the border that are not filtered.
[[nodiscard]] Array<float, 2> sign_of_mean_filter(std::ptrdiff_t gates, std::ptrdiff_t n_azimuth);

/// Throws NumericalError where a scanned image is zero everywhere.
void require_not_zero(const Scan& scan);

/// A result that leaves the image alone.
[[nodiscard]] Result nothing_done(const ImageView& image, const char* reason, const Execution& execution);

/// Writes down what was decided; the points of the result are counted into the sub-apertures that they lie in.
void describe(const Selection& selection, const CfarGate& gate, std::vector<SubAperture> parts, double eta, Result& result);

}  // namespace sarfocus::autofocus::detail
