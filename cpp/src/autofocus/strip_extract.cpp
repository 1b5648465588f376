#include <sarfocus/autofocus/strip.hpp>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>

#include <sarfocus/core/checks.hpp>
#include <sarfocus/core/constants.hpp>
#include <sarfocus/core/error.hpp>
#include <sarfocus/fft/plan.hpp>
#include <sarfocus/signal/phasor.hpp>

#include "strip_lines.hpp"
#include "strip_window.hpp"

namespace sarfocus::autofocus {
namespace {

using detail::at;
using geometry::StripmapGeometry;

constexpr double faintest = 0.02;  // of the middle's power: below, an ideal point's signal says nothing

// A raised-cosine step down from 1 at x <= 1 - width to 0 at x >= 1.
double edge(double x, double width) {
    if (x <= 1.0 - width) return 1.0;
    return x < 1.0 ? 0.5 + 0.5 * std::cos(pi * (x - 1.0 + width) / width) : 0.0;
}

// Decompression of a piece of `length` samples, its middle at sample length / 2.
class PieceDecompressor {
public:
    PieceDecompressor(const StripmapGeometry& geometry, std::ptrdiff_t length, double taper)
        : length_(length),
          forward_(length, fft::Direction::forward),
          inverse_(length, fft::Direction::inverse),
          amplitude_(at(length)),
          squared_(at(length)) {
        const double centroid = geometry.doppler_centroid / geometry.prf;
        for (std::ptrdiff_t k = 0; k < length; ++k) {
            const double cycles = static_cast<double>(k) / static_cast<double>(length) - centroid;
            const double offset = geometry.prf * (cycles - std::floor(cycles + 0.5));
            squared_[at(k)] = offset * offset;
            amplitude_[at(k)] = static_cast<float>(edge(std::abs(offset) / (0.5 * geometry.doppler_bandwidth), taper));
        }
    }

    // In place: the tapered spectrum times exp(+j pi (f - fdc)^2 / K), back in time.
    void decompress(cfloat* piece, double fm_rate) const {
        forward_.execute(piece);
        apply(piece, fm_rate);
        inverse_.execute(piece);
    }

    // The decompressed signal of an ideal point in the middle of a piece.
    void ideal_point(cfloat* piece, double fm_rate) const {
        std::fill(piece, piece + length_, cfloat{});
        piece[length_ / 2] = 1.0f;
        decompress(piece, fm_rate);
    }

private:
    void apply(cfloat* spectrum, double fm_rate) const {
        for (std::ptrdiff_t k = 0; k < length_; ++k) {
            float real = 0.0f;
            float imag = 0.0f;
            signal::unit_phasor(0.5 / fm_rate * squared_[at(k)], real, imag);
            spectrum[k] *= amplitude_[at(k)] * cfloat(real, imag);
        }
    }

