#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>

#include <sarfocus/core/array.hpp>
#include <sarfocus/core/array_view.hpp>

namespace sarfocus::focus {

// A block of gates stays in the second-level cache from load to store; eight complex64 gates are one cache line of a row-major image.
inline constexpr std::ptrdiff_t block_bytes = 1 << 20;
inline constexpr std::ptrdiff_t samples_of_a_line = 8;

/// Azimuth lines of some neighbouring range gates, [n] each, aligned and contiguous for the transforms.
class GateBlock {
public:
    GateBlock(std::ptrdiff_t gates, std::ptrdiff_t n) : n_(n), pitch_((n + 7) / 8 * 8 + 8), memory_({gates * pitch_}) {}

    [[nodiscard]] cfloat* gate(std::ptrdiff_t g) { return memory_.data() + g * pitch_; }

    void load(const ImageView& from) {
        if (from.stride(0) == 1) {
            for (std::ptrdiff_t g = 0; g < from.extent(1); ++g) std::copy_n(&from(0, g), n_, gate(g));
            return;
        }
        walk(from, [this](const cfloat& value, std::ptrdiff_t i, std::ptrdiff_t g) { move(value, gate(g)[i]); });
    }
    void store(const MutableImageView& to) {
        if (to.stride(0) == 1) {
            for (std::ptrdiff_t g = 0; g < to.extent(1); ++g) std::copy_n(gate(g), n_, &to(0, g));
            return;
        }
        walk(to, [this](cfloat& value, std::ptrdiff_t i, std::ptrdiff_t g) { move(gate(g)[i], value); });
    }

private:
    // In one piece: the assignment would move the two parts one by one.
    static void move(const cfloat& from, cfloat& to) { std::memcpy(&to, &from, sizeof from); }

    // In the order in which the image lies in memory, a cache line of every gate at a time; the pitch keeps the gates out of each other's
    // cache sets.
    template <class View, class Move>
    void walk(const View& image, const Move& one) {
        const std::ptrdiff_t gates = image.extent(1);
        if (std::abs(image.stride(0)) <= std::abs(image.stride(1))) {
            for (std::ptrdiff_t g = 0; g < gates; ++g)
                for (std::ptrdiff_t i = 0; i < n_; ++i) one(image(i, g), i, g);
        } else {
            for (std::ptrdiff_t begin = 0; begin < n_; begin += samples_of_a_line) {
                ask_for(image, begin + samples_of_a_line);
                for (std::ptrdiff_t g = 0; g < gates; ++g)
                    for (std::ptrdiff_t i = begin; i < std::min(begin + samples_of_a_line, n_); ++i) one(image(i, g), i, g);
            }
        }
    }

    // The next lines' pieces lie too far apart for the processor to foresee: half of the time of a walk would be waiting.
    template <class View>
    void ask_for(const View& image, std::ptrdiff_t begin) const {
        for (std::ptrdiff_t i = begin; i < std::min(begin + samples_of_a_line, n_); ++i)
            for (std::ptrdiff_t g = 0; g < image.extent(1); g += samples_of_a_line) __builtin_prefetch(&image(i, g));
    }

    std::ptrdiff_t n_;
    std::ptrdiff_t pitch_;
    Array<cfloat, 1> memory_;
};

/// How many azimuth lines of `n` samples a block takes.
[[nodiscard]] inline std::ptrdiff_t gates_of_a_block(std::ptrdiff_t n) {
    const std::ptrdiff_t fitting = block_bytes / (static_cast<std::ptrdiff_t>(sizeof(cfloat)) * n);
    return std::clamp(fitting / samples_of_a_line * samples_of_a_line, samples_of_a_line, 8 * samples_of_a_line);
}

}  // namespace sarfocus::focus
