#include "spectrum_source.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include <sarfocus/core/checks.hpp>
#include <sarfocus/core/complex_product.hpp>
#include <sarfocus/core/constants.hpp>
#include <sarfocus/core/multiversion.hpp>

#include "gate_blocks.hpp"
#include "gate_picture.hpp"
#include "line_sums.hpp"
#include "strip_lines.hpp"

namespace sarfocus::autofocus::detail {
namespace {

constexpr std::ptrdiff_t gates_of_a_sum = 512;  // of which the sums stay in the first cache
constexpr std::ptrdiff_t lines_of_a_gather = 64;

// Sum of squared intensity of some gates, azimuth line after azimuth line.
SARFOCUS_MULTIVERSION void add_squares(const cfloat* line, std::ptrdiff_t gates, double* sum) {
    const auto* x = reinterpret_cast<const float*>(line);
    for (std::ptrdiff_t g = 0; g < gates; ++g) {
        const double re = static_cast<double>(x[2 * g]);
        const double im = static_cast<double>(x[2 * g + 1]);
        const double intensity = re * re + im * im;
        sum[g] += intensity * intensity;
    }
}

double sum_of_squares(const ImageView& image, std::ptrdiff_t gate) {
    double sum = 0.0;
    for (std::ptrdiff_t i = 0; i < image.extent(0); ++i) add_squares(&image(i, gate), 1, &sum);
    return sum;
}

// [n_range], in the order in which the image lies in memory; the same bits either way.
std::vector<double> strengths(const ImageView& image, const Execution& execution) {
    const std::ptrdiff_t n_range = image.extent(1);
    std::vector<double> out(at(n_range), 0.0);
    if (image.stride(1) != 1) {
        parallel_for(execution, "choose range gates", n_range, [&](std::int64_t j) { out[at(j)] = sum_of_squares(image, j); });
        return out;
    }
    parallel_for(execution, "choose range gates", (n_range + gates_of_a_sum - 1) / gates_of_a_sum, [&](std::int64_t b) {
        const std::ptrdiff_t first = b * gates_of_a_sum;
        const std::ptrdiff_t count = std::min(gates_of_a_sum, n_range - first);
        for (std::ptrdiff_t i = 0; i < image.extent(0); ++i) add_squares(&image(i, first), count, out.data() + first);
    });
    return out;
}

// Columns of an image to lines behind one another, in the order in which the image lies in memory.
void gather(const ImageView& image, const std::vector<std::ptrdiff_t>& gates, Array<cfloat, 2>& lines, const Execution& execution) {
    const std::ptrdiff_t n = image.extent(0);
    const auto count = static_cast<std::ptrdiff_t>(gates.size());
    if (std::abs(image.stride(0)) <= std::abs(image.stride(1))) {
        parallel_for(execution, "gather", count, [&](std::int64_t c) {
            for (std::ptrdiff_t i = 0; i < n; ++i) lines.data()[c * n + i] = image(i, gates[at(c)]);
        });
        return;
    }
    parallel_for(execution, "gather", (n + lines_of_a_gather - 1) / lines_of_a_gather, [&](std::int64_t b) {
        const std::ptrdiff_t first = b * lines_of_a_gather;
        const std::ptrdiff_t last = std::min(first + lines_of_a_gather, n);
        Array<cfloat, 2> tile({count, lines_of_a_gather + 8});  // its pitch keeps the gates out of each other's cache sets
        for (std::ptrdiff_t i = first; i < last; ++i)
            for (std::ptrdiff_t c = 0; c < count; ++c) tile.data()[c * tile.extent(1) + i - first] = image(i, gates[at(c)]);
        for (std::ptrdiff_t c = 0; c < count; ++c)
            std::copy_n(tile.data() + c * tile.extent(1), last - first, lines.data() + c * n + first);
    });
}

}  // namespace

std::vector<std::ptrdiff_t> strong_gates(const ImageView& image, const Execution& execution) {
    const std::ptrdiff_t n_range = image.extent(1);
    constexpr std::ptrdiff_t at_least = 512;
    constexpr std::ptrdiff_t share = 8;
    const std::ptrdiff_t count = std::min(n_range, std::max(at_least, n_range / share));
    std::vector<std::ptrdiff_t> gates(at(n_range));
    std::iota(gates.begin(), gates.end(), std::ptrdiff_t{0});
    if (count == n_range) return gates;
    const std::vector<double> strength = strengths(image, execution);
    if (!std::all_of(strength.begin(), strength.end(), [](double s) { return std::isfinite(s); }))
        require_finite(image, "image", execution.threads);
    std::stable_sort(gates.begin(), gates.end(), [&](std::ptrdiff_t a, std::ptrdiff_t b) { return strength[at(a)] > strength[at(b)]; });
    gates.resize(at(count));
    std::sort(gates.begin(), gates.end());
    return gates;
}

bool is_large(const ImageView& image) {
    constexpr std::ptrdiff_t whole = 1024 * 1024;
    return image.size() > whole;
}

SpectrumSource::SpectrumSource(const ImageView& image, const Execution& execution)
    : SpectrumSource(image, strong_gates(image, execution), execution) {}

SpectrumSource::SpectrumSource(const ImageView& image, std::vector<std::ptrdiff_t> gates, const Execution& execution)
    : n_azimuth_(image.extent(0)),
      large_(detail::is_large(image)),
      gates_(std::move(gates)),
      spectrum_({static_cast<std::ptrdiff_t>(gates_.size()), n_azimuth_}),
      inverse_(n_azimuth_, fft::Direction::inverse) {
    const fft::Plan<float> forward(n_azimuth_, fft::Direction::forward);
    gather(image, gates_, spectrum_, execution);
    GateBlocks blocks(1, n_azimuth_, execution);
    parallel_for(execution, "azimuth spectrum", spectrum_.extent(0), [&](std::int64_t c) {
        cfloat* line = blocks.mine().gate(0);
        std::copy_n(spectrum_.data() + c * n_azimuth_, n_azimuth_, line);
        forward.execute(line);
        std::copy_n(line, n_azimuth_, spectrum_.data() + c * n_azimuth_);
    });
    find_support(execution);
}

std::vector<cfloat> SpectrumSource::factors(const std::vector<double>& phase) const {
    std::vector<cfloat> out(at(n_azimuth_), cfloat(1.0f / static_cast<float>(n_azimuth_), 0.0f));
    for (std::ptrdiff_t p = 0; p < n_pulse_; ++p) out[at(bin(p))] *= cfloat(std::polar(1.0, -phase[at(p)]));
    return out;
}

std::unique_ptr<Picture> SpectrumSource::picture(const PictureRequest& request, const Execution& execution) {
    if (!large_) return PointSource::picture(request, execution);
    return std::make_unique<GatePicture>(*this, request.piece, execution);
}

void SpectrumSource::form(const std::vector<double>& phase, MutableImageView image, const Execution& execution) {
    const std::vector<cfloat> factor = factors(phase);
    const focus::BlocksOfGates gates(image, image);
    GateBlocks blocks(gates.width(), n_azimuth_, execution);
    parallel_for(execution, "form", gates.count(), [&](std::int64_t b) {
        const std::ptrdiff_t begin = gates.first(b);
        const std::ptrdiff_t count = gates.gates(b);
        focus::GateBlock& block = blocks.mine();
        for (std::ptrdiff_t g = 0; g < count; ++g) {
            cfloat* line = block.gate(g);
            for (std::ptrdiff_t k = 0; k < n_azimuth_; ++k) line[k] = spectrum_(begin + g, k) * factor[at(k)];
            inverse_.execute(line);
        }
        block.store(image.slice(1, begin, count), gates.past_cache());
    });
}

void SpectrumSource::histories(const std::vector<Pixel>& points, MutableImageView histories, const Execution& execution) {
    parallel_for(execution, "histories", static_cast<std::int64_t>(points.size()), [&](std::int64_t n) {
        const Pixel& point = points[at(n)];
        const cfloat* spectrum = spectrum_.data() + std::lround(point.column) * n_azimuth_;
        const double slope = two_pi * point.azimuth / static_cast<double>(n_azimuth_);
        if (large_) {
            const std::ptrdiff_t before_end = std::min(n_azimuth_ - bin(0), n_pulse_);
            turn_line(spectrum + bin(0), before_end, slope, static_cast<double>(first_), &histories(n, 0));
            turn_line(spectrum, n_pulse_ - before_end, slope, static_cast<double>(first_ + before_end), &histories(n, 0) + before_end);
            return;
        }
        Ramp ramp(slope, static_cast<double>(first_));
        std::ptrdiff_t k = bin(0);
        for (std::ptrdiff_t p = 0; p < n_pulse_; ++p) {
            histories(n, p) = spectrum[k] * cfloat(ramp.next());
            k = k + 1 < n_azimuth_ ? k + 1 : 0;
        }
    });
}

void SpectrumSource::replace(const ImageView& lines, const Array<float, 2>& factor, const Execution& execution) {
    const fft::Plan<float> forward(n_azimuth_, fft::Direction::forward);
    parallel_for(execution, "azimuth spectrum", spectrum_.extent(0), [&](std::int64_t c) {
        Array<cfloat, 1> line({n_azimuth_});
        for (std::ptrdiff_t i = 0; i < n_azimuth_; ++i) line(i) = lines(i, c);
        forward.execute(line.data());
        for (std::ptrdiff_t k = 0; k < n_azimuth_; ++k) spectrum_(c, k) = line(k) * factor(c, k);
    });
}

std::vector<double> SpectrumSource::over_spectrum(const std::vector<double>& values, double elsewhere) const {
    std::vector<double> out(at(n_azimuth_), elsewhere);
    for (std::ptrdiff_t p = 0; p < n_pulse_; ++p) out[at((bin(p) + n_azimuth_ / 2) % n_azimuth_)] = values[at(p)];
    return out;
}

// Occupied: power above -20 dB of the spectrum's upper level, averaged over at least 64 samples. The largest gap is what is left out.
void SpectrumSource::find_support(const Execution& execution) {
    constexpr std::ptrdiff_t bins_of_a_task = 256;
    std::vector<double> power(at(n_azimuth_), 0.0);
    parallel_for(execution, "support", (n_azimuth_ + bins_of_a_task - 1) / bins_of_a_task, [&](std::int64_t b) {
        const std::ptrdiff_t last = std::min((b + 1) * bins_of_a_task, n_azimuth_);
        for (std::ptrdiff_t c = 0; c < spectrum_.extent(0); ++c)
            for (std::ptrdiff_t k = b * bins_of_a_task; k < last; ++k)
                power[at(k)] += std::norm(cdouble(spectrum_.data()[c * n_azimuth_ + k]));
    });
    const std::ptrdiff_t half = std::min((64 / spectrum_.extent(0) + 1) / 2, n_azimuth_ / 32);
    std::vector<double> smooth(at(n_azimuth_), 0.0);
    for (std::ptrdiff_t k = 0; k < n_azimuth_; ++k)
        for (std::ptrdiff_t d = -half; d <= half; ++d) smooth[at(k)] += power[at((k + d + n_azimuth_) % n_azimuth_)];
    std::vector<double> sorted = smooth;
    std::nth_element(sorted.begin(), sorted.begin() + (9 * n_azimuth_) / 10, sorted.end());
    const double threshold = sorted[at((9 * n_azimuth_) / 10)] * 0.01;
    std::ptrdiff_t longest = 0;
    std::ptrdiff_t gap_end = 0;
    std::ptrdiff_t run = 0;
    for (std::ptrdiff_t k = 0; k < 2 * n_azimuth_; ++k) {
        run = smooth[at(k % n_azimuth_)] < threshold ? run + 1 : 0;
        if (run > longest && run < n_azimuth_) {
            longest = run;
            gap_end = k + 1;
        }
    }
    // The frequency axis starts behind the gap, or in the middle of the negative half where there is none.
    first_ = longest > 0 ? gap_end % n_azimuth_ : -(n_azimuth_ / 2);
    if (first_ > n_azimuth_ / 2) first_ -= n_azimuth_;
    n_pulse_ = n_azimuth_ - longest;
}

void correct_spectrum(const ImageView& image, const std::vector<double>& phase, const MutableImageView& corrected,
                      quality::EntropySums* before, quality::EntropySums* after, const Execution& execution) {
    const std::ptrdiff_t n = image.extent(0);
    std::vector<cfloat> factor(at(n));
    for (std::ptrdiff_t k = 0; k < n; ++k) factor[at(k)] = cfloat(std::polar(1.0 / static_cast<double>(n), -phase[at((k + n / 2) % n)]));
    const fft::Plan<float> forward(n, fft::Direction::forward);
    const fft::Plan<float> inverse(n, fft::Direction::inverse);
    const bool measured = before != nullptr && after != nullptr;
    std::vector<std::array<quality::EntropySums, 2>> sums(measured ? at(image.extent(1)) : 0);
    const focus::BlocksOfGates gates(image, corrected);
    GateBlocks blocks(gates.width(), n, execution);
    parallel_for(execution, "correct", gates.count(), [&](std::int64_t b) {
        const std::ptrdiff_t begin = gates.first(b);
        const std::ptrdiff_t count = gates.gates(b);
        focus::GateBlock& block = blocks.mine();
        block.load(image.slice(1, begin, count));
        for (std::ptrdiff_t g = 0; g < count; ++g) {
            cfloat* line = block.gate(g);
            if (measured) sums[at(begin + g)][0] = quality::entropy_sums(line, n);
            forward.execute(line);
            for (std::ptrdiff_t k = 0; k < n; ++k) line[k] = product(line[k], factor[at(k)]);
            inverse.execute(line);
            if (measured) sums[at(begin + g)][1] = quality::entropy_sums(line, n);
        }
        block.store(corrected.slice(1, begin, count), gates.past_cache());
    });
    for (const auto& gate : sums) {
        *before += gate[0];
        *after += gate[1];
    }
}

}  // namespace sarfocus::autofocus::detail
