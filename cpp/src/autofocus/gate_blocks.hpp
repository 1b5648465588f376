#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include <omp.h>

#include <sarfocus/core/execution.hpp>
#include <sarfocus/focus/gate_block.hpp>

namespace sarfocus::autofocus::detail {

/// A block of gates for every thread of a parallel_for, made when it first asks.
class GateBlocks {
public:
    /// gates: the most of a block; n: azimuth lines.
    GateBlocks(std::ptrdiff_t gates, std::ptrdiff_t n, const Execution& execution)
        : gates_(gates), n_(n), blocks_(static_cast<std::size_t>(resolve_threads(execution.threads))) {}

    /// Inside the loop: that of the calling thread, contents left over.
    [[nodiscard]] focus::GateBlock& mine() {
        auto& block = blocks_[static_cast<std::size_t>(omp_get_thread_num())];
        if (!block) block = std::make_unique<focus::GateBlock>(gates_, n_);
        return *block;
    }

private:
    std::ptrdiff_t gates_;
    std::ptrdiff_t n_;
    std::vector<std::unique_ptr<focus::GateBlock>> blocks_;
};

}  // namespace sarfocus::autofocus::detail
