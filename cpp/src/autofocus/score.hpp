#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include <sarfocus/autofocus/result.hpp>
#include <sarfocus/core/array.hpp>
#include <sarfocus/core/array_view.hpp>
#include <sarfocus/core/execution.hpp>

#include "point_source.hpp"
#include "strong_points.hpp"

namespace sarfocus::autofocus::detail {

/// Two halves of the scene, each in pieces spread over it: whole range stripes for a source without neighbours across columns, else a
/// checkerboard. A point of one half does not take part in the estimate that the other half's pixels are judged by.
class Halves {
public:
    Halves(const PixelLayout& layout, const CellSize& cell);
    [[nodiscard]] int of(std::ptrdiff_t azimuth, std::ptrdiff_t column) const;
    /// [source.shape()], true in one half.
    [[nodiscard]] Array<bool, 2> mask(int half) const;

private:
    std::ptrdiff_t n_azimuth_;
    std::vector<std::ptrdiff_t> gate_;
    std::ptrdiff_t azimuth_piece_;
    std::ptrdiff_t range_piece_;
};

/// Of the pixels of one half.
struct HalfSums {
    double pixels = 0.0;
    double power = 0.0;
    double square = 0.0;

    void add(double intensity) {
        pixels += 1.0;
        power += intensity;
        square += intensity * intensity;
    }
    HalfSums& operator+=(const HalfSums& other) {
        pixels += other.pixels;
        power += other.power;
        square += other.square;
        return *this;
    }

    /// log(sum I^2 / (sum I)^2): rises with focus, blind to scale.
    [[nodiscard]] double log_sharpness() const;
};

/// Of the pixels of one half of an image [source.shape()].
[[nodiscard]] HalfSums sums_of(const ImageView& image, const Halves& halves, int half);

/// The four images a decision needs, all [source.shape()].
struct Trial {
    ImageView before;      ///< no correction
    ImageView after;       ///< the estimate from all points
    ImageView from_first;  ///< the estimate from the points of half 0, which judges half 1
    ImageView from_second;
};

/// What a decision needs of these images.
struct TrialSums {
    double entropy_before = 0.0;  ///< nat
    double entropy_after = 0.0;
    std::array<HalfSums, 2> before;    ///< of each half
    std::array<HalfSums, 2> held_out;  ///< of each half, with the phase that the other half's points gave
};

/// What the estimate rests on.
struct Evidence {
    std::vector<Pixel> points;
    std::vector<double> weight;     ///< shares of the information
    std::vector<double> coherence;  ///< |A|^2 over mean power of each history, corrected: pi / 4 at most for noise alone
    std::vector<double> gain_db;    ///< of each point's peak
    double mean_variance = 0.0;     ///< rad^2, of the estimated phase
};

/// Whether nearly all information lies in one half, so that the other has none to confirm a phase with.
[[nodiscard]] bool one_sided(const Halves& halves, const Evidence& evidence);

/// Decides by three things, all of which must hold: entropy falls; sharpness rises on pixels whose own points had no say in the phase, by
/// more than speckle would by chance; the strong points' peaks do not fall on average. Where nearly all information lies in one half, as
/// with a single strong point, the second is replaced: the histories must be steadier than noise turned to any phase could be, and the
/// peaks must rise by more than fitting their noise explains.
[[nodiscard]] Score judge(const Trial& trial, const Halves& halves, const CellSize& cell, const Evidence& evidence,
                          const Execution& execution);

/// The part of it that the halves' own estimates have no say in: only the entropies of `trial` count. True where it decides, and the score
/// then tells what; else its entropies and point_gain_db are set.
[[nodiscard]] bool judged_without_halves(const TrialSums& trial, const Halves& halves, const Evidence& evidence, Score& score);
/// The rest of it, where that has not decided.
void judge_held_out(const TrialSums& trial, const CellSize& cell, Score& score);

}  // namespace sarfocus::autofocus::detail
