#pragma once

#include <array>
#include <cstddef>
#include <vector>

namespace sarfocus::quality::detail {

/// Power along a line through a peak, `step` apart.
struct Cut {
    std::vector<double> power;
    double step = 1.0;
    double peak = 0.0;        ///< index of the peak, fractions allowed
    double peak_power = 0.0;  ///< there
};

struct MainLobe {
    double width = 0.0;             ///< -3 dB
    std::array<double, 2> nulls{};  ///< distance of the first minimum before and behind the peak
};

struct SideLobes {
    std::array<double, 2> pslr_db{};  ///< before and behind the peak
    double islr_db = 0.0;
};

/// In units of `step`. Throws NumericalError where the cut ends before a minimum.
[[nodiscard]] MainLobe main_lobe(const Cut& cut, const char* axis);

/// Side lobes from the nulls as far as `extent` (before and behind the peak, units of `step`, inside the cut).
[[nodiscard]] SideLobes side_lobes(const Cut& cut, const MainLobe& lobe, const std::array<double, 2>& extent);

/// The response of a band with amplitude taper `window` (empty: none) for distances up to `reach` cells, `step` cells apart.
[[nodiscard]] Cut theoretical_cut(const std::vector<double>& window, double step, double reach);

}  // namespace sarfocus::quality::detail
