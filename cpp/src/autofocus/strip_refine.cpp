#include <sarfocus/autofocus/strip.hpp>

#include <algorithm>
#include <string>

#include <sarfocus/core/error.hpp>

#include "strip_lines.hpp"

namespace sarfocus::autofocus {

void StripRefineOptions::validate() const {
    for (const double window : windows)
        if (!(window > 0.0 && window <= 1.0)) throw ValueError("windows", "shares above 0 and up to 1", number_text(window));
    if (rounds < 1) throw ValueError("rounds", "at least 1", std::to_string(rounds));
    require_positive(tolerance, "tolerance");
    (void)resolve_threads(execution.threads);
}

StripPhase refine_strip_phase(const Apertures& apertures, const Stitching& stitching, const StripRefineOptions& options) {
    options.validate();
    if (static_cast<std::ptrdiff_t>(stitching.slope.size()) != apertures.size() || stitching.segment.size() != stitching.slope.size())
        throw ShapeError("stitching", std::to_string(apertures.size()) + " points", std::to_string(stitching.slope.size()));
    std::vector<bool> use(detail::at(apertures.size()));
    for (std::size_t n = 0; n < use.size(); ++n) use[n] = stitching.segment[n] >= 0;
    const detail::CoherentPhase start = detail::coherent_phase(apertures, stitching, use, options.windows, 2, options.execution);
    if (!options.bridge) return detail::joint_refinement(apertures, stitching, start, options);
    Stitching joined = stitching;
    for (int& segment : joined.segment) segment = std::min(segment, 0);
    joined.segments = std::min(stitching.segments, 1);
    return detail::joint_refinement(apertures, joined, start, options);
}

}  // namespace sarfocus::autofocus
