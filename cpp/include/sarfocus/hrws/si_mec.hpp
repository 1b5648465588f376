#pragma once

#include <string>
#include <vector>

#include <sarfocus/autofocus/result.hpp>
#include <sarfocus/autofocus/trajectory.hpp>
#include <sarfocus/core/array.hpp>
#include <sarfocus/core/array_view.hpp>
#include <sarfocus/core/execution.hpp>
#include <sarfocus/core/export.hpp>
#include <sarfocus/geometry/image_grid.hpp>
#include <sarfocus/hrws/echo.hpp>
#include <sarfocus/hrws/reconstruct.hpp>

namespace sarfocus::hrws {

struct SiMecOptions {
    /// `exactly_determined` and `aspect` are set, `execution` is not used: that below goes for all. Its `pixels`: with `brightest` the
    /// regions may be thousands, and no single one contradicts the others.
    autofocus::TrajectoryOptions motion;
    ReconstructOptions reconstruct;  ///< its `execution` is not used
    /// A region contradicts the others where the motion that these give leaves it less coherent than this share of what its own say in the
    /// motion makes of it: half a power, a phase error of 0.8 rad RMS, at which a point loses 3 dB.
    double agreement = 0.5;
    Execution execution;

    /// Throws ValueError.
    SARFOCUS_API void validate() const;
};

enum class SiMecStatus {
    converged,
    max_iterations,   ///< of the last alternation
    inconsistent,     ///< the regions ask for different motions: the motion is zero
    no_strong_point,  ///< not improved, and a region is hardly brighter than the echo at other ranges: the motion is zero
    not_improved      ///< the motion is zero; see the reason
};

[[nodiscard]] SARFOCUS_API const char* status_text(SiMecStatus status);

struct SiMecResult {
    Array<double, 2> motion;      ///< [n_pulse, 3], m, added to the phase centres of every channel
    Array<double, 2> motion_std;  ///< [n_pulse, 3], m, from the residual phases
    Array<double, 2> estimate;    ///< [n_pulse, 3], m, handed out or not
    /// What every region says: coherence without motion, with it, and with the motion that the other regions give; and by how far
    /// its ranges then differ from theirs (`spread`, m). nan where the others do not determine the motion.
    std::vector<autofocus::TrajectoryPoint> regions;
    double coherence_before = 0.0;  ///< mean over the regions
    double coherence = 0.0;
    double coherence_by_chance = 0.0;
    double spread = 0.0;            ///< m, the largest of the regions; nan where none can be told
    std::vector<double> contrast;   ///< of every region, its power over the median of the echo's over range
    bool line_removed = false;      ///< whether constant and line over the pulses were taken out of the motion, as the gauge
    std::vector<double> objective;  ///< of the last alternation, step by step; never falls
    SiMecStatus status = SiMecStatus::not_improved;
    std::string reason;                      ///< one sentence
    std::vector<autofocus::Timing> timings;  ///< s: histories, pixels, alternation, judgement, reconstruction
    int threads = 0;

    /// A few lines for people.
    [[nodiscard]] SARFOCUS_API std::string summary() const;
};

/// Motion compensation by sub-images [Zhou2022, algorithm 1]: the motion of the platform that makes strong points in two or more regions
/// brightest, from the terms of all channels (autofocus::estimate_trajectory), then the image reconstructed from phase centres moved by it.
/// With cross_track and two regions the motion is solved for; no region can then vouch for the others.
///
/// Pulses count for a region where they see it within the Doppler bandwidth of `reconstruct.band`.
///
/// grid: the image wanted; regions: small chips round strong points far apart in range, the first index along the track; image:
/// [grid.shape], overwritten. Where the motion is refused (see the status) the image is that of the phase centres as measured.
/// Throws ValueError also for regions that cannot tell the motion (too few, all at one range) and for one without any echo; otherwise as
/// `reconstruct` and estimate_trajectory do.
SARFOCUS_API SiMecResult si_mec(const Echo& echo, const geometry::ImageGrid& grid, const std::vector<geometry::ImageGrid>& regions,
                                MutableImageView image, const SiMecOptions& options = {});

}  // namespace sarfocus::hrws
