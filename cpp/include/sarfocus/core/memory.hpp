#pragma once

#include <cstddef>

#include <sarfocus/core/export.hpp>

namespace sarfocus {

/// Bytes to which owned memory is aligned: one cache line, one AVX-512 register.
inline constexpr std::size_t memory_alignment = 64;

namespace detail {

/// Memory of zeros, aligned to memory_alignment. A block of 1 MiB or more comes from the system page by page as it is first touched, by
/// whichever thread does, and goes back to it at once: what was large and is gone does not stay with the process. Throws std::bad_alloc.
[[nodiscard]] SARFOCUS_API void* allocate_zeros(std::size_t bytes);
/// bytes: as they were asked for.
SARFOCUS_API void release(void* memory, std::size_t bytes) noexcept;

}  // namespace detail
}  // namespace sarfocus
