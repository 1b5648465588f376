#pragma once

#include <algorithm>
#include <chrono>
#include <string>
#include <vector>

#include <sarfocus/autofocus/result.hpp>

namespace sarfocus::autofocus::detail {

/// Adds the time since the last lap to a phase of the work.
class Stopwatch {
public:
    explicit Stopwatch(std::vector<Timing>& timings) : timings_(timings), last_(std::chrono::steady_clock::now()) {}

    void lap(const char* phase) {
        const auto now = std::chrono::steady_clock::now();
        const double seconds = std::chrono::duration<double>(now - last_).count();
        last_ = now;
        const auto same = std::find_if(timings_.begin(), timings_.end(), [&](const Timing& t) { return t.phase == phase; });
        if (same != timings_.end())
            same->seconds += seconds;
        else
            timings_.push_back({phase, seconds});
    }

private:
    std::vector<Timing>& timings_;
    std::chrono::steady_clock::time_point last_;
};

}  // namespace sarfocus::autofocus::detail
