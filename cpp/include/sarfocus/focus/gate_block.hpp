#pragma once

#include <algorithm>
#include <cstddef>

#include <sarfocus/core/array.hpp>
#include <sarfocus/core/array_view.hpp>
#include <sarfocus/core/export.hpp>

namespace sarfocus::focus {

/// How the range gates of an image are dealt out in blocks that stay in cache from load to store.
class SARFOCUS_API BlocksOfGates {
public:
    /// from, to: of the same shape. Where azimuth is contiguous in both a block is as small as pays. Otherwise neighbouring gates share
    /// cache lines: a block is as many of them as fit, and begins with a cache line of `to` where that can be.
    BlocksOfGates(const ImageView& from, const MutableImageView& to);

    [[nodiscard]] std::ptrdiff_t count() const { return (n_range_ + lead_ + width_ - 1) / width_; }
    /// The most gates of a block.
    [[nodiscard]] std::ptrdiff_t width() const { return std::min(width_, n_range_); }
    [[nodiscard]] std::ptrdiff_t first(std::ptrdiff_t block) const { return std::max<std::ptrdiff_t>(block * width_ - lead_, 0); }
    [[nodiscard]] std::ptrdiff_t gates(std::ptrdiff_t block) const { return std::min(first(block + 1), n_range_) - first(block); }
    /// Whether `to` is larger than caches are: what is stored may go straight to memory, for it won't be found in a cache later on.
    [[nodiscard]] bool past_cache() const { return past_cache_; }

private:
    std::ptrdiff_t n_range_;
    std::ptrdiff_t width_;
    std::ptrdiff_t lead_ = 0;  // gates by which the first block is short
    bool past_cache_;
};

/// Azimuth lines of some neighbouring range gates, [n] each, aligned and contiguous for the transforms.
class SARFOCUS_API GateBlock {
public:
    GateBlock(std::ptrdiff_t gates, std::ptrdiff_t n) : n_(n), pitch_((n + 7) / 8 * 8 + 8), memory_({gates * pitch_}) {}

    [[nodiscard]] cfloat* gate(std::ptrdiff_t g) { return memory_.data() + g * pitch_; }

    /// [n, gates], any strides.
    void load(const ImageView& from);
    void store(const MutableImageView& to, bool past_cache = false);

private:
    std::ptrdiff_t n_;
    std::ptrdiff_t pitch_;  // keeps the gates out of each other's cache sets
    Array<cfloat, 1> memory_;
};

}  // namespace sarfocus::focus
