#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <vector>

#include <sarfocus/core/array_view.hpp>
#include <sarfocus/core/execution.hpp>

namespace sarfocus::autofocus::detail {

/// A place in the image that a source forms, fractional pixels.
struct Pixel {
    double azimuth = 0.0;
    double column = 0.0;
};

/// How the pixels of an image lie to one another.
class PixelLayout {
public:
    PixelLayout() = default;
    virtual ~PixelLayout() = default;
    PixelLayout(const PixelLayout&) = delete;
    PixelLayout& operator=(const PixelLayout&) = delete;

    /// Of the image; its columns are range gates.
    [[nodiscard]] virtual std::array<std::ptrdiff_t, 2> shape() const = 0;
    /// Range gate of a column; columns of successive gates are neighbours.
    [[nodiscard]] virtual std::ptrdiff_t range_gate(std::ptrdiff_t column) const = 0;
    /// True where columns may be interpolated between.
    [[nodiscard]] virtual bool fractional_columns() const = 0;
    /// True where the pixels are single points, without neighbours.
    [[nodiscard]] virtual bool is_list() const = 0;
};

class Picture;

/// How the image of a source will be looked at.
struct PictureRequest {
    std::ptrdiff_t piece = 256;  ///< azimuth lines in each of which a few of the strongest maxima of a column are enough
};

/// Where the point methods take their histories from: an image's azimuth spectrum (pga) or phase history (gpga). The sum of a point's
/// history over the pulses is the image at that point, up to a constant factor. The layout is that of the image that `form` makes.
class PointSource : public PixelLayout {
public:
    [[nodiscard]] virtual std::ptrdiff_t n_pulse() const = 0;
    /// Squared magnitude of a history's sum over that of the image at its point.
    [[nodiscard]] virtual double sum_scale() const = 0;

    /// The image with exp(-j phase) on the pulses. image: [shape()].
    virtual void form(const std::vector<double>& phase, MutableImageView image, const Execution& execution) = 0;
    /// The image to be looked at with one phase after the other; the source and `execution` must outlive it.
    [[nodiscard]] virtual std::unique_ptr<Picture> picture(const PictureRequest& request, const Execution& execution);
    /// True where estimation is to be bounded, as estimate_from_points says.
    [[nodiscard]] virtual bool is_large() const { return false; }
    /// Of as many points histories are best made together.
    [[nodiscard]] virtual std::size_t points_at_once() const { return 64; }
    /// The histories of points, no phase taken out. histories: [n_point, n_pulse].
    virtual void histories(const std::vector<Pixel>& points, MutableImageView histories, const Execution& execution) = 0;
};

}  // namespace sarfocus::autofocus::detail
