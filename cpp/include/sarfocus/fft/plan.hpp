#pragma once

#include <complex>
#include <cstddef>
#include <memory>

#include <sarfocus/core/export.hpp>

namespace sarfocus::fft {

enum class Direction { forward, inverse };  // exponent -j and +j

/// One-dimensional transform of fixed length over contiguous, aligned memory; unnormalised in both directions.
/// Built once, executed from any number of threads at once on different memory. Lengths are free; `good_size` gives fast ones. What is
/// planned for the first lengths asked for, up to 2^17, the process keeps: a host program must not call FFTW's cleanup.
template <class Real>
class SARFOCUS_API Plan {
public:
    Plan(std::ptrdiff_t length, Direction direction);
    ~Plan();
    Plan(Plan&&) noexcept;
    Plan& operator=(Plan&&) noexcept;
    Plan(const Plan&) = delete;
    Plan& operator=(const Plan&) = delete;

    [[nodiscard]] std::ptrdiff_t length() const;

    /// In place; `data` must be aligned as Array aligns (64 bytes).
    void execute(std::complex<Real>* data) const;

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

extern template class Plan<float>;
extern template class Plan<double>;

/// The smallest length >= n with no prime factor above 7.
[[nodiscard]] SARFOCUS_API std::ptrdiff_t good_size(std::ptrdiff_t n);

/// A host program that plans FFTW transforms itself hands over its own lock here, before the first transform.
SARFOCUS_API void set_planner_lock(void (*lock)(), void (*unlock)());

}  // namespace sarfocus::fft
