// What estimate_trajectory does, step by step.
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

#include <sarfocus/autofocus/trajectory.hpp>

#include "trajectory_model.hpp"

namespace sarfocus::autofocus::detail {

/// Unit vectors of the unknowns: up; and across the track; and along it.
[[nodiscard]] std::vector<Vector3> motion_axes(const ArrayView<const double, 3>& positions, const TrajectoryOptions& options);

/// A pixel of a region by fractional indices.
struct Place {
    double i = 0.0;
    double j = 0.0;
};

/// One estimate: histories of strong points (trajectory_estimator.cpp), their pixels and the motion (trajectory_pixels.cpp), what to think
/// of it (trajectory_judgement.cpp). Keeps references to the arguments, which are checked.
class TrajectoryEstimator {
public:
    TrajectoryEstimator(const TrajectoryEchoes& echoes, const std::vector<geometry::ImageGrid>& regions, const TrajectoryOptions& options,
                        const ArrayView<const double, 2>& initial);
    Trajectory run();

private:
    using ImageGrid = geometry::ImageGrid;
    using RangeProfiles = focus::RangeProfiles;

    [[nodiscard]] MotionPoints all() const;
    std::vector<MotionPoint> histories(std::size_t region, const std::vector<Place>& places, const MotionModel* model = nullptr,
                                       const Coefficients* motion = nullptr);
    void prepare();
    void collect(std::size_t region, const std::vector<Place>& places, std::size_t begin, std::vector<double>& energy,
                 std::vector<double>& bright);
    void take_terms(std::size_t channel, const std::vector<Vector3>& path, const Array<double, 2>& xyz, MutableImageView terms) const;
    [[nodiscard]] RangeProfiles near(std::size_t channel, const std::vector<Vector3>& path, const Array<double, 2>& xyz,
                                     std::vector<double>& start) const;
    [[nodiscard]] double azimuth_cell(std::size_t r) const;
    [[nodiscard]] double range_cell(std::size_t r) const;
    void observability();
    [[nodiscard]] MotionModel model_of(double search) const { return {centres_, n_channel_, axes_, wavelength_, options_.knots, search}; }
    MotionModel solve(Coefficients& motion);
    Coefficients turned(const MotionModel& model, const Coefficients& motion);
    Coefficients choose(const MotionModel& model);
    Coefficients match(const MotionModel& model);
    [[nodiscard]] std::vector<cdouble> phasors(const MotionPoint& point) const;
    [[nodiscard]] static cdouble together(const std::vector<cdouble>& second, const std::vector<cdouble>& first);
    void centre(const MotionModel& model, Coefficients& motion);
    [[nodiscard]] double preference(const MotionModel& model, const Coefficients& motion) const;
    [[nodiscard]] std::vector<Place> candidates(std::size_t m) const;
    bool step_aside(const MotionModel& model, Coefficients& motion, std::size_t m, const Place& step, double& best);
    void refine(const MotionModel& model, Coefficients& motion);
    [[nodiscard]] static double farthest(const MotionModel& model, const Coefficients& motion);
    double brightest(const MotionModel& model, const Coefficients& motion, std::size_t m, Vector3* where = nullptr) const;
    double by_chance(const MotionModel& model);
    double between_by_chance();
    [[nodiscard]] double spread(const MotionModel& model, const Coefficients& motion, std::size_t m, const Vector3& position) const;
    [[nodiscard]] Coefficients from_others(const MotionModel& model, const MotionPoints& others, const Coefficients& motion) const;
    void judge(const MotionModel& model, Coefficients& motion, bool converged);
    [[nodiscard]] Coefficients without_line(const Coefficients& motion) const;
    void remove_line(const MotionModel& model, Coefficients& motion);
    struct ChannelShift {
        double shift = 0.0;  // m
        double deviation = 0.0;
    };
    [[nodiscard]] ChannelShift channel_shift(const MotionModel& model, const Coefficients& motion, std::size_t m,
                                             const Vector3& position) const;
    [[nodiscard]] Vector3 track_direction() const;
    void shift_by_channels(const MotionModel& model, Coefficients& motion);
    Trajectory finish(const Coefficients& motion);

    const TrajectoryEchoes& echoes_;
    double wavelength_;
    const std::vector<ImageGrid>& regions_;
    const TrajectoryOptions& options_;
    std::size_t n_channel_;
    std::size_t n_pulse_;
    std::vector<Vector3> axes_;
    std::vector<Vector3> initial_;
    std::vector<Vector3> centres_;  // pulse by pulse, all channels of each
    std::vector<Place> places_;
    std::vector<MotionPoint> points_;
    std::vector<double> power_;
    std::vector<Place> brightest_;    // as it stands
    std::vector<double> cell_;        // pixels along the first index
    std::vector<double> range_cell_;  // of one sample, pixels along the second index
    double search_ = 0.0;
    bool widened_ = false;    // the search
    bool dropped_ = false;    // a direction that no region sees
    std::size_t trials_ = 0;  // pixels that `match` had the choice of
    Coefficients std_;
    Trajectory result_;
};

}  // namespace sarfocus::autofocus::detail
