#pragma once

#include <string>
#include <vector>

#include <sarfocus/core/array_view.hpp>
#include <sarfocus/core/execution.hpp>
#include <sarfocus/core/export.hpp>
#include <sarfocus/focus/backproject.hpp>
#include <sarfocus/geometry/image_grid.hpp>
#include <sarfocus/geometry/trajectory.hpp>

namespace sarfocus::autofocus {

struct TimeOffsetOptions {
    double start = 0.0;         ///< s, the offset as known so far
    double search = 0.2;        ///< s, how far from it to look
    double step = 0.025;        ///< s, of the first look; at most half the width of the sharpness's peak. Refined to a 27th of it
    double minimum_step = 0.0;  ///< m from pulse to pulse at or below which the platform rests; see geometry::path_weights
    bool do_no_harm = true;     ///< hand `start` back where held-out sharpness is not better; false: always take the estimate
    Execution execution;

    SARFOCUS_API void validate() const;
};

enum class TimeOffsetStatus {
    converged,     ///< each half of the scene is sharper with the offset that the other half gave
    not_improved,  ///< no sharper than at the start within the score's noise: the start is handed back
    at_the_edge    ///< sharpest at the end of what was searched (or what the track covers): the start is handed back; search wider
};

[[nodiscard]] SARFOCUS_API const char* status_text(TimeOffsetStatus status);

struct TimeOffset {
    double offset = 0.0;    ///< s, to use; the start itself unless the status is converged
    double estimate = 0.0;  ///< s, the sharpest, whether or not it is handed out
    /// s, of the estimate: half the difference between the offsets of the two halves of the scene. From two values, so no more than the
    /// order of magnitude; nan where one half has no share in the scene's sharpness, or at the edge.
    double offset_std = 0.0;
    double log_sharpness_before = 0.0;  ///< nat, of the whole scene at the start
    double log_sharpness_after = 0.0;   ///< nat, at the estimate
    std::vector<double> offsets;        ///< s, increasing: where the sharpness was taken
    std::vector<double> log_sharpness;  ///< nat, there
    double held_out_gain = 0.0;         ///< nat, mean gain of a half with the offset of the other
    double held_out_noise = 0.0;        ///< nat, what speckle would give by chance
    TimeOffsetStatus status = TimeOffsetStatus::not_improved;
    std::string reason;  ///< one sentence
};

/// The time to add to the radar's clock to get that of the track, by the sharpness sum |I|^4 / (sum |I|^2)^2 of the scene: pulses are
/// placed on the track with each offset tried, weighted by the path they stand for, and the image is formed. No phase per pulse stands for
/// such an error: it moves the antenna along its path, which lengthens the range to what lies ahead and shortens it to what lies behind. On
/// a straight path at constant speed an offset only shifts the image; nothing can be seen of it there.
///
/// profiles: every recorded pulse; pulse_time: [n_pulse], s, on the radar's clock. Offsets for which the track does not cover all pulses
/// are not tried. Decision: the offset that one half of the scene gives (its strong points are dealt out, each with its surroundings) must
/// sharpen the other, both ways, on average by more than three times what speckle would give by chance; where one half has next to no
/// share, the whole scene's gain must exceed that. About 2 search / step + 15 images are formed. Throws as focus::backproject and
/// geometry::interpolate_track do; NumericalError for an image of zeros.
[[nodiscard]] SARFOCUS_API TimeOffset estimate_time_offset(const focus::RangeProfiles& profiles,
                                                           const ArrayView<const double, 1>& pulse_time, const geometry::Track& track,
                                                           const geometry::ImageGrid& grid, const TimeOffsetOptions& options = {});

}  // namespace sarfocus::autofocus
