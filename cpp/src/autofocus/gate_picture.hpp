#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include <sarfocus/core/array.hpp>
#include <sarfocus/quality/image_measures.hpp>

#include "picture.hpp"
#include "spectrum_source.hpp"

namespace sarfocus::autofocus::detail {

/// The picture of a large image's range gates, of which no pixel is kept: gate by gate it is formed, looked at and forgotten. Its points
/// are among the four strongest maxima of every piece of 256 azimuth lines of a gate (or of the least sub-aperture, where that is less).
class GatePicture : public Picture {
public:
    /// The source must outlive the picture. piece: azimuth lines.
    GatePicture(const SpectrumSource& source, std::ptrdiff_t piece, const Execution& execution);
    ~GatePicture() override;

    void focus(const std::vector<double>& phase, const Look& look) override;
    void split(const Halves& halves) override { halves_ = &halves; }
    [[nodiscard]] CellSize cell_size() const override;
    [[nodiscard]] std::vector<Pixel> strongest(int count, const CellSize& separation, Portion part) const override;
    [[nodiscard]] std::vector<Pixel> strongest_of(const PartColumns& parts, const CellSize& separation, Portion part) const override;
    [[nodiscard]] double background() const override;
    [[nodiscard]] HalfSums sums(Portion part) const override;
    [[nodiscard]] double entropy() const override;

private:
    struct Gate;  // what is known of a gate
    class Workspace;

    [[nodiscard]] bool of(std::ptrdiff_t column, Portion part) const;
    [[nodiscard]] std::vector<std::ptrdiff_t> columns_for(const Look& look) const;
    void form(const std::vector<double>& phase, Purpose purpose, std::vector<Gate>& gates);
    void look_at(std::ptrdiff_t column, const std::vector<cfloat>& factor, Purpose purpose, Workspace& workspace, Gate& gate) const;

    const SpectrumSource& source_;
    std::ptrdiff_t n_azimuth_;
    std::ptrdiff_t piece_;
    const Execution& execution_;
    const Halves* halves_ = nullptr;
    fft::Plan<float> inverse_;
    std::vector<Gate> untouched_;            // without a phase
    std::vector<Gate> turned_;               // with the last other phase
    const std::vector<Gate>* gates_;         // what is asked about: one of these two
    std::vector<std::ptrdiff_t> columns_;    // and which of them, ascending
    std::vector<std::ptrdiff_t> strongest_;  // all columns by the sum of squared intensity untouched, the greatest first
};

}  // namespace sarfocus::autofocus::detail
