#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include <sarfocus/autofocus/options.hpp>
#include <sarfocus/autofocus/result.hpp>
#include <sarfocus/autofocus/trajectory.hpp>
#include <sarfocus/core/array.hpp>
#include <sarfocus/core/array_view.hpp>
#include <sarfocus/core/execution.hpp>
#include <sarfocus/core/export.hpp>
#include <sarfocus/focus/backproject.hpp>
#include <sarfocus/geometry/image_grid.hpp>
#include <sarfocus/hrws/echo.hpp>
#include <sarfocus/hrws/weights.hpp>

namespace sarfocus::hrws {

/// The echo of one channel with evenly spaced samples that the channels make together.
struct EvenEcho {
    Array<cfloat, 2> data;         ///< [n_pulse * n_channel, n_range]
    Array<double, 2> positions;    ///< [n_pulse * n_channel, 3], m, on the straight line of `sampling`
    Array<double, 1> range_start;  ///< [1], m
    double range_spacing = 0.0;    ///< m
    double wavelength = 0.0;       ///< m

    [[nodiscard]] focus::RangeProfiles profiles() const { return {data.view(), range_start.view(), range_spacing, wavelength}; }
};

/// Reconstruction before any compensation [Zhou2022, eq. 1]: every range sample by itself, half_width pulses on either side. The longer
/// path of the two legs is taken off as baseline^2 / (8 R). range_start: one value. Throws as `interpolation_coefficients`; ShapeError.
[[nodiscard]] SARFOCUS_API EvenEcho even_echo(const Echo& echo, const BandOptions& band = {}, std::ptrdiff_t half_width = 8,
                                              const Execution& execution = {});

/// What a compensation after the reconstruction gives beside the image.
struct PhaseCompensation {
    std::vector<double> phase_error;         ///< [n_pulse * n_channel], rad, of the evenly spaced samples; corrected by exp(-j phase_error)
    std::string status;                      ///< of gpga, which may refuse (the phase is zero then); "applied" of bp_fmsa
    std::vector<autofocus::Timing> timings;  ///< s: even spacing, estimate, image
};

struct BpFmsaOptions {
    BandOptions band;
    std::ptrdiff_t half_width = 8;
    autofocus::SharpestPhaseOptions estimate;  ///< its `execution` is not used
    Execution execution;
};

/// BP-FMSA as [Zhou2022, section 4] compares with: one phase for each sample of the evenly spaced echo, that of the greatest sharpness
/// (autofocus::sharpest_phase) of one region, for the whole scene. region: a chip; image: [grid.shape], overwritten.
/// Throws ShapeError, ValueError, NumericalError, MemoryEstimateError, Cancelled.
SARFOCUS_API PhaseCompensation bp_fmsa(const Echo& echo, const geometry::ImageGrid& grid, const geometry::ImageGrid& region,
                                       MutableImageView image, const BpFmsaOptions& options = {});

struct PgaOptions {
    BandOptions band;
    std::ptrdiff_t half_width = 8;
    autofocus::PointOptions estimate;  ///< its `execution` is not used
    Execution execution;
};

/// PGA as [Zhou2022, section 4] compares with: the same with the phase of autofocus::gpga on the region. Throws as bp_fmsa.
SARFOCUS_API PhaseCompensation pga(const Echo& echo, const geometry::ImageGrid& grid, const geometry::ImageGrid& region,
                                   MutableImageView image, const PgaOptions& options = {});

}  // namespace sarfocus::hrws
