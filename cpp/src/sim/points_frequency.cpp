#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include <sarfocus/core/array.hpp>
#include <sarfocus/core/checks.hpp>
#include <sarfocus/core/constants.hpp>
#include <sarfocus/core/multiversion.hpp>
#include <sarfocus/signal/phasor.hpp>
#include <sarfocus/sim/points.hpp>

#include "sim/echo_line.hpp"
#include "sim/point_arguments.hpp"

namespace sarfocus::sim {
namespace {

// The phasor of frequency 16 b + l is that of 16 b times that of l: two short tables for each scatterer instead of a phasor for each
// frequency, and every entry of both exact to single precision (a recurrence would drift).
constexpr std::ptrdiff_t lanes = 16;
constexpr std::ptrdiff_t targets_of_a_block = 256;

struct Target {
    double start;  // turns at the first frequency
    double step;   // turns from one frequency to the next
    float real;
    float imag;
};

// sums_real, sums_imag[16 * n_block] += amplitude * exp(2j pi (start + step m)) over the targets; coarse: scratch of 2 * n_block.
SARFOCUS_MULTIVERSION void add_targets(const Target* targets, std::ptrdiff_t n_target, std::ptrdiff_t n_block, float* sums_real,
                                       float* sums_imag, float* coarse) {
    float* coarse_real = coarse;
    float* coarse_imag = coarse + n_block;
    float fine_real[lanes];
    float fine_imag[lanes];
    for (std::ptrdiff_t t = 0; t < n_target; ++t) {
        const Target target = targets[t];
        for (std::ptrdiff_t l = 0; l < lanes; ++l) signal::unit_phasor(target.step * static_cast<double>(l), fine_real[l], fine_imag[l]);
        for (std::ptrdiff_t b = 0; b < n_block; ++b) {
            float c = 0.0f;
            float s = 0.0f;
            signal::unit_phasor(target.start + target.step * static_cast<double>(lanes * b), c, s);
            coarse_real[b] = target.real * c - target.imag * s;
            coarse_imag[b] = target.real * s + target.imag * c;
        }
        for (std::ptrdiff_t b = 0; b < n_block; ++b) {
            const float re = coarse_real[b];
            const float im = coarse_imag[b];
            float* to_real = sums_real + lanes * b;
            float* to_imag = sums_imag + lanes * b;
            for (std::ptrdiff_t l = 0; l < lanes; ++l) {
                to_real[l] += re * fine_real[l] - im * fine_imag[l];
                to_imag[l] += re * fine_imag[l] + im * fine_real[l];
            }
        }
    }
}

// One pulse: block after block of targets, each summed in single precision, into the double-precision line.
void add_history(const std::vector<Target>& targets, std::vector<cdouble>& line) {
    const auto n_frequency = static_cast<std::ptrdiff_t>(line.size());
    const std::ptrdiff_t n_block = (n_frequency + lanes - 1) / lanes;
    Array<float, 1> sums({2 * lanes * n_block});
    Array<float, 1> coarse({2 * n_block});
    float* real = sums.data();
    float* imag = sums.data() + lanes * n_block;
    const auto n_target = static_cast<std::ptrdiff_t>(targets.size());
    for (std::ptrdiff_t first = 0; first < n_target; first += targets_of_a_block) {
        std::fill(sums.begin(), sums.end(), 0.0f);
        add_targets(targets.data() + first, std::min(targets_of_a_block, n_target - first), n_block, real, imag, coarse.data());
        for (std::ptrdiff_t m = 0; m < n_frequency; ++m) line[static_cast<std::size_t>(m)] += cdouble(real[m], imag[m]);
    }
}

}  // namespace

void points_frequency(const geometry::PhaseCentres& centres, const PointTargets& targets, const PointHistoryModel& model,
                      const MutableImageView& out, const PointOptions& options) {
    require_not_empty(out, "out");
    const std::ptrdiff_t n_pulse = out.extent(0);
    const std::ptrdiff_t n_frequency = out.extent(1);
    centres.validate(n_pulse);
    targets.validate();
    require_per_pulse(model.reference_range, "reference_range", n_pulse);
    require_positive(model.frequency_start, "frequency_start");
    require_positive(model.frequency_spacing, "frequency_spacing");
    require_noise_power(model.noise_power);
    const std::ptrdiff_t n_target = targets.reflectivity.extent(0);

    parallel_for(options.execution, "points_frequency", n_pulse, [&](std::int64_t pulse) {
        const double reference = model.reference_range(model.reference_range.extent(0) == 1 ? 0 : pulse);
        std::vector<Target> echoes(static_cast<std::size_t>(n_target));
        for (std::ptrdiff_t t = 0; t < n_target; ++t) {
            const Vector3 p{targets.positions(t, 0), targets.positions(t, 1), targets.positions(t, 2)};
            const double turns_of_a_hertz = -2.0 * (centres.range(pulse, p) - reference) / speed_of_light;
            const cfloat amplitude(targets.reflectivity(t));
            echoes[static_cast<std::size_t>(t)] = {std::remainder(model.frequency_start * turns_of_a_hertz, 1.0),
                                                   std::remainder(model.frequency_spacing * turns_of_a_hertz, 1.0), amplitude.real(),
                                                   amplitude.imag()};
        }
        std::vector<cdouble> line(static_cast<std::size_t>(n_frequency));
        add_history(echoes, line);
        add_noise(line, model.noise_power, model.seed, pulse);
        for (std::ptrdiff_t m = 0; m < n_frequency; ++m) out(pulse, m) = cfloat(line[static_cast<std::size_t>(m)]);
    });
}

}  // namespace sarfocus::sim
