#include "focus/apply_phase.hpp"

#include <algorithm>

#include <sarfocus/core/complex_product.hpp>
#include <sarfocus/core/multiversion.hpp>
#include <sarfocus/signal/phasor.hpp>

namespace sarfocus::focus {
namespace {

constexpr std::ptrdiff_t piece = 256;

}  // namespace

SARFOCUS_MULTIVERSION void apply_phase(cfloat* samples, const double* shape, std::ptrdiff_t n, double rate, float scale) {
    float real[piece];
    float imag[piece];
    for (std::ptrdiff_t begin = 0; begin < n; begin += piece) {
        const std::ptrdiff_t count = std::min(piece, n - begin);
        for (std::ptrdiff_t k = 0; k < count; ++k) signal::unit_phasor(rate * shape[begin + k], real[k], imag[k]);
        auto* x = reinterpret_cast<float*>(samples + begin);
        for (std::ptrdiff_t k = 0; k < count; ++k) {
            const float a = scale * x[2 * k];
            const float b = scale * x[2 * k + 1];
            x[2 * k] = a * real[k] - b * imag[k];
            x[2 * k + 1] = a * imag[k] + b * real[k];
        }
    }
}

SARFOCUS_MULTIVERSION void phase_factors(const double* shape, std::ptrdiff_t n, double rate, float scale, cfloat* factor) {
    float real[piece];
    float imag[piece];
    for (std::ptrdiff_t begin = 0; begin < n; begin += piece) {
        const std::ptrdiff_t count = std::min(piece, n - begin);
        for (std::ptrdiff_t k = 0; k < count; ++k) signal::unit_phasor(rate * shape[begin + k], real[k], imag[k]);
        auto* y = reinterpret_cast<float*>(factor + begin);
        for (std::ptrdiff_t k = 0; k < count; ++k) {
            y[2 * k] = scale * real[k];
            y[2 * k + 1] = scale * imag[k];
        }
    }
}

void mirror(cfloat* line, std::ptrdiff_t n) {
    std::reverse_copy(line + 1, line + (n + 1) / 2, line + n / 2 + 1);
}

SARFOCUS_MULTIVERSION void multiply(cfloat* samples, const cfloat* factor, std::ptrdiff_t n) {
    for (std::ptrdiff_t k = 0; k < n; ++k) samples[k] = product(samples[k], factor[k]);
}

SARFOCUS_MULTIVERSION void multiply_conjugate(cfloat* samples, const cfloat* factor, std::ptrdiff_t n) {
    for (std::ptrdiff_t k = 0; k < n; ++k) samples[k] = product(samples[k], std::conj(factor[k]));
}

}  // namespace sarfocus::focus
