#include <sarfocus/sim/motion.hpp>

#include <algorithm>
#include <cmath>
#include <complex>
#include <string>

#include <sarfocus/core/array.hpp>
#include <sarfocus/core/checks.hpp>
#include <sarfocus/core/constants.hpp>
#include <sarfocus/core/error.hpp>
#include <sarfocus/fft/plan.hpp>

#include "sim/random.hpp"

namespace sarfocus::sim {
namespace {

void require_frequency(double frequency, const std::string& argument, double sampling_rate) {
    if (!(frequency > 0.0 && frequency <= 0.5 * sampling_rate))
        throw ValueError(argument, "a frequency > 0, at most half the sampling rate, " + number_text(0.5 * sampling_rate) + " Hz",
                         number_text(frequency));
}

// Every axis has two sequences of numbers of its own, one for vibrations and one for the random part.
cdouble drawn(const MotionModel& model, std::uint32_t axis, bool vibration, std::ptrdiff_t i) {
    const std::uint64_t sequence = 2 * static_cast<std::uint64_t>(axis) + (vibration ? 0 : 1);
    return complex_normal(model.seed, Stream::motion, sequence << 32 | static_cast<std::uint64_t>(i));
}

void add_random(const ArrayView<double, 1>& error, const MotionModel& model, std::uint32_t axis) {
    if (model.random_rms == 0.0) return;
    const std::ptrdiff_t n = error.extent(0);
    const auto inside = static_cast<std::ptrdiff_t>(2.0 * static_cast<double>(n) * model.random_bandwidth / model.sampling_rate);
    const std::ptrdiff_t modes = std::clamp<std::ptrdiff_t>(inside, 1, n);
    Array<cdouble, 1> spectrum({2 * n});
    const double scale = model.random_rms * std::sqrt(2.0 / static_cast<double>(modes));
    for (std::ptrdiff_t m = 1; m <= modes; ++m) spectrum.data()[m] = scale * drawn(model, axis, false, m);
    fft::Plan<double>(2 * n, fft::Direction::inverse).execute(spectrum.data());
    for (std::ptrdiff_t i = 0; i < n; ++i) error(i) += spectrum.data()[i].real();
}

}  // namespace

void MotionModel::validate() const {
    require_positive(sampling_rate, "sampling_rate");
    require_finite_value(drift, "drift");
    require_finite_value(acceleration, "acceleration");
    if (!(std::isfinite(random_rms) && random_rms >= 0.0)) throw ValueError("random_rms", "a finite number >= 0", number_text(random_rms));
    if (random_rms > 0.0) require_frequency(random_bandwidth, "random_bandwidth", sampling_rate);
    for (std::size_t k = 0; k < vibrations.size(); ++k) {
        const std::string name = "vibrations[" + std::to_string(k) + "]";
        require_finite_value(vibrations[k].amplitude, name.c_str());
        require_frequency(vibrations[k].frequency, name, sampling_rate);
    }
}

void motion_error(const ArrayView<double, 1>& error, const MotionModel& model, std::uint32_t axis) {
    require_not_empty(error, "error");
    model.validate();
    const std::ptrdiff_t n = error.extent(0);
    std::vector<cdouble> phases;
    for (std::size_t k = 0; k < model.vibrations.size(); ++k) {
        const cdouble z = drawn(model, axis, true, static_cast<std::ptrdiff_t>(k));
        phases.push_back(z / std::sqrt(std::norm(z)));
    }
    for (std::ptrdiff_t i = 0; i < n; ++i) {
        const double t = (static_cast<double>(i) - 0.5 * static_cast<double>(n - 1)) / model.sampling_rate;
        double sum = model.drift * t + 0.5 * model.acceleration * t * t;
        for (std::size_t k = 0; k < phases.size(); ++k)
            sum += model.vibrations[k].amplitude * (phases[k] * std::polar(1.0, two_pi * model.vibrations[k].frequency * t)).real();
        error(i) = sum;
    }
    add_random(error, model, axis);
}

}  // namespace sarfocus::sim
