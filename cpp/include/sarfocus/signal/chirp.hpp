#pragma once

#include <cstddef>

#include <sarfocus/core/array.hpp>
#include <sarfocus/core/export.hpp>

namespace sarfocus::signal {

enum class ChirpDirection { up, down };

/// A linear FM pulse of constant amplitude, complex baseband.
struct Chirp {
    double bandwidth = 0.0;      ///< Hz, at most the sampling rate
    double duration = 0.0;       ///< s
    double sampling_rate = 0.0;  ///< Hz
    ChirpDirection direction = ChirpDirection::up;

    /// Throws ValueError naming the field.
    SARFOCUS_API void validate() const;

    /// duration * sampling_rate, rounded, at least 1.
    [[nodiscard]] SARFOCUS_API std::ptrdiff_t n_sample() const;

    /// exp(+-j pi bandwidth / duration t^2), t = (i - (n_sample - 1) / 2) / sampling_rate: the middle of the pulse is at index
    /// (n_sample - 1) / 2. + for `up`. [n_sample]
    [[nodiscard]] SARFOCUS_API Array<cfloat, 1> samples() const;
};

}  // namespace sarfocus::signal
