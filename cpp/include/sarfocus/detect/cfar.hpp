#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include <sarfocus/core/array_view.hpp>
#include <sarfocus/core/execution.hpp>
#include <sarfocus/core/export.hpp>
#include <sarfocus/detect/point.hpp>

namespace sarfocus::detect {

/// How the clutter power about a cell is estimated from its reference cells.
enum class CfarMethod {
    cell_averaging,    ///< their mean: best in uniform clutter
    greatest_of,       ///< the larger mean of those before and those behind in azimuth: holds the rate at clutter edges
    ordered_statistic  ///< one of the sorted values: a few strong neighbours do not hide the cell
};

/// A cell is detected where its intensity exceeds mu times the clutter estimate. mu follows from the false-alarm probability for
/// intensities that are independent and exponential (single-look speckle), for as many reference cells as exist: fewer at the border of the
/// image. Where none exists nothing is detected.
struct CfarOptions {
    CfarMethod method = CfarMethod::cell_averaging;
    double false_alarm_probability = 1e-6;
    /// Cells beyond the guard cells, each side, azimuth and range. 1-D takes the first of the two: 16 cells altogether [Luo2025].
    std::array<std::ptrdiff_t, 2> reference{8, 8};
    /// Cells next to the one under test that are left out, each side: about the main lobe and the first side lobes.
    std::array<std::ptrdiff_t, 2> guard{3, 3};
    double rank = 0.75;  ///< ordered_statistic: the ceil(rank N)-th smallest of N
    /// Independent looks averaged in every cell, the reference cells too. Above 1 the factor is that of `multi_look_factor` for the cells
    /// that the method compares with.
    double looks = 1.0;
    Execution execution;
};

/// A cell under test.
struct CfarCell {
    double intensity = 0.0;
    double clutter = 0.0;    ///< estimate, intensity
    double threshold = 0.0;  ///< mu times the estimate; infinite where there is no reference cell
    bool detected = false;
};

/// mask [n_azimuth, n_range]: true where detected. 1-D: reference cells of the same range gate. 2-D: the frame between the guard cells and
/// the reference cells; greatest_of compares the whole rows before the guard cells with those behind, the rest of the frame is not used.
/// Box sums from summed-area tables in float64; the same bits for any number of threads and strides.
/// Throws ShapeError, ValueError, NumericalError (NaN or infinity; negative intensities), MemoryEstimateError.
SARFOCUS_API void cfar_1d(const ImageView& image, const ArrayView<bool, 2>& mask, const CfarOptions& options = {});
SARFOCUS_API void cfar_1d(const IntensityView& intensity, const ArrayView<bool, 2>& mask, const CfarOptions& options = {});
SARFOCUS_API void cfar_2d(const ImageView& image, const ArrayView<bool, 2>& mask, const CfarOptions& options = {});
SARFOCUS_API void cfar_2d(const IntensityView& intensity, const ArrayView<bool, 2>& mask, const CfarOptions& options = {});

/// The same tests of a few cells {azimuth, range}, by plain summation; only the samples of their windows are looked at.
[[nodiscard]] SARFOCUS_API std::vector<CfarCell> cfar_1d_at(const ImageView& image, const std::vector<std::array<std::ptrdiff_t, 2>>& cells,
                                                            const CfarOptions& options = {});
[[nodiscard]] SARFOCUS_API std::vector<CfarCell> cfar_2d_at(const ImageView& image, const std::vector<std::array<std::ptrdiff_t, 2>>& cells,
                                                            const CfarOptions& options = {});

/// mu = N (Pfa^(-1/N) - 1) for the mean of N cells [Luo2025, section 2.2.1].
[[nodiscard]] SARFOCUS_API double cell_averaging_factor(std::ptrdiff_t cells, double false_alarm_probability);
/// mu for the larger of two means, over `before` and `behind` cells: the root of
/// Pfa = A(n1) + A(n2) - B(n1, n2) - B(n2, n1), A(n) = (n / (n + mu))^n, s = n1 + n2 + mu,
/// B(n, m) = (n / s)^n sum over k < m of C(n + k - 1, k) (m / s)^k. With n1 = n2 that is the classic expression [Hansen1973].
[[nodiscard]] SARFOCUS_API double greatest_of_factor(std::ptrdiff_t before, std::ptrdiff_t behind, double false_alarm_probability);
/// mu for the k-th smallest of N: the root of Pfa = prod over i < k of (N - i) / (N - i + mu) [Rohling1983].
[[nodiscard]] SARFOCUS_API double ordered_statistic_factor(std::ptrdiff_t cells, std::ptrdiff_t k, double false_alarm_probability);

/// mu for cells that are means of `looks` independent exponential intensities, over the mean of `cells` such cells: the quantile of the F
/// distribution with 2 looks and 2 looks cells degrees of freedom, by the cube-root normal approximation [Paulson1942]. For false-alarm
/// probabilities down to 1e-6 and 8 cells or more it is within 10 % of the exact factor at one look, 6 % at two, 1.5 % at ten. With fewer
/// looks * cells it becomes too large, in the end infinite: nothing is detected.
[[nodiscard]] SARFOCUS_API double multi_look_factor(double looks, std::ptrdiff_t cells, double false_alarm_probability);

}  // namespace sarfocus::detect
