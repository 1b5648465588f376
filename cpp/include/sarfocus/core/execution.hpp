#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <exception>
#include <functional>
#include <string>

#include <sarfocus/core/export.hpp>

namespace sarfocus {

/// What a progress callback is told.
struct ProgressUpdate {
    const char* phase = "";  ///< what is being done: "backproject", "estimate", …
    std::int64_t done = 0;   ///< units of work finished
    std::int64_t total = 0;  ///< units of work altogether
};

/// Called on the calling thread, at most about twenty times a second. Return false to stop the computation (Cancelled is thrown);
/// an exception thrown by the callback reaches the caller unchanged.
using ProgressCallback = std::function<bool(const ProgressUpdate&)>;

/// How a function runs: the same for every function of the library.
struct Execution {
    int threads = 0;            ///< 0: all processors OpenMP would use. Results do not depend on it, to the bit.
    ProgressCallback progress;  ///< optional
};

/// Number of threads `requested` stands for (0: all); throws ValueError where negative.
[[nodiscard]] SARFOCUS_API int resolve_threads(int requested);

/// Progress and cancellation for one parallel loop. Nothing is thrown out of a parallel region: workers call `advance`, skip their
/// work when `stopped()`, and the calling thread calls `finish()` behind the region, which throws what has to be thrown.
class SARFOCUS_API Monitor {
public:
    Monitor(const Execution& execution, const char* phase, std::int64_t total);
    Monitor(const Monitor&) = delete;
    Monitor& operator=(const Monitor&) = delete;

    /// Any thread: `count` more units are done. On the calling thread it also reports, at most every 50 ms.
    void advance(std::int64_t count = 1) noexcept;

    [[nodiscard]] bool stopped() const noexcept { return stopped_.load(std::memory_order_relaxed); }

    /// Any thread: remembers the current exception (the first one wins) and stops the others.
    void capture() noexcept;

    /// Calling thread, outside any parallel region: throws the captured exception or Cancelled; otherwise reports completion.
    void finish();

private:
    void report() noexcept;

    const Execution& execution_;
    const char* phase_;
    std::int64_t total_;
    std::atomic<std::int64_t> done_{0};
    std::atomic<bool> stopped_{false};
    std::atomic_flag capturing_ = ATOMIC_FLAG_INIT;
    std::exception_ptr error_;
    bool cancelled_ = false;
    std::uint64_t owner_;
    std::chrono::steady_clock::time_point last_report_;
};

/// Runs body(i) for i in [0, count) on `execution.threads` threads in chunks. Each i must own what it writes.
template <class Body>
void parallel_for(const Execution& execution, const char* phase, std::int64_t count, const Body& body, std::int64_t chunk = 1) {
    Monitor monitor(execution, phase, count);
    const int threads = resolve_threads(execution.threads);
#pragma omp parallel for schedule(dynamic, chunk) num_threads(threads) if (threads > 1)
    for (std::int64_t i = 0; i < count; ++i) {
        if (monitor.stopped()) continue;
        try {
            body(i);
        } catch (...) {
            monitor.capture();
        }
        monitor.advance();
    }
    monitor.finish();
}

}  // namespace sarfocus
