#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <sarfocus/core/export.hpp>

namespace sarfocus::autofocus {

enum class Status {
    converged,         ///< the last round changed the phase by less than the tolerance, and the score says the image is better
    max_iterations,    ///< the image is better, but the rounds ended before the phase stood still
    not_improved,      ///< no better than the input within the score's noise: the input is handed back, bit for bit
    no_strong_points,  ///< nothing to estimate from: the input is handed back, bit for bit
    gaps               ///< better where apertures reach; parts of the aperture have no strong point
};

[[nodiscard]] SARFOCUS_API const char* status_text(Status status);

/// A scatterer that the estimate rests on.
struct StrongPoint {
    double azimuth = 0.0;   ///< pixel, fractional, in the corrected image
    double range = 0.0;     ///< pixel, fractional
    double shift = 0.0;     ///< azimuth pixels by which the correction moves it; zero where one linear phase for all is the gauge
    double weight = 0.0;    ///< its share of the information; all add up to one
    double contrast = 0.0;  ///< peak power over that of the speckle which its range cell would make there: 1 for noise
};

/// One round of the estimation, for the report.
struct Round {
    std::string stage;        ///< "coarse" or "fine"
    double window = 0.0;      ///< half width of the window, as a share of the aperture's bandwidth; 1: none
    int points = 0;           ///< used
    int iterations = 0;       ///< of the alternation
    double update_rms = 0.0;  ///< rad, by which the phase changed
};

/// Why a result was taken or refused.
struct Score {
    double entropy_before = 0.0;  ///< nat, of the strong range gates or the whole image
    double entropy_after = 0.0;
    double held_out_gain = 0.0;   ///< nat, gain in log sharpness where the phase came from the other half of the scene
    double held_out_noise = 0.0;  ///< nat, what chance would give
    double point_gain_db = 0.0;   ///< mean gain of the strong points' peaks
    bool improved = false;
    std::string reason;  ///< one sentence
};

/// Two apertures of a strip that overlap, and by how much their linear phases differ.
struct Seam {
    std::int64_t first = 0;    ///< index of a point
    std::int64_t second = 0;   ///< index of a point behind it in azimuth
    std::int64_t overlap = 0;  ///< samples
    double slope = 0.0;        ///< rad a sample, b_first - b_second [Xie2023, eq. 14]
    double slope_std = 0.0;    ///< rad a sample
    double coherence = 0.0;    ///< of their product over the overlap, after that slope; 1: a pure tone
    double residual = 0.0;     ///< rad a sample, what the stitching leaves of `slope`; 0 before
    double weight = 0.0;       ///< share in the stitching, 0 where it was not used
};

/// What only stripmap methods find.
struct StripDetails {
    std::vector<Seam> seams;            ///< between the points, by index
    std::vector<int> segment;           ///< of every point: those joined by overlaps
    std::vector<double> coverage;       ///< apertures that reach each azimuth sample
    std::vector<double> point_quality;  ///< Q_k of every point [Xie2023, eq. 5]
    std::vector<double> held_out_gain;  ///< nat, of every point's peak with the phase that the others gave; nan where they don't reach it
    int segments = 0;
    double knot = 1.0;                 ///< samples between the values that the refinement estimated
    std::vector<double> block_phase;   ///< rad, [n_block, n_azimuth] row by row, of the range blocks in use, where blocks were asked for
    std::vector<double> block_std;     ///< rad, [n_block, n_azimuth], of block_phase; nan where no aperture of the block reaches
    std::vector<double> block_centre;  ///< range gate of each block, the mean of its points'
};

/// One of the cells that decide whether a scene has strong points [Luo2025, section 2.2.1].
struct GateCell {
    std::int64_t azimuth = 0;  ///< pixel, the middle one
    std::int64_t range = 0;
    std::int64_t extent = 1;  ///< azimuth pixels over which intensity was averaged
    double value = 0.0;       ///< of what was compared: intensity, or amplitude where the paper's mu was given
    double clutter = 0.0;     ///< mean of the reference cells, the same quantity
    double threshold = 0.0;   ///< mu times the clutter
    bool detected = false;
};

/// What was decided in one azimuth sub-aperture [Luo2025, eq. 8-13].
struct SubAperture {
    std::int64_t first = 0;    ///< azimuth line
    std::int64_t count = 0;    ///< azimuth lines
    int gates = 0;             ///< k, range gates used; 0: skipped
    double mean_strong = 0.0;  ///< m1, mean energy of the k strongest gates; of the strongest alone where it was skipped
    double mean_rest = 0.0;    ///< m2, mean energy of the other gates
    int points = 0;            ///< strong points that the phase rests on
};

/// What only adaptive PGA decides.
struct AdaptiveDetails {
    std::vector<GateCell> cells;      ///< the strongest of the scene, tested one by one
    bool strong_points = false;       ///< whether any of them was detected
    bool amplitudes = false;          ///< their values are amplitudes; else intensities
    std::int64_t first_denoised = 0;  ///< range gate
    std::int64_t denoised = 0;        ///< range gates that were mean-filtered; 0: none
    double eta = 0.0;                 ///< m1 must exceed eta m2
    std::vector<SubAperture> sub_apertures;
};

/// What only pga_2d finds.
struct MigrationDetails {
    std::string model;             ///< "range_doppler" or "polar_format"; empty for other methods
    double bandwidth_ratio = 0.0;  ///< range sampling rate over carrier frequency that the correction assumed
    bool estimated = false;        ///< from the image
    double gain = 0.0;             ///< nat, of the log sharpness of range stripes with that ratio from others, where estimated
    double noise = 0.0;            ///< nat, what chance would give
    double gates = 0.0;            ///< over which the error spread a point, peak to peak
    int passes = 0;                ///< estimates, each after a correction in two dimensions by those before
};

/// One method that `autofocus` tried.
struct MethodTrial {
    std::string method;
    Status status = Status::no_strong_points;  ///< of the method on the whole image where it was run there, else on a part
    double held_out_gain_db = 0.0;             ///< mean gain of strong points that had no say in the phase; nan where there are none
    double held_out_std_db = 0.0;              ///< its standard error
    int held_out_points = 0;
    double held_out_entropy = 0.0;  ///< nat, change of the entropy round these points
    double seconds = 0.0;
    bool chosen = false;
    std::string reason;  ///< one sentence: why it was chosen or not
};

struct Timing {
    std::string phase;
    double seconds = 0.0;
};

/// What every autofocus of the library returns beside the image, which goes into the caller's memory.
struct Result {
    std::vector<double> phase_error;  ///< rad; the correction multiplied by exp(-j phase_error). Zero where the input was handed back
    std::vector<double> phase_std;    ///< rad, of phase_error; nan where no aperture reaches
    std::vector<double> estimate;     ///< rad, what was estimated, whether or not it was applied
    Status status = Status::no_strong_points;
    std::vector<StrongPoint> points;
    std::vector<Round> rounds;
    Score score;
    std::string method;               ///< that made this result
    StripDetails strip;               ///< empty for spotlight methods
    AdaptiveDetails adaptive;         ///< empty but for adaptive_pga
    MigrationDetails migration;       ///< empty but for pga_2d, and adaptive_pga with a bandwidth ratio
    std::vector<MethodTrial> trials;  ///< empty but for autofocus
    std::vector<Timing> timings;
    int threads = 0;

    /// True where the caller's image holds the input itself.
    [[nodiscard]] bool input_returned() const { return status == Status::not_improved || status == Status::no_strong_points; }
    /// A few lines for people.
    [[nodiscard]] SARFOCUS_API std::string summary() const;
};

}  // namespace sarfocus::autofocus
