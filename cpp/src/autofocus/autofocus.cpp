#include <sarfocus/autofocus/autofocus.hpp>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <limits>

#include <sarfocus/core/checks.hpp>
#include <sarfocus/core/error.hpp>
#include <sarfocus/quality/image_measures.hpp>

#include "gate_layout.hpp"
#include "gate_stripes.hpp"
#include "held_out.hpp"
#include "method_table.hpp"
#include "stopwatch.hpp"
#include "strip_lines.hpp"
#include "strip_result.hpp"
#include "strip_window.hpp"
#include "trials.hpp"

namespace sarfocus::autofocus {
namespace {

using detail::at;
using detail::HeldOutScores;
using detail::Method;
using detail::ScoredMethod;
using detail::Subject;

std::string names(Scene scene) {
    std::string out;
    for (const std::string& name : method_names(scene)) out += (out.empty() ? "" : ", ") + name;
    return out + (scene == Scene::strip ? " for a strip" : " for an image without stripmap geometry");
}

const Method* find(Scene scene, const std::string& name) {
    const std::vector<Method>& all = detail::methods_of(scene);
    const auto found = std::find_if(all.begin(), all.end(), [&](const Method& m) { return name == m.name; });
    return found == all.end() ? nullptr : &*found;
}

std::vector<const Method*> wanted(Scene scene, const AutofocusOptions& options) {
    std::vector<const Method*> out;
    for (const Method& m : detail::methods_of(scene))
        if (options.methods.empty() || std::find(options.methods.begin(), options.methods.end(), m.name) != options.methods.end())
            out.push_back(&m);
    return out;
}

std::string text(const char* format, double a, double b = 0.0) {
    char out[200];
    std::snprintf(out, sizeof out, format, a, b);
    return out;
}

// Runs methods on the whole image until one holds what its score promised.
class Finals {
public:
    Finals(const Subject& subject, MutableImageView corrected, const detail::CellSize& cell, const Execution& execution)
        : subject_(subject),
          corrected_(corrected),
          rule_(detail::place_rule(subject, cell)),
          centre_(detail::band_centre(subject)),
          execution_(execution),
          entropy_(quality::entropy(subject.image, execution)) {}

    [[nodiscard]] double entropy() const { return entropy_; }

    // True where the image in `corrected` is the one to hand out.
    bool run(ScoredMethod& scored, const std::string& why) {
        MethodTrial& trial = scored.trial;
        const auto start = std::chrono::steady_clock::now();
        try {
            result = scored.method->run(subject_, corrected_, true, execution_);
            trial.status = result.status;
            const std::string refusal = result.input_returned() ? "handed the input back: " + result.score.reason : objection();
            trial.chosen = refusal.empty();
            trial.reason = trial.chosen ? why : refusal;
        } catch (const ValueError& error) {
            trial.reason = std::string("refused the image: ") + error.what();
        } catch (const NumericalError& error) {
            trial.reason = std::string("refused the image: ") + error.what();
        }
        trial.seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
        return trial.chosen;
    }

    Result result;

private:
    // What speaks against the corrected image; empty: nothing.
    [[nodiscard]] std::string objection() {
        const double entropy = quality::entropy(corrected_, execution_);
        result.score.entropy_before = entropy_;
        result.score.entropy_after = entropy;
        if (!(entropy < entropy_))
            return text("the entropy of the whole image does not fall: %.4f nat before, %.4f after", entropy_, entropy);
        return detail::objection_of_points(subject_, corrected_, rule_, centre_, execution_);
    }

