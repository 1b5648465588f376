#pragma once

#include <complex>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <sarfocus/core/array.hpp>
#include <sarfocus/core/array_view.hpp>
#include <sarfocus/fft/plan.hpp>

namespace sarfocus::focus::detail {

/// Turns one range profile into the table that the backprojection kernels read: for each half sample a cubic in the offset from its
/// centre. Every spectral component exp(j w x), |x| <= 1/2, is expanded in Legendre polynomials, whose coefficients are spherical
/// Bessel functions: exp(j w x) = sum_d (2 d + 1) j^d j_d(w / 2) P_d(2 x); the series is cut behind the cubic.
class RangeProfileTable {
public:
    static constexpr int upsample = 2;
    static constexpr int degree = 3;
    static constexpr int floats_per_bin = 2 * (degree + 1);

    explicit RangeProfileTable(std::ptrdiff_t n_range);

    /// Bins of a table, the two zero ones at the ends included.
    [[nodiscard]] std::int32_t n_bin() const { return static_cast<std::int32_t>(upsample * (n_range_ - 1) + 1 + 2); }
    [[nodiscard]] std::ptrdiff_t floats() const { return static_cast<std::ptrdiff_t>(n_bin()) * floats_per_bin; }

    /// Memory one thread needs while building.
    class Workspace {
    public:
        explicit Workspace(const RangeProfileTable& table);

    private:
        friend class RangeProfileTable;
        Array<cfloat, 1> spectrum_;
        Array<cfloat, 1> line_;
    };

    /// table: [floats()], aligned.
    void build(const ArrayView<const cfloat, 1>& profile, float* table, Workspace& workspace) const;

    /// The adjoint of `build`: from weights on the table's entries to a profile.
    void build_adjoint(const float* table, const ArrayView<cfloat, 1>& profile, Workspace& workspace) const;

private:
    std::ptrdiff_t n_range_;
    std::ptrdiff_t n_padded_;  // record and zeros behind it, so that its two ends do not ring into each other
    fft::Plan<float> forward_;
    fft::Plan<float> inverse_;
    fft::Plan<float> adjoint_forward_;
    fft::Plan<float> adjoint_inverse_;
    std::vector<cfloat> weights_;  // [degree + 1][n_padded], of the monomials x^d
};

}  // namespace sarfocus::focus::detail
