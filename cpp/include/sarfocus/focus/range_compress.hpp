#pragma once

#include <cstddef>

#include <sarfocus/core/array_view.hpp>
#include <sarfocus/core/execution.hpp>
#include <sarfocus/core/export.hpp>
#include <sarfocus/signal/window.hpp>

namespace sarfocus::focus {

struct RangeCompressOptions {
    /// The sample of the replica, fractions allowed, that leaves at the instant from which ranges are counted: 0 where echoes are timed
    /// from the leading edge of the pulse, (n_replica - 1) / 2 where from its middle. From 0 to n_replica - 1.
    double replica_origin = 0.0;
    signal::Window window;  ///< over the replica; a chirp maps it onto its band
    Execution execution;
};

/// Matched filter along fast time. raw sample i was recorded c / 2 * delay = range_start + i * range_spacing after time zero of the pulse
/// (range_spacing = c / (2 sampling rate)); sample i of the output is at range range_start + i * range_spacing: the axis stays the same.
/// An echo a * replica becomes a * (pulse response), 1 at its peak: phase, and so the carrier phase exp(-4j pi R / wavelength), is kept.
/// Ranges whose echo reaches beyond either end of `raw` are compressed with the part that was recorded.
///
/// raw, out: [n_pulse, n_fast_time], any strides, no overlap unless the same view; replica: [n_replica], as signal::Chirp::samples gives
/// it. Single-precision transforms; bits do not depend on threads or strides. Throws ValueError, ShapeError, NumericalError (NaN or
/// infinity, with its position; `out` is then partly written), Cancelled.
SARFOCUS_API void range_compress(const ImageView& raw, const ArrayView<const cfloat, 1>& replica, const MutableImageView& out,
                                 const RangeCompressOptions& options = {});

struct FrequencyCompressOptions {
    double oversampling = 1.5;      ///< samples for each range resolution cell, >= 1; rounded up to a fast transform length
    std::ptrdiff_t guard = 16;      ///< samples beyond either end of the unambiguous interval, its periodic continuation, for interpolation
    double centre_frequency = 0.0;  ///< Hz, that of the carrier left in the data; 0: the middle of the band, so that the pulse is real
    signal::Window window;          ///< over the frequencies
    Execution execution;
};

/// The range axis that compress_frequency produces.
struct CompressedRange {
    std::ptrdiff_t n_range = 0;
    double range_spacing = 0.0;  ///< m
    double range_offset = 0.0;   ///< m, range of sample 0 less the reference range of the pulse
    double wavelength = 0.0;     ///< m, of the centre frequency
};

/// frequency_start, frequency_spacing: Hz. Throws ValueError.
[[nodiscard]] SARFOCUS_API CompressedRange compressed_range(std::ptrdiff_t n_frequency, double frequency_start, double frequency_spacing,
                                                            const FrequencyCompressOptions& options = {});

/// Range compression of frequency-domain phase history (stepped or dechirped, motion-compensated to a reference range for each pulse):
/// phase_history(p, m) = sum of a exp(-4j pi f_m (R - reference_range(p)) / c), f_m = frequency_start + m * frequency_spacing.
/// The result keeps the carrier phase as everywhere in the library: out(p, i), at range range_start(p) + i * range_spacing, is the sum of
/// a exp(-4j pi R / wavelength) * h(r - R), h(x) = sum of w_m exp(4j pi (f_m - centre_frequency) x / c) / sum of w_m, 1 at its peak.
/// The samples cover the whole unambiguous interval c / (2 frequency_spacing), centred on reference_range, and `guard` samples more
/// at both ends. Phases of ranges are computed in double precision and reduced to one turn before they are narrowed.
///
/// phase_history: [n_pulse, n_frequency], any strides; reference_range: [n_pulse], m; out: [n_pulse, n_range] of compressed_range;
/// range_start: [n_pulse], m, written. Throws as range_compress does.
SARFOCUS_API void compress_frequency(const ImageView& phase_history, double frequency_start, double frequency_spacing,
                                     const ArrayView<const double, 1>& reference_range, const MutableImageView& out,
                                     const ArrayView<double, 1>& range_start, const FrequencyCompressOptions& options = {});

}  // namespace sarfocus::focus
