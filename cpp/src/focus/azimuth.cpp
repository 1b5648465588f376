#include <sarfocus/focus/azimuth.hpp>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include <omp.h>

#include <sarfocus/core/checks.hpp>
#include <sarfocus/fft/plan.hpp>

#include "focus/apply_phase.hpp"
#include "focus/gate_block.hpp"
#include "focus/line_workspace.hpp"

namespace sarfocus::focus {
namespace {

using geometry::StripmapGeometry;

// (f - fdc)^2 of every bin, Hz^2.
std::vector<double> squared_frequencies(const StripmapGeometry& geometry, std::ptrdiff_t n) {
    std::vector<double> out(static_cast<std::size_t>(n));
    const double centroid = geometry.doppler_centroid / geometry.prf;
    for (std::ptrdiff_t k = 0; k < n; ++k) {
        const double cycles = static_cast<double>(k) / static_cast<double>(n) - centroid;
        const double offset = geometry.prf * (cycles - std::floor(cycles + 0.5));
        out[static_cast<std::size_t>(k)] = offset * offset;
    }
    return out;
}

// The transform of either sense; sign: that of the phase.
void transform(const ImageView& from, const char* from_name, const StripmapGeometry& geometry, const MutableImageView& to,
               const char* to_name, double sign, const char* phase, const Execution& execution) {
    geometry.validate();
    require_not_empty(from, from_name);
    require_same_shape(to, to_name, from, from_name);
    const std::ptrdiff_t n = from.extent(0);
    const std::ptrdiff_t n_range = from.extent(1);
    if (static_cast<std::ptrdiff_t>(geometry.slant_range.size()) != n_range)
        throw ShapeError(from_name,
                         "(n_azimuth, " + std::to_string(geometry.slant_range.size()) + "), a column for every slant_range of the geometry",
                         shape_text(from.extents()));

    const fft::Plan<float> forward(n, fft::Direction::forward);
    const fft::Plan<float> inverse(n, fft::Direction::inverse);
    const std::vector<double> f2 = squared_frequencies(geometry, n);
    const float scale = 1.0f / static_cast<float>(n);
    const std::ptrdiff_t gates = std::min(gates_of_a_block(n), n_range);
    std::vector<std::unique_ptr<GateBlock>> workspaces(static_cast<std::size_t>(resolve_threads(execution.threads)));
    std::atomic<bool> finite{true};

    parallel_for(execution, phase, (n_range + gates - 1) / gates, [&](std::int64_t b) {
        auto& workspace = workspaces[static_cast<std::size_t>(omp_get_thread_num())];
        if (!workspace) workspace = std::make_unique<GateBlock>(gates, n);
        const std::ptrdiff_t first = b * gates;
        const std::ptrdiff_t count = std::min(gates, n_range - first);
        workspace->load(from.slice(1, first, count));
        for (std::ptrdiff_t g = 0; g < count; ++g) {
            cfloat* line = workspace->gate(g);
            forward.execute(line);
            // Bin 0 is the sum of the line: one NaN or infinity anywhere is seen there.
            if (!is_finite(line[0])) finite = false;
            apply_phase(line, f2.data(), n, sign * 0.5 / geometry.fm_rate(static_cast<std::size_t>(first + g)), scale);
            inverse.execute(line);
        }
        if (finite) workspace->store(to.slice(1, first, count));
    });
    if (!finite) throw_not_finite(from, from_name, execution.threads);
}

}  // namespace

void azimuth_compress(const ImageView& raw, const StripmapGeometry& geometry, const MutableImageView& image,
                      const AzimuthOptions& options) {
    transform(raw, "raw", geometry, image, "image", -1.0, "azimuth_compress", options.execution);
}

void azimuth_decompress(const ImageView& image, const StripmapGeometry& geometry, const MutableImageView& raw,
                        const AzimuthOptions& options) {
    transform(image, "image", geometry, raw, "raw", 1.0, "azimuth_decompress", options.execution);
}

}  // namespace sarfocus::focus
