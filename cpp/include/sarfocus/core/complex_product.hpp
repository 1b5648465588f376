#pragma once

#include <complex>

namespace sarfocus {

/// Complex product without the test for infinities that the operator of the standard makes.
template <class Real>
[[nodiscard]] constexpr std::complex<Real> product(const std::complex<Real>& a, const std::complex<Real>& b) {
    return {a.real() * b.real() - a.imag() * b.imag(), a.real() * b.imag() + a.imag() * b.real()};
}

}  // namespace sarfocus
