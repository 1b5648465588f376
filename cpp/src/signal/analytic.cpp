#include <sarfocus/signal/analytic.hpp>

#include <cmath>
#include <complex>
#include <vector>

#include <sarfocus/core/array.hpp>
#include <sarfocus/core/checks.hpp>
#include <sarfocus/core/constants.hpp>
#include <sarfocus/fft/plan.hpp>

namespace sarfocus::signal {
namespace {

// out(p, i) = analytic signal * carrier[i]
void transform(const ArrayView<const double, 2>& samples, const std::vector<cdouble>& carrier, const MutableImageView& out,
               const char* phase, const Execution& execution) {
    require_not_empty(samples, "samples");
    require_same_shape(out, "out", samples, "samples");
    require_finite(samples, "samples");
    const std::ptrdiff_t n = samples.extent(1);
    const fft::Plan<double> forward(n, fft::Direction::forward);
    const fft::Plan<double> inverse(n, fft::Direction::inverse);
    parallel_for(execution, phase, samples.extent(0), [&](std::int64_t pulse) {
        Array<cdouble, 1> line({n});
        for (std::ptrdiff_t i = 0; i < n; ++i) line.data()[i] = samples(pulse, i) / static_cast<double>(n);
        forward.execute(line.data());
        // Bin 0 and, for even length, the one at half the sampling rate are their own mirror images: kept once.
        for (std::ptrdiff_t k = 1; k < (n + 1) / 2; ++k) line.data()[k] *= 2.0;
        for (std::ptrdiff_t k = n / 2 + 1; k < n; ++k) line.data()[k] = 0.0;
        inverse.execute(line.data());
        for (std::ptrdiff_t i = 0; i < n; ++i) out(pulse, i) = cfloat(line.data()[i] * carrier[static_cast<std::size_t>(i)]);
    });
}

}  // namespace

void analytic_signal(const ArrayView<const double, 2>& samples, const MutableImageView& out, const AnalyticOptions& options) {
    transform(samples, std::vector<cdouble>(static_cast<std::size_t>(samples.extent(1)), 1.0), out, "analytic_signal", options.execution);
}

void demodulate(const ArrayView<const double, 2>& samples, double range_start, double range_spacing, double wavelength,
                const MutableImageView& out, const AnalyticOptions& options) {
    require_finite_value(range_start, "range_start");
    require_positive(range_spacing, "range_spacing");
    require_positive(wavelength, "wavelength");
    std::vector<cdouble> carrier;
    for (std::ptrdiff_t i = 0; i < samples.extent(1); ++i) {
        const double range = range_start + static_cast<double>(i) * range_spacing;
        carrier.push_back(std::polar(1.0, -two_pi * std::remainder(2.0 * range / wavelength, 1.0)));
    }
    transform(samples, carrier, out, "demodulate", options.execution);
}

}  // namespace sarfocus::signal
