#include "pulse_set.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include <sarfocus/core/checks.hpp>
#include <sarfocus/core/complex_product.hpp>
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

// The same lines, each aligned; in their memory where they are.
Array<cfloat, 2> aligned_lines(Array<cfloat, 2> lines) {
    const std::ptrdiff_t n = lines.extent(1);
    if (aligned(n) == n) return lines;
    Array<cfloat, 2> out({lines.extent(0), aligned(n)});
    for (std::ptrdiff_t c = 0; c < lines.extent(0); ++c) std::copy_n(lines.data() + c * n, n, out.data() + c * out.extent(1));
    return out;
}

}  // namespace

PulseSet::PulseSet(const ImageView& image, const Execution& execution) {
    SpectrumSource source(image, execution);
    n_azimuth_ = image.extent(0);
    n_pulse_ = source.n_pulse();
    first_ = source.bin(0);
    first_bin_ = first_;
    for (std::ptrdiff_t c = 0; c < source.shape()[1]; ++c) gates_.push_back(source.range_gate(c));
    Array<cfloat, 2> lines = aligned_lines(source.take_spectrum());
    const float scale = 1.0f / std::sqrt(static_cast<float>(n_azimuth_));
    for (cfloat& sample : lines) sample *= scale;
    share(std::move(lines), {});
    plan();
    measure_energy();
}

PulseSet::PulseSet(const ImageView& image, const geometry::StripmapGeometry& geometry, const Execution& execution) {
    n_azimuth_ = image.extent(0);
    n_pulse_ = n_azimuth_;
    const auto n = static_cast<double>(n_azimuth_);
    first_bin_ = std::lround(geometry.doppler_centroid / geometry.prf * n - 0.5 * n) % n_azimuth_;
    if (first_bin_ < 0) first_bin_ += n_azimuth_;
    gates_ = strong_gates(image, execution);
    geometry::StripmapGeometry of_gates = geometry;
    of_gates.slant_range.clear();
    for (const std::ptrdiff_t g : gates_) of_gates.slant_range.push_back(geometry.slant_range[at(g)]);
    plan();
    // The spectrum of azimuth compression is that of a compressed impulse.
    Array<cfloat, 2> chirps({n_gate(), line_length()});
    for (std::ptrdiff_t c = 0; c < n_gate(); ++c) chirps(c, 0) = 1.0f / static_cast<float>(n_azimuth_);
    focus::azimuth_compress(as_image(chirps), of_gates, as_image(chirps), {execution});
    Array<cfloat, 2> lines({n_gate(), line_length()});
    parallel_for(execution, "copy", n_gate(), [&](std::int64_t c) {
        cfloat* chirp = chirps.data() + c * chirps.extent(1);
        cfloat* line = lines.data() + c * lines.extent(1);
        forward_->execute(chirp);
        for (std::ptrdiff_t i = 0; i < n_azimuth_; ++i) line[i] = image(i, gates_[at(c)]);
        slow_time(chirp, line);
    });
    share(std::move(lines), std::move(chirps));
    measure_energy();
}

std::ptrdiff_t PulseSet::line_length() const {
    return aligned(n_azimuth_);
}

void PulseSet::share(Array<cfloat, 2> lines, Array<cfloat, 2> chirps) {
    lines_ = std::make_shared<const Array<cfloat, 2>>(std::move(lines));
    if (!chirps.empty()) chirps_ = std::make_shared<const Array<cfloat, 2>>(std::move(chirps));
    rows_.resize(gates_.size());
    std::iota(rows_.begin(), rows_.end(), std::ptrdiff_t{0});
}

void PulseSet::plan() {
    forward_ = std::make_shared<const fft::Plan<float>>(n_azimuth_, fft::Direction::forward);
    inverse_ = std::make_shared<const fft::Plan<float>>(n_azimuth_, fft::Direction::inverse);
}

