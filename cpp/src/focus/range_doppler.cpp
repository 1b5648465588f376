#include <sarfocus/focus/gate_block.hpp>
#include <sarfocus/focus/range_doppler.hpp>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <omp.h>

#include <sarfocus/core/array.hpp>
#include <sarfocus/core/checks.hpp>
#include <sarfocus/core/error.hpp>
#include <sarfocus/fft/plan.hpp>
#include <sarfocus/focus/range_compress.hpp>

#include "focus/line_workspace.hpp"
#include "focus/migration_correction.hpp"

namespace sarfocus::focus {
namespace {

using geometry::StripmapGeometry;

void require_echo(const ImageView& echo, const StripmapGeometry& geometry, const FastTime& fast_time, const MutableImageView& image,
                  const RangeDopplerOptions& options) {
    geometry.validate();
    require_not_empty(echo, "echo");
    require_positive(fast_time.range_start, "range_start");
    require_positive(fast_time.range_sampling, "range_sampling");
    const std::array<std::ptrdiff_t, 2> expected{echo.extent(0), static_cast<std::ptrdiff_t>(geometry.slant_range.size())};
    if (image.extents() != expected)
        throw ShapeError("image", shape_text(expected) + ", a row for every pulse and a column for every slant_range of the geometry",
                         shape_text(image.extents()));
    for (std::size_t j = 1; j < geometry.slant_range.size(); ++j)
        if (!(geometry.slant_range[j] > geometry.slant_range[j - 1]))
            throw ValueError("slant_range[" + std::to_string(j) + "]",
                             "ascending ranges, above " + number_text(geometry.slant_range[j - 1]) + " m",
                             number_text(geometry.slant_range[j]));
    if (options.chirp.extent(0) == 0 && (options.replica_origin != 0.0 || options.window.kind != signal::WindowKind::rectangular))
        throw ValueError("chirp", "the pulse as sent, which replica_origin and window are about", "none");
}

// In place along azimuth, all columns; what comes in from `from` goes out to `to`, which may be the same.
void transform_columns(const ImageView& from, const MutableImageView& to, fft::Direction direction, const char* phase,
                       const Execution& execution, std::atomic<bool>& finite) {
    const std::ptrdiff_t n = from.extent(0);
    const fft::Plan<float> plan(n, direction);
    const BlocksOfGates blocks(from, to);
    std::vector<std::unique_ptr<GateBlock>> workspaces(static_cast<std::size_t>(resolve_threads(execution.threads)));
    parallel_for(execution, phase, blocks.count(), [&](std::int64_t b) {
        auto& workspace = workspaces[static_cast<std::size_t>(omp_get_thread_num())];
        if (!workspace) workspace = std::make_unique<GateBlock>(blocks.width(), n);
        const std::ptrdiff_t first = blocks.first(b);
        const std::ptrdiff_t count = blocks.gates(b);
        workspace->load(from.slice(1, first, count));
        for (std::ptrdiff_t g = 0; g < count; ++g) {
            cfloat* line = workspace->gate(g);
            plan.execute(line);
            // Bin 0 is the sum of the line: one NaN or infinity anywhere is seen there.
            if (!is_finite(line[0])) finite = false;
        }
        workspace->store(to.slice(1, first, count), blocks.past_cache());
    });
}

[[noreturn]] void throw_overflow() {
    throw NumericalError("echo: expected samples whose sums fit single precision, got larger ones");
}

// The azimuth spectrum of the range-compressed echo, [n_pulse, n_fast_time].
Array<cfloat, 2> azimuth_spectrum(const ImageView& echo, const RangeDopplerOptions& options) {
    Array<cfloat, 2> spectrum({echo.extent(0), echo.extent(1)});
    ImageView source = echo;
    if (options.chirp.extent(0) > 0) {
        require_finite(echo, "echo", options.execution.threads);
        RangeCompressOptions compress;
        compress.replica_origin = options.replica_origin;
        compress.window = options.window;
        compress.execution = options.execution;
        range_compress(echo, options.chirp, spectrum.view(), compress);
        source = ImageView(spectrum.view());
    }
    std::atomic<bool> finite{true};
    transform_columns(source, spectrum.view(), fft::Direction::forward, "azimuth_spectrum", options.execution, finite);
    if (!finite) throw_not_finite(echo, "echo", options.execution.threads);
    return spectrum;
}

}  // namespace

void form_stripmap(const ImageView& echo, const StripmapGeometry& geometry, const FastTime& fast_time, const MutableImageView& image,
                   const RangeDopplerOptions& options) {
    require_echo(echo, geometry, fast_time, image, options);
    const MigrationCorrection correction(geometry, fast_time, echo.extent(0), echo.extent(1));
    const auto threads = static_cast<std::uint64_t>(resolve_threads(options.execution.threads));
    require_memory(sizeof(cfloat) * static_cast<std::uint64_t>(echo.size()) + threads * correction.workspace_bytes(), "form_stripmap");

    std::atomic<bool> finite{true};
    {
        const Array<cfloat, 2> spectrum = azimuth_spectrum(echo, options);
        std::vector<std::unique_ptr<MigrationCorrection::Workspace>> workspaces(threads);
        parallel_for(options.execution, "range_migration", image.extent(0), [&](std::int64_t bin) {
            auto& workspace = workspaces[static_cast<std::size_t>(omp_get_thread_num())];
            if (!workspace) workspace = std::make_unique<MigrationCorrection::Workspace>(correction);
            if (!correction.apply(bin, spectrum.view().row(bin), image.row(bin), *workspace)) finite = false;
        });
    }
    if (!finite) throw_overflow();
    transform_columns(image, image, fft::Direction::inverse, "azimuth_image", options.execution, finite);
    if (!finite) throw_overflow();
}

}  // namespace sarfocus::focus
