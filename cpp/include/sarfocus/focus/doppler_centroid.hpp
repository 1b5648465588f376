#pragma once

#include <sarfocus/core/array_view.hpp>
#include <sarfocus/core/execution.hpp>
#include <sarfocus/core/export.hpp>

namespace sarfocus::focus {

struct DopplerCentroidOptions {
    Execution execution;
};

/// Doppler centroid of echoes, Hz, by the correlation of successive pulses [Madsen1989]: prf / (2 pi) times the argument of the sum over
/// pulses and fast time of data[i + 1] conj(data[i]); strong echoes weigh with their energy. In (-prf/2, prf/2]: the multiple of the prf to
/// add (the ambiguity) has to come from elsewhere, such as the attitude of the antenna. Points of which only a part of the aperture is
/// recorded pull it to the frequencies at which they are seen.
///
/// data: [n_pulse, n_range], n_pulse >= 2, raw or range-compressed, any strides. Sums in double precision and fixed order: bits do not
/// depend on threads. Throws ValueError, ShapeError, NumericalError (NaN or infinity, with its position; pulses without any correlation),
/// Cancelled.
[[nodiscard]] SARFOCUS_API double estimate_doppler_centroid(const ImageView& data, double prf, const DopplerCentroidOptions& options = {});

}  // namespace sarfocus::focus
