#pragma once

#include <chrono>
#include <vector>

#include <sarfocus/autofocus/result.hpp>

namespace sarfocus::hrws::detail {

/// Writes down how long the phases of a work took.
class Laps {
public:
    explicit Laps(std::vector<autofocus::Timing>& timings) : timings_(timings), last_(std::chrono::steady_clock::now()) {}

    void end(const char* phase) {
        const auto now = std::chrono::steady_clock::now();
        timings_.push_back({phase, std::chrono::duration<double>(now - last_).count()});
        last_ = now;
    }

private:
    std::vector<autofocus::Timing>& timings_;
    std::chrono::steady_clock::time_point last_;
};

}  // namespace sarfocus::hrws::detail
