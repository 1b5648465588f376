#pragma once

#include <sarfocus/core/array_view.hpp>
#include <sarfocus/core/execution.hpp>
#include <sarfocus/core/export.hpp>

namespace sarfocus::signal {

struct AnalyticOptions {
    Execution execution;
};

/// Analytic signal of real-valued fast-time samples: the negative frequencies of every line removed, the positive ones doubled, so that the
/// real part stays what it was. The line is taken to be periodic.
///
/// samples, out: [n_pulse, n_fast_time], any strides, no overlap. Double-precision transforms; bits do not depend on threads.
/// Throws ShapeError, NumericalError (NaN or infinity, with its position), Cancelled.
SARFOCUS_API void analytic_signal(const ArrayView<const double, 2>& samples, const MutableImageView& out,
                                  const AnalyticOptions& options = {});

/// Baseband echoes of a radar that samples its impulse without a carrier (ultra-wideband): out = analytic signal * exp(-4j pi r /
/// wavelength), r = range_start + i * range_spacing the range of sample i, m. A scatterer at R, whose echo is Re(p(r - R) exp(4j pi (r - R)
/// / wavelength)), becomes exp(-4j pi R / wavelength) p(r - R): the carrier phase is kept as everywhere in the library, p is the pulse
/// about zero frequency for the `wavelength` of the middle of its band. Subtract what is the same in all pulses (direct coupling)
/// beforehand. As analytic_signal in everything else; throws ValueError too.
SARFOCUS_API void demodulate(const ArrayView<const double, 2>& samples, double range_start, double range_spacing, double wavelength,
                             const MutableImageView& out, const AnalyticOptions& options = {});

}  // namespace sarfocus::signal
