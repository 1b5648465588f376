#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <string>
#include <vector>

#include <sarfocus/core/array.hpp>
#include <sarfocus/core/checks.hpp>
#include <sarfocus/core/complex_product.hpp>
#include <sarfocus/core/constants.hpp>
#include <sarfocus/fft/plan.hpp>
#include <sarfocus/focus/range_compress.hpp>

#include "focus/line_workspace.hpp"

namespace sarfocus::focus {
namespace {

constexpr std::ptrdiff_t most_samples = 1 << 28;

std::ptrdiff_t transform_length(std::ptrdiff_t n_frequency, double oversampling) {
    return fft::good_size(static_cast<std::ptrdiff_t>(std::ceil(oversampling * static_cast<double>(n_frequency))));
}

double centre_frequency_of(std::ptrdiff_t n_frequency, double start, double spacing, const FrequencyCompressOptions& options) {
    return options.centre_frequency > 0.0 ? options.centre_frequency : start + 0.5 * spacing * static_cast<double>(n_frequency - 1);
}

std::ptrdiff_t wrapped(std::ptrdiff_t i, std::ptrdiff_t n) {
    return (i % n + n) % n;
}

void require_ranges(const ArrayView<const double, 1>& reference_range, const ArrayView<double, 1>& range_start, std::ptrdiff_t n_pulse) {
    const std::string expected = "(" + std::to_string(n_pulse) + ",), one for each pulse";
    if (reference_range.extent(0) != n_pulse) throw ShapeError("reference_range", expected, shape_text(reference_range.extents()));
    if (range_start.extent(0) != n_pulse) throw ShapeError("range_start", expected, shape_text(range_start.extents()));
    require_finite(reference_range, "reference_range");
}

}  // namespace

CompressedRange compressed_range(std::ptrdiff_t n_frequency, double frequency_start, double frequency_spacing,
                                 const FrequencyCompressOptions& options) {
    if (n_frequency < 1) throw ValueError("n_frequency", "a number of frequencies > 0", std::to_string(n_frequency));
    require_positive(frequency_start, "frequency_start");
    require_positive(frequency_spacing, "frequency_spacing");
    if (!(options.oversampling >= 1.0 && options.oversampling * static_cast<double>(n_frequency) <= static_cast<double>(most_samples)))
        throw ValueError("oversampling", "a number from 1 to " + std::to_string(most_samples / n_frequency),
                         number_text(options.oversampling));
    if (options.guard < 0 || options.guard > most_samples)
        throw ValueError("guard", "a number of samples >= 0", std::to_string(options.guard));
    if (!(std::isfinite(options.centre_frequency) && options.centre_frequency >= 0.0))
        throw ValueError("centre_frequency", "0 (the middle of the band) or a frequency > 0 Hz", number_text(options.centre_frequency));
    const std::ptrdiff_t n = transform_length(n_frequency, options.oversampling);
    CompressedRange out;
    out.n_range = n + 2 * options.guard;
    out.range_spacing = speed_of_light / (2.0 * frequency_spacing * static_cast<double>(n));
    const std::ptrdiff_t centre = n / 2 + options.guard;
    out.range_offset = -static_cast<double>(centre) * out.range_spacing;
    out.wavelength = speed_of_light / centre_frequency_of(n_frequency, frequency_start, frequency_spacing, options);
    return out;
}

void compress_frequency(const ImageView& phase_history, double frequency_start, double frequency_spacing,
                        const ArrayView<const double, 1>& reference_range, const MutableImageView& out,
                        const ArrayView<double, 1>& range_start, const FrequencyCompressOptions& options) {
    require_not_empty(phase_history, "phase_history");
    const std::ptrdiff_t n_pulse = phase_history.extent(0);
    const std::ptrdiff_t n_frequency = phase_history.extent(1);
    const CompressedRange axis = compressed_range(n_frequency, frequency_start, frequency_spacing, options);
    require_ranges(reference_range, range_start, n_pulse);
    if (out.extents() != std::array<std::ptrdiff_t, 2>{n_pulse, axis.n_range})
        throw ShapeError("out", shape_text(std::array<std::ptrdiff_t, 2>{n_pulse, axis.n_range}), shape_text(out.extents()));

    const std::ptrdiff_t n = transform_length(n_frequency, options.oversampling);
    const std::ptrdiff_t middle = n_frequency / 2;
    const std::vector<double> weights = signal::window_samples(options.window, n_frequency);
    double total = 0.0;
    for (const double w : weights) total += w;
    if (!(total > 0.0))
        throw ValueError("window", "weights that are not all zero for " + std::to_string(n_frequency) + " frequencies", "zeros");

    // What is left of the carrier when the middle bin is taken to zero frequency: at most half a bin over the whole range axis.
    const double centre = centre_frequency_of(n_frequency, frequency_start, frequency_spacing, options);
    const double residual = frequency_start + frequency_spacing * static_cast<double>(middle) - centre;
    Array<cdouble, 1> residual_carrier({axis.n_range});
    for (std::ptrdiff_t i = 0; i < axis.n_range; ++i) {
        const double x = axis.range_offset + static_cast<double>(i) * axis.range_spacing;
        residual_carrier.data()[i] = std::polar(1.0 / total, two_pi * std::remainder(2.0 * residual * x / speed_of_light, 1.0));
    }

    const fft::Plan<float> inverse(n, fft::Direction::inverse);
    LineWorkspaces workspaces(options.execution, n);
    std::atomic<bool> finite{true};
    parallel_for(options.execution, "compress_frequency", n_pulse, [&](std::int64_t pulse) {
        cfloat* line = workspaces.line();
        std::fill(line, line + n, cfloat());
        for (std::ptrdiff_t m = 0; m < n_frequency; ++m)
            line[wrapped(m - middle, n)] = static_cast<float>(weights[static_cast<std::size_t>(m)]) * phase_history(pulse, m);
        inverse.execute(line);
        if (!is_finite(line[0])) {
            finite = false;
            return;
        }
        const cdouble carrier = std::polar(1.0, -two_pi * std::remainder(2.0 * centre * reference_range(pulse) / speed_of_light, 1.0));
        for (std::ptrdiff_t i = 0; i < axis.n_range; ++i)
            out(pulse, i) = product(line[wrapped(i - options.guard - n / 2, n)], cfloat(product(carrier, residual_carrier.data()[i])));
        range_start(pulse) = reference_range(pulse) + axis.range_offset;
    });
    if (!finite) throw_not_finite(phase_history, "phase_history", options.execution.threads);
}

}  // namespace sarfocus::focus
