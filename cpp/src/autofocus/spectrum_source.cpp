#include "spectrum_source.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include <omp.h>

#include <sarfocus/core/constants.hpp>

#include "strip_lines.hpp"

namespace sarfocus::autofocus::detail {
namespace {

constexpr std::ptrdiff_t gates_of_a_block = 8;  // a cache line of a row-major image

// Aligned lines of azimuth for a block of gates, one workspace a thread.
class Lines {
public:
    Lines(std::ptrdiff_t n_azimuth, const Execution& execution)
        : n_azimuth_(n_azimuth),
          stride_((n_azimuth + 7) / 8 * 8),
          workspaces_(static_cast<std::size_t>(resolve_threads(execution.threads))) {}

    // Line g of the calling thread's workspace at data() + g * stride().
    [[nodiscard]] cfloat* mine() {
        auto& workspace = workspaces_[static_cast<std::size_t>(omp_get_thread_num())];
        if (workspace.empty()) workspace = Array<cfloat, 1>({stride_ * gates_of_a_block});
        return workspace.data();
    }
    [[nodiscard]] std::ptrdiff_t stride() const { return stride_; }
    [[nodiscard]] std::ptrdiff_t n_azimuth() const { return n_azimuth_; }

private:
    std::ptrdiff_t n_azimuth_;
    std::ptrdiff_t stride_;
    std::vector<Array<cfloat, 1>> workspaces_;
};

std::ptrdiff_t blocks_of(std::ptrdiff_t gates) {
    return (gates + gates_of_a_block - 1) / gates_of_a_block;
}

}  // namespace

std::vector<std::ptrdiff_t> strong_gates(const ImageView& image, const Execution& execution) {
    const std::ptrdiff_t n_range = image.extent(1);
    constexpr std::ptrdiff_t at_least = 512;
    const std::ptrdiff_t count = std::min(n_range, std::max(at_least, n_range / 4));
    std::vector<std::ptrdiff_t> gates(at(n_range));
    std::iota(gates.begin(), gates.end(), std::ptrdiff_t{0});
    if (count == n_range) return gates;
    std::vector<double> strength(at(n_range), 0.0);
    parallel_for(execution, "choose range gates", n_range, [&](std::int64_t j) {
        double sum = 0.0;
        for (std::ptrdiff_t i = 0; i < image.extent(0); ++i) {
            const double intensity = std::norm(cdouble(image(i, j)));
            sum += intensity * intensity;
        }
        strength[at(j)] = sum;
    });
    std::stable_sort(gates.begin(), gates.end(), [&](std::ptrdiff_t a, std::ptrdiff_t b) { return strength[at(a)] > strength[at(b)]; });
    gates.resize(at(count));
    std::sort(gates.begin(), gates.end());
    return gates;
}

SpectrumSource::SpectrumSource(const ImageView& image, const Execution& execution)
    : SpectrumSource(image, strong_gates(image, execution), execution) {}

SpectrumSource::SpectrumSource(const ImageView& image, std::vector<std::ptrdiff_t> gates, const Execution& execution)
    : n_azimuth_(image.extent(0)),
      gates_(std::move(gates)),
      spectrum_({static_cast<std::ptrdiff_t>(gates_.size()), n_azimuth_}),
      inverse_(n_azimuth_, fft::Direction::inverse) {
    const fft::Plan<float> forward(n_azimuth_, fft::Direction::forward);
    Lines lines(n_azimuth_, execution);
    parallel_for(execution, "azimuth spectrum", blocks_of(spectrum_.extent(0)), [&](std::int64_t b) {
        const std::ptrdiff_t begin = b * gates_of_a_block;
        const std::ptrdiff_t end = std::min(begin + gates_of_a_block, spectrum_.extent(0));
        cfloat* work = lines.mine();
        for (std::ptrdiff_t i = 0; i < n_azimuth_; ++i)
            for (std::ptrdiff_t c = begin; c < end; ++c) work[(c - begin) * lines.stride() + i] = image(i, gates_[at(c)]);
        for (std::ptrdiff_t c = begin; c < end; ++c) {
            cfloat* line = work + (c - begin) * lines.stride();
            forward.execute(line);
            std::copy_n(line, n_azimuth_, spectrum_.data() + c * n_azimuth_);
        }
    });
    find_support();
}

void SpectrumSource::form(const std::vector<double>& phase, MutableImageView image, const Execution& execution) {
    std::vector<cfloat> factor(at(n_azimuth_), cfloat(1.0f / static_cast<float>(n_azimuth_), 0.0f));
    for (std::ptrdiff_t p = 0; p < n_pulse_; ++p) factor[at(bin(p))] *= cfloat(std::polar(1.0, -phase[at(p)]));
    Lines lines(n_azimuth_, execution);
    parallel_for(execution, "form", blocks_of(spectrum_.extent(0)), [&](std::int64_t b) {
        const std::ptrdiff_t begin = b * gates_of_a_block;
        const std::ptrdiff_t end = std::min(begin + gates_of_a_block, spectrum_.extent(0));
        cfloat* work = lines.mine();
        for (std::ptrdiff_t c = begin; c < end; ++c) {
            cfloat* line = work + (c - begin) * lines.stride();
            for (std::ptrdiff_t k = 0; k < n_azimuth_; ++k) line[k] = spectrum_(c, k) * factor[at(k)];
            inverse_.execute(line);
        }
        for (std::ptrdiff_t i = 0; i < n_azimuth_; ++i)
            for (std::ptrdiff_t c = begin; c < end; ++c) image(i, c) = work[(c - begin) * lines.stride() + i];
    });
}

void SpectrumSource::histories(const std::vector<Pixel>& points, MutableImageView histories, const Execution& execution) {
    parallel_for(execution, "histories", static_cast<std::int64_t>(points.size()), [&](std::int64_t n) {
        const Pixel& point = points[at(n)];
        const cfloat* spectrum = spectrum_.data() + std::lround(point.column) * n_azimuth_;
        Ramp ramp(two_pi * point.azimuth / static_cast<double>(n_azimuth_), static_cast<double>(first_));
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
void SpectrumSource::find_support() {
    std::vector<double> power(at(n_azimuth_), 0.0);
    for (std::ptrdiff_t c = 0; c < spectrum_.extent(0); ++c)
        for (std::ptrdiff_t k = 0; k < n_azimuth_; ++k) power[at(k)] += std::norm(cdouble(spectrum_(c, k)));
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
    Lines lines(n, execution);
    const bool measured = before != nullptr && after != nullptr;
    std::vector<std::array<quality::EntropySums, 2>> sums(measured ? at(image.extent(1)) : 0);
    parallel_for(execution, "correct", blocks_of(image.extent(1)), [&](std::int64_t b) {
        const std::ptrdiff_t begin = b * gates_of_a_block;
        const std::ptrdiff_t end = std::min(begin + gates_of_a_block, image.extent(1));
        cfloat* work = lines.mine();
        for (std::ptrdiff_t i = 0; i < n; ++i)
            for (std::ptrdiff_t j = begin; j < end; ++j) work[(j - begin) * lines.stride() + i] = image(i, j);
        for (std::ptrdiff_t j = begin; j < end; ++j) {
            cfloat* line = work + (j - begin) * lines.stride();
            if (measured) sums[at(j)][0] = quality::entropy_sums(line, n);
            forward.execute(line);
            for (std::ptrdiff_t k = 0; k < n; ++k) line[k] *= factor[at(k)];
            inverse.execute(line);
            if (measured) sums[at(j)][1] = quality::entropy_sums(line, n);
        }
        for (std::ptrdiff_t i = 0; i < n; ++i)
            for (std::ptrdiff_t j = begin; j < end; ++j) corrected(i, j) = work[(j - begin) * lines.stride() + i];
    });
    for (const auto& gate : sums) {
        *before += gate[0];
        *after += gate[1];
    }
}

}  // namespace sarfocus::autofocus::detail
