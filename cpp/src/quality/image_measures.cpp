#include <sarfocus/quality/image_measures.hpp>

#include <cmath>
#include <limits>
#include <numbers>
#include <string>

#include <sarfocus/core/checks.hpp>
#include <sarfocus/core/error.hpp>

#include "row_sums.hpp"

namespace sarfocus::quality {
namespace {

using detail::intensity;

void check(const ImageView& image, const char* argument, const Execution& execution) {
    require_not_empty(image, argument);
    require_finite(image, argument, execution.threads);
}

[[noreturn]] void throw_all_zero(const char* argument) {
    throw NumericalError(std::string(argument) + ": expected at least one sample different from zero, got an image of zeros");
}

template <std::size_t N, class Term>
std::array<double, N> sum(const ImageView& image, const Execution& execution, const char* phase, const Term& term) {
    return detail::sum_rows<N>(image.extents(), image.strides(), execution, phase,
                               [&](std::ptrdiff_t i, std::ptrdiff_t j) { return term(intensity(image(i, j))); });
}

/// sum of |I|^2 and of its square.
std::array<double, 2> power_sums(const ImageView& image, const Execution& execution, const char* phase) {
    check(image, "image", execution);
    const auto sums = sum<2>(image, execution, phase, [](double x) { return std::array{x, x * x}; });
    if (sums[0] == 0.0) throw_all_zero("image");
    return sums;
}

}  // namespace

double entropy(const ImageView& image, const Execution& execution) {
    check(image, "image", execution);
    const auto [total, weighted] =
        sum<2>(image, execution, "entropy", [](double x) { return std::array{x, x > 0.0 ? x * std::log(x) : 0.0}; });
    if (total == 0.0) throw_all_zero("image");
    // -sum (x / s) ln(x / s) = ln s - (sum x ln x) / s: one pass instead of two. Rounding may leave it a hair below zero.
    return std::max(0.0, std::log(total) - weighted / total);
}

double entropy_log10(const ImageView& image, const Execution& execution) {
    return entropy(image, execution) / std::numbers::ln10;
}

double contrast(const ImageView& image, const Execution& execution) {
    const auto pixels = static_cast<double>(image.size());
    const double mean = power_sums(image, execution, "mean intensity")[0] / pixels;
    const double squares = sum<1>(image, execution, "contrast", [mean](double x) { return std::array{(x - mean) * (x - mean)}; })[0];
    return std::sqrt(squares / pixels) / mean;
}

double sharpness(const ImageView& image, const Execution& execution) {
    const auto [total, squares] = power_sums(image, execution, "sharpness");
    return squares / (total * total);
}

double psnr(const ImageView& image, const ImageView& reference, const Execution& execution) {
    require_same_shape(image, "image", reference, "reference");
    check(image, "image", execution);
    check(reference, "reference", execution);
    const auto reference_intensity = [&](std::ptrdiff_t i, std::ptrdiff_t j) { return std::array{intensity(reference(i, j))}; };
    const auto larger = [](double a, double b) { return std::max(a, b); };
    const double peak = detail::sum_rows<1>(reference.extents(), reference.strides(), execution, "peak", reference_intensity, larger)[0];
    if (peak == 0.0) throw_all_zero("reference");
    const double squares =
        detail::sum_rows<1>(image.extents(), image.strides(), execution, "psnr", [&](std::ptrdiff_t i, std::ptrdiff_t j) {
            const double difference = std::sqrt(intensity(image(i, j))) - std::sqrt(intensity(reference(i, j)));
            return std::array{difference * difference};
        })[0];
    if (squares == 0.0) return std::numeric_limits<double>::infinity();
    return 10.0 * std::log10(peak * static_cast<double>(image.size()) / squares);
}

}  // namespace sarfocus::quality
