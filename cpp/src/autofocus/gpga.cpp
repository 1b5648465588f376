#include <sarfocus/autofocus/gpga.hpp>

#include <algorithm>
#include <complex>

#include <sarfocus/core/array.hpp>
#include <sarfocus/core/checks.hpp>
#include <sarfocus/core/error.hpp>

#include "point_engine.hpp"
#include "point_source.hpp"

namespace sarfocus::autofocus {
namespace {

using focus::RangeProfiles;
using geometry::ImageGrid;
using geometry::PhaseCentres;

class PhaseHistorySource : public detail::PointSource {
public:
    PhaseHistorySource(const RangeProfiles& profiles, const PhaseCentres& centres, const ImageGrid& grid)
        : profiles_(profiles), centres_(centres), grid_(grid), corrected_({profiles.data.extent(0), profiles.data.extent(1)}) {}

    [[nodiscard]] std::ptrdiff_t n_pulse() const override { return profiles_.data.extent(0); }
    [[nodiscard]] std::array<std::ptrdiff_t, 2> shape() const override { return grid_.shape(); }
    [[nodiscard]] std::ptrdiff_t range_gate(std::ptrdiff_t column) const override { return column; }
    [[nodiscard]] bool fractional_columns() const override { return true; }
    [[nodiscard]] bool is_list() const override { return grid_.kind() == ImageGrid::Kind::points && grid_.shape()[1] == 1; }

    [[nodiscard]] double sum_scale() const override { return 1.0; }

    void form(const std::vector<double>& phase, MutableImageView image, const Execution& execution) override {
        for (std::ptrdiff_t p = 0; p < n_pulse(); ++p) {
            const cfloat rotation(std::polar(1.0, -phase[static_cast<std::size_t>(p)]));
            for (std::ptrdiff_t i = 0; i < corrected_.extent(1); ++i) corrected_(p, i) = profiles_.data(p, i) * rotation;
        }
        RangeProfiles turned = profiles_;
        turned.data = corrected_.view();
        focus::BackprojectOptions options;
        options.execution = execution;
        focus::backproject(turned, centres_, grid_, image, options);
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
    Array<cfloat, 2> corrected_;
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
    const auto pixels = static_cast<std::uint64_t>(grid.size());
    const auto samples = static_cast<std::uint64_t>(profiles.data.size());
    const auto lines = static_cast<std::uint64_t>(options.fine_points) * static_cast<std::uint64_t>(profiles.data.extent(0));
    require_memory((4 * pixels + samples + 3 * lines) * sizeof(cfloat), "gpga");

    PhaseHistorySource source(profiles, centres, grid);
    Result result = detail::estimate_from_points(source, options);
    result.method = "gpga";
    result.phase_error = result.input_returned() ? std::vector<double>(result.estimate.size(), 0.0) : result.estimate;
    source.form(result.phase_error, image, options.execution);
    return result;
}

}  // namespace sarfocus::autofocus
