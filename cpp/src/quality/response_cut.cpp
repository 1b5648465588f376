#include "response_cut.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <string>

#include <sarfocus/core/constants.hpp>
#include <sarfocus/core/error.hpp>

namespace sarfocus::quality::detail {
namespace {

/// One side of a cut: the samples beyond the peak in the direction of `sign`, the nearest first.
class Side {
public:
    Side(const Cut& cut, int sign) : cut_(cut), sign_(sign) {
        start_ = static_cast<std::ptrdiff_t>(sign > 0 ? std::floor(cut.peak) + 1 : std::ceil(cut.peak) - 1);
        count_ = sign > 0 ? static_cast<std::ptrdiff_t>(cut.power.size()) - start_ : start_ + 1;
    }

    [[nodiscard]] std::ptrdiff_t count() const { return count_; }
    [[nodiscard]] double power(std::ptrdiff_t i) const { return cut_.power[static_cast<std::size_t>(start_ + sign_ * i)]; }
    /// From the peak, samples.
    [[nodiscard]] double distance(std::ptrdiff_t i) const { return std::abs(static_cast<double>(start_ + sign_ * i) - cut_.peak); }

private:
    const Cut& cut_;
    int sign_;
    std::ptrdiff_t start_ = 0;
    std::ptrdiff_t count_ = 0;
};

/// Extremum of the parabola through three equidistant samples: offset from the middle one, in samples, and value.
std::array<double, 2> parabola(double before, double middle, double behind) {
    const double curvature = before - 2.0 * middle + behind;
    if (curvature == 0.0) return {0.0, middle};
    const double offset = 0.5 * (before - behind) / curvature;
    return {offset, middle - 0.25 * (before - behind) * offset};
}

double half_power_distance(const Side& side, const Cut& cut, const char* axis) {
    const double half = 0.5 * cut.peak_power;
    double last_power = cut.peak_power;
    double last_distance = 0.0;
    for (std::ptrdiff_t i = 0; i < side.count(); ++i) {
        if (side.power(i) <= half)
            return last_distance + (side.distance(i) - last_distance) * (last_power - half) / (last_power - side.power(i));
        last_power = side.power(i);
        last_distance = side.distance(i);
    }
    throw NumericalError(std::string(axis) + ": the response does not fall to half its peak inside the chip");
}

double null_distance(const Side& side, double from, const char* axis) {
    for (std::ptrdiff_t i = 1; i + 1 < side.count(); ++i)
        if (side.distance(i) > from && side.power(i) <= side.power(i - 1) && side.power(i) < side.power(i + 1))
            return side.distance(i) + parabola(side.power(i - 1), side.power(i), side.power(i + 1))[0];
    throw NumericalError(std::string(axis) + ": no null between the peak and the border of the chip");
}

struct LobeSum {
    double highest = 0.0;
    double side = 0.0;
    double main = 0.0;
};

LobeSum sum_lobes(const Side& side, double null, double extent) {
    LobeSum out;
    for (std::ptrdiff_t i = 0; i < side.count() && side.distance(i) <= extent; ++i) {
        const double power = side.power(i);
        if (side.distance(i) < null) {
            out.main += power;
            continue;
        }
        out.side += power;
        const bool peak = i > 0 && i + 1 < side.count() && power >= side.power(i - 1) && power > side.power(i + 1);
        out.highest = std::max(out.highest, peak ? parabola(side.power(i - 1), power, side.power(i + 1))[1] : power);
    }
    return out;
}

double decibels(double ratio) {
    return ratio > 0.0 ? 10.0 * std::log10(ratio) : -std::numeric_limits<double>::infinity();
}

/// Amplitude response at x cells of equal parts of a band one cycle per cell wide: an array factor times the response of one part.
double band_response(const std::vector<double>& window, double x) {
    const auto parts = static_cast<double>(window.empty() ? 1 : window.size());
    const double u = pi * x / parts;
    const double part = u == 0.0 ? 1.0 : std::sin(u) / u;
    if (window.empty()) return std::abs(part);
    std::complex<double> sum = 0.0;
    for (std::size_t k = 0; k < window.size(); ++k)
        sum += window[k] * std::polar(1.0, two_pi * x * (static_cast<double>(k) + 0.5 - 0.5 * parts) / parts);
    return std::abs(sum * part);
}

}  // namespace

MainLobe main_lobe(const Cut& cut, const char* axis) {
    MainLobe out;
    for (const int sign : {-1, 1}) {
        const Side side(cut, sign);
        const double half = half_power_distance(side, cut, axis);
        out.width += half * cut.step;
        out.nulls[sign > 0 ? 1 : 0] = null_distance(side, half, axis) * cut.step;
    }
    return out;
}

SideLobes side_lobes(const Cut& cut, const MainLobe& lobe, const std::array<double, 2>& extent) {
    SideLobes out;
    double side = 0.0;
    double main = std::round(cut.peak) == cut.peak ? cut.peak_power : 0.0;
    for (const std::size_t k : {0U, 1U}) {
        const LobeSum sum = sum_lobes(Side(cut, k == 0 ? -1 : 1), lobe.nulls[k] / cut.step, extent[k] / cut.step);
        out.pslr_db[k] = decibels(sum.highest / cut.peak_power);
        side += sum.side;
        main += sum.main;
    }
    out.islr_db = decibels(side / main);
    return out;
}

Cut theoretical_cut(const std::vector<double>& window, double step, double reach) {
    const auto half = static_cast<std::ptrdiff_t>(std::ceil(reach / step)) + 1;
    Cut out;
    out.step = step;
    out.peak = static_cast<double>(half);
    out.power.resize(static_cast<std::size_t>(2 * half + 1));
    for (std::ptrdiff_t i = 0; i <= half; ++i) {
        const double amplitude = band_response(window, static_cast<double>(i) * step);
        out.power[static_cast<std::size_t>(half + i)] = out.power[static_cast<std::size_t>(half - i)] = amplitude * amplitude;
    }
    out.peak_power = out.power[static_cast<std::size_t>(half)];
    return out;
}

}  // namespace sarfocus::quality::detail
