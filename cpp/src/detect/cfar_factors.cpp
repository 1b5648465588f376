#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>

#include <sarfocus/core/error.hpp>
#include <sarfocus/detect/cfar.hpp>

namespace sarfocus::detect {
namespace {

void require_probability(double p) {
    if (!(p > 0.0 && p < 1.0)) throw ValueError("false_alarm_probability", "a number between 0 and 1", number_text(p));
}

void require_cells(std::ptrdiff_t cells, const char* argument) {
    if (cells < 1) throw ValueError(argument, "at least one reference cell", std::to_string(cells));
}

/// Root of the decreasing `rate` = p between 0 and `high`, to rounding.
template <class Rate>
double solve(const Rate& rate, double p, double high) {
    double low = 0.0;
    while (high - low > 1e-14 * high) {
        const double middle = 0.5 * (low + high);
        if (middle == low || middle == high) break;
        (rate(middle) > p ? low : high) = middle;
    }
    return 0.5 * (low + high);
}

/// (n / s)^n sum over k < m of C(n + k - 1, k) (m / s)^k; the power is kept as a logarithm, since it alone may underflow.
double greatest_of_term(double n, double m, double s) {
    constexpr double large = 1e250;
    double scale = n * std::log(n / s);
    double term = 1.0;
    double sum = 1.0;
    for (double k = 1.0; k < m; k += 1.0) {
        term *= (n + k - 1.0) / k * (m / s);
        sum += term;
        if (sum < large) continue;
        sum /= large;
        term /= large;
        scale += std::log(large);
    }
    return sum * std::exp(scale);
}

}  // namespace

double cell_averaging_factor(std::ptrdiff_t cells, double false_alarm_probability) {
    require_cells(cells, "cells");
    require_probability(false_alarm_probability);
    const auto n = static_cast<double>(cells);
    return n * std::expm1(-std::log(false_alarm_probability) / n);
}

double greatest_of_factor(std::ptrdiff_t before, std::ptrdiff_t behind, double false_alarm_probability) {
    require_cells(before, "before");
    require_cells(behind, "behind");
    const auto n1 = static_cast<double>(before);
    const auto n2 = static_cast<double>(behind);
    const auto rate = [=](double mu) {
        const double s = n1 + n2 + mu;
        return std::exp(-n1 * std::log1p(mu / n1)) + std::exp(-n2 * std::log1p(mu / n2)) - greatest_of_term(n1, n2, s) -
               greatest_of_term(n2, n1, s);
    };
    // Either mean alone is smaller than the larger of the two and needs the larger factor.
    const double high =
        std::min(cell_averaging_factor(before, false_alarm_probability), cell_averaging_factor(behind, false_alarm_probability));
    return solve(rate, false_alarm_probability, high);
}

double ordered_statistic_factor(std::ptrdiff_t cells, std::ptrdiff_t k, double false_alarm_probability) {
    require_cells(cells, "cells");
    if (k < 1 || k > cells) throw ValueError("k", "1 to " + std::to_string(cells), std::to_string(k));
    require_probability(false_alarm_probability);
    const auto rate = [=](double mu) {
        double log_rate = 0.0;
        for (std::ptrdiff_t i = 0; i < k; ++i) log_rate -= std::log1p(mu / static_cast<double>(cells - i));
        return std::exp(log_rate);
    };
    // Every factor of the product is at most N / (N + mu).
    const double high = static_cast<double>(cells) * std::expm1(-std::log(false_alarm_probability) / static_cast<double>(k));
    return solve(rate, false_alarm_probability, high);
}

double multi_look_factor(double looks, std::ptrdiff_t cells, double false_alarm_probability) {
    require_cells(cells, "cells");
    require_probability(false_alarm_probability);
    if (!(looks >= 1.0)) throw ValueError("looks", "at least 1", number_text(looks));
    // z of the normal distribution exceeded with that probability.
    const auto tail = [](double x) { return 0.5 * std::erfc(x / std::numbers::sqrt2); };
    double low = -40.0;
    double high = 40.0;
    for (int i = 0; i < 100; ++i) {
        const double middle = 0.5 * (low + high);
        (tail(middle) > false_alarm_probability ? low : high) = middle;
    }
    const double z = 0.5 * (low + high);
    // ((1 - b) x - (1 - a)) / sqrt(b x^2 + a) = z for x, the cube root of the factor.
    const double a = 1.0 / (9.0 * looks);
    const double b = a / static_cast<double>(cells);
    const double quadratic = (1.0 - b) * (1.0 - b) - z * z * b;
    const double constant = (1.0 - a) * (1.0 - a) - z * z * a;
    const double half = (1.0 - a) * (1.0 - b);
    const double root = half * half - quadratic * constant;
    if (!(quadratic > 0.0) || root < 0.0) return std::numeric_limits<double>::infinity();
    const double x = (half + std::copysign(std::sqrt(root), z)) / quadratic;
    return x * x * x;
}

}  // namespace sarfocus::detect
