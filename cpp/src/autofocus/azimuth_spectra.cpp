#include "azimuth_spectra.hpp"

#include <algorithm>

#include "gate_blocks.hpp"

namespace sarfocus::autofocus::detail {

void transform_azimuth(const ImageView& from, fft::Direction direction, const MutableImageView& to, const Execution& execution) {
    constexpr std::ptrdiff_t gates = 16;  // whole cache lines of a row-major image; few, for a stripe of 64 has work for all threads
    const std::ptrdiff_t n = from.extent(0);
    const fft::Plan<float> plan(n, direction);
    GateBlocks blocks(gates, n, execution);
    parallel_for(execution, "azimuth spectrum", (from.extent(1) + gates - 1) / gates, [&](std::int64_t b) {
        const std::ptrdiff_t first = b * gates;
        const std::ptrdiff_t count = std::min(gates, from.extent(1) - first);
        focus::GateBlock& block = blocks.mine();
        block.load(from.slice(1, first, count));
        for (std::ptrdiff_t g = 0; g < count; ++g) plan.execute(block.gate(g));
        block.store(to.slice(1, first, count));
    });
}

}  // namespace sarfocus::autofocus::detail
