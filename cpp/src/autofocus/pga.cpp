#include <sarfocus/autofocus/pga.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include <sarfocus/core/array.hpp>
#include <sarfocus/core/checks.hpp>
#include <sarfocus/core/constants.hpp>
#include <sarfocus/core/error.hpp>
#include <sarfocus/fft/plan.hpp>

#include "point_engine.hpp"
#include "point_source.hpp"

namespace sarfocus::autofocus {
namespace {

std::size_t at(std::ptrdiff_t i) {
    return static_cast<std::size_t>(i);
}

// Range gates worth estimating from: those with the largest sum of squared intensity, which a strong point raises most, defocused or not.
std::vector<std::ptrdiff_t> strong_gates(const ImageView& image, const Execution& execution) {
    const std::ptrdiff_t n_range = image.extent(1);
    constexpr std::ptrdiff_t at_least = 512;  // all of a small image; of a large one, a quarter loses next to nothing
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

// The azimuth spectrum of the strong gates. Its pulses are the occupied part of the spectrum, in the order in which it is one piece: a
// Doppler centroid may have folded it round the ends.
class SpectrumSource : public detail::PointSource {
public:
    SpectrumSource(const ImageView& image, const Execution& execution)
        : n_azimuth_(image.extent(0)),
          gates_(strong_gates(image, execution)),
          spectrum_({static_cast<std::ptrdiff_t>(gates_.size()), n_azimuth_}),
          inverse_(n_azimuth_, fft::Direction::inverse) {
        const fft::Plan<float> forward(n_azimuth_, fft::Direction::forward);
        parallel_for(execution, "azimuth spectrum", spectrum_.extent(0), [&](std::int64_t c) {
            Array<cfloat, 1> line({n_azimuth_});
            for (std::ptrdiff_t i = 0; i < n_azimuth_; ++i) line(i) = image(i, gates_[at(c)]);
            forward.execute(line.data());
            std::copy_n(line.data(), n_azimuth_, spectrum_.data() + c * n_azimuth_);
        });
        find_support();
    }

    [[nodiscard]] std::ptrdiff_t n_pulse() const override { return n_pulse_; }
    [[nodiscard]] std::array<std::ptrdiff_t, 2> shape() const override { return {n_azimuth_, spectrum_.extent(0)}; }
    [[nodiscard]] std::ptrdiff_t range_gate(std::ptrdiff_t column) const override { return gates_[at(column)]; }
    [[nodiscard]] bool fractional_columns() const override { return false; }
    [[nodiscard]] bool is_list() const override { return false; }
    [[nodiscard]] double sum_scale() const override { return static_cast<double>(n_azimuth_) * static_cast<double>(n_azimuth_); }

    void form(const std::vector<double>& phase, MutableImageView image, const Execution& execution) override {
        std::vector<cfloat> factor(at(n_azimuth_), cfloat(1.0f / static_cast<float>(n_azimuth_), 0.0f));
        for (std::ptrdiff_t p = 0; p < n_pulse_; ++p) factor[at(bin(p))] *= cfloat(std::polar(1.0, -phase[at(p)]));
        parallel_for(execution, "form", spectrum_.extent(0), [&](std::int64_t c) {
            Array<cfloat, 1> line({n_azimuth_});
            for (std::ptrdiff_t k = 0; k < n_azimuth_; ++k) line(k) = spectrum_(c, k) * factor[at(k)];
            inverse_.execute(line.data());
            for (std::ptrdiff_t i = 0; i < n_azimuth_; ++i) image(i, c) = line(i);
        });
    }

    void histories(const std::vector<detail::Pixel>& points, MutableImageView histories, const Execution& execution) override {
        parallel_for(execution, "histories", static_cast<std::int64_t>(points.size()), [&](std::int64_t n) {
            const detail::Pixel& point = points[at(n)];
            const std::ptrdiff_t column = std::lround(point.column);
            const double step = two_pi * point.azimuth / static_cast<double>(n_azimuth_);
            for (std::ptrdiff_t p = 0; p < n_pulse_; ++p)
                histories(n, p) =
                    spectrum_(column, bin(p)) * cfloat(std::polar(1.0, std::remainder(step * static_cast<double>(first_ + p), two_pi)));
        });
    }

    // From pulses to fftshift(fft(image)): index p of the support goes to its place among all n_azimuth.
    [[nodiscard]] std::vector<double> over_spectrum(const std::vector<double>& values, double elsewhere) const {
        std::vector<double> out(at(n_azimuth_), elsewhere);
        for (std::ptrdiff_t p = 0; p < n_pulse_; ++p) out[at((bin(p) + n_azimuth_ / 2) % n_azimuth_)] = values[at(p)];
        return out;
    }

private:
    // Unshifted transform bin of pulse p.
    [[nodiscard]] std::ptrdiff_t bin(std::ptrdiff_t p) const { return ((first_ + p) % n_azimuth_ + n_azimuth_) % n_azimuth_; }

    // Occupied: power above -20 dB of the spectrum's upper level, averaged over at least 64 samples. The largest gap is what is left out.
    void find_support() {
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

    std::ptrdiff_t n_azimuth_;
    std::vector<std::ptrdiff_t> gates_;
    Array<cfloat, 2> spectrum_;
    fft::Plan<float> inverse_;
    std::ptrdiff_t first_ = 0;  // frequency index of pulse 0
    std::ptrdiff_t n_pulse_ = 0;
};

void require_image(const ImageView& image, const MutableImageView& corrected, const Execution& execution) {
    require_not_empty(image, "image");
    require_same_shape(corrected, "out", image, "image");
    require_finite(image, "image", execution.threads);
}

void copy(const ImageView& from, MutableImageView to) {
    if (from.data() == to.data() && from.strides() == to.strides()) return;
    for (std::ptrdiff_t i = 0; i < from.extent(0); ++i)
        for (std::ptrdiff_t j = 0; j < from.extent(1); ++j) to(i, j) = from(i, j);
}

}  // namespace

void correct_azimuth_spectrum(const ImageView& image, const std::vector<double>& phase, MutableImageView corrected,
                              const Execution& execution) {
    require_image(image, corrected, execution);
    const std::ptrdiff_t n = image.extent(0);
    if (static_cast<std::ptrdiff_t>(phase.size()) != n)
        throw ShapeError("phase", std::to_string(n) + " values", std::to_string(phase.size()));
    std::vector<cfloat> factor(at(n));
    for (std::ptrdiff_t k = 0; k < n; ++k) factor[at(k)] = cfloat(std::polar(1.0 / static_cast<double>(n), -phase[at((k + n / 2) % n)]));
    const fft::Plan<float> forward(n, fft::Direction::forward);
    const fft::Plan<float> inverse(n, fft::Direction::inverse);
    parallel_for(execution, "correct", image.extent(1), [&](std::int64_t j) {
        Array<cfloat, 1> line({n});
        for (std::ptrdiff_t i = 0; i < n; ++i) line(i) = image(i, j);
        forward.execute(line.data());
        for (std::ptrdiff_t k = 0; k < n; ++k) line(k) *= factor[at(k)];
        inverse.execute(line.data());
        for (std::ptrdiff_t i = 0; i < n; ++i) corrected(i, j) = line(i);
    });
}

Result pga(const ImageView& image, MutableImageView corrected, const PointOptions& options) {
    options.validate();
    require_image(image, corrected, options.execution);
    if (image.extent(0) < 16) throw ShapeError("image", "at least 16 azimuth lines", shape_text(image.extents()));
    bool empty = true;
    for (std::ptrdiff_t i = 0; i < image.extent(0) && empty; ++i)
        for (std::ptrdiff_t j = 0; j < image.extent(1) && empty; ++j) empty = image(i, j) == cfloat{};
    if (empty) throw NumericalError("image: expected pixels other than zero, got all zero");

    SpectrumSource source(image, options.execution);
    Result result = detail::estimate_from_points(source, options);
    result.method = "pga";
    result.estimate = source.over_spectrum(result.estimate, 0.0);
    result.phase_std = source.over_spectrum(result.phase_std, std::numeric_limits<double>::quiet_NaN());
    if (result.input_returned()) {
        result.phase_error.assign(result.estimate.size(), 0.0);
        copy(image, corrected);
    } else {
        result.phase_error = result.estimate;
        correct_azimuth_spectrum(image, result.phase_error, corrected, options.execution);
    }
    return result;
}

}  // namespace sarfocus::autofocus
