#pragma once

#include <sarfocus/core/array_view.hpp>
#include <sarfocus/core/execution.hpp>
#include <sarfocus/core/export.hpp>
#include <sarfocus/geometry/stripmap_geometry.hpp>
#include <sarfocus/signal/window.hpp>

namespace sarfocus::focus {

/// When the samples of an echo were taken.
struct FastTime {
    double range_start = 0.0;     ///< m, slant range of sample 0, as for range_compress
    double range_sampling = 0.0;  ///< Hz, sampling rate; the samples are c / (2 range_sampling) apart in range
};

struct RangeDopplerOptions {
    ArrayView<const cfloat, 1> chirp;  ///< [n_replica] the pulse as sent, where the echo is raw; empty: it is range-compressed
    double replica_origin = 0.0;       ///< of the chirp, see RangeCompressOptions
    signal::Window window;             ///< over the chirp
    Execution execution;
};

/// Stripmap image by the range-Doppler algorithm [Cumming2005, chapter 6], phases preserved: range compression where a chirp is given,
/// azimuth transform, secondary range compression, correction of range migration, azimuth compression.
/// With D(f) = sqrt(1 - (wavelength f / 2v)^2), fdc and B the Doppler centroid and bandwidth of the geometry:
///
/// - Pixel (i, j) is the target whose closest range is slant_range[j] and whose Doppler frequency is fdc at pulse i (its beam centre), as
///   with azimuth_compress. It was closest (zero Doppler) wavelength R fdc / (2 v^2 D(fdc)) seconds later.
/// - A point of reflectivity a at closest range R, echo a exp(-4j pi R(t) / wavelength), has at its peak the phase of
///   a exp(-4j pi R / wavelength - j pi/4) and the amplitude |a| B / sqrt(K D(fdc)^3), K = 2 v^2 / (wavelength R).
/// - The azimuth filter is exp(4j pi R / wavelength (D(f) - 1 + (wavelength / 2v)^2 f fdc / D(fdc))), phase only. With a squint the range
///   spectrum of the image is centred at (1 / D(fdc) - 1) c / wavelength.
/// - f is the alias of a bin's frequency within prf/2 of fdc: give fdc with its multiple of the prf. Frequencies outside
///   fdc - B/2 <= f < fdc + B/2 are set to zero: the image is limited to the band.
/// - The transform is circular along azimuth, as with azimuth_compress: what is recorded of targets beyond one end of the strip comes out
///   at the other. Append an aperture's length of empty pulses to the echo where that matters.
///
/// Migration is taken out along R / D(f) on the trigonometric interpolant of the record with zeros behind it, evaluated by twelve taps at
/// twice the sampling rate: at most -84 dB off for any component up to critical sampling, -90 dB on average. Any ascending slant ranges
/// will do. Outside the record echoes are taken to be zero, as for backproject. Secondary range compression is that of the exact
/// two-dimensional spectrum at reference ranges, as many as it takes to be 0.1 rad apart at the edges of the range band, linear between
/// them: -58 dB there, less over all (one reference, in the middle, where the swath makes less than 2e-3 rad of difference). Against the
/// sum over the exact two-dimensional spectrum in double precision the image is off by -80 dB or less at X band, 4 km, 150 MHz, up to 3
/// degrees of squint.
///
/// azimuth_decompress(image, geometry) turns the hyperbolic phase history of a target into the parabola exp(-j pi K (t' - tc)^2) about its
/// beam centre tc, K = fm_rate. A phase error of the pulse at time t is found there at t' = t + (g(f) - g(fdc)) / K, g(f) = f / D(f) - f, f
/// the Doppler frequency of the target at t. Without squint that is off by (Ts / 2) theta^2 / 2 at the ends of the aperture Ts, theta the
/// half angle under which it is seen: 0.4 of 1400 pulses at X band, 4 km, 1.8 degrees. A squint theta_c adds 1.5 theta_c^2 (t - tc), 2.8
/// pulses at 3 degrees in this example, and up to 1.5 theta_c theta Ts / 2, 1.8 pulses; the first of them goes away with the velocity times
/// D(fdc)^1.5 in the geometry given to azimuth_decompress and azimuth_compress. Besides, an error of slope phi' (rad/s) moves a target's
/// frequency and with it the range by wavelength^2 R f phi' / (8 pi v^2) against the migration corrected. Where either matters, multiply
/// the echo by exp(-j phi) and form the image again.
///
/// echo: [n_pulse, n_fast_time]; image: [n_pulse, n_range], a column for every slant_range of the geometry, overwritten; any strides;
/// they may share memory. Bits do not depend on threads or strides. Beyond its arguments it takes as much memory as the echo and a few
/// lines a thread.
/// Throws ValueError (geometry; slant ranges that do not ascend or of which nothing is recorded; a Doppler band beyond 2 v / wavelength,
/// where no echo comes from; secondary range compression that varies by more than 12.7 rad over the swath), ShapeError, NumericalError (NaN
/// or infinity in the echo, with its position; overflow), MemoryEstimateError, Cancelled.
SARFOCUS_API void form_stripmap(const ImageView& echo, const geometry::StripmapGeometry& geometry, const FastTime& fast_time,
                                const MutableImageView& image, const RangeDopplerOptions& options = {});

}  // namespace sarfocus::focus
