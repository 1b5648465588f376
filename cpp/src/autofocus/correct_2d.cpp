#include <algorithm>
#include <cmath>
#include <limits>

#include <sarfocus/autofocus/pga.hpp>
#include <sarfocus/autofocus/pga_2d.hpp>
#include <sarfocus/core/array.hpp>
#include <sarfocus/core/checks.hpp>
#include <sarfocus/core/constants.hpp>
#include <sarfocus/core/error.hpp>
#include <sarfocus/core/multiversion.hpp>
#include <sarfocus/fft/plan.hpp>
#include <sarfocus/signal/phasor.hpp>

#include "azimuth_spectra.hpp"

namespace sarfocus::autofocus {
namespace {

// A value between the samples by a cubic through four neighbours (Catmull-Rom); beyond the ends it goes on as a line.
double between(const std::vector<double>& phase, double position) {
    const auto n = static_cast<std::ptrdiff_t>(phase.size());
    const auto value = [&](std::ptrdiff_t k) {
        if (k < 0) return phase[0] + static_cast<double>(k) * (phase[1] - phase[0]);
        if (k >= n) return phase[phase.size() - 1] + static_cast<double>(k - n + 1) * (phase[phase.size() - 1] - phase[phase.size() - 2]);
        return phase[static_cast<std::size_t>(k)];
    };
    const auto k = static_cast<std::ptrdiff_t>(std::floor(position));
    const double x = position - static_cast<double>(k);
    const double a = value(k - 1);
    const double b = value(k);
    const double c = value(k + 1);
    const double d = value(k + 2);
    return b + 0.5 * x * (c - a + x * (2.0 * a - 5.0 * b + 4.0 * c - d + x * (3.0 * (b - c) + d - a)));
}

// line[f] *= scale exp(2 pi j turns[f]).
SARFOCUS_MULTIVERSION void turn(cfloat* line, const double* turns, std::ptrdiff_t m, float scale) {
    auto* x = reinterpret_cast<float*>(line);
    for (std::ptrdiff_t f = 0; f < m; ++f) {
        float real = 0.0f;
        float imag = 0.0f;
        signal::unit_phasor(turns[f], real, imag);
        const float re = scale * (x[2 * f] * real - x[2 * f + 1] * imag);
        const float im = scale * (x[2 * f] * imag + x[2 * f + 1] * real);
        x[2 * f] = re;
        x[2 * f + 1] = im;
    }
}

}  // namespace

double range_migration(const std::vector<double>& phase, double bandwidth_ratio, MigrationModel model) {
    // Derivative of the term by y at 0: phi, less u dphi/du in the polar format.
    const auto n = static_cast<std::ptrdiff_t>(phase.size());
    const std::ptrdiff_t middle = n / 2;
    double low = std::numeric_limits<double>::infinity();
    double high = -low;
    for (std::ptrdiff_t k = 0; k < n; ++k) {
        double slope = phase[static_cast<std::size_t>(k)];
        if (model == MigrationModel::polar_format && n > 1) {
            const std::ptrdiff_t before = std::max<std::ptrdiff_t>(k - 1, 0);
            const std::ptrdiff_t behind = std::min(k + 1, n - 1);
            slope -= static_cast<double>(k - middle) * (phase[static_cast<std::size_t>(behind)] - phase[static_cast<std::size_t>(before)]) /
                     static_cast<double>(behind - before);
        }
        low = std::min(low, slope);
        high = std::max(high, slope);
    }
    return n > 0 ? (high - low) * std::abs(bandwidth_ratio) / two_pi : 0.0;
}

void correct_two_dimensional(const ImageView& image, const std::vector<double>& phase, double bandwidth_ratio, MigrationModel model,
                             MutableImageView corrected, const Execution& execution) {
    constexpr double largest = 0.9;  // beyond, the band would reach down to zero frequency
    if (!(std::abs(bandwidth_ratio) <= largest)) throw ValueError("bandwidth_ratio", "-0.9 to 0.9", number_text(bandwidth_ratio));
    require_not_empty(image, "image");
    require_same_shape(corrected, "out", image, "image");
    const std::ptrdiff_t n = image.extent(0);
    const std::ptrdiff_t m = image.extent(1);
    if (static_cast<std::ptrdiff_t>(phase.size()) != n)
        throw ShapeError("phase", std::to_string(n) + " values", std::to_string(phase.size()));
    require_finite(ArrayView<const double, 1>(phase.data(), {n}), "phase");
    if (bandwidth_ratio == 0.0) return correct_azimuth_spectrum(image, phase, corrected, execution);
    require_finite(image, "image", execution.threads);
    detail::transform_azimuth(image, fft::Direction::forward, corrected, execution);
    const fft::Plan<float> forward(m, fft::Direction::forward);
    const fft::Plan<float> inverse(m, fft::Direction::inverse);
    const float scale = 1.0f / (static_cast<float>(n) * static_cast<float>(m));
    const std::ptrdiff_t middle = n / 2;
    const auto u_middle = static_cast<double>(middle);
    std::vector<double> frequency;  // 1 + y
    for (std::ptrdiff_t f = 0; f < m; ++f)
        frequency.push_back(1.0 + bandwidth_ratio * static_cast<double>(f < (m + 1) / 2 ? f : f - m) / static_cast<double>(m));
    constexpr std::ptrdiff_t rows = 8;  // whole cache lines of an image whose azimuth is contiguous
    parallel_for(execution, "correct", (n + rows - 1) / rows, [&](std::int64_t b) {
        const std::ptrdiff_t first = b * rows;
        const std::ptrdiff_t count = std::min(rows, n - first);
        Array<cfloat, 2> lines({count, (m + rows - 1) / rows * rows});  // every line aligned
        std::vector<double> turns(frequency.size());
        for (std::ptrdiff_t j = 0; j < m; ++j)
            for (std::ptrdiff_t r = 0; r < count; ++r) lines(r, j) = corrected(first + r, j);
        for (std::ptrdiff_t r = 0; r < count; ++r) {
            cfloat* line = &lines(r, 0);
            const std::ptrdiff_t shifted = (first + r + middle) % n;
            const double u = static_cast<double>(shifted) - u_middle;
            forward.execute(line);
            const double value = phase[static_cast<std::size_t>(shifted)];
            for (std::size_t f = 0; f < turns.size(); ++f) {
                const double here = model == MigrationModel::polar_format ? between(phase, u / frequency[f] + u_middle) : value;
                turns[f] = frequency[f] * (-here / two_pi);
            }
            turn(line, turns.data(), m, scale);
            inverse.execute(line);
        }
        for (std::ptrdiff_t j = 0; j < m; ++j)
            for (std::ptrdiff_t r = 0; r < count; ++r) corrected(first + r, j) = lines(r, j);
    });
    detail::transform_azimuth(corrected, fft::Direction::inverse, corrected, execution);
}

}  // namespace sarfocus::autofocus
