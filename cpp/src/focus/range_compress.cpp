#include <sarfocus/focus/range_compress.hpp>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <string>
#include <vector>

#include <sarfocus/core/array.hpp>
#include <sarfocus/core/checks.hpp>
#include <sarfocus/core/complex_product.hpp>
#include <sarfocus/core/constants.hpp>
#include <sarfocus/fft/plan.hpp>

#include "focus/line_workspace.hpp"

namespace sarfocus::focus {
namespace {

// Transfer function [n]: the conjugate spectrum of the weighted replica, shifted so that its sample replica_origin is at time zero; scaled
// to a unit response to the replica itself and for the unnormalised transforms.
Array<cfloat, 1> matched_filter(const ArrayView<const cfloat, 1>& replica, const RangeCompressOptions& options, std::ptrdiff_t n) {
    const std::ptrdiff_t m = replica.extent(0);
    const std::vector<double> weights = signal::window_samples(options.window, m);
    Array<cdouble, 1> spectrum({n});
    double energy = 0.0;
    for (std::ptrdiff_t i = 0; i < m; ++i) {
        const cdouble sample(replica(i));
        spectrum.data()[i] = weights[static_cast<std::size_t>(i)] * sample;
        energy += weights[static_cast<std::size_t>(i)] * std::norm(sample);
    }
    if (!(std::isfinite(energy) && energy > 0.0))
        throw NumericalError("replica: expected finite samples, not all zero, got a weighted energy of " + number_text(energy));
    fft::Plan<double>(n, fft::Direction::forward).execute(spectrum.data());
    Array<cfloat, 1> out({n});
    for (std::ptrdiff_t k = 0; k < n; ++k) {
        const std::ptrdiff_t signed_bin = k < (n + 1) / 2 ? k : k - n;
        const double turns = static_cast<double>(signed_bin) * options.replica_origin / static_cast<double>(n);
        out.data()[k] = cfloat(std::conj(spectrum.data()[k]) *
                               std::polar(1.0 / (energy * static_cast<double>(n)), -two_pi * std::remainder(turns, 1.0)));
    }
    return out;
}

}  // namespace

void range_compress(const ImageView& raw, const ArrayView<const cfloat, 1>& replica, const MutableImageView& out,
                    const RangeCompressOptions& options) {
    require_not_empty(raw, "raw");
    require_not_empty(replica, "replica");
    require_same_shape(out, "out", raw, "raw");
    const std::ptrdiff_t n_fast_time = raw.extent(1);
    const std::ptrdiff_t n_replica = replica.extent(0);
    if (!(options.replica_origin >= 0.0 && options.replica_origin <= static_cast<double>(n_replica - 1)))
        throw ValueError("replica_origin", "an index of the replica, 0 to " + std::to_string(n_replica - 1),
                         number_text(options.replica_origin));

    // Long enough for every lag to have its own place: nothing wraps round.
    const std::ptrdiff_t n = fft::good_size(n_fast_time + n_replica - 1);
    const Array<cfloat, 1> filter = matched_filter(replica, options, n);
    const fft::Plan<float> forward(n, fft::Direction::forward);
    const fft::Plan<float> inverse(n, fft::Direction::inverse);
    LineWorkspaces workspaces(options.execution, n);
    std::atomic<bool> finite{true};

    parallel_for(options.execution, "range_compress", raw.extent(0), [&](std::int64_t pulse) {
        cfloat* line = workspaces.line();
        for (std::ptrdiff_t i = 0; i < n_fast_time; ++i) line[i] = raw(pulse, i);
        std::fill(line + n_fast_time, line + n, cfloat());
        forward.execute(line);
        if (!is_finite(line[0])) {
            finite = false;
            return;
        }
        for (std::ptrdiff_t k = 0; k < n; ++k) line[k] = product(line[k], filter.data()[k]);
        inverse.execute(line);
        for (std::ptrdiff_t i = 0; i < n_fast_time; ++i) out(pulse, i) = line[i];
    });
    if (!finite) throw_not_finite(raw, "raw", options.execution.threads);
}

}  // namespace sarfocus::focus
