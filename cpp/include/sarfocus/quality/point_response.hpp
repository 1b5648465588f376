#pragma once

#include <array>
#include <cstddef>
#include <limits>
#include <vector>

#include <sarfocus/core/array_view.hpp>
#include <sarfocus/core/export.hpp>

namespace sarfocus::quality {

/// What a response looks like beside the theoretical one; the first that applies.
enum class Verdict {
    clipped_by_edge,  ///< the image ends before the side lobes that are to be measured do: the other figures are of what is there
    broadened,        ///< the main lobe is wider than it should be (defocus, a narrower band)
    asymmetric,       ///< side lobes too high on one side (odd phase errors, a neighbour)
    high_sidelobes,   ///< side lobes too high (even phase errors, clutter)
    good
};

/// "good", "broadened", …
[[nodiscard]] SARFOCUS_API const char* verdict_text(Verdict verdict);

/// What is known and wanted along one axis.
struct AxisOptions {
    /// Samples per resolution cell, sampling rate / bandwidth, >= 1; 0: unknown. Then the cell is taken from the measured main lobe,
    /// figures in cells are NaN, and broadening goes unseen.
    double oversampling = 0.0;
    /// Amplitude taper of the spectrum, sampled in the middle of equal parts of the band; empty: none. The theory to compare with.
    std::vector<double> window;
    /// Centre of the band, cycles per sample (Doppler centroid / prf); NaN: found from the gap of the chip's spectrum, 0 where there is
    /// none.
    double band_centre = std::numeric_limits<double>::quiet_NaN();
};

struct PointResponseOptions {
    std::ptrdiff_t upsample = 32;  ///< points of the cuts per pixel, 8 to 1024
    std::ptrdiff_t search = 2;     ///< the target is the strongest local maximum within so many pixels of the given position
    /// Side lobes each side that count for PSLR and ISLR: they reach from the theoretical first null over so many cells outwards.
    std::ptrdiff_t lobes = 10;
    /// Largest chip, pixels along each axis; an odd number of them is used, for which interpolation needs no Nyquist bin. What the border
    /// cuts off the tails of a critically sampled sinc costs 0.017 dB of PSLR for 255, 0.009 dB for 511 pixels; with oversampling 1.1 and
    /// more less than 0.002 dB. Make it smaller where the Doppler centroid drifts along the image (TOPS).
    std::ptrdiff_t chip = 511;
    double irw_tolerance = 0.05;      ///< `broadened` from this excess of the IRW on
    double sidelobe_tolerance = 1.0;  ///< dB; `high_sidelobes` and `asymmetric` from this excess of PSLR or ISLR on
    AxisOptions azimuth;
    AxisOptions range;
};

/// The response along one axis, through the peak. Powers of the upsampled cut; the main lobe reaches from null to null (the first minimum
/// on either side).
struct AxisResponse {
    double position = 0.0;           ///< of the peak, pixels
    double irw = 0.0;                ///< -3 dB width, pixels
    double irw_cells = 0.0;          ///< the same in resolution cells; NaN where the oversampling is unknown
    double pslr_db = 0.0;            ///< highest side lobe over the peak
    double pslr_left_db = 0.0;       ///< of the side lobes before the peak
    double pslr_right_db = 0.0;      ///< of those behind it
    double islr_db = 0.0;            ///< energy of the side lobes over energy of the main lobe
    std::array<double, 2> nulls{};   ///< pixels from the peak, both > 0
    std::array<double, 2> extent{};  ///< how far out the side lobes were measured, pixels from the peak, both > 0
    double theory_irw_cells = 0.0;   ///< of the stated window, measured in the same way over the same extent
    double theory_pslr_db = 0.0;
    double theory_islr_db = 0.0;
    Verdict verdict = Verdict::good;
    std::vector<double> cut;  ///< amplitude over the peak's amplitude, `upsample` points a pixel
    double cut_start = 0.0;   ///< position of the first point of the cut, pixels of the image
    double cut_step = 0.0;    ///< distance of its points, pixels
};

struct PointResponse {
    double amplitude = 0.0;  ///< of the interpolated peak
    /// rad, of the interpolated peak. Between samples it depends on which of the bands one sampling rate apart is meant: the given
    /// band_centre, or else the one within half a cycle per sample of zero.
    double phase = 0.0;
    AxisResponse azimuth;
    AxisResponse range;
    Verdict verdict = Verdict::good;  ///< the first that applies to either axis
};

/// Impulse response of a point target near pixel (azimuth, range) of image [n_azimuth, n_range]; fractions are rounded. The peak is found
/// on a grid refined in two dimensions and with a parabola on it; the cuts run along the axes of the image through the peak. Interpolation
/// is linear and band-limited, so a brighter neighbour does not displace the measurement, but its side lobes count. Throws ValueError
/// (options, position outside the image), ShapeError (fewer than 8 pixels), NumericalError (NaN or infinity in the chip; zeros or no local
/// maximum about the position; no null on one side of the peak).
[[nodiscard]] SARFOCUS_API PointResponse point_response(const ImageView& image, std::array<double, 2> position,
                                                        const PointResponseOptions& options = {});

}  // namespace sarfocus::quality
