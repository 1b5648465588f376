#include <sarfocus/autofocus/options.hpp>

#include <string>

#include <sarfocus/core/error.hpp>

namespace sarfocus::autofocus {
namespace {

void require_at_least(int value, int least, const char* argument) {
    if (value < least) throw ValueError(argument, "at least " + std::to_string(least), std::to_string(value));
}

}  // namespace

void PointOptions::validate() const {
    for (const double window : coarse_windows)
        if (!(window > 0.0 && window <= 0.5))
            throw ValueError("coarse_windows", "shares of the bandwidth above 0 and up to 0.5", number_text(window));
    require_at_least(coarse_points, 1, "coarse_points");
    require_at_least(fine_points, 1, "fine_points");
    require_at_least(minimum_points, 1, "minimum_points");
    require_at_least(fine_rounds, 1, "fine_rounds");
    require_positive(coarse_separation, "coarse_separation");
    require_positive(fine_separation, "fine_separation");
    require_positive(coarse_noise_floor, "coarse_noise_floor");
    require_positive(fine_noise_floor, "fine_noise_floor");
    require_positive(tolerance, "tolerance");
    require_finite_value(minimum_contrast, "minimum_contrast");
    (void)resolve_threads(execution.threads);
}

}  // namespace sarfocus::autofocus
