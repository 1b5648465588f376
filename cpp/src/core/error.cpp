#include <sarfocus/core/error.hpp>

#include <charconv>
#include <cmath>

namespace sarfocus {

ValueError::ValueError(const std::string& argument, const std::string& expected, const std::string& actual)
    : std::invalid_argument(argument + ": expected " + expected + ", got " + actual) {}

std::string number_text(double value) {
    char text[32];
    const auto end = std::to_chars(text, text + sizeof text, value);
    return {text, end.ptr};
}

void require_positive(double value, const char* argument) {
    if (!(std::isfinite(value) && value > 0.0)) throw ValueError(argument, "a finite number > 0", number_text(value));
}

void require_finite_value(double value, const char* argument) {
    if (!std::isfinite(value)) throw ValueError(argument, "a finite number", number_text(value));
}

}  // namespace sarfocus
