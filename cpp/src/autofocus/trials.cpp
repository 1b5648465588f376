#include "trials.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <limits>
#include <optional>

#include <sarfocus/core/error.hpp>

#include "gate_stripes.hpp"
#include "strip_lines.hpp"

namespace sarfocus::autofocus::detail {
namespace {

constexpr double sigmas = 3.0;
constexpr std::size_t fewest_points = 4;  // of both sets together

std::string text(const char* format, double a, double b = 0.0) {
    char out[240];
    std::snprintf(out, sizeof out, format, a, b);
    return out;
}

// The phase that a method finds in a part; none where it refuses the part.
std::optional<std::vector<double>> phase_from(const Subject& part, ScoredMethod& scored, MutableImageView corrected,
                                              const Execution& execution) {
    try {
        Result found = scored.method->run(part, corrected, false, execution);
        scored.trial.status = found.status;
        return std::move(found.phase_error);
    } catch (const ValueError& error) {
        scored.trial.reason = std::string("refused a part of the image: ") + error.what();
    } catch (const NumericalError& error) {
        scored.trial.reason = std::string("refused a part of the image: ") + error.what();
    }
    return std::nullopt;
}

// One set of gates with the phases from the other.
class Judged {
public:
    Judged(const Subject& part, const std::vector<std::ptrdiff_t>& gates, const std::vector<bool>& inner, const PlaceRule& rule,
           double centre, const Execution& execution)
        : part_(part),
          gates_(gates),
          inner_(inner),
          rule_(rule),
          centre_(centre),
          execution_(execution),
          brightest_(part.image, execution) {}

    void show(const std::vector<double>& phase) {
        if (scratch_.empty()) scratch_ = Array<cfloat, 2>(part_.image.extents());
        take_out(part_, phase, scratch_.view(), execution_);
        brightest_.add(scratch_.view(), execution_);
    }

    std::size_t choose() {
        scratch_ = {};
        places_ = brightest_.places(gates_, inner_, rule_, execution_);
        before_ = measure(part_.image, centre_, places_, rule_, execution_);
        return places_.size();
    }

    void score(const std::vector<double>& phase, ScoredMethod& scored) const {
        const PlaceMeasures after = measure_without(part_, phase, centre_, places_, rule_, execution_);
        for (std::size_t p = 0; p < places_.size(); ++p) {
            scored.gain_db.push_back(after.peak_db[p] - before_.peak_db[p]);
            scored.trial.held_out_entropy += after.entropy[p] - before_.entropy[p];  // becomes a mean in `finish`
        }
    }

private:
    const Subject part_;
    const std::vector<std::ptrdiff_t>& gates_;
    const std::vector<bool>& inner_;
    const PlaceRule& rule_;
    double centre_;
    const Execution& execution_;
    Brightest brightest_;
    Array<cfloat, 2> scratch_;
    std::vector<JudgedPoint> places_;
    PlaceMeasures before_;
};

void finish(ScoredMethod& scored) {
    MethodTrial& trial = scored.trial;
    const MeanGain mean = mean_gain(scored.gain_db);
    trial.held_out_gain_db = mean.mean;
    trial.held_out_std_db = mean.standard_error;
    trial.held_out_points = static_cast<int>(scored.gain_db.size());
    if (trial.held_out_points > 0) trial.held_out_entropy /= trial.held_out_points;
}

using Phases = std::array<std::optional<std::vector<double>>, 2>;  // from either part
using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
    return std::chrono::duration<double>(Clock::now() - start).count();
}

// The phases that all methods find in some gates, of those that have not refused others; each in memory that the next one loads anew.
void estimate_from(const Subject& whole, const std::vector<std::ptrdiff_t>& gates, std::size_t from, std::vector<ScoredMethod>& methods,
                   std::vector<Phases>& phases, const Execution& execution) {
    Part part(whole, gates, execution);
    for (std::size_t m = 0; m < methods.size(); ++m) {
        if (from == 1 && !phases[m][0]) continue;
        const Clock::time_point start = Clock::now();
        phases[m][from] = phase_from(part.subject(), methods[m], part.pixels(), execution);
        part.load(whole.image, gates, execution);
        methods[m].trial.seconds += seconds_since(start);
    }
}

// Returns the number of points of the set, by which the methods with phases from both parts are scored.
std::size_t judge(Judged& set, std::size_t from, const std::vector<Phases>& phases, std::vector<ScoredMethod>& methods) {
    for (std::size_t m = 0; m < methods.size(); ++m) {
        const Clock::time_point start = Clock::now();
        const auto& phase = phases[m][from];
        if (phase.has_value()) set.show(phase.value());
        methods[m].trial.seconds += seconds_since(start);
    }
    const std::size_t points = set.choose();
    for (std::size_t m = 0; m < methods.size(); ++m) {
        const auto& own = phases[m][from];
        if (own.has_value() && phases[m][1 - from].has_value()) set.score(own.value(), methods[m]);
    }
    return points;
}

}  // namespace

