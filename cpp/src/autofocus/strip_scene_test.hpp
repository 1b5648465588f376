#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <random>
#include <vector>

#include <sarfocus/autofocus/phase_estimate.hpp>
#include <sarfocus/autofocus/strip.hpp>
#include <sarfocus/core/array.hpp>
#include <sarfocus/core/constants.hpp>
#include <sarfocus/focus/azimuth.hpp>
#include <sarfocus/geometry/stripmap_geometry.hpp>
#include <sarfocus/sim/stripmap.hpp>

/// Strips and apertures that the tests of the stripmap methods share.
namespace sarfocus::autofocus::test {

using Image = Array<cfloat, 2>;

inline std::size_t at(std::ptrdiff_t i) {
    return static_cast<std::size_t>(i);
}

/// Apertures of about 208 samples, 10 % of oversampling; `band` Hz of the 240 that the prf holds.
inline geometry::StripmapGeometry strip_geometry(std::ptrdiff_t n_range, double band = 200.0, double doppler_centroid = 0.0,
                                                 double range_step = 0.5, double first_range = 4000.0) {
    geometry::StripmapGeometry out;
    out.wavelength = 0.03125;
    out.prf = 240.0;
    out.velocity = 120.0;
    out.doppler_bandwidth = band;
    out.doppler_centroid = doppler_centroid;
    for (std::ptrdiff_t g = 0; g < n_range; ++g) out.slant_range.push_back(first_range + range_step * static_cast<double>(g));
    return out;
}

struct Target {
    double azimuth = 0.0;
    double range = 0.0;
    double db = 30.0;  ///< of the peak, over 1
};

struct Strip {
    geometry::StripmapGeometry geometry;
    std::vector<Target> targets;
    Image focused;
    Image blurred;
};

inline Image compressed(const Image& raw, const geometry::StripmapGeometry& geometry) {
    Image out(raw.extents());
    focus::azimuth_compress(raw.view(), geometry, out.view());
    return out;
}

/// Targets with random phases in band-limited clutter, without and with the phase error.
inline Strip make_strip(const geometry::StripmapGeometry& geometry, std::ptrdiff_t n, const std::vector<Target>& targets,
                        const std::vector<double>& phase, double clutter_power = 0.0, unsigned seed = 1) {
    std::mt19937 bits(seed);
    Strip out{geometry, targets, {}, {}};
    Array<double, 2> pixels({static_cast<std::ptrdiff_t>(targets.size()), 2});
    Array<cdouble, 1> reflectivity({static_cast<std::ptrdiff_t>(targets.size())});
    for (std::size_t t = 0; t < targets.size(); ++t) {
        const auto i = static_cast<std::ptrdiff_t>(t);
        pixels(i, 0) = targets[t].azimuth;
        pixels(i, 1) = targets[t].range;
        reflectivity(i) = std::polar(std::pow(10.0, targets[t].db / 20.0), two_pi * static_cast<double>(bits()) / 4294967296.0);
    }
    Image raw({n, static_cast<std::ptrdiff_t>(geometry.slant_range.size())});
    sim::StripmapTargets all;
    all.pixels = std::as_const(pixels).view();
    all.reflectivity = std::as_const(reflectivity).view();
    sim::StripmapOptions options;
    options.clutter_power = clutter_power;
    options.effects.seed = seed;
    sim::stripmap(geometry, all, raw.view(), options);
    out.focused = compressed(raw, geometry);
    for (std::ptrdiff_t k = 0; k < n; ++k)
        for (std::ptrdiff_t g = 0; g < raw.extent(1); ++g) raw(k, g) = cfloat(cdouble(raw(k, g)) * std::polar(1.0, phase[at(k)]));
    out.blurred = compressed(raw, geometry);
    return out;
}

/// `count` targets evenly along azimuth, each in a gate of its own as far as there are gates.
inline std::vector<Target> spread_targets(int count, std::ptrdiff_t n, std::ptrdiff_t n_range, double db) {
    std::vector<Target> out;
    for (int t = 0; t < count; ++t)
        out.push_back({std::floor((t + 0.5) * static_cast<double>(n) / count), static_cast<double>((5 + 7 * t) % n_range), db});
    return out;
}

/// Some turns of a few smooth waves: curvature that defocuses, slopes that displace by a few pixels.
inline std::vector<double> smooth_phase(std::ptrdiff_t n, double amplitude = 4.0, double cycles = 3.0) {
    std::vector<double> out;
    for (std::ptrdiff_t k = 0; k < n; ++k) {
        const double x = static_cast<double>(k) / static_cast<double>(n);
        out.push_back(amplitude * (std::sin(two_pi * cycles * x + 0.4) + 0.4 * std::cos(two_pi * 1.7 * cycles * x)));
    }
    return out;
}

/// RMS of a - b with constant and line removed, over the samples where `where` (if given) is finite.
inline double gauge_free_rms(const std::vector<double>& a, const std::vector<double>& b, const std::vector<double>& where = {}) {
    std::vector<double> error;
    for (std::size_t k = 0; k < a.size(); ++k)
        error.push_back(where.empty() || std::isfinite(where[k]) ? a[k] - b[k] : std::numeric_limits<double>::quiet_NaN());
    remove_linear(error);
    double sum = 0.0;
    double count = 0.0;
    for (const double e : error)
        if (std::isfinite(e)) {
            sum += e * e;
            count += 1.0;
        }
    return std::sqrt(sum / count);
}

inline bool same_bits(const Image& a, const Image& b) {
    return a.extents() == b.extents() && std::equal(a.begin(), a.end(), b.begin(), b.end());
}

/// One aperture of a made-up set.
struct Line {
    std::ptrdiff_t start = 0;
    std::ptrdiff_t count = 0;
    double slope = 0.0;     ///< b, rad a sample
    double constant = 0.0;  ///< a, rad
    double amplitude = 1.0;
    double noise = 0.0;  ///< power, independent from sample to sample
};

/// Dechirped lines A exp(j (phi(k) + a + b (k - azimuth))) + noise, all weights 1, points in the middle of their apertures, noise
/// independent from sample to sample (window and FM rate are such that a look is one sample).
inline Apertures make_apertures(const std::vector<Line>& lines, std::ptrdiff_t n_azimuth, const std::vector<double>& phase,
                                unsigned seed = 1, double fm_rate = 0.004, double window = 200.0) {
    std::mt19937 bits(seed);
    std::normal_distribution<double> normal(0.0, std::sqrt(0.5));
    Apertures out;
    std::ptrdiff_t longest = 1;
    for (const Line& line : lines) longest = std::max(longest, line.count);
    out.lines = Array<cfloat, 2>({static_cast<std::ptrdiff_t>(lines.size()), longest});
    out.weight = Array<float, 2>({static_cast<std::ptrdiff_t>(lines.size()), longest});
    out.n_azimuth = n_azimuth;
    out.window = window;
    for (std::size_t i = 0; i < lines.size(); ++i) {
        const Line& line = lines[i];
        out.start.push_back(line.start);
        out.count.push_back(line.count);
        out.fm_rate.push_back(fm_rate);
        StripPoint point;
        point.azimuth = line.start + line.count / 2;
        point.range = static_cast<std::int64_t>(i);
        point.contrast = 0.0;
        out.points.push_back(point);
        for (std::ptrdiff_t k = 0; k < line.count; ++k) {
            const double turn = (phase.empty() ? 0.0 : phase[at(line.start + k)]) + line.constant +
                                line.slope * static_cast<double>(line.start + k - point.azimuth);
            const cdouble noise = std::sqrt(line.noise) * cdouble(normal(bits), normal(bits));
            out.lines(static_cast<std::ptrdiff_t>(i), k) = cfloat(std::polar(line.amplitude, turn) + noise);
            out.weight(static_cast<std::ptrdiff_t>(i), k) = 1.0f;
        }
    }
    return out;
}

}  // namespace sarfocus::autofocus::test
