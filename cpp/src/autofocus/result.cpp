#include <sarfocus/autofocus/result.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace sarfocus::autofocus {

const char* status_text(Status status) {
    switch (status) {
        case Status::converged:
            return "converged";
        case Status::max_iterations:
            return "max_iterations";
        case Status::not_improved:
            return "not_improved";
        case Status::no_strong_points:
            return "no_strong_points";
        case Status::gaps:
            return "gaps";
    }
    return "unknown";
}

namespace {

// The decisions of adaptive PGA.
std::string decisions(const AdaptiveDetails& adaptive) {
    const auto margin = [](const GateCell& c) { return c.threshold > 0.0 ? c.value / c.threshold : 0.0; };
    const GateCell& best = *std::max_element(adaptive.cells.begin(), adaptive.cells.end(),
                                             [&](const auto& a, const auto& b) { return margin(a) < margin(b); });
    char text[320];
    std::snprintf(text, sizeof text, "\n%s: best cell (%lld, %lld) over %lld pixels, %+.1f dB above its threshold; ",
                  adaptive.strong_points ? "strong points" : "no strong points", static_cast<long long>(best.azimuth),
                  static_cast<long long>(best.range), static_cast<long long>(best.extent),
                  10.0 * std::log10(std::max(margin(best), 1e-12)));
    std::string out = text;
    if (!adaptive.strong_points) {
        std::snprintf(text, sizeof text, "gates %lld to %lld denoised", static_cast<long long>(adaptive.first_denoised),
                      static_cast<long long>(adaptive.first_denoised + adaptive.denoised - 1));
        return out + (adaptive.denoised > 0 ? text : "passed through");
    }
    int least = 0;
    int most = 0;
    int skipped = 0;
    for (const SubAperture& s : adaptive.sub_apertures) {
        skipped += s.gates == 0 ? 1 : 0;
        if (s.gates > 0) least = least == 0 ? s.gates : std::min(least, s.gates);
        most = std::max(most, s.gates);
    }
    std::snprintf(text, sizeof text, "%d to %d gates a sub-aperture, %d of %zu skipped (eta %.2f)", least, most, skipped,
                  adaptive.sub_apertures.size(), adaptive.eta);
    return out + text;
}

// One line for each method that `autofocus` tried.
std::string trials_table(const std::vector<MethodTrial>& trials) {
    std::string out;
    for (const MethodTrial& t : trials) {
        char line[160];
        if (std::isfinite(t.held_out_gain_db))
            std::snprintf(line, sizeof line, "\n%s %-17s %+6.2f dB +- %.2f on %3d held-out points: ", t.chosen ? "*" : " ",
                          t.method.c_str(), t.held_out_gain_db, t.held_out_std_db, t.held_out_points);
        else
            std::snprintf(line, sizeof line, "\n%s %-17s ", t.chosen ? "*" : " ", t.method.c_str());
        out += line + t.reason;
    }
    return out;
}

}  // namespace

std::string Result::summary() const {
    double square = 0.0;
    double variance = 0.0;
    double reached = 0.0;
    for (std::size_t k = 0; k < phase_error.size(); ++k) {
        square += phase_error[k] * phase_error[k];
        if (std::isfinite(phase_std[k])) {
            variance += phase_std[k] * phase_std[k];
            reached += 1.0;
        }
    }
    const double pulses = phase_error.empty() ? 1.0 : static_cast<double>(phase_error.size());
    double seconds = 0.0;
    for (const Timing& t : timings) seconds += t.seconds;
    char text[640];
    std::snprintf(text, sizeof text,
                  "status: %s (%s)\n"
                  "phase error removed: %.3f rad RMS, standard deviation %.3f rad, %.0f %% of the aperture reached\n"
                  "strong points: %zu; rounds: %zu; entropy %.4f -> %.4f nat; %.2f s on %d threads",
                  status_text(status), score.reason.c_str(), std::sqrt(square / pulses),
                  reached > 0.0 ? std::sqrt(variance / reached) : 0.0, 100.0 * reached / pulses, points.size(), rounds.size(),
                  score.entropy_before, score.entropy_after, seconds, threads);
    std::string out = text;
    if (!adaptive.cells.empty()) out += decisions(adaptive);
    return out + trials_table(trials);
}

}  // namespace sarfocus::autofocus
