#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include <sarfocus/core/error.hpp>
#include <sarfocus/detect/cfar.hpp>
#include <sarfocus/detect/local_maxima.hpp>

#include "adaptive_steps.hpp"
#include "strong_points.hpp"

namespace sarfocus::autofocus {
namespace {

// The mean over reference boxes of what a box says, and how many there are.
struct Reference {
    double mean = 0.0;
    std::ptrdiff_t boxes = 0;
};

double mean_intensity(const ImageView& image, std::ptrdiff_t begin, std::ptrdiff_t extent, std::ptrdiff_t gate) {
    double sum = 0.0;
    for (std::ptrdiff_t i = begin; i < begin + extent; ++i) sum += std::norm(cdouble(image(i, gate)));
    return sum / static_cast<double>(extent);
}

Reference reference_of(const ImageView& image, std::ptrdiff_t begin, std::ptrdiff_t extent, std::ptrdiff_t gate, bool amplitudes,
                       const CfarGateOptions& options) {
    Reference out;
    for (std::ptrdiff_t c = options.guard + 1; c <= options.guard + options.reference / 2; ++c)
        for (const std::ptrdiff_t box : {begin - c * extent, begin + c * extent}) {
            if (box < 0 || box + extent > image.extent(0)) continue;
            const double intensity = mean_intensity(image, box, extent, gate);
            out.mean += amplitudes ? std::sqrt(intensity) : intensity;
            ++out.boxes;
        }
    if (out.boxes > 0) out.mean /= static_cast<double>(out.boxes);
    return out;
}

// The same boxes of other gates: a bright field is as wide in range as in azimuth, a defocused point is not.
Reference across_gates(const ImageView& image, std::ptrdiff_t begin, std::ptrdiff_t extent, std::ptrdiff_t gate,
                       const CfarGateOptions& options) {
    Reference out;
    for (std::ptrdiff_t c = options.guard + 1; c <= options.guard + options.reference / 2; ++c)
        for (const std::ptrdiff_t other : {gate - c, gate + c}) {
            if (other < 0 || other >= image.extent(1)) continue;
            out.mean += mean_intensity(image, begin, extent, other);
            ++out.boxes;
        }
    if (out.boxes > 0) out.mean /= static_cast<double>(out.boxes);
    return out;
}

// Factor for intensities: each box tells as much as extent / cell independent ones, and so do its references.
double factor_of(std::ptrdiff_t boxes, double extent, double cell, double false_alarm_probability) {
    const double looks = extent / cell;
    if (looks > 1.0) return detect::multi_look_factor(looks, boxes, false_alarm_probability);
    const auto independent = std::max<std::ptrdiff_t>(std::lround(static_cast<double>(boxes) * looks), 1);
    return detect::cell_averaging_factor(independent, false_alarm_probability);
}

GateCell test_box(const ImageView& image, const detect::Point& box, std::ptrdiff_t extent, double cell, double false_alarm_probability,
                  const CfarGateOptions& options) {
    const bool amplitudes = options.mu > 0.0;
    const std::ptrdiff_t begin = box.azimuth - extent / 2;
    const double intensity = mean_intensity(image, begin, extent, box.range);
    Reference reference = reference_of(image, begin, extent, box.range, amplitudes, options);
    if (extent > 1) {
        const Reference beside = across_gates(image, begin, extent, box.range, options);
        if (beside.boxes > 0 && (reference.boxes == 0 || beside.mean > reference.mean)) reference = beside;
    }
    GateCell out;
    out.azimuth = box.azimuth;
    out.range = box.range;
    out.extent = extent;
    out.value = amplitudes ? std::sqrt(intensity) : intensity;
    out.clutter = reference.mean;
    out.threshold = std::numeric_limits<double>::infinity();
    if (reference.boxes > 0)
        out.threshold = reference.mean *
                        (amplitudes ? options.mu : factor_of(reference.boxes, static_cast<double>(extent), cell, false_alarm_probability));
    out.detected = out.value > out.threshold;
    return out;
}

}  // namespace

void CfarGateOptions::validate() const {
    if (extents.empty()) throw ValueError("extents", "at least one length", "none");
    for (const int extent : extents)
        if (extent < 1 || (extent > 1 && extent % 2 != 0))
            throw ValueError("extents", "1 or even numbers of pixels", std::to_string(extent));
    if (!(std::isfinite(mu) && mu >= 0.0))
        throw ValueError("mu", "0 (from the false-alarm probability) or a positive factor", number_text(mu));
    if (!(false_alarm_probability > 0.0 && false_alarm_probability < 1.0))
        throw ValueError("false_alarm_probability", "a number above 0 and below 1", number_text(false_alarm_probability));
    if (reference < 2 || reference % 2 != 0)
        throw ValueError("reference", "an even number of cells, at least 2", std::to_string(reference));
    if (guard < 0) throw ValueError("guard", "0 or more cells", std::to_string(guard));
    if (cells < 1) throw ValueError("cells", "at least 1", std::to_string(cells));
    (void)resolve_threads(execution.threads);
}

namespace detail {

double azimuth_cell(const ImageView& image) {
    constexpr std::ptrdiff_t samples = 65536;  // the correlation to half a per cent
    const std::ptrdiff_t gates = std::clamp<std::ptrdiff_t>(samples / image.extent(0), 1, image.extent(1));
    double power = 0.0;
    cdouble product{};
    for (std::ptrdiff_t g = 0; g < gates; ++g) {
        const std::ptrdiff_t gate = (2 * g + 1) * image.extent(1) / (2 * gates);
        for (std::ptrdiff_t i = 0; i + 1 < image.extent(0); ++i) {
            const cdouble value(image(i, gate));
            power += std::norm(value);
            product += value * std::conj(cdouble(image(i + 1, gate)));
        }
    }
    return power > 0.0 ? pixels_per_cell(std::abs(product) / power) : 1.0;
}

std::vector<int> tested_extents(const CfarGateOptions& options) {
    return options.mu > 0.0 ? std::vector<int>{1} : options.extents;
}

CfarGate gate_of(const ImageView& image, const Scan& scan, double cell, const CfarGateOptions& options) {
    CfarGate out;
    out.amplitudes = options.mu > 0.0;
    for (std::size_t e = 0; e < scan.extents.size(); ++e) {
        const std::ptrdiff_t extent = scan.extents[e];
        if (extent > image.extent(0)) continue;
        const auto step = static_cast<double>(std::max<std::ptrdiff_t>(extent / 2, 1));
        const double share =
            options.false_alarm_probability / (static_cast<double>(scan.extents.size()) * static_cast<double>(image.size()) / step);
        std::vector<detect::Point> strongest = detect::coalesce(scan.strongest[e], {std::max<std::ptrdiff_t>(4, extent), 4});
        if (strongest.size() > static_cast<std::size_t>(options.cells)) strongest.resize(static_cast<std::size_t>(options.cells));
        for (const detect::Point& box : strongest) {
            out.cells.push_back(test_box(image, box, extent, cell, share, options));
            out.strong_points = out.strong_points || out.cells.back().detected;
        }
    }
    return out;
}

}  // namespace detail

CfarGate cfar_gate(const ImageView& image, const CfarGateOptions& options) {
    options.validate();
    const detail::Scan scan = detail::scan_image(image, image.extent(0), detail::tested_extents(options), options.cells, options.execution);
    return detail::gate_of(image, scan, detail::azimuth_cell(image), options);
}

}  // namespace sarfocus::autofocus
