#pragma once

#include <numbers>

namespace sarfocus {

inline constexpr double speed_of_light = 299'792'458.0;  // m/s, in vacuum
inline constexpr double pi = std::numbers::pi;
inline constexpr double two_pi = 2.0 * pi;

}  // namespace sarfocus
