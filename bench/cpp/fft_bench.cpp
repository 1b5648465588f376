// Speed and error of the transforms behind everything else: single precision forward and back, compared with the input.
#include <algorithm>
#include <cmath>
#include <complex>
#include <cstddef>

#include <benchmark/benchmark.h>

#include <sarfocus/core/array.hpp>
#include <sarfocus/fft/plan.hpp>

namespace {

using sarfocus::Array;
using sarfocus::cfloat;
using sarfocus::fft::Direction;
using sarfocus::fft::Plan;

Array<cfloat, 1> chirp(std::ptrdiff_t n) {
    Array<cfloat, 1> x({n});
    for (std::ptrdiff_t i = 0; i < n; ++i) {
        const double t = static_cast<double>(i) - 0.5 * static_cast<double>(n);
        x(i) = static_cast<cfloat>(std::polar(1.0, 3.0 * t * t / static_cast<double>(n)));
    }
    return x;
}

// Relative to the norm of the input, dB.
double round_trip_error_db(const Plan<float>& forward, const Plan<float>& inverse) {
    const auto n = forward.length();
    const auto expected = chirp(n);
    auto x = chirp(n);
    forward.execute(x.data());
    inverse.execute(x.data());
    double error = 0.0;
    for (std::ptrdiff_t i = 0; i < n; ++i) error += std::norm(x(i) / static_cast<float>(n) - expected(i));
    return 10.0 * std::log10(std::max(error, 1e-300) / static_cast<double>(n));
}

void transform(benchmark::State& state) {
    const auto n = static_cast<std::ptrdiff_t>(state.range(0));
    const Plan<float> forward(n, Direction::forward);
    const Plan<float> inverse(n, Direction::inverse);
    state.counters["round_trip_error_dB"] = round_trip_error_db(forward, inverse);
    auto x = chirp(n);
    const auto source = chirp(n);
    for (auto _ : state) {
        std::copy(source.begin(), source.end(), x.begin());
        forward.execute(x.data());
        benchmark::DoNotOptimize(x.data());
    }
    state.SetItemsProcessed(state.iterations() * n);
}
BENCHMARK(transform)->Arg(1024)->Arg(4096)->Arg(sarfocus::fft::good_size(10'007))->Arg(16384);

}  // namespace
