#include <sarfocus/hrws/si_mec.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <utility>

#include <sarfocus/core/error.hpp>

#include "beam.hpp"
#include "laps.hpp"

namespace sarfocus::hrws {
namespace {

using autofocus::Trajectory;
using autofocus::TrajectoryPoint;
using autofocus::TrajectoryStatus;

constexpr double faint = 2.0;  // power of a region over the median of the echo

// Median over range of the mean power over the pulses of the first channel.
double background(const Echo& echo) {
    const ImageView samples = echo.data.row(0);
    std::vector<double> power(static_cast<std::size_t>(samples.extent(1)), 0.0);
    for (std::ptrdiff_t k = 0; k < samples.extent(0); ++k)
        for (std::ptrdiff_t i = 0; i < samples.extent(1); ++i)
            power[static_cast<std::size_t>(i)] += static_cast<double>(std::norm(samples(k, i))) / static_cast<double>(samples.extent(0));
    const auto middle = power.begin() + static_cast<std::ptrdiff_t>(power.size() / 2);
    std::nth_element(power.begin(), middle, power.end());
    return *middle;
}

Trajectory estimate(const Echo& echo, const std::vector<geometry::ImageGrid>& regions, const SiMecOptions& options) {
    if (regions.size() < 2)
        throw ValueError("regions", "two or more chips round strong points, far apart in range", std::to_string(regions.size()));
    autofocus::TrajectoryEchoes echoes;
    for (std::ptrdiff_t n = 0; n < echo.n_channel(); ++n) echoes.channels.push_back(echo.profiles(n));
    echoes.positions = echo.phase_centres;
    echoes.baselines = echo.baselines;
    autofocus::TrajectoryOptions how = options.motion;
    how.exactly_determined = true;
    how.aspect = detail::beam_of(echo, options.reconstruct.band);
    how.execution = options.execution;
    Trajectory found = autofocus::estimate_trajectory(echoes, regions, how);
    if (found.empty_region >= 0)
        throw ValueError("regions[" + std::to_string(found.empty_region) + "]", "a strong point within the recorded ranges", "no echo");
    if (!found.determined) throw ValueError("regions: " + found.reason);
    return found;
}

// The region that the others' motion suits least, as a share of its coherence; 1 where none is told.
std::pair<std::size_t, double> worst_region(const std::vector<TrajectoryPoint>& points) {
    std::pair<std::size_t, double> out{0, 1.0};
    for (std::size_t m = 0; m < points.size(); ++m)
        if (points[m].held_out < out.second * points[m].coherence) out = {m, points[m].held_out / points[m].coherence};
    return out;
}

std::string text_of(const char* format, std::size_t region, double first, double second) {
    char text[240];
    std::snprintf(text, sizeof text, format, region, first, second);
    return text;
}

void judge(const Trajectory& found, const SiMecOptions& options, SiMecResult& out) {
    out.reason = found.reason;
    if (found.status == TrajectoryStatus::not_improved) {
        out.status = SiMecStatus::not_improved;
        const auto least = std::min_element(out.contrast.begin(), out.contrast.end());
        if (least == out.contrast.end() || !(*least < faint)) return;
        out.status = SiMecStatus::no_strong_point;
        out.reason = text_of("region %zu has %.1f times the power that the echo has at most ranges, a strong point at least %.0f times; ",
                             static_cast<std::size_t>(least - out.contrast.begin()), *least, faint) +
                     found.reason;
        return;
    }
    out.status = found.status == TrajectoryStatus::converged ? SiMecStatus::converged : SiMecStatus::max_iterations;
    if (options.motion.pixels == autofocus::PixelChoice::brightest) return;  // clutter contradicts every single point
    const auto [region, share] = worst_region(found.points);
    if (share < options.agreement && options.motion.do_no_harm) {
        out.status = SiMecStatus::inconsistent;
        out.reason = text_of("region %zu contradicts the others: their motion leaves it %.3f coherent, one with its say %.3f", region,
                             found.points[region].held_out, found.points[region].coherence);
    }
}

double largest_spread(const std::vector<TrajectoryPoint>& points) {
    double out = std::numeric_limits<double>::quiet_NaN();
    for (const TrajectoryPoint& p : points)
        if (!(p.spread <= out)) out = std::isnan(p.spread) ? out : p.spread;
    return out;
}

}  // namespace

const char* status_text(SiMecStatus status) {
    switch (status) {
        case SiMecStatus::converged:
            return "converged";
        case SiMecStatus::max_iterations:
            return "max_iterations";
        case SiMecStatus::inconsistent:
            return "inconsistent";
        case SiMecStatus::no_strong_point:
            return "no_strong_point";
        case SiMecStatus::not_improved:
            return "not_improved";
    }
    return "unknown";
}

void SiMecOptions::validate() const {
    motion.validate();
    if (!(agreement >= 0.0 && agreement <= 1.0)) throw ValueError("agreement", "a share from 0 to 1", number_text(agreement));
    (void)resolve_threads(execution.threads);
}

SiMecResult si_mec(const Echo& echo, const geometry::ImageGrid& grid, const std::vector<geometry::ImageGrid>& regions,
                   MutableImageView image, const SiMecOptions& options) {
    options.validate();
    ReconstructOptions reconstruction = options.reconstruct;
    reconstruction.execution = options.execution;
    require_reconstructible(echo, grid, {}, image, reconstruction);
    (void)channel_weights(sampling(echo).offsets, echo.prf, echo.velocity, reconstruction.band);  // refused now, not behind the estimate

    SiMecResult out;
    Trajectory found = estimate(echo, regions, options);
    out.timings = std::move(found.timings);
    const double usual = background(echo);
    for (const TrajectoryPoint& p : found.points)
        out.contrast.push_back(usual > 0.0 ? p.power / usual : std::numeric_limits<double>::infinity());
    judge(found, options, out);
    out.motion = std::move(found.motion);
    if (out.status == SiMecStatus::inconsistent) out.motion = Array<double, 2>(out.motion.extents());
    out.motion_std = std::move(found.motion_std);
    out.estimate = std::move(found.estimate);
    out.regions = std::move(found.points);
    out.coherence_before = found.coherence_before;
    out.coherence = found.coherence;
    out.coherence_by_chance = found.coherence_by_chance;
    out.spread = largest_spread(out.regions);
    out.line_removed = found.line_removed;
    out.objective = std::move(found.objective);
    out.threads = resolve_threads(options.execution.threads);

    detail::Laps laps(out.timings);
    reconstruct(echo, grid, std::as_const(out.motion).view(), image, reconstruction);
    laps.end("reconstruction");
    return out;
}

std::string SiMecResult::summary() const {
    char text[240];
    std::snprintf(text, sizeof text, "si_mec: %s, coherence of the regions %.4f -> %.4f (by chance %.4f)", status_text(status),
                  coherence_before, coherence, coherence_by_chance);
    std::string out = text;
    out += "\n" + reason;
    constexpr std::size_t most = 8;
    if (regions.size() > most) out += "\n" + std::to_string(regions.size()) + " regions";
    for (std::size_t m = 0; m < regions.size() && regions.size() <= most; ++m) {
        const TrajectoryPoint& p = regions[m];
        std::snprintf(text, sizeof text, "\nregion %zu: coherence %.4f -> %.4f, by the others' motion %.4f, spread %.2g mm", m,
                      p.coherence_before, p.coherence, p.held_out, 1e3 * p.spread);
        out += text;
    }
    double seconds = 0.0;
    for (const autofocus::Timing& t : timings) seconds += t.seconds;
    std::snprintf(text, sizeof text, "\n%.2f s on %d threads", seconds, threads);
    return out + text;
}

}  // namespace sarfocus::hrws
