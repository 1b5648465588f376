#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <sarfocus/core/array_view.hpp>
#include <sarfocus/core/execution.hpp>
#include <sarfocus/core/export.hpp>
#include <sarfocus/focus/backproject.hpp>
#include <sarfocus/geometry/image_grid.hpp>
#include <sarfocus/geometry/phase_centres.hpp>

namespace sarfocus::focus {

struct FactorizedOptions {
    double target_error_db = -60.0;  ///< RMS error over RMS of the exact image, -90 … -20: taps, oversampling and tiles follow from it
    Execution execution;
};

/// One step down: tiles of rows x columns pixels, for each of which the pulses are replaced by `centres` virtual ones.
struct FactorizedStage {
    std::ptrdiff_t rows = 0;
    std::ptrdiff_t columns = 0;
    std::ptrdiff_t centres = 0;  ///< of all pieces of the path
    std::ptrdiff_t taps = 0;     ///< of the kernel along the track
    double oversampling = 0.0;   ///< of the virtual centres, over what the tile needs
};

struct FactorizedReport {
    bool factorized = false;
    std::string reason;               ///< why the exact sum was taken, where it was
    double predicted_error_db = 0.0;  ///< from the geometry and the kernels, before any data are seen; that of `backproject` is not counted
    std::vector<FactorizedStage> stages;
    std::ptrdiff_t pieces = 0;  ///< into which the path was cut, because it turns
    double work = 0.0;          ///< of the way taken over that of the exact sum, estimated
    std::uint64_t memory = 0;   ///< bytes beyond input and output
};

/// Fast factorised backprojection: the sum of `backproject`, to a given error, in much less time where pixels and pulses are many. The
/// image is cut into tiles. For the pixels of a tile the echoes, once the phase of the tile's centre is taken off, change slowly from pulse
/// to pulse; so all pulses together are laid on a few virtual phase centres on a smooth track (the transpose of band-limited
/// interpolation of exp(j k R): pulses may lie anywhere along the track, evenly or not), each with a short line of samples round the
/// tile. Smaller tiles take fewer of them [McCorkle1996, Ulander2003]. The tile's pixels sum over the last ones.
///
/// Pulses beside the smooth track are brought onto it by matching direction and scale of the range's gradient in the image plane; what
/// that leaves, like every other error, is predicted by trying out sample pulses, tiles and pixels. Where the target can't be kept, or
/// the exact sum is as quick, the exact sum is formed, and the report says so.
///
/// image: [grid.shape], overwritten; the same bits for any number of threads. Throws as `backproject`, and ValueError for a grid of
/// arbitrary points and for a target outside -90 … -20 dB.
SARFOCUS_API FactorizedReport backproject_factorized(const RangeProfiles& profiles, const geometry::PhaseCentres& centres,
                                                     const geometry::ImageGrid& grid, MutableImageView image,
                                                     const FactorizedOptions& options = {});

/// What `backproject_factorized` would do and need; looks at shapes and geometry only, not at the data.
[[nodiscard]] SARFOCUS_API FactorizedReport plan_factorized(const RangeProfiles& profiles, const geometry::PhaseCentres& centres,
                                                            const geometry::ImageGrid& grid, const FactorizedOptions& options = {});

}  // namespace sarfocus::focus
