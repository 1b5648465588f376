#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <sarfocus/core/array.hpp>
#include <sarfocus/core/array_view.hpp>
#include <sarfocus/fft/plan.hpp>
#include <sarfocus/focus/range_doppler.hpp>
#include <sarfocus/geometry/stripmap_geometry.hpp>

#include "focus/sinc_kernel.hpp"

namespace sarfocus::focus {

/// What the range-Doppler algorithm does to one Doppler frequency, from fast time to slant range: secondary range compression, migration
/// correction, azimuth filter, all of it as documented in range_doppler.hpp.
class MigrationCorrection {
public:
    /// Throws ValueError where the algorithm doesn't bear the geometry. `geometry` must outlive the object.
    MigrationCorrection(const geometry::StripmapGeometry& geometry, const FastTime& fast_time, std::ptrdiff_t n_pulse,
                        std::ptrdiff_t n_fast_time);

    /// Memory of one thread.
    class Workspace {
    public:
        explicit Workspace(const MigrationCorrection& correction);

    private:
        friend class MigrationCorrection;
        std::vector<double> excess_;  // of every range frequency, see excess_path
        Array<cfloat, 1> spectrum_;
        Array<cfloat, 1> fine_;  // twice the sampling rate, with a margin at either end for the kernel
        Array<cfloat, 1> values_;
        Array<cfloat, 1> gates_;
    };
    [[nodiscard]] std::uint64_t workspace_bytes() const;

    /// line: [n_fast_time], the azimuth spectrum at Doppler bin `bin`; gates: [n_range], overwritten, scaled for the unnormalised azimuth
    /// transforms. False where sums overflowed.
    [[nodiscard]] bool apply(std::ptrdiff_t bin, const ArrayView<const cfloat, 1>& line, const ArrayView<cfloat, 1>& gates,
                             Workspace& workspace) const;

private:
    static constexpr std::ptrdiff_t margin = 8;  // fine samples; keeps the transform aligned

    [[nodiscard]] double doppler_offset(std::ptrdiff_t bin) const;
    void require_band() const;
    void require_recorded() const;
    [[nodiscard]] std::ptrdiff_t checked_length() const;
    [[nodiscard]] double variation(double sine) const;
    void add_reference(double cosine, double reference, double reach, Workspace& workspace) const;

    const geometry::StripmapGeometry& geometry_;
    double range_start_;
    double spacing_;        // m
    double range_band_;     // range_sampling over the carrier frequency
    double sine_of_hertz_;  // wavelength / (2 v)
    std::ptrdiff_t n_pulse_;
    std::ptrdiff_t n_fast_time_;
    std::ptrdiff_t n_;  // samples of a transformed line, zeros behind the record included
    fft::Plan<float> forward_;
    fft::Plan<float> inverse_;
    SincKernel kernel_;
};

}  // namespace sarfocus::focus
