#include <sarfocus/focus/gate_block.hpp>

#include <algorithm>
#include <array>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <sarfocus/core/array.hpp>

namespace sarfocus::focus {
namespace {

// An image with memory before and behind its samples, which nobody else may write to.
struct Framed {
    static constexpr float untouched = -7.0f;
    std::vector<cfloat> memory;
    MutableImageView view;

    // offset: samples before it; step: 1, or 2 for every second sample; gap: what lies between lines and beyond the last gate.
    Framed(std::ptrdiff_t n, std::ptrdiff_t gates, bool azimuth_contiguous, std::ptrdiff_t offset, std::ptrdiff_t step, std::ptrdiff_t gap)
        : memory(static_cast<std::size_t>((n + gap) * (gates + gap) * step + offset + 8), cfloat(untouched, untouched)) {
        const std::array<std::ptrdiff_t, 2> strides = azimuth_contiguous ? std::array<std::ptrdiff_t, 2>{step, (n + gap) * step}
                                                                         : std::array<std::ptrdiff_t, 2>{(gates + gap) * step, step};
        view = MutableImageView(memory.data() + offset, {n, gates}, strides);
    }

    void fill() const {
        for (std::ptrdiff_t i = 0; i < view.extent(0); ++i)
            for (std::ptrdiff_t g = 0; g < view.extent(1); ++g) view(i, g) = cfloat(static_cast<float>(i), static_cast<float>(g));
    }

    [[nodiscard]] std::ptrdiff_t written() const {
        return std::count_if(memory.begin(), memory.end(), [](const cfloat& x) { return x != cfloat(untouched, untouched); });
    }
};

TEST(GateBlock, MovesEverySampleToItsPlaceWhateverTheLayout) {
    for (const bool past_cache : {false, true})
        for (const bool azimuth_contiguous : {false, true})
            for (const std::ptrdiff_t step : {1, 2})
                for (const std::ptrdiff_t gap : {0, 5})
                    for (const std::ptrdiff_t offset : {0, 1, 2, 7})
                        for (const std::ptrdiff_t n : {1, 3, 8, 37})
                            for (const std::ptrdiff_t gates : {1, 2, 7, 8, 16, 27}) {
                                const Framed from(n, gates, azimuth_contiguous, offset, step, gap);
                                const Framed to(n, gates, azimuth_contiguous, 7 - offset, step, gap);
                                from.fill();
                                GateBlock block(gates, n);
                                block.load(from.view);
                                block.store(to.view, past_cache);
                                const std::string where =
                                    std::to_string(n) + " x " + std::to_string(gates) + ", offset " + std::to_string(offset);
                                EXPECT_EQ(to.written(), n * gates) << where;
                                for (std::ptrdiff_t g = 0; g < gates; ++g)
                                    for (std::ptrdiff_t i = 0; i < n; ++i) {
                                        const cfloat expected(static_cast<float>(i), static_cast<float>(g));
                                        ASSERT_EQ(block.gate(g)[i], expected) << where;
                                        ASSERT_EQ(to.view(i, g), expected) << where;
                                    }
                            }
}

TEST(BlocksOfGates, HoldEveryGateOnceAndBeginWithCacheLines) {
    Array<cfloat, 1> memory({16});  // blocks look at addresses alone, never at what is there
    for (const std::ptrdiff_t n : {4, 3000, 100'000})
        for (const std::ptrdiff_t gates : {1, 7, 8, 65, 200})
            for (const std::ptrdiff_t offset : {0, 2, 7})
                for (const bool azimuth_contiguous : {false, true}) {
                    const std::array<std::ptrdiff_t, 2> strides =
                        azimuth_contiguous ? std::array<std::ptrdiff_t, 2>{1, n} : std::array<std::ptrdiff_t, 2>{gates, 1};
                    const MutableImageView image(memory.data() + offset, {n, gates}, strides);
                    const BlocksOfGates blocks(image, image);
                    std::ptrdiff_t next = 0;
                    for (std::ptrdiff_t b = 0; b < blocks.count(); ++b) {
                        EXPECT_EQ(blocks.first(b), next);
                        EXPECT_GT(blocks.gates(b), 0);
                        EXPECT_LE(blocks.gates(b), blocks.width());
                        if (b > 0 && !azimuth_contiguous) EXPECT_EQ((offset + blocks.first(b)) % 8, 0);
                        next += blocks.gates(b);
                    }
                    EXPECT_EQ(next, gates);
                }
}

}  // namespace
}  // namespace sarfocus::focus
