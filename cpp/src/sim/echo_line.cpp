#include "sim/echo_line.hpp"

#include <algorithm>
#include <cmath>
#include <complex>

#include <sarfocus/core/constants.hpp>

#include "sim/random.hpp"

namespace sarfocus::sim {

EchoLine::EchoLine(double range_spacing, double wavelength, double bandwidth, const signal::Window& window, double support)
    : range_spacing_(range_spacing),
      wavelength_(wavelength),
      cells_of_a_metre_(2.0 * bandwidth / speed_of_light),
      support_(support),
      response_(window) {}

void EchoLine::add(const cdouble& amplitude, double range, double start, std::vector<cdouble>& line) const {
    const auto n = static_cast<double>(line.size());
    const double at = (range - start) / range_spacing_;
    const double reach = support_ / range_spacing_;
    const auto first = static_cast<std::ptrdiff_t>(std::clamp(std::ceil(at - reach), 0.0, n));
    const auto last = static_cast<std::ptrdiff_t>(std::clamp(std::floor(at + reach) + 1.0, 0.0, n));
    const cdouble echo = amplitude * std::polar(1.0, -two_pi * std::remainder(2.0 * range / wavelength_, 1.0));
    for (std::ptrdiff_t i = first; i < last; ++i)
        line[static_cast<std::size_t>(i)] += echo * response_((static_cast<double>(i) - at) * range_spacing_ * cells_of_a_metre_);
}

void add_noise(std::vector<cdouble>& line, double power, std::uint64_t seed, std::int64_t row) {
    if (power == 0.0) return;
    const double scale = std::sqrt(power);
    const auto first = static_cast<std::uint64_t>(row) * line.size();
    for (std::size_t i = 0; i < line.size(); ++i) line[i] += scale * complex_normal(seed, Stream::noise, first + i);
}

}  // namespace sarfocus::sim
