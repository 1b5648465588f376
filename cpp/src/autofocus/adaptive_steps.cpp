#include "adaptive_steps.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>

#include <sarfocus/core/checks.hpp>
#include <sarfocus/core/error.hpp>

namespace sarfocus::autofocus {
namespace {

void require_length(std::ptrdiff_t length) {
    if (length < 2 || length % 2 != 0) throw ValueError("length", "an even number of azimuth lines, at least 2", std::to_string(length));
}

}  // namespace

GateSpan gates_to_denoise(std::ptrdiff_t n_range, std::ptrdiff_t centre) {
    if (n_range < 1) throw ValueError("n_range", "at least 1", std::to_string(n_range));
    if (centre < 0 || centre >= n_range)
        throw ValueError("centre", "a range gate of the " + std::to_string(n_range), std::to_string(centre));
    GateSpan out;
    out.count = std::min(std::max<std::ptrdiff_t>(n_range / 16, 3), n_range);
    out.first = std::clamp<std::ptrdiff_t>(centre - out.count / 2, 0, n_range - out.count);
    return out;
}

void mean_filter(const ImageView& image, MutableImageView filtered, const Execution& execution) {
    require_not_empty(image, "image");
    require_same_shape(filtered, "filtered", image, "image");
    const std::ptrdiff_t rows = image.extent(0);
    const std::ptrdiff_t columns = image.extent(1);
    parallel_for(execution, "mean filter", rows, [&](std::int64_t i) {
        for (std::ptrdiff_t j = 0; j < columns; ++j) {
            if (i == 0 || i + 1 == rows || j == 0 || j + 1 == columns) {
                filtered(i, j) = image(i, j);
                continue;
            }
            cdouble sum{};
            for (std::ptrdiff_t r = i - 1; r <= i + 1; ++r)
                for (std::ptrdiff_t c = j - 1; c <= j + 1; ++c) sum += cdouble(image(r, c));
            filtered(i, j) = cfloat(sum / 9.0);
        }
    });
}

std::vector<SubAperture> sub_apertures(std::ptrdiff_t n_azimuth, std::ptrdiff_t length) {
    if (n_azimuth < 1) throw ValueError("n_azimuth", "at least 1", std::to_string(n_azimuth));
    require_length(length);
    const std::ptrdiff_t step = length / 2;
    std::vector<SubAperture> out;
    do {
        SubAperture next;
        next.first = static_cast<std::ptrdiff_t>(out.size()) * step;
        next.count = std::min(length, n_azimuth - next.first);
        out.push_back(next);
    } while (out.back().first + out.back().count < n_azimuth);
    return out;
}

Array<double, 2> gate_energies(const ImageView& image, std::ptrdiff_t length, const Execution& execution) {
    require_length(length);
    return detail::energies_of(detail::scan_image(image, length / 2, {}, 0, execution));
}

GateChoice choose_gates(const ArrayView<const double, 1>& energies, int k, double eta) {
    require_not_empty(energies, "energies");
    if (k < 1) throw ValueError("k", "at least 1", std::to_string(k));
    require_positive(eta, "eta");
    require_finite(energies, "energies");
    const std::ptrdiff_t n = energies.extent(0);
    for (std::ptrdiff_t j = 0; j < n; ++j)
        if (energies(j) < 0.0) throw NumericalError("energies: expected numbers >= 0, got " + number_text(energies(j)));
    std::vector<std::ptrdiff_t> order(static_cast<std::size_t>(n));
    std::iota(order.begin(), order.end(), std::ptrdiff_t{0});
    const auto most = order.begin() + std::min<std::ptrdiff_t>(k, n);
    std::partial_sort(order.begin(), most, order.end(),
                      [&](std::ptrdiff_t a, std::ptrdiff_t b) { return energies(a) != energies(b) ? energies(a) > energies(b) : a < b; });
    // Sum of the k strongest and of those behind them, for every k that can come.
    double rest = 0.0;
    for (auto j = most; j != order.end(); ++j) rest += energies(*j);
    std::vector<double> behind(static_cast<std::size_t>(most - order.begin()) + 1, rest);
    for (std::size_t i = behind.size() - 1; i-- > 0;) behind[i] = behind[i + 1] + energies(order[i]);
    GateChoice out;
    double strong = 0.0;
    std::vector<double> before(behind.size(), 0.0);
    for (std::size_t i = 1; i < before.size(); ++i) before[i] = strong += energies(order[i - 1]);
    for (std::ptrdiff_t kept = k; kept > 0; kept /= 2) {
        if (kept >= n && kept > 1) continue;
        const auto i = static_cast<std::size_t>(kept);
        out.mean_strong = before[i] / static_cast<double>(kept);
        out.mean_rest = n > kept ? behind[i] / static_cast<double>(n - kept) : 0.0;
        if (!(n > kept && out.mean_strong > eta * out.mean_rest)) continue;
        out.gates.assign(order.begin(), order.begin() + kept);
        break;
    }
    return out;
}

}  // namespace sarfocus::autofocus
