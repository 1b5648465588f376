#pragma once

#include <array>
#include <complex>
#include <cstddef>
#include <cstdint>

#include <sarfocus/core/array.hpp>
#include <sarfocus/core/array_view.hpp>
#include <sarfocus/fft/plan.hpp>

#include "backproject_kernel.hpp"

namespace sarfocus::focus::detail {

/// Filters that turn a sequence, sampled at twice its Nyquist rate, into the coefficients of x^0 … x^3 of a cubic about every sample, good
/// for |x| <= 1/2: even or odd about their middle, taps[d][k - 1] those of distance k, centre[d] that of distance 0.
struct CubicFilters {
    static constexpr int reach = 6;
    std::array<float, 4> centre{};
    std::array<std::array<float, reach>, 4> taps{};
};

/// Turns one range profile into the table that the backprojection kernels read: for each half sample a cubic in the offset from its
/// centre. Every spectral component exp(j w x), |x| <= 1/2, is expanded in Legendre polynomials, whose coefficients are spherical
/// Bessel functions: exp(j w x) = sum_d (2 d + 1) j^d j_d(w / 2) P_d(2 x); the series is cut behind the cubic. The profile is brought to
/// twice its sampling rate by a transform; what the series makes of it there are filters, fitted to -110 dB over the profile's band.
class RangeProfileTable {
public:
    static constexpr int upsample = 2;

    RangeProfileTable(std::ptrdiff_t n_range, ProfileLayout layout);

    /// Bins of a table, the frame of zeros included; bin ProfileLayout::frame is sample 0 of the record.
    [[nodiscard]] std::int32_t n_bin() const {
        constexpr std::ptrdiff_t chunk = ProfileLayout::chunk;
        return static_cast<std::int32_t>((n_recorded() + chunk - 1) / chunk * chunk) + 2 * ProfileLayout::frame;
    }
    [[nodiscard]] std::ptrdiff_t floats() const {
        return static_cast<std::ptrdiff_t>(n_bin() / ProfileLayout::chunk) * layout_.chunk_floats();
    }

    /// Memory one thread needs while building.
    class Workspace {
    public:
        explicit Workspace(const RangeProfileTable& table);

    private:
        friend class RangeProfileTable;
        Array<cfloat, 1> spectrum_;
        Array<cfloat, 1> line_;  // with `margin` samples before and behind
    };

    /// Of the profile times a factor. table: [floats()], aligned, as ProfileLayout says.
    void build(const ArrayView<const cfloat, 1>& profile, float* table, Workspace& workspace, cfloat factor = {1.0f, 0.0f}) const;

    /// The adjoint of `build`: from weights on the table's entries to a profile. table: [n_bin()][ProfileLayout::coefficients].
    void build_adjoint(const float* table, const ArrayView<cfloat, 1>& profile, Workspace& workspace) const;

private:
    static constexpr std::ptrdiff_t margin = 8;  // at least the filters' reach; keeps the line aligned

    [[nodiscard]] std::ptrdiff_t n_recorded() const { return upsample * (n_range_ - 1) + 1; }

    ProfileLayout layout_;
    std::ptrdiff_t n_range_;
    std::ptrdiff_t n_padded_;  // record and zeros behind it, so that its two ends do not ring into each other
    fft::Plan<float> forward_;
    fft::Plan<float> inverse_;
    fft::Plan<float> adjoint_forward_;
    fft::Plan<float> adjoint_inverse_;
    CubicFilters filters_;
};

}  // namespace sarfocus::focus::detail
