#include <sarfocus/autofocus/spga.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include <sarfocus/core/checks.hpp>
#include <sarfocus/core/error.hpp>
#include <sarfocus/focus/azimuth.hpp>

#include "stopwatch.hpp"
#include "strip_chain.hpp"
#include "strip_lines.hpp"
#include "strip_result.hpp"
#include "strip_window.hpp"

namespace sarfocus::autofocus {
namespace {

using detail::at;
using geometry::StripmapGeometry;

// The mean phase step of every aperture, which the classic method takes for the point's position and removes.
Stitching without_mean_steps(const Apertures& apertures) {
    Stitching out;
    out.segment.assign(at(apertures.size()), 0);
    out.segments = apertures.size() > 0 ? 1 : 0;
    for (std::ptrdiff_t n = 0; n < apertures.size(); ++n) {
        const std::vector<cdouble> line = detail::whitened_line(apertures, n, {}, 0.0);
        cdouble sum{};
        for (std::size_t k = 1; k < line.size(); ++k) sum += line[k] * std::conj(line[k - 1]);
        out.slope.push_back(sum != cdouble{} ? std::arg(sum) : 0.0);
    }
    return out;
}

struct Pass {
    Apertures apertures;
    Stitching stitching;
    StripPhase phase;
};

Pass estimate(const ImageView& image, const StripmapGeometry& geometry, const SpgaOptions& options, const detail::StripChooser& choose,
              double share, detail::Stopwatch& clock) {
    Pass out;
    StripSelectOptions select = options.select;
    select.execution = options.execution;
    StripExtractOptions extract = options.extract;
    extract.execution = options.execution;
    extract.window = std::max(
        static_cast<int>(std::lround(share * (options.extract.window > 0 ? options.extract.window : detail::narrow_window(geometry)))), 4);
    select.window = extract.window;
    const std::vector<StripPoint> points = choose(image, geometry, select);
    clock.lap("select");
    out.apertures = extract_apertures(image, geometry, points, extract);
    clock.lap("extract");
    out.stitching = without_mean_steps(out.apertures);
    if (!points.empty()) out.phase = integrate_gradient(out.apertures, out.stitching, options.execution);
    clock.lap("estimate");
    return out;
}

std::vector<StrongPoint> as_detected(const Apertures& apertures) {
    std::vector<StrongPoint> out;
    for (const StripPoint& p : apertures.points)
        out.push_back({static_cast<double>(p.azimuth), static_cast<double>(p.range), 0.0, 0.0, 0.0});
    return out;
}

void add_round(const Pass& pass, Result& result) {
    double square = 0.0;
    for (std::size_t k = 0; k < pass.phase.phase.size(); ++k) {
        result.estimate[k] += pass.phase.phase[k];
        square += pass.phase.phase[k] * pass.phase.phase[k];
    }
    Round round;
    round.stage = "pass";
    round.window = pass.apertures.window;
    round.points = static_cast<int>(pass.apertures.size());
    round.iterations = 1;
    round.update_rms = std::sqrt(square / static_cast<double>(result.estimate.size()));
    result.rounds.push_back(round);
}

}  // namespace

void SpgaOptions::validate() const {
    select.validate();
    extract.validate();
    if (iterations < 1) throw ValueError("iterations", "at least 1", std::to_string(iterations));
    if (!(narrowing > 0.0 && narrowing <= 1.0)) throw ValueError("narrowing", "a factor above 0, at most 1", number_text(narrowing));
    (void)resolve_threads(execution.threads);
}

Result spga(const ImageView& image, const StripmapGeometry& geometry, MutableImageView corrected, const SpgaOptions& options) {
    return detail::spga_with(image, geometry, corrected, options, select_strip_points);
}

Result detail::spga_with(const ImageView& image, const StripmapGeometry& geometry, MutableImageView corrected, const SpgaOptions& options,
                         const StripChooser& choose) {
    options.validate();
    detail::require_strip_input(image, geometry, corrected);
    const auto n = at(image.extent(0));
    Result result;
    result.method = "spga";
    result.threads = resolve_threads(options.execution.threads);
    result.estimate.assign(n, 0.0);
    result.phase_error.assign(n, 0.0);
    result.phase_std.assign(n, std::numeric_limits<double>::quiet_NaN());
    result.strip.coverage.assign(n, 0.0);
    detail::Stopwatch clock(result.timings);
    Array<cfloat, 2> kept;
    if (options.do_no_harm && image.data() == corrected.data()) {
        require_memory(static_cast<std::uint64_t>(image.size()) * sizeof(cfloat), "the input, to hand it back where it gets no better");
        kept = Array<cfloat, 2>(image.extents());
        detail::copy_image(image, kept.view(), options.execution);
    }
    const ImageView input = kept.empty() ? image : ImageView(kept.view());
    clock.lap("copy");
    double share = 1.0;
    Pass pass;
    detail::PeakWatch peaks({}, geometry, image.extent(0));  // of the points of the first pass
    for (int i = 0; i < options.iterations; ++i) {
        pass = estimate(i == 0 ? input : ImageView(corrected), geometry, options, choose, share, clock);
        if (pass.apertures.size() == 0) break;
        add_round(pass, result);
        const ArrayView<const double, 2> phase(pass.phase.phase.data(), {1, image.extent(0)});
        detail::EntropyWatch watch(image.extent(0), image.extent(1));
        if (i == 0) peaks = detail::PeakWatch(as_detected(pass.apertures), geometry, image.extent(0));
        focus::azimuth_correct(i == 0 ? input : ImageView(corrected), geometry, phase, {0.0}, corrected,
                               detail::watched_by(watch, peaks, i == 0, options.execution));
        if (i == 0) result.score.entropy_before = watch.before();
        result.score.entropy_after = watch.after();
        clock.lap("correct");
        share = std::max(share * options.narrowing, 0.25);
    }
    if (result.rounds.empty()) {
        result.score.reason = "no pixel stands out of the clutter";
        detail::copy_image(input, corrected, options.execution);
        return result;
    }
    if (pass.apertures.size() > 0) {
        result.phase_std = pass.phase.phase_std;
        detail::StripEvidence none;
        none.held_out_gain.assign(at(pass.apertures.size()), std::numeric_limits<double>::quiet_NaN());
        const std::vector<double> shift(at(pass.apertures.size()), 0.0);
        detail::append_details(pass.apertures, pass.stitching, pass.phase, shift, none, result);
    }
    if (options.do_no_harm) {
        std::string harm = detail::harm_done(result.score, peaks);
        // No phase from other points judges these; a strong one that falls among weak ones that rise is harm.
        if (harm.empty() && peaks.total_gain_db() < 0.0) harm = "the strongest points that the phase rests on fall";
        result.score.improved = harm.empty();
        result.score.point_gain_db = peaks.mean_gain_db();
        result.score.reason = harm.empty() ? "the entropy of the whole image falls, the points' peaks don't" : harm;
        if (!result.score.improved) {
            result.status = Status::not_improved;
            detail::copy_image(input, corrected, options.execution);
            return result;
        }
    }
    result.phase_error = result.estimate;
    result.status = detail::coverage_status(result, geometry);
    return result;
}

}  // namespace sarfocus::autofocus
