#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <vector>

#include <sarfocus/autofocus/result.hpp>
#include <sarfocus/core/array.hpp>
#include <sarfocus/core/execution.hpp>

#include "point_source.hpp"
#include "score.hpp"
#include "strong_points.hpp"

namespace sarfocus::autofocus::detail {

/// Which pixels of a picture are wanted.
enum class Portion { first_half = 0, second_half = 1, everywhere };

/// What a source's image is looked at for: no more than this may be asked about it then.
enum class Purpose {
    points,       ///< points, background and sums
    some_points,  ///< some of the strongest points
    sums,         ///< sums
    entropy,      ///< sums and entropy
    everything
};
struct Look {
    Portion part = Portion::everywhere;  ///< pixels that will be asked for; others need not be formed
    Purpose purpose = Purpose::points;
};

/// Columns of every sub-aperture that points are taken from, ascending.
struct PartColumns {
    std::vector<SubAperture> parts;
    std::vector<std::vector<std::ptrdiff_t>> columns;  ///< [parts]
    std::size_t most = 0;                              ///< points
};

/// The image that a source forms with a phase taken out, as the estimation from points looks at it.
class Picture {
public:
    Picture() = default;
    virtual ~Picture() = default;
    Picture(const Picture&) = delete;
    Picture& operator=(const Picture&) = delete;

    /// What is asked below is about the image with exp(-j phase) on the pulses. phase: [n_pulse].
    virtual void focus(const std::vector<double>& phase, const Look& look) = 0;
    /// Before parts other than everywhere are asked for; `halves` must outlive the picture.
    virtual void split(const Halves& halves) = 0;

    [[nodiscard]] virtual CellSize cell_size() const = 0;
    /// As detail::strongest_points.
    [[nodiscard]] virtual std::vector<Pixel> strongest(int count, const CellSize& separation, Portion part) const = 0;
    /// The strongest of every sub-aperture in each of its columns, none within `separation` of a stronger one.
    [[nodiscard]] virtual std::vector<Pixel> strongest_of(const PartColumns& parts, const CellSize& separation, Portion part) const = 0;
    /// Mean power of what lies between the strong points.
    [[nodiscard]] virtual double background() const = 0;
    [[nodiscard]] virtual HalfSums sums(Portion part) const = 0;
    [[nodiscard]] virtual double entropy() const = 0;
};

/// Mean power of speckle among other things, from some of their powers: its median is ln 2 of its mean.
[[nodiscard]] double speckle_mean(std::vector<double> powers);

/// The whole image in memory.
class WholePicture : public Picture {
public:
    /// image: memory for it, [source.shape()].
    WholePicture(PointSource& source, MutableImageView image, const Execution& execution);
    /// In memory of its own.
    WholePicture(PointSource& source, const Execution& execution);

    void focus(const std::vector<double>& phase, const Look& look) override;
    void split(const Halves& halves) override { halves_ = &halves; }
    [[nodiscard]] CellSize cell_size() const override { return detail::cell_size(image_, source_); }
    [[nodiscard]] std::vector<Pixel> strongest(int count, const CellSize& separation, Portion part) const override;
    [[nodiscard]] std::vector<Pixel> strongest_of(const PartColumns& parts, const CellSize& separation, Portion part) const override;
    [[nodiscard]] double background() const override;
    [[nodiscard]] HalfSums sums(Portion part) const override;
    [[nodiscard]] double entropy() const override;

private:
    /// Empty: all pixels.
    [[nodiscard]] Array<bool, 2> wanted(Portion part) const;

    PointSource& source_;
    const Execution& execution_;
    Array<cfloat, 2> memory_;
    MutableImageView image_;
    const Halves* halves_ = nullptr;
};

}  // namespace sarfocus::autofocus::detail
