// estimate_trajectory from many points of the image as it stands.
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

#include <sarfocus/autofocus/trajectory.hpp>

namespace sarfocus::autofocus::detail {

/// Brightest pixels, what every pulse adds up there, the alternation, and what points say that had no part in it. Keeps references to the
/// arguments, which are checked.
///
/// The terms of a point are a constant and Gaussian clutter of unknown power: the likelihood of the displacements is -sum log(1 -
/// coherence) over the points, of coherence |sum b|^2 / (n sum |b|^2). The channels of a pulse see a displacement under one angle: their
/// terms are summed before.
class PointTrajectory {
public:
    PointTrajectory(const TrajectoryEchoes& echoes, const std::vector<geometry::ImageGrid>& regions, const TrajectoryOptions& options,
                    const ArrayView<const double, 2>& initial);
    Trajectory run();

private:
    /// What a pulse adds to a point, and how its phase changes with the displacement along the axes, rad/m.
    struct Term {
        std::size_t point = 0;
        cdouble value;
        Vector3 rate{};
    };
    using Displacements = std::vector<Vector3>;  ///< [n_pulse], m along the axes

    [[nodiscard]] Vector3 place(std::size_t pulse, std::size_t channel) const;
    template <class Take>
    void gather(const std::vector<Vector3>& points, const std::vector<std::size_t>& region, const char* phase, const Take& take) const;
    void find_peaks(const std::vector<bool>& wanted);
    void collect_terms();
    void observability();
    [[nodiscard]] std::vector<cdouble> sums(const Displacements& d) const;
    void climb(const std::vector<Term>& terms, const std::vector<cdouble>& sums, const Vector3& centre, bool scan, Vector3& d) const;
    [[nodiscard]] std::pair<std::vector<cdouble>, double> objective(const Displacements& d, const std::vector<bool>& taken) const;
    [[nodiscard]] Displacements climbed(Displacements d, const std::vector<cdouble>& sums, bool scan) const;
    Displacements alternate(Displacements d, const std::vector<bool>& taken, double tolerance, bool scan, std::vector<double>* steps,
                            bool* converged = nullptr) const;
    [[nodiscard]] std::vector<bool> half_of(bool second) const;
    void hold_out();
    void judge(bool converged);
    void deviation();
    Trajectory finish();

    const TrajectoryEchoes& echoes_;
    const std::vector<geometry::ImageGrid>& regions_;
    const TrajectoryOptions& options_;
    std::size_t n_channel_;
    std::size_t n_pulse_;
    std::vector<Vector3> axes_;
    std::vector<Vector3> initial_;
    double wavenumber_;
    double search_ = 0.0;
    Displacements motion_;
    std::vector<Vector3> middles_;          // of the regions
    std::vector<Vector3> peaks_;            // m
    std::vector<double> power_;             // of the terms at a peak, mean over its pulses and channels
    std::vector<double> chance_;            // coherence of random phases
    std::vector<std::vector<Term>> terms_;  // pulse by pulse, along the path moved by the motion
    std::vector<Displacements> halves_;     // what each half of the points gives by itself in the first round
    std::vector<Vector3> std_;
    Trajectory result_;
};

}  // namespace sarfocus::autofocus::detail
