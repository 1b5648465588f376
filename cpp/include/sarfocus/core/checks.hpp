#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include <sarfocus/core/array_view.hpp>
#include <sarfocus/core/error.hpp>
#include <sarfocus/core/export.hpp>

namespace sarfocus {

/// Throws ShapeError where any extent is zero.
template <class T, std::size_t N>
void require_not_empty(const ArrayView<T, N>& view, const char* argument) {
    for (const auto e : view.extents())
        if (e <= 0) throw ShapeError(argument, "no dimension of size zero", shape_text(view.extents()));
}

/// Throws ShapeError unless both views have the same extents.
template <class T, class U, std::size_t N>
void require_same_shape(const ArrayView<T, N>& view, const char* argument, const ArrayView<U, N>& other, const char* other_argument) {
    if (view.extents() != other.extents())
        throw ShapeError(argument, "the shape of " + std::string(other_argument) + " " + shape_text(other.extents()),
                         shape_text(view.extents()));
}

/// Throws NumericalError naming the position of the first NaN or infinity (in index order, whatever the number of threads).
SARFOCUS_API void require_finite(const ImageView& data, const char* argument, int threads = 0);
SARFOCUS_API void require_finite(const ArrayView<const double, 2>& data, const char* argument);
SARFOCUS_API void require_finite(const ArrayView<const double, 1>& data, const char* argument);
SARFOCUS_API void require_finite(const ArrayView<const cdouble, 1>& data, const char* argument);

/// Memory the system could give out now, bytes; 0 where the system does not tell.
[[nodiscard]] SARFOCUS_API std::uint64_t available_memory();

/// Throws MemoryEstimateError, saying how much, where `bytes` exceeds what is available. Call before allocating.
SARFOCUS_API void require_memory(std::uint64_t bytes, const char* purpose);

/// "1.5 GiB".
[[nodiscard]] SARFOCUS_API std::string memory_text(std::uint64_t bytes);

}  // namespace sarfocus
