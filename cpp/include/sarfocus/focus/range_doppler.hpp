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

/// Stripmap image by the range-Doppler algorithm [Cumming, Wong, Digital Processing of Synthetic Aperture Radar Data, 2005, chapter 6],
/// phases preserved: range compression where a chirp is given, azimuth transform, secondary range compression, correction of range
/// migration, azimuth compression. With D(f) = sqrt(1 - (wavelength f / (2 v))^2) and fdc the Doppler centroid of the geometry:
///
/// - Pixel (i, j) is the target whose closest range is slant_range[j] and whose Doppler frequency is fdc at pulse i (its beam centre), as
/// for
///   azimuth_compress. It was closest (zero Doppler) wavelength R fdc / (2 v^2 D(fdc)) seconds later.
/// - A point of reflectivity a at closest range R, echo a exp(-4j pi R(t) / wavelength), has the phase of a exp(-4j pi R / wavelength - j
/// pi/4)
///   at its peak and the amplitude |a| doppler_bandwidth / sqrt(K D(fdc)^3), K = 2 v^2 / (wavelength R). The azimuth filter is
///   exp(4j pi R / wavelength (D(f) - 1 + (wavelength / 2v)^2 f fdc / D(fdc))), phase only. With a squint the range spectrum of the image
///   is centred at (1 / D(fdc) - 1) c / wavelength.
/// - f is the alias of a bin's frequency within prf/2 of fdc: give fdc with its multiple of the prf. Frequencies outside
///   fdc - B/2 <= f < fdc + B/2, B the doppler_bandwidth, are set to zero: the image is limited to the band.
/// - The transform is circular along azimuth, as azimuth_compress is: what is recorded of targets beyond an end of the strip comes out at
/// the
///   other end. Append an aperture's length of empty pulses to the echo where that matters.
///
/// Migration is taken out along R / D(f) by interpolation with the error of SincKernel, -80 dB with single-precision transforms against the
/// exact sum, whatever the band of the pulse up to range_sampling; any ascending slant ranges will do. Outside the record echoes are taken
/// to be zero, as for backproject. Secondary range compression is that of the exact two-dimensional spectrum at reference ranges, as many
/// as it takes for the phase left to stay below 0.02 rad at the edges of the range band (mostly one). Left out: what stationary phase
/// leaves out.
///
/// azimuth_decompress(image, geometry) turns the hyperbolic phase history of a target into the parabola exp(-j pi K (t' - tc)^2) about its
/// beam centre tc, K = fm_rate. A phase error of the pulse at time t is found there at t' = t + (g(f) - g(fdc)) / K, g(f) = f / D(f) - f, f
/// the Doppler frequency of the target at t. Without squint that is (Ts / 2) theta^2 / 2 at the ends of the aperture Ts, theta the half
/// angle it is seen under: X band, 4 km, Ts of 1160 pulses, theta 1.7 deg: 0.25 pulses. A squint of theta_c adds 1.5 theta_c^2 (t -
/// tc), 2.4 pulses at 3 deg in this example, and about 1.5 theta_c theta Ts / 2, 1.3 pulses; the first of them goes away with the velocity
/// times D(fdc)^1.5 in the geometry given to azimuth_decompress and azimuth_compress. An error that changes little in so many pulses does
/// not notice.
///
/// echo: [n_pulse, n_fast_time]; image: [n_pulse, n_range], a column for every slant_range of the geometry, overwritten; any strides;
/// they may share memory. Bits do not depend on threads or strides. Beyond its arguments it takes as much memory as the echo and a few
/// lines a thread. Throws ValueError (geometry; slant ranges that do not ascend or of which nothing is recorded; a Doppler band that
/// reaches beyond 2 v / wavelength, so that the echo comes from nowhere; secondary range compression that would take more than 64 reference
/// ranges), ShapeError, NumericalError (NaN or infinity in the echo, with its position; overflow), MemoryEstimateError, Cancelled.
SARFOCUS_API void form_stripmap(const ImageView& echo, const geometry::StripmapGeometry& geometry, const FastTime& fast_time,
                                const MutableImageView& image, const RangeDopplerOptions& options = {});

}  // namespace sarfocus::focus
