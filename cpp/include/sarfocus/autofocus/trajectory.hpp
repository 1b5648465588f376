#pragma once

#include <string>
#include <vector>

#include <sarfocus/autofocus/result.hpp>
#include <sarfocus/core/array.hpp>
#include <sarfocus/core/array_view.hpp>
#include <sarfocus/core/execution.hpp>
#include <sarfocus/core/export.hpp>
#include <sarfocus/core/vector3.hpp>
#include <sarfocus/focus/backproject.hpp>
#include <sarfocus/geometry/image_grid.hpp>

namespace sarfocus::autofocus {

enum class TrajectoryUnknowns {
    height,       ///< along `up`
    cross_track,  ///< in the plane perpendicular to the track
    full          ///< in space; a direction that no region sees (all at a right angle to it) is left alone
};

/// Which pixel of a region is its point.
enum class PixelChoice {
    joint,  ///< the one that together with the others can be made most coherent: for a few points that stand out of the echo of a pulse
    /// The brightest of the image as it stands, and again of that with the motion found, `rounds` times: for tens to thousands of points
    /// that clutter hides in each pulse. Free displacements only, within `search`; they must leave some of the points visible, which errors
    /// of up to a third of a turn of the phase (RMS) do.
    brightest
};

struct TrajectoryOptions {
    TrajectoryUnknowns unknowns = TrajectoryUnknowns::height;
    PixelChoice pixels = PixelChoice::joint;
    focus::Aspect aspect;  ///< of the beam: terms from outside are left out
    /// Pulses between the knots of a cubic spline; 0: every pulse has a displacement of its own, which takes more regions than unknowns
    /// (for the height one more than needed to solve, because it is the second that tells which pixel is right).
    int knots = 0;
    Vector3 up = {0.0, 0.0, 1.0};
    double search = 0.0;  ///< m, either side, of a free displacement; 0: half the displacement that turns the phase by a full turn
    /// Of free displacements in a plane, accept as many regions as unknowns: any pixels are then consistent, and those are taken whose
    /// phases differ least from pulse to pulse between the regions, which is the motion that scatters least.
    bool exactly_determined = false;
    int rounds = 3;            ///< outer rounds: samples interpolated anew where the displacement exceeds a quarter of a range sample
    int iterations = 200;      ///< of one alternation, at most
    double tolerance = 1e-10;  ///< relative gain of the objective below which an alternation ends
    bool do_no_harm = true;
    Execution execution;

