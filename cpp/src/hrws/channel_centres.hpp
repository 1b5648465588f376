#pragma once

#include <vector>

#include <sarfocus/core/array.hpp>
#include <sarfocus/geometry/phase_centres.hpp>
#include <sarfocus/hrws/echo.hpp>

namespace sarfocus::hrws::detail {

/// The antennas of one channel, motion added.
class ChannelCentres {
public:
    ChannelCentres(const Echo& echo, const ArrayView<const double, 2>& motion, std::ptrdiff_t channel)
        : transmit_({echo.n_pulse(), 3}), receive_({echo.baselines.empty() ? 0 : echo.n_pulse(), 3}) {
        for (std::ptrdiff_t k = 0; k < echo.n_pulse(); ++k)
            for (std::ptrdiff_t d = 0; d < 3; ++d) {
                const double centre = echo.phase_centres(channel, k, d) + (motion.empty() ? 0.0 : motion(k, d));
                const double half = echo.baselines.empty() ? 0.0 : 0.5 * echo.baselines(channel, d);
                transmit_(k, d) = centre - half;
                if (!echo.baselines.empty()) receive_(k, d) = centre + half;
            }
    }

    [[nodiscard]] geometry::PhaseCentres view() const {
        return receive_.empty() ? geometry::PhaseCentres(transmit_.view()) : geometry::PhaseCentres(transmit_.view(), receive_.view());
    }

private:
    Array<double, 2> transmit_;
    Array<double, 2> receive_;
};

}  // namespace sarfocus::hrws::detail
