#include <sarfocus/autofocus/pga.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

#include <sarfocus/core/checks.hpp>
#include <sarfocus/core/error.hpp>

#include "pga_estimate.hpp"
#include "point_engine.hpp"
#include "spectrum_source.hpp"
#include "strip_result.hpp"

namespace sarfocus::autofocus {
namespace {

void require_image(const ImageView& image, const MutableImageView& corrected) {
    require_not_empty(image, "image");
    require_same_shape(corrected, "out", image, "image");
}

}  // namespace

void correct_azimuth_spectrum(const ImageView& image, const std::vector<double>& phase, MutableImageView corrected,
                              const Execution& execution) {
    require_image(image, corrected);
    require_finite(image, "image", execution.threads);
    const std::ptrdiff_t n = image.extent(0);
    if (static_cast<std::ptrdiff_t>(phase.size()) != n)
        throw ShapeError("phase", std::to_string(n) + " values", std::to_string(phase.size()));
    detail::correct_spectrum(image, phase, corrected, nullptr, nullptr, execution);
}

namespace detail {

Result pga_estimate(const ImageView& image, const PointOptions& options, Array<cfloat, 2> spent) {
    if (image.extent(0) < 16) throw ShapeError("image", "at least 16 azimuth lines", shape_text(image.extents()));
    bool empty = true;
    for (std::ptrdiff_t i = 0; i < image.extent(0) && empty; ++i)
        for (std::ptrdiff_t j = 0; j < image.extent(1) && empty; ++j) empty = image(i, j) == cfloat{};
    if (empty) throw NumericalError("image: expected pixels other than zero, got all zero");

    std::vector<std::ptrdiff_t> gates = strong_gates(image, options.execution);
    if (static_cast<std::ptrdiff_t>(gates.size()) == image.extent(1)) require_finite(image, "image", options.execution.threads);
    SpectrumSource source(image, std::move(gates), options.execution);
    spent = {};
    Result result = estimate_from_points(source, options);
    result.method = "pga";
    result.estimate = source.over_spectrum(result.estimate, 0.0);
    result.phase_std = source.over_spectrum(result.phase_std, std::numeric_limits<double>::quiet_NaN());
    return result;
}

}  // namespace detail

Result pga(const ImageView& image, MutableImageView corrected, const PointOptions& options) {
    options.validate();
    require_image(image, corrected);
    Result result = detail::pga_estimate(image, options);
    if (result.input_returned()) {
        result.phase_error.assign(result.estimate.size(), 0.0);
        detail::copy_image(image, corrected, options.execution);
    } else {
        result.phase_error = result.estimate;
        detail::correct_spectrum(image, result.phase_error, corrected, nullptr, nullptr, options.execution);
    }
    return result;
}

}  // namespace sarfocus::autofocus
