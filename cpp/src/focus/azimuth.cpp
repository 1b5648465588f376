#include <sarfocus/focus/azimuth.hpp>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include <omp.h>

#include <sarfocus/core/checks.hpp>
#include <sarfocus/core/constants.hpp>
#include <sarfocus/fft/plan.hpp>
#include <sarfocus/focus/gate_block.hpp>
#include <sarfocus/signal/phasor.hpp>

#include "focus/apply_phase.hpp"
#include "focus/line_workspace.hpp"

namespace sarfocus::focus {
namespace {

using geometry::StripmapGeometry;

// (f - fdc)^2 of every bin, Hz^2. Without a centroid bins k and n - k have the same.
std::vector<double> squared_frequencies(const StripmapGeometry& geometry, std::ptrdiff_t n) {
    std::vector<double> out(static_cast<std::size_t>(n));
    const double centroid = geometry.doppler_centroid / geometry.prf;
    for (std::ptrdiff_t k = 0; k < n; ++k) {
        const double cycles = static_cast<double>(2 * k <= n ? k : k - n) / static_cast<double>(n) - centroid;
        const double offset = geometry.prf * (cycles - std::floor(cycles + 0.5));
        out[static_cast<std::size_t>(k)] = offset * offset;
    }
    return out;
}

void require_strip(const ImageView& from, const char* from_name, const StripmapGeometry& geometry, const MutableImageView& to,
                   const char* to_name) {
    geometry.validate();
    require_not_empty(from, from_name);
    require_same_shape(to, to_name, from, from_name);
    if (static_cast<std::ptrdiff_t>(geometry.slant_range.size()) != from.extent(1))
        throw ShapeError(from_name,
                         "(n_azimuth, " + std::to_string(geometry.slant_range.size()) + "), a column for every slant_range of the geometry",
                         shape_text(from.extents()));
}

// Block by block: load, work(line, gate) in place, store. work returns false where the line holds NaN or infinity.
template <class Work>
void walk_gates(const ImageView& from, const char* from_name, const MutableImageView& to, const char* phase, const Execution& execution,
                const Work& work) {
    const std::ptrdiff_t n = from.extent(0);
    const BlocksOfGates blocks(from, to);
    std::vector<std::unique_ptr<GateBlock>> workspaces(static_cast<std::size_t>(resolve_threads(execution.threads)));
    std::atomic<bool> finite{true};
    parallel_for(execution, phase, blocks.count(), [&](std::int64_t b) {
        auto& workspace = workspaces[static_cast<std::size_t>(omp_get_thread_num())];
        if (!workspace) workspace = std::make_unique<GateBlock>(blocks.width(), n);
        const std::ptrdiff_t first = blocks.first(b);
        const std::ptrdiff_t count = blocks.gates(b);
        workspace->load(from.slice(1, first, count));
        for (std::ptrdiff_t g = 0; g < count; ++g)
            if (!work(workspace->gate(g), first + g)) finite = false;
        if (finite) workspace->store(to.slice(1, first, count), blocks.past_cache());
    });
    if (!finite) throw_not_finite(from, from_name, execution.threads);
}

// The transform of either sense; sign: that of the phase.
void transform(const ImageView& from, const char* from_name, const StripmapGeometry& geometry, const MutableImageView& to,
               const char* to_name, double sign, const char* phase, const Execution& execution) {
    require_strip(from, from_name, geometry, to, to_name);
    const std::ptrdiff_t n = from.extent(0);
    const fft::Plan<float> forward(n, fft::Direction::forward);
    const fft::Plan<float> inverse(n, fft::Direction::inverse);
    const std::vector<double> f2 = squared_frequencies(geometry, n);
    const float scale = 1.0f / static_cast<float>(n);
    walk_gates(from, from_name, to, phase, execution, [&](cfloat* line, std::ptrdiff_t gate) {
        forward.execute(line);
        // Bin 0 is the sum of the line: one NaN or infinity anywhere is seen there.
        if (!is_finite(line[0])) return false;
        apply_phase(line, f2.data(), n, sign * 0.5 / geometry.fm_rate(static_cast<std::size_t>(gate)), scale);
        inverse.execute(line);
        return true;
    });
}

void write_factor(double phase, cfloat& factor) {
    float real = 0.0f;
    float imag = 0.0f;
    signal::unit_phasor(-phase / two_pi, real, imag);
    factor = {real, imag};
}

// exp(-j phase) of a range gate, interpolated between blocks.
class PhaseOfGate {
public:
    PhaseOfGate(const ArrayView<const double, 2>& phase, const std::vector<double>& centres) : phase_(phase), centres_(centres) {
        if (phase.extent(0) == 1) write(0, 0, 0.0, common_);
    }

    // [n_azimuth]; `own` is written where the gate needs a phase of its own.
    [[nodiscard]] const cfloat* of(std::ptrdiff_t gate, std::vector<cfloat>& own) const {
        if (!common_.empty()) return common_.data();
        const auto position = static_cast<double>(gate);
        const auto above = std::upper_bound(centres_.begin(), centres_.end(), position) - centres_.begin();
        const std::ptrdiff_t low = std::max<std::ptrdiff_t>(above - 1, 0);
        const std::ptrdiff_t high = std::min<std::ptrdiff_t>(above, phase_.extent(0) - 1);
        const double gap = centres_[static_cast<std::size_t>(high)] - centres_[static_cast<std::size_t>(low)];
        write(low, high, gap > 0.0 ? (position - centres_[static_cast<std::size_t>(low)]) / gap : 0.0, own);
        return own.data();
    }

private:
    void write(std::ptrdiff_t low, std::ptrdiff_t high, double share, std::vector<cfloat>& out) const {
        out.resize(static_cast<std::size_t>(phase_.extent(1)));
        for (std::ptrdiff_t k = 0; k < phase_.extent(1); ++k)
            write_factor((1.0 - share) * phase_(low, k) + share * phase_(high, k), out[static_cast<std::size_t>(k)]);
    }

