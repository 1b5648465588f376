#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include <sarfocus/core/array.hpp>
#include <sarfocus/core/array_view.hpp>
#include <sarfocus/core/export.hpp>
#include <sarfocus/core/vector3.hpp>

namespace sarfocus::autofocus {

struct RidgePathOptions {
    Vector3 look{};                   ///< towards the scatterers; its part along the track is taken off. Zero: to the right, horizontally
    bool across = false;              ///< displacements along `look`, too; takes three ridges at once
    int knots = 10;                   ///< pulses between the knots of the cubic spline of the displacement
    double range_std = 0.003;         ///< m, of a ridge's ranges, their constant apart; larger residuals count less (Cauchy)
    int correlation = 10;             ///< pulses over which the errors of a ridge's ranges are one
    double offset_std = 0.02;         ///< m, of the constant of each ridge
    double step_change = 0.0;         ///< m per pulse squared, RMS expected of the displacement's curvature; 0: the mean step / 20
    double length_std = 0.3;          ///< relative, of the length of the start
    double across_std = 0.1;          ///< m, of displacements along `look`
    double largest_residual = 0.015;  ///< m, robust: while a ridge fits worse, the one without which the others fit best is left out
    int iterations = 200;
    double tolerance = 1e-8;  ///< relative gain of the objective below which it ends

    SARFOCUS_API void validate() const;
};

enum class RidgePathStatus {
    converged,
    max_iterations,
    not_determined  ///< too few ridges that agree: the motion is zero; see the reason
};

[[nodiscard]] SARFOCUS_API const char* status_text(RidgePathStatus status);

/// What a ridge is taken for.
struct RidgePoint {
    Vector3 position{};         ///< m, in the plane of track and look
    double offset = 0.0;        ///< m, by which its ranges are too long
    double residual = 0.0;      ///< m, robust standard deviation of its ranges about those of the point
    double residual_rms = 0.0;  ///< m
    double coverage = 0.0;      ///< share of the pulses in which it is seen
    bool used = false;
};

struct RidgePath {
    Array<double, 2> positions;      ///< [n_pulse, 3], m: start + motion
    Array<double, 2> motion;         ///< [n_pulse, 3], m
    Array<double, 2> motion_std;     ///< [n_pulse, 3], m; of the shape: the length as a whole is uncertain by `length_std`
    std::vector<RidgePoint> points;  ///< one for each ridge
    double residual_rms = 0.0;       ///< m, over the ridges used
    double coverage = 0.0;           ///< share of the pulses in which as many ridges are seen as it takes to determine them alone
    double length_ratio = 1.0;       ///< scale along the track by which the start fits the path best (least squares over the pulses)
    double length_std = 0.0;         ///< of that ratio; near the one given, the ranges say nothing of the length
    int rejected = 0;                ///< ridges left out because they do not fit
    int iterations = 0;              ///< of the last fit
    RidgePathStatus status = RidgePathStatus::not_determined;
    std::string reason;  ///< one sentence
};

/// The path and the scatterers that fit the ranges of several ridges together: least squares over a cubic spline of displacements along a
/// roughly straight track (and, with `across`, along `look`), the place of every scatterer in the plane of track and look and a constant of
/// every ridge (Levenberg and Marquardt, robust weights; the self-calibration of bundle adjustment with ranges alone).
///
/// range: [n_ridge, n_pulse], m, nan where not seen (see track_ridges); start: [n_pulse, 3], m.
///
/// What ranges do not tell stays as at the start: where the scene is as a whole (mean displacement), how it is turned (with `across`, its
/// line), on which side of the track and at which height about it each scatterer lies. The length of the path shows in the curvature of the
/// ridges, and a constant error of all ranges looks almost the same: by about half its share of the distance.
/// Leaving one ridge out of n takes n short fits.
/// Too few ridges that agree are no error: `not_determined`. Throws ShapeError, ValueError, NumericalError.
[[nodiscard]] SARFOCUS_API RidgePath trajectory_from_ridges(const ArrayView<const double, 2>& range,
                                                            const ArrayView<const double, 2>& start, const RidgePathOptions& options = {});

}  // namespace sarfocus::autofocus
