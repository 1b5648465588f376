#pragma once

#include <cstddef>

#include <sarfocus/core/array.hpp>
#include <sarfocus/core/array_view.hpp>
#include <sarfocus/fft/plan.hpp>

namespace sarfocus::focus::detail {

/// Doubles the sampling rate of range profiles: the trigonometric interpolant of the record with zeros round it, `guard` samples of
/// which are kept in front of the record and behind it.
class RangeUpsampler {
public:
    RangeUpsampler(std::ptrdiff_t n_range, std::ptrdiff_t guard);

    /// Samples of a line: sample i lies i / 2 - guard samples behind the first of the record. A multiple of 16.
    [[nodiscard]] std::ptrdiff_t width() const { return width_; }

    class Workspace {
    public:
        explicit Workspace(const RangeUpsampler& upsampler);

    private:
        friend class RangeUpsampler;
        Array<cfloat, 1> spectrum_;
        Array<cfloat, 1> line_;
    };

    /// re, im: [width()].
    void run(const ArrayView<const cfloat, 1>& profile, float* re, float* im, Workspace& workspace) const;

private:
    std::ptrdiff_t n_range_;
    std::ptrdiff_t guard_;
    std::ptrdiff_t width_;
    std::ptrdiff_t n_padded_;
    fft::Plan<float> forward_;
    fft::Plan<float> inverse_;
};

}  // namespace sarfocus::focus::detail
