#pragma once

#include <array>
#include <cstdint>

#include <sarfocus/core/array_view.hpp>

namespace sarfocus::sim {

/// Philox4x32-10 [Salmon et al., Parallel random numbers: as easy as 1, 2, 3, SC 2011]: four random words for every counter and key.
[[nodiscard]] std::array<std::uint32_t, 4> philox(std::array<std::uint32_t, 4> counter, std::array<std::uint32_t, 2> key);

/// What a sequence of random numbers is for; sequences of the same seed are independent of each other.
enum class Stream : std::uint32_t { noise = 1, clutter = 2, motion = 3 };

/// Complex Gaussian number `index` of a sequence: mean square 1, real and imaginary part independent. A function of its arguments alone,
/// made of integer and correctly rounded operations: the same bits on any platform, in any order.
[[nodiscard]] cdouble complex_normal(std::uint64_t seed, Stream stream, std::uint64_t index);

}  // namespace sarfocus::sim
