#include <sarfocus/core/checks.hpp>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <limits>
#include <string>

#include <sarfocus/core/execution.hpp>

namespace sarfocus {
namespace {

bool finite_value(float x) {
    return (std::bit_cast<std::uint32_t>(x) & 0x7f800000u) != 0x7f800000u;
}
bool finite_value(double x) {
    return std::isfinite(x);
}
template <class T>
bool finite_value(const std::complex<T>& x) {
    return finite_value(x.real()) && finite_value(x.imag());
}

template <class T>
std::string value_text(const std::complex<T>& x) {
    return number_text(static_cast<double>(x.real())) + (std::signbit(x.imag()) ? "" : "+") + number_text(static_cast<double>(x.imag())) +
           "j";
}
std::string value_text(double x) {
    return number_text(x);
}

[[noreturn]] void throw_not_finite(const char* argument, const std::string& position, const std::string& value) {
    throw NumericalError(std::string(argument) + ": expected finite samples, got " + value + " at " + position);
}

template <class T>
void require_finite_vector(const ArrayView<const T, 1>& data, const char* argument) {
    for (std::ptrdiff_t i = 0; i < data.extent(0); ++i)
        if (!finite_value(data(i))) throw_not_finite(argument, "[" + std::to_string(i) + "]", value_text(data(i)));
}

template <class T>
void require_finite_matrix(const ArrayView<const T, 2>& data, const char* argument, int threads) {
    const std::ptrdiff_t rows = data.extent(0);
    const std::ptrdiff_t columns = data.extent(1);
    // Walk memory in its own order: a transposed image is checked as fast as a contiguous one.
    const bool swapped = std::abs(data.stride(0)) < std::abs(data.stride(1));
    const std::ptrdiff_t outer = swapped ? columns : rows;
    const std::ptrdiff_t inner = swapped ? rows : columns;
    std::ptrdiff_t first = std::numeric_limits<std::ptrdiff_t>::max();
    const int workers = resolve_threads(threads);
#pragma omp parallel for num_threads(workers) reduction(min : first) schedule(static) if (data.size() > 65536)
    for (std::ptrdiff_t i = 0; i < outer; ++i)
        for (std::ptrdiff_t j = 0; j < inner; ++j) {
            const std::ptrdiff_t r = swapped ? j : i;
            const std::ptrdiff_t c = swapped ? i : j;
            if (!finite_value(data(r, c))) first = std::min(first, r * columns + c);
        }
    if (first == std::numeric_limits<std::ptrdiff_t>::max()) return;
    const std::ptrdiff_t r = first / columns;
    const std::ptrdiff_t c = first % columns;
    throw_not_finite(argument, "[" + std::to_string(r) + ", " + std::to_string(c) + "]", value_text(data(r, c)));
}

}  // namespace

void require_finite(const ImageView& data, const char* argument, int threads) {
    require_finite_matrix(data, argument, threads);
}
void require_finite(const ArrayView<const double, 2>& data, const char* argument) {
    require_finite_matrix(data, argument, 1);
}
void require_finite(const ArrayView<const double, 1>& data, const char* argument) {
    require_finite_vector(data, argument);
}
void require_finite(const ArrayView<const cdouble, 1>& data, const char* argument) {
    require_finite_vector(data, argument);
}

std::uint64_t available_memory() {
    std::ifstream file("/proc/meminfo");
    std::string key;
    std::uint64_t kib = 0;
    std::string unit;
    while (file >> key >> kib >> unit)
        if (key == "MemAvailable:") return kib * 1024;
    return 0;
}

std::string memory_text(std::uint64_t bytes) {
    const char* units[] = {"B", "KiB", "MiB", "GiB", "TiB", "PiB"};
    auto value = static_cast<double>(bytes);
    std::size_t unit = 0;
    while (value >= 1024.0 && unit < 5) {
        value /= 1024.0;
        ++unit;
    }
    char text[48];
    std::snprintf(text, sizeof text, unit == 0 ? "%.0f %s" : "%.1f %s", value, units[unit]);
    return text;
}

void require_memory(std::uint64_t bytes, const char* purpose) {
    const std::uint64_t available = available_memory();
    if (available == 0 || bytes <= available) return;
    throw MemoryEstimateError(std::string(purpose) + ": needs about " + memory_text(bytes) + " of memory, " + memory_text(available) +
                              " are available; ask for fewer pixels or process in parts");
}

}  // namespace sarfocus
