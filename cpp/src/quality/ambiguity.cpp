#include <sarfocus/quality/ambiguity.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include <sarfocus/core/checks.hpp>
#include <sarfocus/core/error.hpp>

#include "row_sums.hpp"

namespace sarfocus::quality {
namespace {

using HalfWidth = std::array<std::ptrdiff_t, 2>;

/// True where the box about `centre` lies inside the image. Compared in floating point: no position is too far out to be compared.
bool inside(const ImageView& image, const std::array<double, 2>& centre, const HalfWidth& half_width) {
    for (const std::size_t d : {0U, 1U}) {
        const double half = static_cast<double>(half_width[d]);
        if (!(std::round(centre[d]) - half >= 0.0 && std::round(centre[d]) + half <= static_cast<double>(image.extent(d) - 1)))
            return false;
    }
    return true;
}

double strength(const ImageView& image, const std::array<double, 2>& centre, const AmbiguityOptions& options) {
    ImageView box = image;
    for (const std::size_t d : {0U, 1U}) box = box.slice(d, std::lround(centre[d]) - options.half_width[d], 2 * options.half_width[d] + 1);
    require_finite(box, "the box of a target or an ambiguity", 1);
    double peak = 0.0;
    double energy = 0.0;
    for (std::ptrdiff_t i = 0; i < box.extent(0); ++i)
        for (std::ptrdiff_t j = 0; j < box.extent(1); ++j) {
            const double power = detail::intensity(box(i, j));
            peak = std::max(peak, power);
            energy += power;
        }
    return options.measure == AmbiguityMeasure::peak ? peak : energy;
}

}  // namespace

double azimuth_ambiguity_offset(double prf, double wavelength, double velocity, double slant_range) {
    require_positive(prf, "prf");
    require_positive(wavelength, "wavelength");
    require_positive(velocity, "velocity");
    require_positive(slant_range, "slant_range");
    return prf * wavelength * slant_range / (2.0 * velocity) / (velocity / prf);
}

AmbiguityRatio azimuth_ambiguity_ratio(const ImageView& image, std::array<double, 2> position, const std::vector<double>& offsets,
                                       const AmbiguityOptions& options) {
    require_not_empty(image, "image");
    if (offsets.empty()) throw ValueError("offsets", "at least one offset", "none");
    if (options.half_width[0] < 0 || options.half_width[1] < 0)
        throw ValueError("half_width", "0 or more pixels", shape_text(options.half_width));
    if (!inside(image, position, options.half_width))
        throw ValueError("position",
                         "a box of " + shape_text(options.half_width) + " pixels each side inside the image " + shape_text(image.extents()),
                         "(" + number_text(position[0]) + ", " + number_text(position[1]) + ")");
    const double target = strength(image, position, options);
    if (target == 0.0) throw NumericalError("image: expected a target, got only zeros about the position");

    AmbiguityRatio out;
    out.highest_db = -std::numeric_limits<double>::infinity();
    bool any = false;
    for (const double offset : offsets) {
        require_finite_value(offset, "offsets");
        if (std::abs(offset) <= 2.0 * static_cast<double>(options.half_width[0]) + 1.0)
            throw ValueError("offsets", "samples further from the target than two half widths of the boxes", number_text(offset));
        const std::array<double, 2> centre{position[0] + offset, position[1]};
        if (!inside(image, centre, options.half_width)) {
            out.ratio_db.push_back(std::numeric_limits<double>::quiet_NaN());
            continue;
        }
        any = true;
        out.ratio_db.push_back(10.0 * std::log10(strength(image, centre, options) / target));
        out.highest_db = std::max(out.highest_db, out.ratio_db.back());
    }
    if (!any) throw ValueError("offsets", "an ambiguity inside the image " + shape_text(image.extents()), "none");
    return out;
}

}  // namespace sarfocus::quality