    SARFOCUS_API void validate() const;
};

enum class TrajectoryStatus {
    converged,
    max_iterations,  ///< of the last alternation
    not_improved     ///< the motion is zero; see the reason
};

[[nodiscard]] SARFOCUS_API const char* status_text(TrajectoryStatus status);

/// What a region said.
struct TrajectoryPoint {
    Vector3 position{};             ///< m, of the pixel used
    double power = 0.0;             ///< mean |b_k|^2 over pulses and channels, of the pixel where it is greatest
    double coherence_before = 0.0;  ///< |sum b_k|^2 / (sum |b_k|)^2 without displacement, at its own best pixel
    double coherence = 0.0;         ///< with it
    /// The same before and after a displacement that the other regions gave; nan where those do not determine one.
    double held_out_before = 0.0;
    double held_out = 0.0;
    /// m, RMS over the pulses: the range of the region as it shows itself less that which the others' motion gives, within half a
    /// wavelength.
    double spread = 0.0;
};

/// Echoes of one receiving channel or more on one platform; views, owned by the caller.
struct TrajectoryEchoes {
    std::vector<focus::RangeProfiles> channels;  ///< data [n_pulse, n_range] each; one wavelength and range spacing for all
    ArrayView<const double, 3> positions;        ///< [n_channel, n_pulse, 3], m, phase centres as measured
    ArrayView<const double, 2> baselines;        ///< [n_channel, 3], m, from transmitter to receiver; or empty
};

struct Trajectory {
    Array<double, 2> motion;              ///< [n_pulse, 3], m, to add to the positions; zero where not improved
    Array<double, 2> motion_std;          ///< [n_pulse, 3], m, of the estimate, from the residual phases
    Array<double, 2> estimate;            ///< [n_pulse, 3], m, handed out or not
    std::vector<TrajectoryPoint> points;  ///< one for each region
    double coherence_before = 0.0;        ///< mean over the regions
    double coherence = 0.0;
    double coherence_by_chance = 0.0;  ///< mean of what the same alternation makes of random phases
    double chance_std = 0.0;
    int empty_region = -1;           ///< index of the first region without any echo
    bool determined = true;          ///< false: too few regions, or all at one range
    bool by_construction = false;    ///< as many regions as unknowns: their coherence says nothing; coherence_between does
    double coherence_between = 0.0;  ///< of the phase differences between the regions from pulse to pulse, where by_construction
    double condition = 0.0;          ///< largest over smallest singular value of what the regions see of the unknowns
    /// Whether constant and line over the pulses were taken out of the motion: done where the regions stay as coherent, shifted.
    bool line_removed = false;
    int rounds = 0;
    std::vector<double> objective;  ///< of the last alternation, step by step; never falls
    std::vector<Timing> timings;
    TrajectoryStatus status = TrajectoryStatus::not_improved;
    std::string reason;
};

/// The displacement of every pulse that makes one strong point in each region brightest: maximises
/// sum over regions of alpha_m |B_m|^2, B_m = sum over channels and pulses of b_kmn exp(4j pi (|p_kn + delta_k - x_m| - |p_kn - x_m|) /
/// wavelength) [Zhou2022, eq. 9-10], alpha_m = 1 / (sum |b|)^2, so that every region counts with its coherence. Given the B_m the objective
/// falls apart into one maximisation for each pulse; the two are alternated, and neither step lowers it. The pixel of each point is chosen
/// jointly: its azimuth over the whole chip relative to the points before, by the coherence that can be reached, then to a small fraction
/// of a cell. Several starts. A constant and a line over the pulses, which shift the scene as a whole, are taken out where they do no more;
/// several channels then say, by their phases within a pulse, where along the track the points lie, and if that is more than noise a line
/// follows them.
///
/// regions: chips round strong points at different ranges, plane or polar. All channels of a pulse share its displacement. initial:
/// [n_pulse, 3] m to start from, or empty; it is part of the motion handed back. Regions that do not determine the unknowns give
/// not_improved, with the reason.
/// Throws ShapeError, ValueError, NumericalError, MemoryEstimateError, Cancelled.
[[nodiscard]] SARFOCUS_API Trajectory estimate_trajectory(const TrajectoryEchoes& echoes, const std::vector<geometry::ImageGrid>& regions,
                                                          const TrajectoryOptions& options = {},
                                                          const ArrayView<const double, 2>& initial = {});

/// One channel. positions: [n_pulse, 3].
[[nodiscard]] SARFOCUS_API Trajectory estimate_trajectory(const focus::RangeProfiles& profiles, const ArrayView<const double, 2>& positions,
                                                          const std::vector<geometry::ImageGrid>& regions,
                                                          const TrajectoryOptions& options = {},
                                                          const ArrayView<const double, 2>& initial = {});

struct SharpestPhaseOptions {
    int iterations = 200;
    double tolerance = 1e-8;  ///< relative gain of the sharpness
    focus::Aspect aspect;     ///< of the beam: terms from outside are left out
    Execution execution;
};

/// One phase per pulse for the whole scene, that of the greatest sharpness sum |I|^4 of one region (BP-FMSA in [Zhou2022]): the sum is
/// convex in the image, so the phases that align every pulse with |I|^2 I never lower it. rad, [n_pulse]; data are corrected by
/// exp(-j phase).
[[nodiscard]] SARFOCUS_API std::vector<double> sharpest_phase(const focus::RangeProfiles& profiles,
                                                              const ArrayView<const double, 2>& positions,
                                                              const geometry::ImageGrid& region, const SharpestPhaseOptions& options = {});

}  // namespace sarfocus::autofocus
