#pragma once

#include <cstddef>

// Compiles a function once for every width of vector register and chooses when the program is loaded. Only on plain functions that hold
// a loop. Not under the sanitisers: their run-time isn't ready when the choice is made.
#if defined(__x86_64__) && defined(__gnu_linux__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__) && \
    !defined(__SANITIZE_THREAD__)
#define SARFOCUS_MULTIVERSION __attribute__((target_clones("default", "arch=x86-64-v3", "arch=x86-64-v4")))
#else
#define SARFOCUS_MULTIVERSION
#endif

namespace sarfocus::detail {

// Bytes of a vector register of this processor: explicit vectors wider than that are taken through memory.
inline std::ptrdiff_t find_register_bytes() noexcept {
#if defined(__x86_64__)
    if (__builtin_cpu_supports("avx512f")) return 64;
    if (__builtin_cpu_supports("avx2")) return 32;
#endif
    return 16;
}

inline const std::ptrdiff_t register_bytes = find_register_bytes();

template <class Number, std::ptrdiff_t bytes>
struct VectorOf {
    using Type __attribute__((vector_size(bytes))) = Number;
};

}  // namespace sarfocus::detail
