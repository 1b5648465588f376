#include "sub_image.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <vector>

#include <sarfocus/core/array.hpp>
#include <sarfocus/core/checks.hpp>
#include <sarfocus/core/constants.hpp>
#include <sarfocus/core/multiversion.hpp>

#include "channel_centres.hpp"

namespace sarfocus::hrws::detail {
namespace {

constexpr std::int64_t block_bytes = std::int64_t{32} << 20;  // of the histories held at a time

struct Complex {
    float re, im;
};

// Sum of coefficients times samples; real and imaginary parts apart.
SARFOCUS_MULTIVERSION Complex product(const float* psi_re, const float* psi_im, const float* re, const float* im, std::ptrdiff_t n) {
    float sum_re = 0.0f;
    float sum_im = 0.0f;
#pragma omp simd reduction(+ : sum_re, sum_im)
    for (std::ptrdiff_t i = 0; i < n; ++i) {
        sum_re += psi_re[i] * re[i] - psi_im[i] * im[i];
        sum_im += psi_re[i] * im[i] + psi_im[i] * re[i];
    }
    return {sum_re, sum_im};
}

class SubImages {
public:
    SubImages(const Echo& echo, const ReconstructOptions& options)
        : echo_(echo),
          n_channel_(echo.n_channel()),
          n_pulse_(echo.n_pulse()),
          half_width_(options.half_width),
          sampled_(sampling(echo)),
          band_centre_(options.band.doppler_centroid),
          band_(options.band.processed(n_channel_, echo.prf)) {
        const auto psi = interpolation_coefficients(sampled_.offsets, echo.prf, echo.velocity, half_width_, options.band);
        for (const cdouble& value : psi) {
            psi_re_.push_back(static_cast<float>(value.real()));
            psi_im_.push_back(static_cast<float>(value.imag()));
        }
    }

    // terms: [n_channel][n_pulse], the backprojection terms of the pixel, motion in their ranges.
    [[nodiscard]] cfloat pixel(const Vector3& p, const std::vector<ArrayView<const cfloat, 1>>& terms) const {
        const std::ptrdiff_t taps = (2 * half_width_ + 1) * n_channel_;
        std::vector<float> re(static_cast<std::size_t>((n_pulse_ + 2 * half_width_) * n_channel_));
        std::vector<float> im(re.size());
        for (std::ptrdiff_t k = 0; k < n_pulse_; ++k)
            for (std::ptrdiff_t n = 0; n < n_channel_; ++n) {
                const cfloat sample = terms[static_cast<std::size_t>(n)](k);
                if (sample == cfloat{}) continue;
                const cfloat value = sample * std::conj(carrier(p, k, sampled_.offsets[static_cast<std::size_t>(n)]));
                re[static_cast<std::size_t>((k + half_width_) * n_channel_ + n)] = value.real();
                im[static_cast<std::size_t>((k + half_width_) * n_channel_ + n)] = value.imag();
            }
        cdouble sum{};
        for (std::ptrdiff_t k = 0; k < n_pulse_; ++k)
            for (std::ptrdiff_t i = 0; i < n_channel_; ++i) {
                const double offset =
                    (static_cast<double>(i) - 0.5 * static_cast<double>(n_channel_ - 1)) / static_cast<double>(n_channel_);
                if (!in_band(p, k, offset * sampled_.step)) continue;
                const Complex even = product(psi_re_.data() + i * taps, psi_im_.data() + i * taps, re.data() + k * n_channel_,
                                             im.data() + k * n_channel_, taps);
                sum += cdouble(cfloat(even.re, even.im) * carrier(p, k, offset * sampled_.step));
            }
        return cfloat(sum);
    }

private:
    [[nodiscard]] Vector3 sight(const Vector3& p, std::ptrdiff_t pulse, double offset) const {
        return p - sampled_.origin - (static_cast<double>(pulse) * sampled_.step + offset) * sampled_.direction;
    }

    // exp(+4j pi R / wavelength) from the straight line.
    [[nodiscard]] cfloat carrier(const Vector3& p, std::ptrdiff_t pulse, double offset) const {
        const double cycles = 2.0 * norm(sight(p, pulse, offset)) / echo_.wavelength;
        return cfloat(std::polar(1.0, two_pi * std::remainder(cycles, 1.0)));
    }

    [[nodiscard]] bool in_band(const Vector3& p, std::ptrdiff_t pulse, double offset) const {
        const Vector3 s = sight(p, pulse, offset);
        const double f = 2.0 * echo_.velocity * dot(s, sampled_.direction) / (echo_.wavelength * norm(s));
        return std::abs(f - band_centre_) < 0.5 * band_;
    }

    const Echo& echo_;
    std::ptrdiff_t n_channel_;
    std::ptrdiff_t n_pulse_;
    std::ptrdiff_t half_width_;
    Sampling sampled_;
    double band_centre_;
    double band_;
    std::vector<float> psi_re_;
    std::vector<float> psi_im_;
};

}  // namespace

void reconstruct_sub_images(const Echo& echo, const geometry::ImageGrid& grid, const ArrayView<const double, 2>& motion,
                            MutableImageView image, const ReconstructOptions& options) {
    const SubImages engine(echo, options);
    const std::ptrdiff_t n_channel = echo.n_channel();
    const std::ptrdiff_t columns = grid.shape()[1];
    const std::int64_t pixel_bytes = n_channel * echo.n_pulse() * static_cast<std::int64_t>(sizeof(cfloat));
    const std::ptrdiff_t block = std::min<std::ptrdiff_t>(grid.size(), std::max<std::int64_t>(1, block_bytes / pixel_bytes));
    require_memory(static_cast<std::uint64_t>(block * pixel_bytes), "histories of sub-images");
    std::vector<Array<cfloat, 2>> histories;
    std::vector<ChannelCentres> centres;
    for (std::ptrdiff_t n = 0; n < n_channel; ++n) {
        histories.emplace_back(std::array<std::ptrdiff_t, 2>{block, echo.n_pulse()});
        centres.emplace_back(echo, motion, n);
    }
    Array<double, 2> points({block, 3});

    const std::int64_t parts = (grid.size() + block - 1) / block * (n_channel + 1);
    std::int64_t part = 0;
    for (std::ptrdiff_t begin = 0; begin < grid.size(); begin += block) {
        const std::ptrdiff_t count = std::min(block, grid.size() - begin);
        for (std::ptrdiff_t q = 0; q < count; ++q) {
            const std::ptrdiff_t row = (begin + q) / columns;
            const Vector3 p = grid.position(static_cast<double>(row), static_cast<double>((begin + q) % columns));
            std::copy(p.begin(), p.end(), points.data() + 3 * q);
        }
        const ArrayView<const double, 2> places = ArrayView<const double, 2>(points.view()).slice(0, 0, count);
        for (std::ptrdiff_t n = 0; n < n_channel; ++n) {
            const auto index = static_cast<std::size_t>(n);
            focus::BackprojectOptions run;
            run.execution = part_of(options.execution, part++, parts);
            focus::backproject_histories(echo.profiles(n), centres[index].view(), places, histories[index].view().slice(0, 0, count), run);
        }
        const Execution run = part_of(options.execution, part++, parts);
        parallel_for(run, "sub-images", count, [&](std::int64_t q) {
            std::vector<ArrayView<const cfloat, 1>> terms;
            for (const auto& history : histories) terms.push_back(history.view().row(q));
            image((begin + q) / columns, (begin + q) % columns) = engine.pixel({points(q, 0), points(q, 1), points(q, 2)}, terms);
        });
    }
}

}  // namespace sarfocus::hrws::detail
