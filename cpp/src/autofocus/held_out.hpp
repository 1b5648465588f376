#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include <sarfocus/core/array.hpp>
#include <sarfocus/core/array_view.hpp>
#include <sarfocus/core/execution.hpp>

#include "method_table.hpp"
#include "strong_points.hpp"

namespace sarfocus::autofocus::detail {

/// A strong point to judge by.
struct JudgedPoint {
    std::ptrdiff_t azimuth = 0;
    std::ptrdiff_t column = 0;
    double power = 0.0;  ///< the largest in any of the images
};

/// How points are told apart, pixels of azimuth.
struct PlaceRule {
    std::ptrdiff_t search = 8;  ///< a correction may displace a point by so much
    std::ptrdiff_t reach = 0;   ///< a defocused point's energy may lie so far from it
    double range_cell = 1.0;    ///< gates
};
[[nodiscard]] PlaceRule place_rule(const Subject& subject, const CellSize& cell);

/// The largest power that any of several images has at a pixel: choosing strong points in it favours none of them.
class Brightest {
public:
    Brightest(const ImageView& first, const Execution& execution);
    void add(const ImageView& image, const Execution& execution);

    /// Places that stand out of speckle as bright as `first` has between its points, strongest first; nothing that may be another's side
    /// lobe. gates: of every column; inner: columns that count.
    [[nodiscard]] std::vector<JudgedPoint> places(const std::vector<std::ptrdiff_t>& gates, const std::vector<bool>& inner,
                                                  const PlaceRule& rule, const Execution& execution) const;

private:
    Array<float, 2> power_;
    double background_ = 0.0;
    int images_ = 0;
};

/// Of every place: the interpolated peak within the search distance along azimuth, dB, and the entropy there, nat.
struct PlaceMeasures {
    std::vector<double> peak_db;
    std::vector<double> entropy;
};

/// Cycles per azimuth sample: the middle of the occupied band.
[[nodiscard]] double band_centre(const Subject& subject);

[[nodiscard]] PlaceMeasures measure(const ImageView& image, double centre, const std::vector<JudgedPoint>& places, const PlaceRule& rule,
                                    const Execution& execution);
/// Of the image without a phase error; only the columns that hold places are corrected.
[[nodiscard]] PlaceMeasures measure_without(const Subject& subject, const std::vector<double>& phase, double centre,
                                            const std::vector<JudgedPoint>& places, const PlaceRule& rule, const Execution& execution);

/// What the strong points of a whole image and of its correction have against the correction: that their peaks fall on average, or that
/// more than a tenth of them lose 3 dB. Empty: nothing.
[[nodiscard]] std::string objection_of_points(const Subject& subject, const ImageView& corrected, const PlaceRule& rule, double centre,
                                              const Execution& execution);

/// A mean over points and its standard error; of few points no less than if they scattered by half a decibel.
struct MeanGain {
    double mean = 0.0;
    double standard_error = 0.0;
};
[[nodiscard]] MeanGain mean_gain(const std::vector<double>& gains_db);

}  // namespace sarfocus::autofocus::detail
