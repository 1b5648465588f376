#include <sarfocus/core/execution.hpp>

#include <functional>
#include <thread>

#include <omp.h>

#include <sarfocus/core/error.hpp>

namespace sarfocus {
namespace {

constexpr auto report_interval = std::chrono::milliseconds(50);

std::uint64_t this_thread_id() {
    return std::hash<std::thread::id>{}(std::this_thread::get_id());
}

}  // namespace

int resolve_threads(int requested) {
    if (requested < 0) throw ValueError("threads", "0 (all) or a positive number", std::to_string(requested));
    return requested == 0 ? omp_get_max_threads() : requested;
}

Monitor::Monitor(const Execution& execution, const char* phase, std::int64_t total)
    : execution_(execution), phase_(phase), total_(total), owner_(this_thread_id()), last_report_(std::chrono::steady_clock::now()) {}

void Monitor::report() noexcept {
    try {
        if (!execution_.progress({phase_, done_.load(), total_})) {
            cancelled_ = true;
            stopped_ = true;
        }
    } catch (...) {
        capture();
    }
}

void Monitor::advance(std::int64_t count) noexcept {
    done_.fetch_add(count, std::memory_order_relaxed);
    if (!execution_.progress || stopped() || this_thread_id() != owner_) return;
    const auto now = std::chrono::steady_clock::now();
    if (now - last_report_ < report_interval) return;
    last_report_ = now;
    report();
}

void Monitor::capture() noexcept {
    if (!capturing_.test_and_set()) error_ = std::current_exception();
    stopped_ = true;
}

void Monitor::finish() {
    if (!stopped() && execution_.progress) report();
    if (error_) std::rethrow_exception(error_);
    if (cancelled_) throw Cancelled();
}

}  // namespace sarfocus
