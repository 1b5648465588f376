#pragma once

#include <vector>

#include <sarfocus/autofocus/phase_estimate.hpp>
#include <sarfocus/core/execution.hpp>
#include <sarfocus/core/export.hpp>

namespace sarfocus::autofocus {

/// Options of the methods that estimate one phase per pulse from many strong points: pga and gpga.
struct PointOptions {
    Estimator estimator = Estimator::maximum_likelihood;

    /// Coarse rounds: half width of the window round every point, as a share of the aperture's bandwidth; 0.5: no window. Wide while the
    /// image is defocused, then narrow to keep clutter out.
    std::vector<double> coarse_windows = {0.5, 0.25, 0.125, 0.0625};
    int coarse_points = 100;          ///< enough to average over points that are not point-like; 50 to 1000 made no difference
    double coarse_separation = 6.5;   ///< resolution cells between them, so that one scatterer is not counted many times
    double coarse_noise_floor = 0.2;  ///< see PhaseEstimateOptions::noise_floor; higher, because the windows hold neighbours too

    /// Fine rounds: no window, many points, the noise kept out by their weights.
    int fine_points = 2000;        ///< at most; 4000 took in so many weak ones that measured data came out worse. Of an image of more than
                                   ///< 2^20 pixels no more than the range gates looked at, or 512
    double fine_separation = 1.8;  ///< resolution cells
    double minimum_contrast =
        12.0;                 ///< of a point (StrongPoint::contrast); the brightest speckle reaches about the logarithm of the pixels
    int minimum_points = 16;  ///< kept even below that, so that the weights have something to choose from
    int fine_rounds = 6;      ///< at most; three are common
    double fine_noise_floor = 0.05;

    double tolerance = 5e-3;  ///< rad RMS change of the phase that ends the rounds; a tenth of the best accuracy met on measured data. The
                              ///< first attempt on an image of more than 2^20 pixels ends at 0.02, two thousandths of a decibel
    bool do_no_harm = true;   ///< hand the input back where the score is not better; false: always apply
    Execution execution;

    SARFOCUS_API void validate() const;
};

}  // namespace sarfocus::autofocus