    const Subject subject_;
    MutableImageView corrected_;
    detail::PlaceRule rule_;
    double centre_;
    const Execution& execution_;
    double entropy_;
};

bool choose(HeldOutScores& scores, Finals& finals) {
    if (!scores.decides) {
        bool found = false;
        for (ScoredMethod& scored : scores.methods) {
            if (found) {
                scored.trial.reason = "a method that ranks before it passed its own judgement; " + scores.how;
                continue;
            }
            found = finals.run(scored, "the first in order whose own judgement and the whole image agree; " + scores.how);
        }
        return found;
    }
    bool found = false;
    for (ScoredMethod* scored : detail::ranked(scores)) {
        if (found) {
            scored->trial.reason = "no better than the method chosen, within the noise";
            continue;
        }
        found = finals.run(*scored, "the best, or as good within the noise and first in order; " + scores.how);
    }
    return found;
}

Result handed_back(const Subject& subject, const HeldOutScores& scores, double entropy, const Execution& execution) {
    Result out;
    const auto n = at(subject.image.extent(0));
    out.method = "auto";
    out.phase_error.assign(n, 0.0);
    out.estimate.assign(n, 0.0);
    out.phase_std.assign(n, std::numeric_limits<double>::quiet_NaN());
    out.score.entropy_before = entropy;
    out.score.entropy_after = entropy;
    out.threads = resolve_threads(execution.threads);
    const bool pointless = std::all_of(scores.methods.begin(), scores.methods.end(),
                                       [](const ScoredMethod& s) { return s.trial.status == Status::no_strong_points; });
    out.status = pointless ? Status::no_strong_points : Status::not_improved;
    out.score.reason = pointless ? "no method found a strong point" : "no method improved the image beyond doubt; " + scores.how;
    return out;
}

Result choose_and_run(const Subject& subject, MutableImageView corrected, const AutofocusOptions& options) {
    std::vector<Timing> timings;
    detail::Stopwatch clock(timings);
    const detail::GateLayout layout(subject.image.extent(0), subject.image.extent(1));
    const detail::CellSize cell = detail::cell_size(subject.image, layout);
    HeldOutScores scores = detail::score_held_out(subject, wanted(subject.scene(), options), cell, options.execution);
    clock.lap("score methods");
    Finals finals(subject, corrected, cell, options.execution);
    const bool found = choose(scores, finals);
    if (!found) detail::copy_image(subject.image, corrected, options.execution);
    Result result = found ? std::move(finals.result) : handed_back(subject, scores, finals.entropy(), options.execution);
    result.timings.insert(result.timings.begin(), timings.begin(), timings.end());
    for (ScoredMethod& scored : scores.methods) result.trials.push_back(std::move(scored.trial));
    return result;
}

Result run(const Subject& subject, MutableImageView corrected, const AutofocusOptions& options) {
    const Scene scene = subject.scene();
    options.validate(scene);
    const ImageView& image = subject.image;
    require_not_empty(image, "image");
    require_same_shape(corrected, "out", image, "image");
    if (subject.geometry != nullptr) detail::require_strip_image(image, *subject.geometry);
    require_finite(image, "image", options.execution.threads);
    if (options.method != "auto") return find(scene, options.method)->run(subject, corrected, true, options.execution);
    if (image.data() != corrected.data()) return choose_and_run(subject, corrected, options);
    require_memory(static_cast<std::uint64_t>(image.size()) * sizeof(cfloat), "the input, to hand it back where it gets no better");
    Array<cfloat, 2> kept(image.extents());
    detail::copy_image(image, kept.view(), options.execution);
    return choose_and_run({kept.view(), subject.geometry}, corrected, options);
}

}  // namespace

std::vector<std::string> method_names(Scene scene) {
    std::vector<std::string> out;
    for (const Method& m : detail::methods_of(scene)) out.emplace_back(m.name);
    return out;
}

void AutofocusOptions::validate(Scene scene) const {
    if (method != "auto" && find(scene, method) == nullptr)
        throw ValueError("method", "auto or one of " + names(scene), "\"" + method + "\"");
    if (method != "auto" && !methods.empty())
        throw ValueError("methods", "none beside method \"" + method + "\"", std::to_string(methods.size()));
    for (const std::string& name : methods)
        if (find(scene, name) == nullptr) throw ValueError("methods", "some of " + names(scene), "\"" + name + "\"");
    (void)resolve_threads(execution.threads);
}

Result autofocus(const ImageView& image, MutableImageView corrected, const AutofocusOptions& options) {
    return run({image, nullptr}, corrected, options);
}

Result autofocus(const ImageView& image, const geometry::StripmapGeometry& geometry, MutableImageView corrected,
                 const AutofocusOptions& options) {
    return run({image, &geometry}, corrected, options);
}

}  // namespace sarfocus::autofocus
