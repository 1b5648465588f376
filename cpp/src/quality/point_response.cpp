#include <sarfocus/quality/point_response.hpp>

#include <algorithm>
#include <cmath>
#include <complex>
#include <string>

#include <sarfocus/core/array.hpp>
#include <sarfocus/core/checks.hpp>
#include <sarfocus/core/constants.hpp>
#include <sarfocus/core/error.hpp>
#include <sarfocus/fft/plan.hpp>
#include <sarfocus/signal/interpolation.hpp>

#include "response_cut.hpp"
#include "row_sums.hpp"

namespace sarfocus::quality {
namespace {

using detail::Cut;
using detail::intensity;
using detail::MainLobe;
using detail::SideLobes;
using Pixel = std::array<std::ptrdiff_t, 2>;
using Weights = std::vector<cdouble>;

constexpr const char* axis_names[] = {"azimuth", "range"};
constexpr std::ptrdiff_t smallest_extent = 8;

std::string pixel_text(const Pixel& pixel) {
    return "[" + std::to_string(pixel[0]) + ", " + std::to_string(pixel[1]) + "]";
}

void validate(const AxisOptions& axis, const std::string& name) {
    if (axis.oversampling != 0.0 && !(std::isfinite(axis.oversampling) && axis.oversampling >= 1.0))
        throw ValueError(name + " oversampling", "0 (unknown) or at least 1 sample per cell", number_text(axis.oversampling));
    bool any = axis.window.empty();
    for (const double w : axis.window) {
        require_finite_value(w, (name + " window").c_str());
        any = any || w != 0.0;
    }
    if (!any) throw ValueError(name + " window", "a weight different from zero", "zeros");
    if (std::isinf(axis.band_centre)) throw ValueError(name + " band_centre", "cycles per sample or NaN", number_text(axis.band_centre));
}

void validate(const PointResponseOptions& options) {
    const auto require = [](bool holds, const char* argument, const char* expected, double actual) {
        if (!holds) throw ValueError(argument, expected, number_text(actual));
    };
    require(options.upsample >= 8 && options.upsample <= 1024, "upsample", "8 to 1024", static_cast<double>(options.upsample));
    require(options.search >= 0, "search", "0 or more pixels", static_cast<double>(options.search));
    require(options.lobes >= 1 && options.lobes <= 1000, "lobes", "1 to 1000", static_cast<double>(options.lobes));
    require(options.chip >= smallest_extent, "chip", "8 or more pixels", static_cast<double>(options.chip));
    require(options.irw_tolerance >= 0.0, "irw_tolerance", "a number >= 0", options.irw_tolerance);
    require(options.sidelobe_tolerance >= 0.0, "sidelobe_tolerance", "a number of dB >= 0", options.sidelobe_tolerance);
    validate(options.azimuth, "azimuth");
    validate(options.range, "range");
}

Pixel nearest_pixel(const ImageView& image, const std::array<double, 2>& position) {
    Pixel out{};
    for (const std::size_t d : {0U, 1U}) {
        const double last = static_cast<double>(image.extent(d)) - 1.0;
        if (!(position[d] >= -0.5 && position[d] <= last + 0.5))
            throw ValueError(std::string(axis_names[d]) + " position", "a pixel from 0 to " + number_text(last), number_text(position[d]));
        out[d] = std::clamp<std::ptrdiff_t>(std::lround(position[d]), 0, image.extent(d) - 1);
    }
    return out;
}

bool is_local_maximum(const ImageView& image, const Pixel& p) {
    const double power = intensity(image(p[0], p[1]));
    for (std::ptrdiff_t i = std::max<std::ptrdiff_t>(0, p[0] - 1); i <= std::min(image.extent(0) - 1, p[0] + 1); ++i)
        for (std::ptrdiff_t j = std::max<std::ptrdiff_t>(0, p[1] - 1); j <= std::min(image.extent(1) - 1, p[1] + 1); ++j)
            if (intensity(image(i, j)) > power) return false;
    return power > 0.0;
}

Pixel strongest_local_maximum(const ImageView& image, const Pixel& about, std::ptrdiff_t search) {
    Pixel best{};
    double best_power = 0.0;
    double highest = 0.0;
    for (std::ptrdiff_t i = std::max<std::ptrdiff_t>(0, about[0] - search); i <= std::min(image.extent(0) - 1, about[0] + search); ++i)
        for (std::ptrdiff_t j = std::max<std::ptrdiff_t>(0, about[1] - search); j <= std::min(image.extent(1) - 1, about[1] + search);
             ++j) {
            const double power = intensity(image(i, j));
            highest = std::max(highest, power);
            if (power > best_power && is_local_maximum(image, {i, j})) {
                best = {i, j};
                best_power = power;
            }
        }
    const std::string where = " within " + std::to_string(search) + " pixels of " + pixel_text(about);
    if (highest == 0.0) throw NumericalError("image: expected a target, got only zeros" + where);
    if (best_power == 0.0) throw NumericalError("image: expected a local maximum, got none" + where);
    return best;
}

/// The part of the image about a target, odd extents, and where its bands lie.
struct Chip {
    ImageView samples;
    Pixel begin{};
    std::array<double, 2> band_centre{};
};

Chip cut_chip(const ImageView& image, const Pixel& peak, std::ptrdiff_t largest) {
    Chip out{image, {}, {}};
    for (const std::size_t d : {0U, 1U}) {
        std::ptrdiff_t count = std::min(largest, image.extent(d));
        if (count % 2 == 0) --count;
        // At the border the chip is moved, not shortened.
        out.begin[d] = std::clamp<std::ptrdiff_t>(peak[d] - count / 2, 0, image.extent(d) - count);
        if (peak[d] >= out.begin[d] + count) out.begin[d] = image.extent(d) - count;
        out.samples = out.samples.slice(d, out.begin[d], count);
    }
    for (std::ptrdiff_t i = 0; i < out.samples.extent(0); ++i)
        for (std::ptrdiff_t j = 0; j < out.samples.extent(1); ++j)
            if (!std::isfinite(intensity(out.samples(i, j))))
                throw NumericalError("image: expected finite samples, got NaN or infinity at " +
                                     pixel_text({out.begin[0] + i, out.begin[1] + j}));
    return out;
}

/// Power spectrum along dimension d of the lines next to the peak, averaged over 1/64 of the band.
std::vector<double> smooth_spectrum(const Chip& chip, std::size_t d, const Pixel& peak) {
    const std::ptrdiff_t n = chip.samples.extent(d);
    const std::size_t other = 1 - d;
    const fft::Plan<double> plan(n, fft::Direction::forward);
    Array<cdouble, 1> line({n});
    std::vector<double> power(static_cast<std::size_t>(n), 0.0);
    const std::ptrdiff_t centre = peak[other] - chip.begin[other];
    for (std::ptrdiff_t k = std::max<std::ptrdiff_t>(0, centre - 2); k <= std::min(chip.samples.extent(other) - 1, centre + 2); ++k) {
        for (std::ptrdiff_t i = 0; i < n; ++i) line(i) = cdouble(d == 0 ? chip.samples(i, k) : chip.samples(k, i));
        plan.execute(line.data());
        for (std::ptrdiff_t i = 0; i < n; ++i) power[static_cast<std::size_t>(i)] += std::norm(line(i));
    }
    const std::ptrdiff_t half = std::max<std::ptrdiff_t>(1, n / 128);
    std::vector<double> smooth(power.size(), 0.0);
    for (std::ptrdiff_t i = 0; i < n; ++i)
        for (std::ptrdiff_t k = i - half; k <= i + half; ++k)
            smooth[static_cast<std::size_t>(i)] += power[static_cast<std::size_t>((k + n) % n)];
    return smooth;
}

/// Cycles per sample: half a turn from the emptiest part of the spectrum. A gap opposite zero frequency, where images usually have it, goes
/// before an emptier one: interference of two targets can hollow out any part of a band. Without a gap, 0.
double find_band_centre(const Chip& chip, std::size_t d, const Pixel& peak) {
    const std::vector<double> spectrum = smooth_spectrum(chip, d, peak);
    double mean = 0.0;
    for (const double power : spectrum) mean += power / static_cast<double>(spectrum.size());
    const double gap = 0.25 * mean;  // 6 dB: three standard deviations for 16 independent looks at a full band
    if (spectrum[spectrum.size() / 2] < gap) return 0.0;
    const auto n = static_cast<std::ptrdiff_t>(spectrum.size());
    const std::ptrdiff_t lowest = std::min_element(spectrum.begin(), spectrum.end()) - spectrum.begin();
    if (spectrum[static_cast<std::size_t>(lowest)] >= gap) return 0.0;
    const auto is_empty = [&](std::ptrdiff_t k) { return spectrum[static_cast<std::size_t>((k % n + n) % n)] < gap; };
    std::ptrdiff_t first = lowest;
    std::ptrdiff_t last = lowest;
    while (last - first < n && is_empty(first - 1)) --first;
    while (last - first < n && is_empty(last + 1)) ++last;
    const double middle = 0.5 * static_cast<double>(first + last) / static_cast<double>(n);
    return middle - std::floor(middle) - 0.5;
}

/// Band-limited interpolation of n samples (odd) at position t, value = sum of weight i times sample i: periodic about the carrier.
Weights interpolation_weights(std::ptrdiff_t n, double band_centre, double t) {
    const auto length = static_cast<double>(n);
    const double carrier = two_pi * band_centre;
    Weights out(static_cast<std::size_t>(n));
    for (std::ptrdiff_t i = 0; i < n; ++i) {
        const double x = t - static_cast<double>(i);
        const double below = length * std::sin(pi * x / length);
        const double kernel = std::abs(below) < 1e-9 ? 1.0 : std::sin(pi * x) / below;
        out[static_cast<std::size_t>(i)] = std::polar(1.0, carrier * x) * kernel;
    }
    return out;
}

cdouble weighted_sum(const Weights& weights, const ArrayView<const cfloat, 1>& samples) {
    double re = 0.0;
    double im = 0.0;
    for (std::ptrdiff_t i = 0; i < samples.extent(0); ++i) {
        const cdouble w = weights[static_cast<std::size_t>(i)];
        const cfloat x = samples(i);
        re += w.real() * x.real() - w.imag() * x.imag();
        im += w.real() * x.imag() + w.imag() * x.real();
    }
    return {re, im};
}

cdouble weighted_sum(const Weights& weights, const Array<cdouble, 1>& samples) {
    cdouble sum = 0.0;
    for (std::ptrdiff_t i = 0; i < samples.extent(0); ++i) sum += weights[static_cast<std::size_t>(i)] * samples(i);
    return sum;
}

/// The line along dimension d at position t (pixels of the chip) of the other dimension.
Array<cdouble, 1> line_at(const Chip& chip, std::size_t d, double t) {
    const std::size_t other = 1 - d;
    const Weights weights = interpolation_weights(chip.samples.extent(other), chip.band_centre[other], t);
    Array<cdouble, 1> out({chip.samples.extent(d)});
    for (std::ptrdiff_t i = 0; i < out.extent(0); ++i)
        out(i) = weighted_sum(weights, d == 0 ? chip.samples.row(i) : chip.samples.column(i));
    return out;
}

/// Vertex of the parabola through equidistant powers, relative to the middle one, in samples; the middle one is the largest.
double vertex(double before, double middle, double behind) {
    const double curvature = before - 2.0 * middle + behind;
    return curvature < 0.0 ? 0.5 * (before - behind) / curvature : 0.0;
}

/// The strongest of (2 half + 1)^2 points `step` apart about `about`, then the vertex of parabolas through it, pixels of the chip.
std::array<double, 2> refine(const Chip& chip, const std::array<double, 2>& about, std::ptrdiff_t half, double step) {
    const std::ptrdiff_t side = 2 * half + 1;
    std::vector<Weights> azimuth;
    for (std::ptrdiff_t f = -half; f <= half; ++f)
        azimuth.push_back(interpolation_weights(chip.samples.extent(0), chip.band_centre[0], about[0] + static_cast<double>(f) * step));
    Array<double, 2> power({side, side});
    Pixel best{half, half};
    for (std::ptrdiff_t g = 0; g < side; ++g) {
        const Array<cdouble, 1> line = line_at(chip, 0, about[1] + static_cast<double>(g - half) * step);
        for (std::ptrdiff_t f = 0; f < side; ++f) {
            power(f, g) = std::norm(weighted_sum(azimuth[static_cast<std::size_t>(f)], line));
            if (power(f, g) > power(best[0], best[1])) best = {f, g};
        }
    }
    std::array<double, 2> out{};
    for (const std::size_t d : {0U, 1U}) {
        double offset = static_cast<double>(best[d] - half);
        if (best[d] > 0 && best[d] < side - 1) {
            const auto at = [&](std::ptrdiff_t k) { return d == 0 ? power(best[0] + k, best[1]) : power(best[0], best[1] + k); };
            offset += vertex(at(-1), at(0), at(1));
        }
        out[d] = std::clamp(about[d] + offset * step, 0.0, static_cast<double>(chip.samples.extent(d) - 1));
    }
    return out;
}

Cut upsampled_cut(const Chip& chip, std::size_t d, const std::array<double, 2>& peak, double peak_power, std::ptrdiff_t upsample) {
    Array<cdouble, 1> line = line_at(chip, d, peak[1 - d]);
    // To base band first: the centre need not lie on a bin, and powers do not know the difference.
    for (std::ptrdiff_t i = 0; i < line.extent(0); ++i) line(i) *= std::polar(1.0, -two_pi * chip.band_centre[d] * static_cast<double>(i));
    const signal::LineUpsampler<double> upsampler(line.extent(0), upsample);
    Array<cdouble, 1> fine({upsampler.output_length()});
    upsampler.apply(line.view(), fine.view());
    Cut out;
    out.step = 1.0 / static_cast<double>(upsample);
    out.peak = peak[d] * static_cast<double>(upsample);
    out.peak_power = peak_power;
    // What lies behind the last sample leads back to the first one.
    for (std::ptrdiff_t i = 0; i <= (line.extent(0) - 1) * upsample; ++i) out.power.push_back(std::norm(fine(i)));
    return out;
}

Verdict judge(const AxisResponse& r, bool clipped, const PointResponseOptions& options) {
    if (clipped) return Verdict::clipped_by_edge;
    if (r.irw_cells > (1.0 + options.irw_tolerance) * r.theory_irw_cells) return Verdict::broadened;
    const bool high = r.pslr_db > r.theory_pslr_db + options.sidelobe_tolerance;
    if (high && std::abs(r.pslr_left_db - r.pslr_right_db) > options.sidelobe_tolerance) return Verdict::asymmetric;
    if (high || r.islr_db > r.theory_islr_db + options.sidelobe_tolerance) return Verdict::high_sidelobes;
    return Verdict::good;
}

/// The samples of the cut inside the extent, as amplitudes relative to the peak.
void keep_cut(const Cut& cut, std::ptrdiff_t begin, AxisResponse& out) {
    const auto first = static_cast<std::ptrdiff_t>(std::ceil(cut.peak - out.extent[0] / cut.step - 1e-6));
    const auto last = static_cast<std::ptrdiff_t>(std::floor(cut.peak + out.extent[1] / cut.step + 1e-6));
    for (std::ptrdiff_t i = first; i <= last; ++i) out.cut.push_back(std::sqrt(cut.power[static_cast<std::size_t>(i)] / cut.peak_power));
    out.cut_step = cut.step;
    out.cut_start = static_cast<double>(begin) + static_cast<double>(first) * cut.step;
}

AxisResponse measure_axis(const Cut& cut, std::size_t d, const Chip& chip, std::ptrdiff_t image_extent,
                          const PointResponseOptions& options) {
    const AxisOptions& axis = d == 0 ? options.azimuth : options.range;
    const double lobes = static_cast<double>(options.lobes);
    const Cut ideal = detail::theoretical_cut(axis.window, 1.0 / static_cast<double>(options.upsample), lobes + 8.0);
    const MainLobe ideal_lobe = detail::main_lobe(ideal, (std::string(axis_names[d]) + " window").c_str());
    const MainLobe lobe = detail::main_lobe(cut, axis_names[d]);
    const double null_cells = ideal_lobe.nulls[1];
    const bool known = axis.oversampling > 0.0;
    const double cell = known ? axis.oversampling : 0.5 * (lobe.nulls[0] + lobe.nulls[1]) / null_cells;

    AxisResponse out;
    const double reach = (null_cells + lobes) * cell;
    const auto last = static_cast<double>(chip.samples.extent(d) - 1);
    const double at = cut.peak * cut.step;
    out.extent = {std::min(reach, at), std::min(reach, last - at)};
    const bool clipped_before = out.extent[0] < reach;
    const bool clipped_behind = out.extent[1] < reach;
    // An odd chip may leave out the last pixel of an even image.
    const bool more_before = chip.begin[d] > 1;
    const bool more_behind = chip.begin[d] + chip.samples.extent(d) + 1 < image_extent;
    if ((clipped_before && more_before) || (clipped_behind && more_behind))
        throw ValueError("chip",
                         "at least " + std::to_string(static_cast<std::ptrdiff_t>(std::ceil(2.0 * reach)) + 3) + " pixels for " +
                             std::to_string(options.lobes) + " side lobes in " + axis_names[d],
                         std::to_string(options.chip));

    const SideLobes sides = detail::side_lobes(cut, lobe, out.extent);
    const SideLobes ideal_sides = detail::side_lobes(ideal, ideal_lobe, {out.extent[0] / cell, out.extent[1] / cell});
    out.position = static_cast<double>(chip.begin[d]) + at;
    out.irw = lobe.width;
    out.irw_cells = known ? lobe.width / cell : std::numeric_limits<double>::quiet_NaN();
    out.pslr_left_db = sides.pslr_db[0];
    out.pslr_right_db = sides.pslr_db[1];
    out.pslr_db = std::max(sides.pslr_db[0], sides.pslr_db[1]);
    out.islr_db = sides.islr_db;
    out.nulls = lobe.nulls;
    out.theory_irw_cells = ideal_lobe.width;
    out.theory_pslr_db = std::max(ideal_sides.pslr_db[0], ideal_sides.pslr_db[1]);
    out.theory_islr_db = ideal_sides.islr_db;
    out.verdict = judge(out, clipped_before || clipped_behind, options);
    keep_cut(cut, chip.begin[d], out);
    return out;
}

}  // namespace

const char* verdict_text(Verdict verdict) {
    switch (verdict) {
        case Verdict::clipped_by_edge:
            return "clipped_by_edge";
        case Verdict::broadened:
            return "broadened";
        case Verdict::asymmetric:
            return "asymmetric";
        case Verdict::high_sidelobes:
            return "high_sidelobes";
        case Verdict::good:
            break;
    }
    return "good";
}

PointResponse point_response(const ImageView& image, std::array<double, 2> position, const PointResponseOptions& options) {
    validate(options);
    if (image.extent(0) < smallest_extent || image.extent(1) < smallest_extent)
        throw ShapeError("image", "at least 8 pixels along each axis", shape_text(image.extents()));
    const Pixel pixel = strongest_local_maximum(image, nearest_pixel(image, position), options.search);
    Chip chip = cut_chip(image, pixel, options.chip);
    for (const std::size_t d : {0U, 1U}) {
        const double given = (d == 0 ? options.azimuth : options.range).band_centre;
        chip.band_centre[d] = std::isnan(given) ? find_band_centre(chip, d, pixel) : given;
    }
    // Steps of a quarter pixel about the strongest pixel, then of 1 / upsample about the best of them.
    const auto local = [&](std::size_t d) { return static_cast<double>(pixel[d] - chip.begin[d]); };
    std::array<double, 2> peak = refine(chip, {local(0), local(1)}, 4, 0.25);
    peak = refine(chip, peak, options.upsample / 4 + 1, 1.0 / static_cast<double>(options.upsample));

    const cdouble value =
        weighted_sum(interpolation_weights(chip.samples.extent(0), chip.band_centre[0], peak[0]), line_at(chip, 0, peak[1]));
    PointResponse out;
    out.amplitude = std::abs(value);
    out.phase = std::arg(value);
    for (const std::size_t d : {0U, 1U}) {
        const Cut cut = upsampled_cut(chip, d, peak, std::norm(value), options.upsample);
        (d == 0 ? out.azimuth : out.range) = measure_axis(cut, d, chip, image.extent(d), options);
    }
    out.verdict = std::min(out.azimuth.verdict, out.range.verdict);
    return out;
}

}  // namespace sarfocus::quality
