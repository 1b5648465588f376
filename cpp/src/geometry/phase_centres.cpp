#include <sarfocus/geometry/phase_centres.hpp>

#include <array>
#include <string>
#include <utility>

#include <sarfocus/core/checks.hpp>

namespace sarfocus::geometry {

void PhaseCentres::validate(std::ptrdiff_t n_pulse) const {
    for (const auto& [view, name] : {std::pair{transmit, "positions"}, std::pair{receive, "receive positions"}}) {
        if (view.extents() != std::array<std::ptrdiff_t, 2>{n_pulse, 3})
            throw ShapeError(name, "(" + std::to_string(n_pulse) + ", 3), one position per pulse", shape_text(view.extents()));
        require_finite(view, name);
    }
}

}  // namespace sarfocus::geometry
