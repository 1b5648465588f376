#include <sarfocus/geometry/stripmap_geometry.hpp>

#include <cmath>
#include <string>

#include <sarfocus/core/error.hpp>

namespace sarfocus::geometry {

void StripmapGeometry::validate() const {
    require_positive(wavelength, "wavelength");
    require_positive(prf, "prf");
    require_positive(velocity, "velocity");
    require_positive(doppler_bandwidth, "doppler_bandwidth");
    require_finite_value(doppler_centroid, "doppler_centroid");
    if (doppler_bandwidth > prf)
        throw ValueError("doppler_bandwidth", "at most the prf of " + number_text(prf) + " Hz", number_text(doppler_bandwidth));
    if (slant_range.empty()) throw ShapeError("slant_range", "at least one range gate", "none");
    for (std::size_t i = 0; i < slant_range.size(); ++i)
        if (!(std::isfinite(slant_range[i]) && slant_range[i] > 0.0))
            throw ValueError("slant_range[" + std::to_string(i) + "]", "a finite range > 0 m", number_text(slant_range[i]));
}

double StripmapGeometry::fm_rate(std::size_t range_gate) const {
    return 2.0 * velocity * velocity / (wavelength * slant_range[range_gate]);
}
double StripmapGeometry::doppler_rate(std::size_t range_gate) const {
    return -fm_rate(range_gate);
}
double StripmapGeometry::aperture_time(std::size_t range_gate) const {
    return doppler_bandwidth / fm_rate(range_gate);
}
double StripmapGeometry::aperture_samples(std::size_t range_gate) const {
    return aperture_time(range_gate) * prf;
}

}  // namespace sarfocus::geometry
