#include <sarfocus/focus/gate_block.hpp>

#include <cmath>
#include <cstdint>
#include <cstring>

#if defined(__SSE2__)
#include <emmintrin.h>
#endif

namespace sarfocus::focus {
namespace {

constexpr std::ptrdiff_t sample_bytes = sizeof(cfloat);
constexpr std::ptrdiff_t samples_of_a_line = 8;  // of cache
// Azimuth: their pieces of a block are some sixteen cache lines, as many as are under way at a time.
constexpr std::ptrdiff_t lines_of_a_step = 4;

// Two samples, as bits: what is only moved must not change.
using Pair = std::int64_t __attribute__((vector_size(2 * sample_bytes)));

inline Pair pair_at(const cfloat* from) {
    Pair out;
    std::memcpy(&out, from, sizeof out);
    return out;
}

inline void put(Pair pair, cfloat* to) {
    std::memcpy(static_cast<void*>(to), &pair, sizeof pair);
}

// Straight to memory, without reading first what is there; to: aligned to the pair. Whole cache lines one after the other, or it's slow.
inline void put_past_cache(Pair pair, cfloat* to) {
#if defined(__SSE2__)
    _mm_stream_si128(reinterpret_cast<__m128i*>(to), reinterpret_cast<__m128i>(pair));
#else
    put(pair, to);
#endif
}

// Before other threads may look at what went past the cache.
inline void finish_past_cache() {
#if defined(__SSE2__)
    _mm_sfence();
#endif
}

inline bool begins_a_line(const cfloat* at) {
    return reinterpret_cast<std::uintptr_t>(at) % (samples_of_a_line * sample_bytes) == 0;
}

// The pieces of later azimuth lines lie too far apart for the processor to foresee: most of the time would be waiting.
template <bool to_write, class View>
inline void ask_for(const View& image, std::ptrdiff_t begin) {
    for (std::ptrdiff_t i = begin; i < std::min(begin + lines_of_a_step, image.extent(0)); ++i)
        for (std::ptrdiff_t g = 0; g < image.extent(1); g += samples_of_a_line) __builtin_prefetch(&image(i, g), to_write ? 1 : 0);
}

// In one piece: the assignment would move the two parts one by one.
inline void move(const cfloat& from, cfloat& to) {
    std::memcpy(&to, &from, sizeof from);
}

// Any strides, in the order in which the image lies in memory.
template <bool to_write, class View, class Move>
void walk(const View& image, const Move& one) {
    const std::ptrdiff_t n = image.extent(0);
    const std::ptrdiff_t gates = image.extent(1);
    if (std::abs(image.stride(0)) <= std::abs(image.stride(1))) {
        for (std::ptrdiff_t g = 0; g < gates; ++g)
            for (std::ptrdiff_t i = 0; i < n; ++i) one(image(i, g), i, g);
        return;
    }
    for (std::ptrdiff_t begin = 0; begin < n; begin += lines_of_a_step) {
        ask_for<to_write>(image, begin + lines_of_a_step);
        for (std::ptrdiff_t g = 0; g < gates; ++g)
            for (std::ptrdiff_t i = begin; i < std::min(begin + lines_of_a_step, n); ++i) one(image(i, g), i, g);
    }
}

// Gates [0, gates) of azimuth lines that are contiguous in range; gates and lines in whole pairs and steps.
void load_lines(const ImageView& from, std::ptrdiff_t n, std::ptrdiff_t gates, cfloat* block, std::ptrdiff_t pitch) {
    for (std::ptrdiff_t begin = 0; begin < n; begin += lines_of_a_step) {
        ask_for<false>(from, begin + 2 * lines_of_a_step);
        for (std::ptrdiff_t g = 0; g < gates; g += 2)
            for (std::ptrdiff_t i = begin; i < begin + lines_of_a_step; i += 2) {
                const Pair a = pair_at(&from(i, g));
                const Pair b = pair_at(&from(i + 1, g));
                put(__builtin_shufflevector(a, b, 0, 2), block + g * pitch + i);
                put(__builtin_shufflevector(a, b, 1, 3), block + (g + 1) * pitch + i);
            }
    }
}

// The same back; gates: in whole cache lines where it goes past the cache.
template <bool past_cache>
void store_lines(const cfloat* block, std::ptrdiff_t pitch, std::ptrdiff_t n, std::ptrdiff_t gates, const MutableImageView& to) {
    constexpr std::ptrdiff_t pairs = samples_of_a_line / 2;
    for (std::ptrdiff_t begin = 0; begin < n; begin += lines_of_a_step) {
        if (!past_cache) ask_for<true>(to, begin + 2 * lines_of_a_step);
        for (std::ptrdiff_t first = 0; first < gates; first += samples_of_a_line)
            for (std::ptrdiff_t i = begin; i < begin + lines_of_a_step; i += 2) {
                Pair line[2][pairs];
                for (std::ptrdiff_t p = 0; p < pairs; ++p) {
                    const Pair a = pair_at(block + (first + 2 * p) * pitch + i);
                    const Pair b = pair_at(block + (first + 2 * p + 1) * pitch + i);
                    line[0][p] = __builtin_shufflevector(a, b, 0, 2);
                    line[1][p] = __builtin_shufflevector(a, b, 1, 3);
                }
                for (std::ptrdiff_t l = 0; l < 2; ++l)
                    for (std::ptrdiff_t p = 0; p < pairs; ++p) {
                        cfloat* at = &to(i + l, first + 2 * p);
                        past_cache ? put_past_cache(line[l][p], at) : put(line[l][p], at);
                    }
            }
    }
}

void copy_past_cache(const cfloat* from, std::ptrdiff_t n, cfloat* to) {
    std::ptrdiff_t i = 0;
    for (; i < std::min(samples_of_a_line, n) && !begins_a_line(to + i); ++i) move(from[i], to[i]);
    if (i < samples_of_a_line)
        for (; i + samples_of_a_line <= n; i += samples_of_a_line)
            for (std::ptrdiff_t k = 0; k < samples_of_a_line; k += 2) put_past_cache(pair_at(from + i + k), to + i + k);
    for (; i < n; ++i) move(from[i], to[i]);
}

}  // namespace

BlocksOfGates::BlocksOfGates(const ImageView& from, const MutableImageView& to)
    : n_range_(to.extent(1)), past_cache_(to.size() * sample_bytes >= std::ptrdiff_t{32} << 20) {
    constexpr std::ptrdiff_t most = 64;
    const std::ptrdiff_t line_bytes = to.extent(0) * sample_bytes;
    if (from.stride(0) == 1 && to.stride(0) == 1) {
        constexpr std::ptrdiff_t second_level = 1 << 16;  // for the line and what works on it
        width_ = std::clamp<std::ptrdiff_t>(second_level / line_bytes, 1, most);
        return;
    }
    constexpr std::ptrdiff_t third_level = 1 << 21;  // of each thread
    width_ = std::clamp(third_level / line_bytes / samples_of_a_line * samples_of_a_line, samples_of_a_line, most);
    if (to.stride(1) == 1)
        lead_ = static_cast<std::ptrdiff_t>(reinterpret_cast<std::uintptr_t>(to.data()) / sample_bytes % samples_of_a_line);
}

void GateBlock::load(const ImageView& from) {
    if (from.stride(0) == 1) {
        for (std::ptrdiff_t g = 0; g < from.extent(1); ++g) std::copy_n(&from(0, g), n_, gate(g));
        return;
    }
    const auto one_by_one = [this](const ImageView& part, std::ptrdiff_t first_line, std::ptrdiff_t first_gate) {
        walk<false>(part,
                    [&](const cfloat& value, std::ptrdiff_t i, std::ptrdiff_t g) { move(value, gate(first_gate + g)[first_line + i]); });
    };
    if (from.stride(1) != 1) return one_by_one(from, 0, 0);
    const std::ptrdiff_t lines = n_ / lines_of_a_step * lines_of_a_step;
    const std::ptrdiff_t gates = from.extent(1) / 2 * 2;
    load_lines(from, lines, gates, gate(0), pitch_);
    one_by_one(from.slice(1, gates, from.extent(1) - gates), 0, gates);
    one_by_one(from.slice(0, lines, n_ - lines).slice(1, 0, gates), lines, 0);
}

void GateBlock::store(const MutableImageView& to, bool past_cache) {
    if (to.stride(0) == 1) {
        for (std::ptrdiff_t g = 0; g < to.extent(1); ++g)
            past_cache ? copy_past_cache(gate(g), n_, &to(0, g)) : static_cast<void>(std::copy_n(gate(g), n_, &to(0, g)));
        if (past_cache) finish_past_cache();
        return;
    }
    const auto one_by_one = [this](const MutableImageView& part, std::ptrdiff_t first_line, std::ptrdiff_t first_gate) {
        walk<true>(part, [&](cfloat& value, std::ptrdiff_t i, std::ptrdiff_t g) { move(gate(first_gate + g)[first_line + i], value); });
    };
    if (to.stride(1) != 1) return one_by_one(to, 0, 0);
    const std::ptrdiff_t lines = n_ / lines_of_a_step * lines_of_a_step;
    const std::ptrdiff_t gates = to.extent(1) / samples_of_a_line * samples_of_a_line;
    const bool whole_lines = begins_a_line(to.data()) && to.stride(0) % samples_of_a_line == 0;
    if (past_cache && whole_lines) {
        store_lines<true>(gate(0), pitch_, lines, gates, to);
        finish_past_cache();
    } else {
        store_lines<false>(gate(0), pitch_, lines, gates, to);
    }
    one_by_one(to.slice(1, gates, to.extent(1) - gates), 0, gates);
    one_by_one(to.slice(0, lines, n_ - lines).slice(1, 0, gates), lines, 0);
}

}  // namespace sarfocus::focus
