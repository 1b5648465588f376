#include "python_result.hpp"

#include <pybind11/numpy.h>

#include "convert.hpp"

namespace sarfocus::python {
namespace {

py::dict strip_details(const autofocus::StripDetails& strip) {
    py::dict out;
    out["seams"] = to_numpy(strip.seams);
    out["segment"] = to_numpy(strip.segment);
    out["segments"] = strip.segments;
    out["coverage"] = to_numpy(strip.coverage);
    out["point_quality"] = to_numpy(strip.point_quality);
    out["held_out_gain"] = to_numpy(strip.held_out_gain);
    out["knot"] = strip.knot;
    if (!strip.block_centre.empty()) {
        const auto blocks = static_cast<py::ssize_t>(strip.block_centre.size());
        const auto n = static_cast<py::ssize_t>(strip.block_phase.size()) / blocks;
        out["block_phase"] = py::array_t<double>({blocks, n}, strip.block_phase.data());
        out["block_std"] = py::array_t<double>({blocks, n}, strip.block_std.data());
        out["block_centre"] = to_numpy(strip.block_centre);
    }
    return out;
}

py::dict adaptive_details(const autofocus::AdaptiveDetails& adaptive) {
    py::list cells;
    for (const autofocus::GateCell& c : adaptive.cells) {
        py::dict row;
        row["azimuth"] = c.azimuth;
        row["range"] = c.range;
        row["extent"] = c.extent;
        row["value"] = c.value;
        row["clutter"] = c.clutter;
        row["threshold"] = c.threshold;
        row["detected"] = c.detected;
        cells.append(row);
    }
    py::list sub_apertures;
    for (const autofocus::SubAperture& s : adaptive.sub_apertures) {
        py::dict row;
        row["first"] = s.first;
        row["count"] = s.count;
        row["gates"] = s.gates;
        row["mean_strong"] = s.mean_strong;
        row["mean_rest"] = s.mean_rest;
        row["points"] = s.points;
        sub_apertures.append(row);
    }
    py::dict out;
    out["cells"] = cells;
    out["strong_points"] = adaptive.strong_points;
    out["amplitudes"] = adaptive.amplitudes;
    out["first_denoised"] = adaptive.first_denoised;
    out["denoised"] = adaptive.denoised;
    out["eta"] = adaptive.eta;
    out["sub_apertures"] = sub_apertures;
    return out;
}

py::dict migration_details(const autofocus::MigrationDetails& migration) {
    py::dict out;
    out["model"] = migration.model;
    out["bandwidth_ratio"] = migration.bandwidth_ratio;
    out["estimated"] = migration.estimated;
    out["gain"] = migration.gain;
    out["noise"] = migration.noise;
    out["gates"] = migration.gates;
    out["passes"] = migration.passes;
    return out;
}

py::list method_trials(const std::vector<autofocus::MethodTrial>& trials) {
    py::list out;
    for (const autofocus::MethodTrial& t : trials) {
        py::dict row;
        row["method"] = t.method;
        row["status"] = autofocus::status_text(t.status);
        row["held_out_gain_db"] = t.held_out_gain_db;
        row["held_out_std_db"] = t.held_out_std_db;
        row["held_out_points"] = t.held_out_points;
        row["held_out_entropy"] = t.held_out_entropy;
        row["seconds"] = t.seconds;
        row["chosen"] = t.chosen;
        row["reason"] = t.reason;
        out.append(row);
    }
    return out;
}

}  // namespace

py::dict diagnostics(const autofocus::Result& result) {
    py::list rounds;
    for (const autofocus::Round& r : result.rounds) {
        py::dict row;
        row["stage"] = r.stage;
        row["window"] = r.window;
        row["points"] = r.points;
        row["iterations"] = r.iterations;
        row["update_rms"] = r.update_rms;
        rounds.append(row);
    }
    py::dict score;
    score["entropy_before"] = result.score.entropy_before;
    score["entropy_after"] = result.score.entropy_after;
    score["held_out_gain"] = result.score.held_out_gain;
    score["held_out_noise"] = result.score.held_out_noise;
    score["point_gain_db"] = result.score.point_gain_db;
    score["improved"] = result.score.improved;
    score["reason"] = result.score.reason;
    py::dict timings;
    for (const autofocus::Timing& t : result.timings) timings[py::str(t.phase)] = t.seconds;
    py::dict out;
    out["method"] = result.method;
    if (!result.strip.coverage.empty()) out["strip"] = strip_details(result.strip);
    if (!result.adaptive.cells.empty()) out["adaptive"] = adaptive_details(result.adaptive);
    if (!result.migration.model.empty()) out["migration"] = migration_details(result.migration);
    if (!result.trials.empty()) out["trials"] = method_trials(result.trials);
    out["rounds"] = rounds;
    out["score"] = score;
    out["timings"] = timings;
    out["threads"] = result.threads;
    return out;
}

}  // namespace sarfocus::python
