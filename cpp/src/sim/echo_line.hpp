#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <sarfocus/core/array_view.hpp>
#include <sarfocus/signal/window.hpp>

namespace sarfocus::sim {

/// The range-compressed echo of one scatterer in one pulse.
class EchoLine {
public:
    /// m, m, Hz; support: m, how far from the scatterer samples are written.
    EchoLine(double range_spacing, double wavelength, double bandwidth, const signal::Window& window, double support);

    /// line[i] += amplitude * exp(-4j pi range / wavelength) * h(2 bandwidth (start + i * range_spacing - range) / c).
    void add(const cdouble& amplitude, double range, double start, std::vector<cdouble>& line) const;

private:
    double range_spacing_;
    double wavelength_;
    double cells_of_a_metre_;
    double support_;
    signal::WindowResponse response_;
};

/// line[i] += complex Gaussian number row * line.size() + i of the noise of `seed`, mean square `power`.
void add_noise(std::vector<cdouble>& line, double power, std::uint64_t seed, std::int64_t row);

}  // namespace sarfocus::sim