bool ScoredMethod::helps() const {
    return trial.held_out_points > 0 && trial.held_out_gain_db > sigmas * trial.held_out_std_db && trial.held_out_entropy < 0.0;
}

HeldOutScores score_held_out(const Subject& subject, const std::vector<const Method*>& methods, const CellSize& cell,
                             const Execution& execution) {
    HeldOutScores out;
    const double nan = std::numeric_limits<double>::quiet_NaN();
    for (const Method* m : methods) {
        ScoredMethod scored;
        scored.method = m;
        scored.trial.method = m->name;
        scored.trial.held_out_gain_db = nan;
        scored.trial.held_out_std_db = nan;
        out.methods.push_back(std::move(scored));
    }
    const GateStripes stripes = stripes_of(subject.image, cell, execution);
    if (stripes.stripes == 0) {
        out.how = "too few range gates to hold any back";
        return out;
    }
    const PlaceRule rule = place_rule(subject, cell);
    const double centre = band_centre(subject);
    std::vector<Phases> phases(out.methods.size());
    for (const std::size_t from : {0U, 1U}) estimate_from(subject, stripes.gates[from], from, out.methods, phases, execution);
    std::array<std::size_t, 2> points{};
    for (const std::size_t judged : {0U, 1U}) {
        const Part part(subject, stripes.gates[judged], execution);
        Judged set(part.subject(), stripes.gates[judged], stripes.inner[judged], rule, centre, execution);
        points[judged] = judge(set, 1 - judged, phases, out.methods);
    }
    for (std::size_t m = 0; m < out.methods.size(); ++m)
        if (phases[m][0].has_value() && phases[m][1].has_value()) finish(out.methods[m]);
    out.decides = points[0] > 0 && points[1] > 0 && points[0] + points[1] >= fewest_points;
    out.how = out.decides ? text("scored on %.0f held-out points", static_cast<double>(points[0] + points[1]), 0.0)
                          : text("%.0f and %.0f strong points in the two parts of the scene, too few to hold any back",
                                 static_cast<double>(points[0]), static_cast<double>(points[1]));
    if (stripes.stripes < stripes.of_stripes)
        out.how += text(" in the strongest %.0f of %.0f range stripes", static_cast<double>(stripes.stripes),
                        static_cast<double>(stripes.of_stripes));
    return out;
}

namespace {

// Whether `better` does better than `scored` on the same points, beyond the noise.
bool beats(const ScoredMethod& better, const ScoredMethod& scored) {
    std::vector<double> difference;
    for (std::size_t p = 0; p < better.gain_db.size(); ++p) difference.push_back(better.gain_db[p] - scored.gain_db[p]);
    const MeanGain mean = mean_gain(difference);
    constexpr double negligible = 0.05;  // dB
    return mean.mean > negligible && mean.mean > sigmas * mean.standard_error;
}

}  // namespace

std::vector<ScoredMethod*> ranked(HeldOutScores& scores) {
    std::vector<ScoredMethod*> left;
    for (ScoredMethod& scored : scores.methods) {
        MethodTrial& trial = scored.trial;
        if (scored.helps())
            left.push_back(&scored);
        else if (trial.held_out_points > 0)
            trial.reason = trial.held_out_gain_db > sigmas * trial.held_out_std_db
                               ? text("the peaks rose, but their surroundings spread: entropy %+.3f nat", trial.held_out_entropy)
                               : "the gain is not above three times its noise";
    }
    std::vector<ScoredMethod*> out;
    while (!left.empty()) {
        const ScoredMethod* best = left.front();
        for (const ScoredMethod* candidate : left)
            if (candidate->trial.held_out_gain_db > best->trial.held_out_gain_db) best = candidate;
        const auto first = std::find_if(left.begin(), left.end(), [&](const ScoredMethod* s) { return !beats(*best, *s); });
        out.push_back(*first);
        left.erase(first);
    }
    return out;
}

}  // namespace sarfocus::autofocus::detail
