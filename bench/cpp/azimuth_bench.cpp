// Azimuth compression of a strip, for each number of threads: speed beside the error of compress(decompress(x)) relative to x.
#include <cmath>
#include <cstddef>
#include <vector>

#include <benchmark/benchmark.h>

#include <sarfocus/core/array.hpp>
#include <sarfocus/focus/azimuth.hpp>

namespace {

using sarfocus::Array;
using sarfocus::cfloat;

constexpr std::ptrdiff_t n_range = 512;

sarfocus::geometry::StripmapGeometry geometry() {
    std::vector<double> slant_range(n_range);
    for (std::ptrdiff_t i = 0; i < n_range; ++i) slant_range[static_cast<std::size_t>(i)] = 1000.0 + 0.5 * static_cast<double>(i);
    return {.wavelength = 0.031, .prf = 1000.0, .velocity = 100.0, .slant_range = slant_range, .doppler_bandwidth = 800.0};
}

Array<cfloat, 2> scene(std::ptrdiff_t n_azimuth) {
    Array<cfloat, 2> out({n_azimuth, n_range});
    for (std::ptrdiff_t i = 0; i < out.size(); ++i)
        out.data()[i] = static_cast<cfloat>(std::polar(1.0, 1e-3 * static_cast<double>(i % 100'003)));
    return out;
}

double round_trip_error_db(std::ptrdiff_t n_azimuth, const sarfocus::focus::AzimuthOptions& options) {
    const auto original = scene(n_azimuth);
    auto x = original.copy();
    sarfocus::focus::azimuth_decompress(x.view(), geometry(), x.view(), options);
    sarfocus::focus::azimuth_compress(x.view(), geometry(), x.view(), options);
    double error = 0.0;
    for (std::ptrdiff_t i = 0; i < x.size(); ++i) error += std::norm(x.data()[i] - original.data()[i]);
    return 10.0 * std::log10(error / static_cast<double>(x.size()));
}

void azimuth_compress(benchmark::State& state) {
    const auto n_azimuth = static_cast<std::ptrdiff_t>(state.range(0));
    sarfocus::focus::AzimuthOptions options;
    options.execution.threads = static_cast<int>(state.range(1));
    const auto strip = geometry();
    const auto echo = scene(n_azimuth);
    Array<cfloat, 2> image({n_azimuth, n_range});
    for (auto _ : state) {
        sarfocus::focus::azimuth_compress(echo.view(), strip, image.view(), options);
        benchmark::DoNotOptimize(image.data());
    }
    state.SetItemsProcessed(state.iterations() * n_azimuth * n_range);
    state.counters["round_trip_error_dB"] = round_trip_error_db(n_azimuth, options);
}
BENCHMARK(azimuth_compress)
    ->ArgNames({"n_azimuth", "threads"})
    ->ArgsProduct({{4096, 8192}, {1, 2}})
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);

}  // namespace
