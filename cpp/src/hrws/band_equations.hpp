#pragma once

#include <complex>
#include <string>
#include <vector>

#include <Eigen/Core>

#include <sarfocus/hrws/weights.hpp>

namespace sarfocus::hrws::detail {

using Matrix = Eigen::MatrixXcd;
using Vector = Eigen::VectorXcd;

/// "channels 1 and 3 sample …", or nothing where no two lie within a hundredth of `step` (m), the distance of the pulses, modulo it.
[[nodiscard]] std::string coinciding_channels(const std::vector<double>& offsets, double step);

/// Throws NumericalError above options.condition_limit.
void require_condition(double found, const std::vector<double>& offsets, double prf, double velocity, const BandOptions& options);

}  // namespace sarfocus::hrws::detail