    std::ptrdiff_t length_;
    fft::Plan<float> forward_;
    fft::Plan<float> inverse_;
    std::vector<float> amplitude_;
    std::vector<double> squared_;
};

void require_points(const std::vector<StripPoint>& points, const ImageView& image) {
    for (const StripPoint& p : points)
        if (p.azimuth < 0 || p.azimuth >= image.extent(0) || p.range < 0 || p.range >= image.extent(1))
            throw ValueError("points", "pixels of the image " + shape_text(image.extents()),
                             "(" + std::to_string(p.azimuth) + ", " + std::to_string(p.range) + ")");
}

// The piece of image round a point, its outer quarters rounded off. What lies beyond the strip is zero.
void cut(const ImageView& image, const StripPoint& point, double window, std::ptrdiff_t length, cfloat* piece) {
    std::fill(piece, piece + length, cfloat{});
    const auto reach = static_cast<std::ptrdiff_t>(std::ceil(window));
    for (std::ptrdiff_t i = -reach; i <= reach; ++i) {
        const std::ptrdiff_t azimuth = point.azimuth + i;
        if (azimuth < 0 || azimuth >= image.extent(0)) continue;
        piece[length / 2 + i] = static_cast<float>(edge(std::abs(static_cast<double>(i)) / window, 0.25)) * image(azimuth, point.range);
    }
}

// Sum of intensity over 2 reach + 1 pixels, as far as the strip goes, less the clutter's share.
double energy_within(const ImageView& image, const StripPoint& point, std::ptrdiff_t reach, double clutter) {
    double sum = 0.0;
    for (std::ptrdiff_t i = std::max<std::ptrdiff_t>(point.azimuth - reach, 0); i < std::min(point.azimuth + reach + 1, image.extent(0));
         ++i)
        sum += std::norm(cdouble(image(i, point.range))) - clutter;
    return sum;
}

// Clutter power of the point's gate: the median over pieces of 64 pixels within three times the reach.
double clutter_beyond(const ImageView& image, const StripPoint& point, std::ptrdiff_t reach) {
    constexpr std::ptrdiff_t piece = 64;
    std::vector<double> means;
    const std::ptrdiff_t first = std::max<std::ptrdiff_t>(point.azimuth - 3 * reach, 0);
    const std::ptrdiff_t last = std::min(point.azimuth + 3 * reach, image.extent(0));
    for (std::ptrdiff_t begin = first; begin + piece <= last; begin += piece) {
        double sum = 0.0;
        for (std::ptrdiff_t i = begin; i < begin + piece; ++i) sum += std::norm(cdouble(image(i, point.range)));
        means.push_back(sum / static_cast<double>(piece));
    }
    if (means.empty()) return 0.0;
    const auto middle = means.begin() + static_cast<std::ptrdiff_t>(means.size() / 2);
    std::nth_element(means.begin(), middle, means.end());
    return *middle;
}

struct Reach {
    std::ptrdiff_t begin = 0;  // samples from the point
    std::ptrdiff_t end = 0;
};

// Where an ideal point is strong enough, as far as the strip goes.
Reach reach_of(const cfloat* ideal, double middle_power, std::ptrdiff_t length, const StripPoint& point, std::ptrdiff_t n_azimuth) {
    Reach out{0, 1};
    const std::ptrdiff_t half = length / 2;
    const auto strong = [&](std::ptrdiff_t i) { return std::norm(ideal[half + i]) > faintest * middle_power; };
    while (-out.begin < half && point.azimuth + out.begin > 0 && strong(out.begin - 1)) --out.begin;
    while (out.end < half && point.azimuth + out.end < n_azimuth && strong(out.end)) ++out.end;
    return out;
}

// Mean power over the central half of the aperture.
double power_of_the_middle(const cfloat* ideal, std::ptrdiff_t length, double aperture) {
    const auto reach = std::max<std::ptrdiff_t>(static_cast<std::ptrdiff_t>(0.25 * aperture), 1);
    double sum = 0.0;
    for (std::ptrdiff_t i = -reach; i <= reach; ++i) sum += std::norm(cdouble(ideal[length / 2 + i]));
    return sum / static_cast<double>(2 * reach + 1);
}

// Power of an ideal point over that of clutter, 1 where the aperture is even. Clutter of the piece has the apertures of its own pixels: its
// power is that of the ideal point, averaged over the window (over a box of the same area as the squared window).
std::vector<double> signal_to_noise(const cfloat* ideal, std::ptrdiff_t length, double window) {
    std::vector<double> sums(at(length + 1), 0.0);
    for (std::ptrdiff_t k = 0; k < length; ++k) sums[at(k + 1)] = sums[at(k)] + std::norm(cdouble(ideal[k]));
    const auto reach = static_cast<std::ptrdiff_t>(std::lround(0.84 * window));
    std::vector<double> out(at(length));
    for (std::ptrdiff_t k = 0; k < length; ++k) {
        const double noise = sums[at(std::min(k + reach + 1, length))] - sums[at(std::max<std::ptrdiff_t>(k - reach, 0))];
        const double signal = std::norm(cdouble(ideal[k]));
        out[at(k)] = noise > 0.0 ? signal * static_cast<double>(2 * reach + 1) / noise : 0.0;
    }
    return out;
}

}  // namespace

namespace detail {

int narrow_window(const StripmapGeometry& geometry) {
    return static_cast<int>(std::max(std::round(geometry.aperture_samples(geometry.slant_range.size() / 2) / 12.0), 32.0));
}

void require_strip_image(const ImageView& image, const StripmapGeometry& geometry) {
    geometry.validate();
    require_not_empty(image, "image");
    if (static_cast<std::ptrdiff_t>(geometry.slant_range.size()) != image.extent(1))
        throw ShapeError("image",
                         "(n_azimuth, " + std::to_string(geometry.slant_range.size()) + "), a column for every slant_range of the geometry",
                         shape_text(image.extents()));
    constexpr double steepest = 0.1;  // sine of the squint or of the half beam: beyond, slow time and Doppler no longer answer linearly
    const double squint = geometry.wavelength * geometry.doppler_centroid / (2.0 * geometry.velocity);
    if (std::abs(squint) > steepest)
        throw ValueError("doppler_centroid", "a squint whose sine lambda fdc / (2 v) is at most 0.1: the method is made for small squint",
                         number_text(squint));
    const double beam = geometry.wavelength * geometry.doppler_bandwidth / (4.0 * geometry.velocity);
    if (beam > steepest) throw ValueError("doppler_bandwidth", "a half beam whose sine lambda B / (4 v) is at most 0.1", number_text(beam));
    for (const std::size_t gate : {std::size_t{0}, geometry.slant_range.size() - 1})
        if (geometry.aperture_samples(gate) < 32.0)
            throw ValueError("geometry", "apertures of at least 32 azimuth samples", number_text(geometry.aperture_samples(gate)));
}

}  // namespace detail

void StripExtractOptions::validate() const {
    if (window < 0) throw ValueError("window", "0 (what holds the points) or a number of pixels", std::to_string(window));
    if (!(taper >= 0.0 && taper <= 1.0)) throw ValueError("taper", "a share from 0 to 1", number_text(taper));
    (void)resolve_threads(execution.threads);
}

int containing_window(const ImageView& image, const StripmapGeometry& geometry, const std::vector<StripPoint>& points) {
    detail::require_strip_image(image, geometry);
    require_points(points, image);
    int window = detail::narrow_window(geometry);
    constexpr int doublings = 3;
    const double aperture = geometry.aperture_samples(geometry.slant_range.size() / 2);
    for (int i = 0; i < doublings && 4.0 * window < aperture; ++i, window *= 2) {
        std::size_t spilled = 0;
        for (const StripPoint& p : points) {
            const double clutter = clutter_beyond(image, p, 4 * window);
            const double inside = energy_within(image, p, window, clutter);
            const double around = energy_within(image, p, 2 * window, clutter);
            if (inside < 0.94 * around) ++spilled;
        }
        if (2 * spilled <= points.size()) break;
    }
    return window;
}

Apertures extract_apertures(const ImageView& image, const StripmapGeometry& geometry, const std::vector<StripPoint>& points,
                            const StripExtractOptions& options) {
    options.validate();
    detail::require_strip_image(image, geometry);
    require_points(points, image);
    Apertures out;
    out.points = points;
    std::stable_sort(out.points.begin(), out.points.end(), [](const StripPoint& a, const StripPoint& b) {
        return a.azimuth != b.azimuth ? a.azimuth < b.azimuth : a.range < b.range;
    });
    out.n_azimuth = image.extent(0);
    out.window = options.window > 0 ? options.window : containing_window(image, geometry, out.points);
    out.taper = options.taper;
    double longest = 0.0;
    for (const StripPoint& p : out.points) {
        const double rate = geometry.fm_rate(at(p.range));
        out.fm_rate.push_back(rate / (geometry.prf * geometry.prf));
        longest = std::max(longest, geometry.aperture_samples(at(p.range)));
    }
    const std::ptrdiff_t n = out.size();
    const auto length = fft::good_size(static_cast<std::ptrdiff_t>(1.2 * longest + 2.0 * out.window) + 64);
    const auto sample_limit = static_cast<std::ptrdiff_t>(std::ceil(1.2 * longest)) + 1;
    require_memory(static_cast<std::uint64_t>(n * sample_limit) * (sizeof(cfloat) + sizeof(float)), "the signals of the strong points");
    out.lines = Array<cfloat, 2>({n, sample_limit});
    out.weight = Array<float, 2>({n, sample_limit});
    out.start.assign(at(n), 0);
    out.count.assign(at(n), 0);
    if (n == 0) return out;

    const PieceDecompressor decompressor(geometry, length, options.taper);
    parallel_for(options.execution, "extract", n, [&](std::int64_t i) {
        const StripPoint& point = out.points[at(i)];
        const double rate = geometry.fm_rate(at(point.range));
        Array<cfloat, 1> piece({length});
        Array<cfloat, 1> ideal({length});
        cut(image, point, out.window, length, piece.data());
        decompressor.decompress(piece.data(), rate);
        decompressor.ideal_point(ideal.data(), rate);
        const double middle = power_of_the_middle(ideal.data(), length, geometry.aperture_samples(at(point.range)));
        const Reach reach = reach_of(ideal.data(), middle, length, point, out.n_azimuth);
        const std::vector<double> weight = signal_to_noise(ideal.data(), length, out.window);
        out.start[at(i)] = point.azimuth + reach.begin;
        out.count[at(i)] = std::min(reach.end - reach.begin, sample_limit);
        for (std::ptrdiff_t k = 0; k < out.count[at(i)]; ++k) {
            const cfloat expected = ideal(length / 2 + reach.begin + k);
            const cfloat value = piece(length / 2 + reach.begin + k) * std::conj(expected) / std::norm(expected);
            if (!(std::isfinite(value.real()) && std::isfinite(value.imag())))
                throw NumericalError("image: expected finite pixels, got NaN or infinity within " +
                                     std::to_string(std::lround(out.window)) + " azimuth pixels of [" + std::to_string(point.azimuth) +
                                     ", " + std::to_string(point.range) + "]");
            out.lines(i, k) = value;
            out.weight(i, k) = static_cast<float>(weight[at(length / 2 + reach.begin + k)]);
        }
        out.points[at(i)].contrast = aperture_contrast(out, i);
    });
    return out;
}

double aperture_contrast(const Apertures& apertures, std::ptrdiff_t n) {
    if (n < 0 || n >= apertures.size())
        throw ValueError("n", "a point from 0 to " + std::to_string(apertures.size() - 1), std::to_string(n));
    double amplitude = 0.0;
    double power = 0.0;
    double count = 0.0;
    for (std::ptrdiff_t k = 0; k < apertures.count[at(n)]; ++k) {
        if (apertures.weight(n, k) < 0.5f) continue;
        const double value = std::norm(cdouble(apertures.lines(n, k)));
        amplitude += std::sqrt(value);
        power += value;
        count += 1.0;
    }
    return power > 0.0 ? std::max(0.0, 1.0 - amplitude * amplitude / (count * power)) : 1.0;
}

}  // namespace sarfocus::autofocus
