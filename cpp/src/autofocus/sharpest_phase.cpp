#include <cmath>
#include <complex>
#include <cstdint>
#include <string>

#include <sarfocus/autofocus/trajectory.hpp>
#include <sarfocus/core/array.hpp>
#include <sarfocus/core/checks.hpp>
#include <sarfocus/core/error.hpp>
#include <sarfocus/geometry/phase_centres.hpp>

namespace sarfocus::autofocus {

std::vector<double> sharpest_phase(const focus::RangeProfiles& profiles, const ArrayView<const double, 2>& positions,
                                   const geometry::ImageGrid& region, const SharpestPhaseOptions& options) {
    if (options.iterations < 1) throw ValueError("iterations", "at least 1", std::to_string(options.iterations));
    require_positive(options.tolerance, "tolerance");
    profiles.validate(options.execution.threads);
    const geometry::PhaseCentres centres(positions);
    centres.validate(profiles.data.extent(0));
    const std::ptrdiff_t n_pulse = profiles.data.extent(0);
    const auto shape = region.shape();
    require_memory(static_cast<std::uint64_t>(region.size() * n_pulse) * sizeof(cfloat), "sharpest_phase");
    Array<double, 2> xyz({region.size(), 3});
    for (std::ptrdiff_t i = 0; i < shape[0]; ++i) region.row_positions(i, xyz.data() + 3 * i * shape[1]);
    Array<cfloat, 2> terms({region.size(), n_pulse});
    focus::BackprojectOptions how;
    how.execution = options.execution;
    focus::backproject_histories(profiles, centres, ArrayView<const double, 2>(xyz.view()), terms.view(), how);
    for (std::ptrdiff_t p = 0; p < region.size() && options.aspect.limited(); ++p)
        for (std::ptrdiff_t k = 0; k < n_pulse; ++k)
            if (!options.aspect.sees({positions(k, 0), positions(k, 1), positions(k, 2)}, {xyz(p, 0), xyz(p, 1), xyz(p, 2)}))
                terms(p, k) = {};
    std::vector<double> phase(static_cast<std::size_t>(n_pulse));
    double before = 0.0;
    for (int round = 0; round < options.iterations; ++round) {
        std::vector<cdouble> turn(phase.size());
        for (std::size_t k = 0; k < phase.size(); ++k) turn[k] = std::polar(1.0, -phase[k]);
        std::vector<cdouble> slope(phase.size());
        double sharpness = 0.0;
        for (std::ptrdiff_t p = 0; p < region.size(); ++p) {
            cdouble pixel{};
            for (std::ptrdiff_t k = 0; k < n_pulse; ++k) pixel += cdouble(terms(p, k)) * turn[static_cast<std::size_t>(k)];
            sharpness += std::norm(pixel) * std::norm(pixel);
            const cdouble weight = std::norm(pixel) * std::conj(pixel);
            for (std::ptrdiff_t k = 0; k < n_pulse; ++k) slope[static_cast<std::size_t>(k)] += weight * cdouble(terms(p, k));
        }
        if (!(sharpness - before > options.tolerance * sharpness)) break;
        before = sharpness;
        for (std::size_t k = 0; k < phase.size(); ++k) phase[k] = std::arg(slope[k]);
    }
    return phase;
}

}  // namespace sarfocus::autofocus
