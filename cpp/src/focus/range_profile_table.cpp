#include "range_profile_table.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/Dense>

#include <sarfocus/core/complex_product.hpp>
#include <sarfocus/core/constants.hpp>
#include <sarfocus/core/multiversion.hpp>

namespace sarfocus::focus::detail {
namespace {

constexpr std::ptrdiff_t guard_samples = 32;
constexpr std::ptrdiff_t chunk = ProfileLayout::chunk;
constexpr std::size_t orders = ProfileLayout::degree + 1;

// Coefficients of x^0 … x^3 in the cubic Legendre approximation of exp(j w x) on |x| <= 1/2: the odd ones are imaginary, of which the
// imaginary part is given. w >= 0.
std::array<double, orders> cubic_of_frequency(double w) {
    std::array<double, orders> legendre{};
    for (unsigned d = 0; d < orders; ++d) legendre[d] = (2.0 * d + 1.0) * (d < 2 ? 1.0 : -1.0) * std::sph_bessel(d, 0.5 * w);
    // P_0 = 1, P_1 = u, P_2 = (3 u^2 - 1) / 2, P_3 = (5 u^3 - 3 u) / 2 with u = 2 x.
    return {legendre[0] - 0.5 * legendre[2], 2.0 * (legendre[1] - 1.5 * legendre[3]), 6.0 * legendre[2], 20.0 * legendre[3]};
}

// By least squares over the band |w| <= pi / 2.
CubicFilters fit_filters() {
    constexpr Eigen::Index samples = 200;
    constexpr Eigen::Index reach = CubicFilters::reach;
    CubicFilters out;
    for (std::size_t d = 0; d < orders; ++d) {
        const bool even = d % 2 == 0;
        Eigen::MatrixXd waves(samples, reach + (even ? 1 : 0));
        Eigen::VectorXd wanted(samples);
        for (Eigen::Index s = 0; s < samples; ++s) {
            const double w = 0.5 * pi * static_cast<double>(s) / static_cast<double>(samples - 1);
            wanted(s) = cubic_of_frequency(w)[d];
            for (Eigen::Index k = 1; k <= reach; ++k)
                waves(s, k - 1) = 2.0 * (even ? std::cos(static_cast<double>(k) * w) : std::sin(static_cast<double>(k) * w));
            if (even) waves(s, reach) = 1.0;
        }
        const Eigen::VectorXd fitted = waves.colPivHouseholderQr().solve(wanted);
        for (Eigen::Index k = 0; k < reach; ++k) out.taps[d][static_cast<std::size_t>(k)] = static_cast<float>(fitted(k));
        if (even) out.centre[d] = static_cast<float>(fitted(reach));
    }
    return out;
}

// A chunk of the table from the samples about it; line: (re, im) of its first sample.
SARFOCUS_MULTIVERSION void fit_chunk(const float* line, const CubicFilters& filters, std::ptrdiff_t pitch, float* table) {
    float fitted[orders][2 * chunk];
    for (std::ptrdiff_t i = 0; i < 2 * chunk; ++i)
        for (std::size_t d = 0; d < orders; ++d) fitted[d][i] = filters.centre[d] * line[i];
    for (std::ptrdiff_t k = 1; k <= CubicFilters::reach; ++k) {
        const auto tap = static_cast<std::size_t>(k - 1);
        const float even[2] = {filters.taps[0][tap], filters.taps[2][tap]};
        const float odd[2] = {filters.taps[1][tap], filters.taps[3][tap]};
        for (std::ptrdiff_t i = 0; i < 2 * chunk; ++i) {
            const float sum = line[i + 2 * k] + line[i - 2 * k];
            const float difference = line[i + 2 * k] - line[i - 2 * k];
            fitted[0][i] += even[0] * sum;
            fitted[1][i] += odd[0] * difference;
            fitted[2][i] += even[1] * sum;
            fitted[3][i] += odd[1] * difference;
        }
    }
    for (std::size_t d = 0; d < orders; ++d)
        for (std::ptrdiff_t i = 0; i < chunk; ++i) {
            table[2 * static_cast<std::ptrdiff_t>(d) * pitch + i] = fitted[d][2 * i];
            table[(2 * static_cast<std::ptrdiff_t>(d) + 1) * pitch + i] = fitted[d][2 * i + 1];
        }
}

// The adjoint for one sample: entry holds the (re, im) of x^0 … x^3.
void spread_entry(const float* entry, const CubicFilters& filters, cfloat* line) {
    for (std::size_t d = 0; d < orders; ++d) {
        const cfloat value(entry[2 * d], entry[2 * d + 1]);
        line[0] += filters.centre[d] * value;
        for (std::ptrdiff_t k = 1; k <= CubicFilters::reach; ++k) {
            const cfloat part = filters.taps[d][static_cast<std::size_t>(k - 1)] * value;
            line[k] += part;
            line[-k] += d % 2 == 0 ? part : -part;
        }
    }
}

}  // namespace

RangeProfileTable::RangeProfileTable(std::ptrdiff_t n_range, ProfileLayout layout)
    : layout_(layout),
      n_range_(n_range),
      n_padded_(fft::good_size(n_range + guard_samples)),
      forward_(n_padded_, fft::Direction::forward),
      inverse_(upsample * n_padded_, fft::Direction::inverse),
      adjoint_forward_(upsample * n_padded_, fft::Direction::forward),
      adjoint_inverse_(n_padded_, fft::Direction::inverse),
      filters_(fit_filters()) {
    static_assert(margin >= CubicFilters::reach && upsample == 2);
}

RangeProfileTable::Workspace::Workspace(const RangeProfileTable& table)
    : spectrum_({table.n_padded_}), line_({upsample * table.n_padded_ + 2 * margin}) {}

void RangeProfileTable::build(const ArrayView<const cfloat, 1>& profile, float* table, Workspace& workspace, cfloat factor) const {
    cfloat* spectrum = workspace.spectrum_.data();
    cfloat* line = workspace.line_.data() + margin;
    for (std::ptrdiff_t i = 0; i < n_range_; ++i) spectrum[i] = product(factor, profile(i));
    std::fill(spectrum + n_range_, spectrum + n_padded_, cfloat{});
    forward_.execute(spectrum);

    const float scale = 1.0f / static_cast<float>(n_padded_);
    const std::ptrdiff_t positive = (n_padded_ + 1) / 2;  // components 0 … positive - 1, the rest are negative frequencies
    const std::ptrdiff_t n_long = upsample * n_padded_;
    for (std::ptrdiff_t k = 0; k < positive; ++k) line[k] = scale * spectrum[k];
    std::fill(line + positive, line + n_long - n_padded_ + positive, cfloat{});
    for (std::ptrdiff_t k = positive; k < n_padded_; ++k) line[n_long - n_padded_ + k] = scale * spectrum[k];
    if (n_padded_ % 2 == 0) {  // the component at half the sampling rate is shared out between both signs
        line[positive] = 0.5f * scale * spectrum[positive];
        line[n_long - positive] = line[positive];
    }
    inverse_.execute(line);
    std::copy(line + n_long - margin, line + n_long, line - margin);

    const std::ptrdiff_t step = layout_.chunk_floats();
    float* record = table + layout_.offset(ProfileLayout::frame);
    std::fill(table, record, 0.0f);
    std::ptrdiff_t b = 0;
    float* to = record;
    for (; b < n_recorded(); b += chunk, to += step) fit_chunk(reinterpret_cast<const float*>(line + b), filters_, layout_.pitch, to);
    std::fill(to, table + floats(), 0.0f);
    for (std::ptrdiff_t k = 0; k < ProfileLayout::coefficients; ++k) {
        float* last = to - step + k * layout_.pitch;
        std::fill(last + n_recorded() - (b - chunk), last + chunk, 0.0f);
    }
    const std::ptrdiff_t more = layout_.pitch - chunk;
    if (more == 0) return;
    for (float* own = record - step; own < to; own += step)
        for (std::ptrdiff_t k = 0; k < ProfileLayout::coefficients; ++k)
            std::copy_n(own + step + k * layout_.pitch, more, own + k * layout_.pitch + chunk);
}

void RangeProfileTable::build_adjoint(const float* table, const ArrayView<cfloat, 1>& profile, Workspace& workspace) const {
    cfloat* spectrum = workspace.spectrum_.data();
    cfloat* line = workspace.line_.data() + margin;
    const std::ptrdiff_t positive = (n_padded_ + 1) / 2;
    const std::ptrdiff_t n_long = upsample * n_padded_;
    std::fill(line - margin, line + n_long + margin, cfloat{});
    for (std::ptrdiff_t b = 0; b < n_recorded(); ++b)
        spread_entry(table + (ProfileLayout::frame + b) * ProfileLayout::coefficients, filters_, line + b);
    for (std::ptrdiff_t k = 1; k <= margin; ++k) line[n_long - k] += line[-k];
    adjoint_forward_.execute(line);

    const float scale = 1.0f / static_cast<float>(n_padded_);
    for (std::ptrdiff_t k = 0; k < positive; ++k) spectrum[k] = scale * line[k];
    for (std::ptrdiff_t k = positive; k < n_padded_; ++k) spectrum[k] = scale * line[n_long - n_padded_ + k];
    if (n_padded_ % 2 == 0) spectrum[positive] = 0.5f * scale * (line[positive] + line[n_long - positive]);
    adjoint_inverse_.execute(spectrum);
    for (std::ptrdiff_t i = 0; i < n_range_; ++i) profile(i) = spectrum[i];
}

}  // namespace sarfocus::focus::detail
