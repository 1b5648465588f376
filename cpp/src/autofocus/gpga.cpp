#include <sarfocus/autofocus/gpga.hpp>

#include <algorithm>
#include <complex>
#include <memory>
#include <vector>

#include <sarfocus/core/array.hpp>
#include <sarfocus/core/checks.hpp>
#include <sarfocus/core/error.hpp>

#include "picture.hpp"
#include "point_engine.hpp"
#include "point_source.hpp"

namespace sarfocus::autofocus {
namespace {

using focus::RangeProfiles;
using geometry::ImageGrid;
using geometry::PhaseCentres;

class PhaseHistorySource : public detail::PointSource {
public:
    /// image: memory for what is looked at, [grid.shape].
    PhaseHistorySource(const RangeProfiles& profiles, const PhaseCentres& centres, const ImageGrid& grid, MutableImageView image)
        : profiles_(profiles), centres_(centres), grid_(grid), image_(image) {}

    [[nodiscard]] std::ptrdiff_t n_pulse() const override { return profiles_.data.extent(0); }
    [[nodiscard]] std::array<std::ptrdiff_t, 2> shape() const override { return grid_.shape(); }
    [[nodiscard]] std::ptrdiff_t range_gate(std::ptrdiff_t column) const override { return column; }
    [[nodiscard]] bool fractional_columns() const override { return true; }
    [[nodiscard]] bool is_list() const override { return grid_.kind() == ImageGrid::Kind::points && grid_.shape()[1] == 1; }

    [[nodiscard]] double sum_scale() const override { return 1.0; }
    [[nodiscard]] std::size_t points_at_once() const override { return 256; }  // for which every profile is made ready once

    void form(const std::vector<double>& phase, MutableImageView image, const Execution& execution) override {
        std::vector<cfloat> factors;
        for (const double p : phase) factors.emplace_back(std::polar(1.0, -p));
        focus::BackprojectOptions options;
        options.execution = execution;
        focus::backproject_turned(profiles_, centres_, grid_, factors, image, options);
    }

    [[nodiscard]] std::unique_ptr<detail::Picture> picture(const detail::PictureRequest& /*request*/, const Execution& execution) override {
        return std::make_unique<detail::WholePicture>(*this, image_, execution);
    }

    void histories(const std::vector<detail::Pixel>& points, MutableImageView histories, const Execution& execution) override {
        Array<double, 2> positions({static_cast<std::ptrdiff_t>(points.size()), 3});
        for (std::size_t n = 0; n < points.size(); ++n) {
            const Vector3 p = grid_.position(points[n].azimuth, points[n].column);
            std::copy(p.begin(), p.end(), positions.data() + 3 * n);
        }
        focus::BackprojectOptions options;
        options.execution = execution;
        focus::backproject_histories(profiles_, centres_, ArrayView<const double, 2>(positions.view()), histories, options);
    }

private:
    const RangeProfiles& profiles_;
    const PhaseCentres& centres_;
    const ImageGrid& grid_;
    MutableImageView image_;
};

}  // namespace

Result gpga(const RangeProfiles& profiles, const PhaseCentres& centres, const ImageGrid& grid, MutableImageView image,
            const PointOptions& options) {
    options.validate();
    profiles.validate(options.execution.threads);
    centres.validate(profiles.data.extent(0));
    if (image.extents() != grid.shape())
        throw ShapeError("image", "the shape of the grid " + shape_text(grid.shape()), shape_text(image.extents()));
    if (profiles.data.extent(0) < 8) throw ShapeError("data", "at least 8 pulses", shape_text(profiles.data.extents()));
    const auto lines = static_cast<std::uint64_t>(options.fine_points) * static_cast<std::uint64_t>(profiles.data.extent(0));
    require_memory(lines * sizeof(cfloat), "gpga");

    PhaseHistorySource source(profiles, centres, grid, image);
    Result result = detail::estimate_from_points(source, options);
    result.method = "gpga";
    result.phase_error = result.input_returned() ? std::vector<double>(result.estimate.size(), 0.0) : result.estimate;
    source.form(result.phase_error, image, options.execution);
    return result;
}

}  // namespace sarfocus::autofocus
