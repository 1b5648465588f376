#include "pulse_set.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <sarfocus/core/checks.hpp>
#include <sarfocus/focus/azimuth.hpp>

namespace sarfocus::autofocus::detail {
namespace {

std::size_t at(std::ptrdiff_t i) {
    return static_cast<std::size_t>(i);
}

std::ptrdiff_t aligned(std::ptrdiff_t n) {
    constexpr auto samples = static_cast<std::ptrdiff_t>(memory_alignment / sizeof(cfloat));
    return (n + samples - 1) / samples * samples;
}

}  // namespace

PulseSet::PulseSet(const ImageView& image, const Execution& execution) {
    const SpectrumSource source(image, execution);
    n_azimuth_ = image.extent(0);
    n_pulse_ = source.n_pulse();
    first_ = source.bin(0);
    first_bin_ = first_;
    for (std::ptrdiff_t c = 0; c < source.shape()[1]; ++c) gates_.push_back(source.range_gate(c));
    lines_ = Array<cfloat, 2>({n_gate(), aligned(n_azimuth_)});
    const float scale = 1.0f / std::sqrt(static_cast<float>(n_azimuth_));
    parallel_for(execution, "copy", n_gate(), [&](std::int64_t g) {
        for (std::ptrdiff_t k = 0; k < n_azimuth_; ++k) lines_(g, k) = source.spectrum()(g, k) * scale;
    });
    plan();
}

PulseSet::PulseSet(const ImageView& image, const geometry::StripmapGeometry& geometry, const Execution& execution) {
    strip_ = true;
    geometry_ = geometry;
    n_azimuth_ = image.extent(0);
    n_pulse_ = n_azimuth_;
    const auto n = static_cast<double>(n_azimuth_);
    first_bin_ = std::lround(geometry.doppler_centroid / geometry.prf * n - 0.5 * n) % n_azimuth_;
    if (first_bin_ < 0) first_bin_ += n_azimuth_;
    gates_ = strong_gates(image, execution);
    geometry_.slant_range.clear();
    for (const std::ptrdiff_t g : gates_) geometry_.slant_range.push_back(geometry.slant_range[at(g)]);
    lines_ = Array<cfloat, 2>({n_gate(), aligned(n_azimuth_)});
    parallel_for(execution, "copy", n_gate(), [&](std::int64_t c) {
        for (std::ptrdiff_t i = 0; i < n_azimuth_; ++i) lines_(c, i) = image(i, gates_[at(c)]);
    });
    to_pulses(lines_, execution);
}

void PulseSet::plan() {
    forward_ = std::make_shared<const fft::Plan<float>>(n_azimuth_, fft::Direction::forward);
    inverse_ = std::make_shared<const fft::Plan<float>>(n_azimuth_, fft::Direction::inverse);
}

PulseSet PulseSet::subset(const std::vector<std::ptrdiff_t>& columns) const {
    PulseSet out;
    out.strip_ = strip_;
    out.geometry_ = geometry_;
    out.n_azimuth_ = n_azimuth_;
    out.n_pulse_ = n_pulse_;
    out.first_ = first_;
    out.first_bin_ = first_bin_;
    out.forward_ = forward_;
    out.inverse_ = inverse_;
    out.geometry_.slant_range.clear();
    out.lines_ = Array<cfloat, 2>({static_cast<std::ptrdiff_t>(columns.size()), lines_.extent(1)});
    for (std::size_t c = 0; c < columns.size(); ++c) {
        out.gates_.push_back(gates_[at(columns[c])]);
        if (strip_) out.geometry_.slant_range.push_back(geometry_.slant_range[at(columns[c])]);
        std::copy_n(lines_.data() + columns[c] * lines_.extent(1), lines_.extent(1),
                    out.lines_.data() + static_cast<std::ptrdiff_t>(c) * lines_.extent(1));
    }
    return out;
}

PulseSet PulseSet::strongest(std::ptrdiff_t count, const Execution& execution) const {
    Array<cfloat, 2> image(lines_.extents());
    form(std::vector<double>(at(n_pulse_), 0.0), image, execution);
    std::vector<double> strength(gates_.size(), 0.0);
    parallel_for(execution, "choose range gates", n_gate(), [&](std::int64_t g) {
        for (std::ptrdiff_t i = 0; i < n_azimuth_; ++i) {
            const double intensity = std::norm(cdouble(image(g, i)));
            strength[at(g)] += intensity * intensity;
        }
    });
    std::vector<std::ptrdiff_t> columns(gates_.size());
    std::iota(columns.begin(), columns.end(), std::ptrdiff_t{0});
    std::stable_sort(columns.begin(), columns.end(), [&](std::ptrdiff_t a, std::ptrdiff_t b) { return strength[at(a)] > strength[at(b)]; });
    columns.resize(std::min(columns.size(), at(count)));
    std::sort(columns.begin(), columns.end());
    return subset(columns);
}

void PulseSet::transform(const fft::Plan<float>& plan, Array<cfloat, 2>& lines, const Execution& execution) const {
    const float scale = 1.0f / std::sqrt(static_cast<float>(n_azimuth_));
    parallel_for(execution, "transform", n_gate(), [&](std::int64_t g) {
        cfloat* line = lines.data() + g * lines.extent(1);
        plan.execute(line);
        for (std::ptrdiff_t k = 0; k < n_azimuth_; ++k) line[k] *= scale;
    });
}

void PulseSet::form(const std::vector<double>& phase, Array<cfloat, 2>& lines, const Execution& execution) const {
    std::vector<cfloat> factor(at(n_azimuth_), cfloat(1.0f, 0.0f));
    for (std::ptrdiff_t p = 0; p < n_pulse_; ++p) factor[at(place(p))] = cfloat(std::polar(1.0, -phase[at(p)]));
    parallel_for(execution, "turn", n_gate(), [&](std::int64_t g) {
        for (std::ptrdiff_t k = 0; k < n_azimuth_; ++k) lines(g, k) = lines_(g, k) * factor[at(k)];
    });
    if (strip_)
        focus::azimuth_compress(as_image(lines), geometry_, as_image(lines), {execution});
    else
        transform(*inverse_, lines, execution);
}

void PulseSet::to_pulses(Array<cfloat, 2>& lines, const Execution& execution) const {
    if (strip_)
        focus::azimuth_decompress(as_image(lines), geometry_, as_image(lines), {execution});
    else
        transform(*forward_, lines, execution);
}

std::vector<double> PulseSet::over_azimuth(const std::vector<double>& values, double elsewhere) const {
    std::vector<double> out(at(n_azimuth_), elsewhere);
    const std::ptrdiff_t shift = strip_ ? 0 : n_azimuth_ / 2;
    for (std::ptrdiff_t p = 0; p < n_pulse_; ++p) out[at((place(p) + shift) % n_azimuth_)] = values[at(p)];
    return out;
}

}  // namespace sarfocus::autofocus::detail