    const ArrayView<const double, 2>& phase_;
    const std::vector<double>& centres_;
    std::vector<cfloat> common_;
};

// exp(-j phase) of a range gate, from scaled shapes.
class ScaledPhaseOfGate {
public:
    ScaledPhaseOfGate(const ArrayView<const double, 2>& phase, const ArrayView<const double, 2>& scale) : phase_(phase), scale_(scale) {}

    [[nodiscard]] const cfloat* of(std::ptrdiff_t gate, std::vector<cfloat>& own) const {
        own.resize(static_cast<std::size_t>(phase_.extent(1)));
        for (std::ptrdiff_t k = 0; k < phase_.extent(1); ++k) {
            double phase = 0.0;
            for (std::ptrdiff_t m = 0; m < phase_.extent(0); ++m) phase += scale_(m, gate) * phase_(m, k);
            write_factor(phase, own[static_cast<std::size_t>(k)]);
        }
        return own.data();
    }

private:
    const ArrayView<const double, 2>& phase_;
    const ArrayView<const double, 2>& scale_;
};

void require_phase(const ArrayView<const double, 2>& phase, std::ptrdiff_t n_azimuth) {
    if (phase.extent(0) < 1 || phase.extent(1) != n_azimuth)
        throw ShapeError("phase", "(at least 1, " + std::to_string(n_azimuth) + "), a value for every azimuth line",
                         shape_text(phase.extents()));
    require_finite(phase, "phase");
}

void require_centres(const std::vector<double>& centres, const ArrayView<const double, 2>& phase) {
    if (static_cast<std::ptrdiff_t>(centres.size()) != phase.extent(0))
        throw ShapeError("centres", std::to_string(phase.extent(0)) + " range gates, one for each row of phase",
                         std::to_string(centres.size()));
    for (std::size_t b = 0; b < centres.size(); ++b)
        if (!std::isfinite(centres[b]) || (b > 0 && !(centres[b] > centres[b - 1])))
            throw ValueError("centres", "finite, ascending range gates", number_text(centres[b]));
}

template <class Factors>
void correct(const ImageView& image, const StripmapGeometry& geometry, const Factors& factors, const MutableImageView& corrected,
             const AzimuthCorrectOptions& options) {
    const std::ptrdiff_t n = image.extent(0);
    const fft::Plan<float> forward(n, fft::Direction::forward);
    const fft::Plan<float> inverse(n, fft::Direction::inverse);
    const std::vector<double> f2 = squared_frequencies(geometry, n);
    const float scale = 1.0f / static_cast<float>(n);
    const bool even = geometry.doppler_centroid == 0.0;
    LineWorkspaces filters(options.execution, n);
    walk_gates(image, "image", corrected, "correct", options.execution, [&](cfloat* line, std::ptrdiff_t gate) {
        cfloat* filter = filters.line();
        phase_factors(f2.data(), even ? n / 2 + 1 : n, 0.5 / geometry.fm_rate(static_cast<std::size_t>(gate)), scale, filter);
        if (even) mirror(filter, n);
        if (options.before) options.before(gate, line);
        forward.execute(line);
        if (!is_finite(line[0])) return false;
        multiply(line, filter, n);
        inverse.execute(line);
        std::vector<cfloat> own;
        multiply(line, factors.of(gate, own), n);
        forward.execute(line);
        multiply_conjugate(line, filter, n);
        inverse.execute(line);
        if (options.after) options.after(gate, line);
        return true;
    });
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

void azimuth_correct(const ImageView& image, const StripmapGeometry& geometry, const ArrayView<const double, 2>& phase,
                     const std::vector<double>& centres, const MutableImageView& corrected, const AzimuthCorrectOptions& options) {
    require_strip(image, "image", geometry, corrected, "corrected");
    require_phase(phase, image.extent(0));
    require_centres(centres, phase);
    correct(image, geometry, PhaseOfGate(phase, centres), corrected, options);
}

void azimuth_correct(const ImageView& image, const StripmapGeometry& geometry, const ArrayView<const double, 2>& phase,
                     const ArrayView<const double, 2>& scale, const MutableImageView& corrected, const AzimuthCorrectOptions& options) {
    require_strip(image, "image", geometry, corrected, "corrected");
    require_phase(phase, image.extent(0));
    if (scale.extent(0) != phase.extent(0) || scale.extent(1) != image.extent(1))
        throw ShapeError("scale",
                         shape_text(std::array<std::ptrdiff_t, 2>{phase.extent(0), image.extent(1)}) + ", one for each row of phase",
                         shape_text(scale.extents()));
    require_finite(scale, "scale");
    correct(image, geometry, ScaledPhaseOfGate(phase, scale), corrected, options);
}

}  // namespace sarfocus::focus
