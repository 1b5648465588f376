#include <sarfocus/autofocus/result.hpp>

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
    return text;
}

}  // namespace sarfocus::autofocus
