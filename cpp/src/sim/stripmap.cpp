#include <sarfocus/sim/stripmap.hpp>

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstdint>
#include <string>
#include <vector>

#include <sarfocus/core/array.hpp>
#include <sarfocus/core/checks.hpp>
#include <sarfocus/core/constants.hpp>
#include <sarfocus/fft/plan.hpp>

#include "sim/point_arguments.hpp"
#include "sim/random.hpp"
#include "sim/stripmap_arguments.hpp"

namespace sarfocus::sim {
namespace {

using geometry::StripmapGeometry;

// Neighbouring gates of a row-major image share cache lines: one thread takes eight.
constexpr std::int64_t gates_of_a_chunk = 8;

struct Target {
    double azimuth;
    cdouble reflectivity;
};

// The targets of every range gate, in the caller's order.
std::vector<std::vector<Target>> targets_of_gates(const StripmapTargets& targets, std::ptrdiff_t n_range) {
    std::vector<std::vector<Target>> out(static_cast<std::size_t>(n_range));
    for (std::ptrdiff_t t = 0; t < targets.reflectivity.extent(0); ++t) {
        const double gate = targets.pixels(t, 1);
        if (!(gate >= 0.0 && gate <= static_cast<double>(n_range - 1)) || gate != std::floor(gate))
            throw ValueError("targets[" + std::to_string(t) + ", 1]", "a whole range gate from 0 to " + std::to_string(n_range - 1),
                             number_text(gate));
        out[static_cast<std::size_t>(gate)].push_back({targets.pixels(t, 0), targets.reflectivity(t)});
    }
    return out;
}

// A bin within the Doppler band: its place in the transform, and its frequency over the prf, less the centroid.
struct BandBin {
    std::ptrdiff_t bin;
    double offset;
};

std::vector<BandBin> band_bins(const StripmapGeometry& geometry, std::ptrdiff_t n) {
    const double centroid = geometry.doppler_centroid / geometry.prf;
    const double half = 0.5 * geometry.doppler_bandwidth / geometry.prf;
    std::vector<BandBin> out;
    for (std::ptrdiff_t k = 0; k < n; ++k) {
        const double cycles = static_cast<double>(k) / static_cast<double>(n) - centroid;
        const double offset = cycles - std::floor(cycles + 0.5);
        if (offset >= -half && offset < half) out.push_back({k, offset});
    }
    return out;
}

// Spectrum of the compressed band-limited targets and clutter of one gate, then spread by the conjugate of the compression filter.
class BandLimitedGate {
public:
    BandLimitedGate(const StripmapGeometry& geometry, std::ptrdiff_t n)
        : geometry_(geometry), n_(n), bins_(band_bins(geometry, n)), inverse_(n, fft::Direction::inverse) {
        if (bins_.empty())
            throw ValueError("doppler_bandwidth",
                             "at least prf / n_azimuth = " + number_text(geometry.prf / static_cast<double>(n)) + " Hz",
                             number_text(geometry.doppler_bandwidth));
    }

    void add(std::vector<cdouble>& line, std::ptrdiff_t gate, const std::vector<Target>& targets, double clutter_power,
             std::uint64_t seed) const {
        Array<cdouble, 1> spectrum({n_});
        const auto count = static_cast<double>(bins_.size());
        const double clutter = std::sqrt(clutter_power / count);
        const double rate = geometry_.fm_rate(static_cast<std::size_t>(gate)) / (geometry_.prf * geometry_.prf);
        for (const auto& [bin, offset] : bins_) {
            cdouble sum = 0.0;
            const double cycles = offset + geometry_.doppler_centroid / geometry_.prf;
            for (const Target& target : targets)
                sum += target.reflectivity * std::polar(1.0 / count, -two_pi * std::remainder(cycles * target.azimuth, 1.0));
            if (clutter > 0.0) sum += clutter * complex_normal(seed, Stream::clutter, static_cast<std::uint64_t>(gate * n_ + bin));
            spectrum.data()[bin] = sum * std::polar(1.0, two_pi * std::remainder(0.5 * offset * offset / rate, 1.0));
        }
        inverse_.execute(spectrum.data());
        for (std::ptrdiff_t i = 0; i < n_; ++i) line[static_cast<std::size_t>(i)] += spectrum.data()[i];
    }

private:
    const StripmapGeometry& geometry_;
    std::ptrdiff_t n_;
    std::vector<BandBin> bins_;
    fft::Plan<double> inverse_;
};

void add_chirp(std::vector<cdouble>& line, const StripmapGeometry& geometry, std::ptrdiff_t gate, const Target& target) {
    const auto g = static_cast<std::size_t>(gate);
    const double rate = geometry.fm_rate(g) / (geometry.prf * geometry.prf);
    const double centroid = geometry.doppler_centroid / geometry.prf;
    const double reach = 0.5 * geometry.aperture_samples(g);
    const auto n = static_cast<double>(line.size());
    const auto first = static_cast<std::ptrdiff_t>(std::clamp(std::ceil(target.azimuth - reach), 0.0, n));
    const auto last = static_cast<std::ptrdiff_t>(std::clamp(std::floor(target.azimuth + reach) + 1.0, 0.0, n));
    const cdouble amplitude =
        target.reflectivity * std::polar(1.0 / std::sqrt(geometry.doppler_bandwidth * geometry.aperture_time(g)), 0.25 * pi);
    for (std::ptrdiff_t i = first; i < last; ++i) {
        const double x = static_cast<double>(i) - target.azimuth;
        line[static_cast<std::size_t>(i)] += amplitude * std::polar(1.0, two_pi * std::remainder(centroid * x - 0.5 * rate * x * x, 1.0));
    }
}

}  // namespace

void stripmap(const StripmapGeometry& geometry, const StripmapTargets& targets, const MutableImageView& out,
              const StripmapOptions& options) {
    require_strip(geometry, targets, options.effects, out);
    require_noise_power(options.clutter_power, "clutter_power");
    const std::ptrdiff_t n = out.extent(0);
    const auto by_gate = targets_of_gates(targets, out.extent(1));
    const BandLimitedGate band_limited(geometry, n);
    const bool chirps = options.model == StripmapModel::chirp;

    parallel_for(
        options.execution, "stripmap", out.extent(1),
        [&](std::int64_t gate) {
            const auto& here = by_gate[static_cast<std::size_t>(gate)];
            std::vector<cdouble> line(static_cast<std::size_t>(n));
            if (chirps)
                for (const Target& target : here) add_chirp(line, geometry, gate, target);
            const bool spectral = (!chirps && !here.empty()) || options.clutter_power > 0.0;
            if (spectral) band_limited.add(line, gate, chirps ? std::vector<Target>() : here, options.clutter_power, options.effects.seed);
            const double noise = std::sqrt(options.effects.noise_power);
            for (std::ptrdiff_t i = 0; i < n; ++i) {
                cdouble value = line[static_cast<std::size_t>(i)] * phase_error_factor(options.effects, i);
                if (noise > 0.0)
                    value +=
                        noise * complex_normal(options.effects.seed, Stream::noise, static_cast<std::uint64_t>(i * out.extent(1) + gate));
                out(i, gate) = cfloat(value);
            }
        },
        gates_of_a_chunk);
}

}  // namespace sarfocus::sim
