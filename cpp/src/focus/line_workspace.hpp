#pragma once

#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

#include <omp.h>

#include <sarfocus/core/array.hpp>
#include <sarfocus/core/checks.hpp>
#include <sarfocus/core/execution.hpp>

namespace sarfocus::focus {

/// One aligned line for each thread of a parallel_for, made when the thread first asks.
class LineWorkspaces {
public:
    LineWorkspaces(const Execution& execution, std::ptrdiff_t length)
        : length_(length), lines_(static_cast<std::size_t>(resolve_threads(execution.threads))) {}

    /// Inside the loop: the line of the calling thread, [length], contents left over.
    [[nodiscard]] cfloat* line() {
        auto& own = lines_[static_cast<std::size_t>(omp_get_thread_num())];
        if (own.empty()) own = Array<cfloat, 1>({length_});
        return own.data();
    }

private:
    std::ptrdiff_t length_;
    std::vector<Array<cfloat, 1>> lines_;
};

[[nodiscard]] inline bool is_finite(const cfloat& x) {
    return std::isfinite(x.real()) && std::isfinite(x.imag());
}

/// After bin 0 of a transform, the sum of its line, was not finite: names the sample at fault, or says that the sum overflowed.
[[noreturn]] inline void throw_not_finite(const ImageView& data, const char* argument, int threads) {
    require_finite(data, argument, threads);
    throw NumericalError(std::string(argument) + ": expected samples whose sum along a line fits single precision, got larger ones");
}

}  // namespace sarfocus::focus