void PulseSet::measure_energy() {
    energy_ = 0.0;
    for (std::ptrdiff_t g = 0; g < n_gate(); ++g)
        for (std::ptrdiff_t k = 0; k < n_azimuth_; ++k) energy_ += std::norm(cdouble(pulses(g)[k]));
}

PulseSet PulseSet::subset(const std::vector<std::ptrdiff_t>& columns) const {
    PulseSet out;
    out.n_azimuth_ = n_azimuth_;
    out.n_pulse_ = n_pulse_;
    out.first_ = first_;
    out.first_bin_ = first_bin_;
    out.forward_ = forward_;
    out.inverse_ = inverse_;
    out.lines_ = lines_;
    out.chirps_ = chirps_;
    for (const std::ptrdiff_t c : columns) {
        out.gates_.push_back(gates_[at(c)]);
        out.rows_.push_back(rows_[at(c)]);
    }
    out.measure_energy();
    return out;
}

PulseSet PulseSet::strongest(std::ptrdiff_t count, const Execution& execution) const {
    const std::vector<cfloat> factor = factors(std::vector<double>(at(n_pulse_), 0.0));
    std::vector<double> strength(gates_.size(), 0.0);
    parallel_for(execution, "choose range gates", n_gate(), [&](std::int64_t g) {
        Array<cfloat, 1> line({n_azimuth_});
        form_line(g, factor, line.data());
        for (const cfloat& sample : line) {
            const double intensity = std::norm(cdouble(sample));
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

std::vector<cfloat> PulseSet::factors(const std::vector<double>& phase) const {
    const float scale = strip() ? 1.0f : 1.0f / std::sqrt(static_cast<float>(n_azimuth_));
    std::vector<cfloat> out(at(n_azimuth_), cfloat(scale, 0.0f));
    for (std::ptrdiff_t p = 0; p < n_pulse_; ++p) out[at(place(p))] = scale * cfloat(std::polar(1.0, -phase[at(p)]));
    return out;
}

void PulseSet::form_line(std::ptrdiff_t gate, const std::vector<cfloat>& factors, cfloat* line) const {
    const cfloat* own = pulses(gate);
    for (std::ptrdiff_t k = 0; k < n_azimuth_; ++k) line[k] = product(own[k], factors[at(k)]);
    if (strip()) {
        const cfloat* chirp = row(*chirps_, gate);
        forward_->execute(line);
        for (std::ptrdiff_t k = 0; k < n_azimuth_; ++k) line[k] = product(line[k], chirp[k]);
    }
    inverse_->execute(line);
}

void PulseSet::to_pulses(std::ptrdiff_t gate, cfloat* line) const {
    if (strip()) return slow_time(row(*chirps_, gate), line);
    forward_->execute(line);
    const float scale = 1.0f / std::sqrt(static_cast<float>(n_azimuth_));
    for (std::ptrdiff_t k = 0; k < n_azimuth_; ++k) line[k] *= scale;
}

void PulseSet::slow_time(const cfloat* chirp, cfloat* line) const {
    forward_->execute(line);
    for (std::ptrdiff_t k = 0; k < n_azimuth_; ++k) line[k] = product(line[k], std::conj(chirp[k]));
    inverse_->execute(line);
}

void PulseSet::form(const std::vector<double>& phase, Array<cfloat, 2>& lines, const Execution& execution) const {
    const std::vector<cfloat> factor = factors(phase);
    parallel_for(execution, "form", n_gate(), [&](std::int64_t g) { form_line(g, factor, lines.data() + g * lines.extent(1)); });
}

std::vector<double> PulseSet::over_azimuth(const std::vector<double>& values, double elsewhere) const {
    std::vector<double> out(at(n_azimuth_), elsewhere);
    const std::ptrdiff_t shift = strip() ? 0 : n_azimuth_ / 2;
    for (std::ptrdiff_t p = 0; p < n_pulse_; ++p) out[at((place(p) + shift) % n_azimuth_)] = values[at(p)];
    return out;
}

}  // namespace sarfocus::autofocus::detail
