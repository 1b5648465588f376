#pragma once

#include <array>
#include <cstddef>
#include <stdexcept>
#include <string>

#include <sarfocus/core/export.hpp>

namespace sarfocus {

/// An argument has a value the function can't work with. Python: ValueError.
class SARFOCUS_API ValueError : public std::invalid_argument {
public:
    /// «argument: expected …, got …».
    ValueError(const std::string& argument, const std::string& expected, const std::string& actual);
    explicit ValueError(const std::string& message) : std::invalid_argument(message) {}
};

/// Array extents that do not fit each other or the function. Python: sarfocus.ShapeError, a ValueError.
class SARFOCUS_API ShapeError : public ValueError {
public:
    using ValueError::ValueError;
};

/// The data, not the call, make the computation impossible (NaN, infinity, a singular system). Python: sarfocus.NumericalError.
class SARFOCUS_API NumericalError : public std::runtime_error {
public:
    using std::runtime_error::runtime_error;
};

/// The job needs more memory than there is; thrown before anything is allocated. Python: MemoryError.
class SARFOCUS_API MemoryEstimateError : public std::runtime_error {
public:
    using std::runtime_error::runtime_error;
};

/// The progress callback asked to stop. Python: KeyboardInterrupt where Ctrl-C was the reason.
class SARFOCUS_API Cancelled : public std::runtime_error {
public:
    Cancelled() : std::runtime_error("cancelled by the caller") {}
};

/// "(3, 4)".
template <std::size_t N>
[[nodiscard]] std::string shape_text(const std::array<std::ptrdiff_t, N>& extents) {
    std::string out = "(";
    for (std::size_t d = 0; d < N; ++d) out += (d ? ", " : "") + std::to_string(extents[d]);
    return out + (N == 1 ? ",)" : ")");
}

/// Shortest decimal text of a number, for messages.
[[nodiscard]] SARFOCUS_API std::string number_text(double value);

/// Throws ValueError unless `value` is finite and > 0.
SARFOCUS_API void require_positive(double value, const char* argument);
/// Throws ValueError unless `value` is finite.
SARFOCUS_API void require_finite_value(double value, const char* argument);

}  // namespace sarfocus
