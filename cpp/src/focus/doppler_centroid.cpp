#include <sarfocus/focus/doppler_centroid.hpp>

#include <complex>
#include <cstddef>
#include <vector>

#include <sarfocus/core/checks.hpp>
#include <sarfocus/core/complex_product.hpp>
#include <sarfocus/core/constants.hpp>
#include <sarfocus/core/error.hpp>

namespace sarfocus::focus {

double estimate_doppler_centroid(const ImageView& data, double prf, const DopplerCentroidOptions& options) {
    require_positive(prf, "prf");
    require_not_empty(data, "data");
    if (data.extent(0) < 2) throw ShapeError("data", "two pulses or more", shape_text(data.extents()));
    require_finite(data, "data", options.execution.threads);

    std::vector<cdouble> of_pulse(static_cast<std::size_t>(data.extent(0) - 1));
    parallel_for(options.execution, "estimate_doppler_centroid", data.extent(0) - 1, [&](std::int64_t pulse) {
        cdouble sum = 0.0;
        for (std::ptrdiff_t i = 0; i < data.extent(1); ++i) sum += product(cdouble(data(pulse + 1, i)), std::conj(cdouble(data(pulse, i))));
        of_pulse[static_cast<std::size_t>(pulse)] = sum;
    });
    cdouble correlation = 0.0;
    for (const cdouble& sum : of_pulse) correlation += sum;
    if (correlation == cdouble()) throw NumericalError("data: expected successive pulses that correlate, got a correlation of zero");
    const double cycles = std::arg(correlation) / two_pi;
    return prf * (cycles <= -0.5 ? 0.5 : cycles);
}

}  // namespace sarfocus::focus
