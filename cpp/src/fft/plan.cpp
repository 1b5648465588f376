// The only source file that knows FFTW.
#include <sarfocus/fft/plan.hpp>

#include <atomic>
#include <mutex>
#include <type_traits>

#include <fftw3.h>

#include <sarfocus/core/array.hpp>
#include <sarfocus/core/error.hpp>

namespace sarfocus::fft {
namespace {

std::mutex own_lock;
void (*host_lock)() = nullptr;
void (*host_unlock)() = nullptr;

struct PlannerGuard {
    PlannerGuard() { host_lock ? host_lock() : own_lock.lock(); }
    ~PlannerGuard() { host_unlock ? host_unlock() : own_lock.unlock(); }
    PlannerGuard(const PlannerGuard&) = delete;
    PlannerGuard& operator=(const PlannerGuard&) = delete;
};

fftwf_plan make_plan(int n, std::complex<float>* x, int sign) {
    auto* p = reinterpret_cast<fftwf_complex*>(x);
    return fftwf_plan_dft_1d(n, p, p, sign, FFTW_ESTIMATE);
}
fftw_plan make_plan(int n, std::complex<double>* x, int sign) {
    auto* p = reinterpret_cast<fftw_complex*>(x);
    return fftw_plan_dft_1d(n, p, p, sign, FFTW_ESTIMATE);
}
void run(fftwf_plan plan, std::complex<float>* x) {
    auto* p = reinterpret_cast<fftwf_complex*>(x);
    fftwf_execute_dft(plan, p, p);
}
void run(fftw_plan plan, std::complex<double>* x) {
    auto* p = reinterpret_cast<fftw_complex*>(x);
    fftw_execute_dft(plan, p, p);
}
void destroy(fftwf_plan plan) {
    fftwf_destroy_plan(plan);
}
void destroy(fftw_plan plan) {
    fftw_destroy_plan(plan);
}

}  // namespace

template <class Real>
struct Plan<Real>::Impl {
    using Handle = std::conditional_t<std::is_same_v<Real, float>, fftwf_plan, fftw_plan>;
    Handle handle = nullptr;
    std::ptrdiff_t length = 0;

    Impl(std::ptrdiff_t n, Direction direction) : length(n) {
        if (n < 1 || n > (1 << 30)) throw ValueError("length", "a transform length from 1 to 2^30", std::to_string(n));
        // FFTW_ESTIMATE: the same plan, and so the same bits, on every call; measured plans differ from run to run.
        Array<std::complex<Real>, 1> scratch({n});
        const PlannerGuard guard;
        handle = make_plan(static_cast<int>(n), scratch.data(), direction == Direction::forward ? FFTW_FORWARD : FFTW_BACKWARD);
        if (handle == nullptr) throw NumericalError("no transform of length " + std::to_string(n) + " could be planned");
    }
    ~Impl() {
        const PlannerGuard guard;
        destroy(handle);
    }
    Impl(const Impl&) = delete;
    Impl& operator=(const Impl&) = delete;
};

template <class Real>
Plan<Real>::Plan(std::ptrdiff_t length, Direction direction) : impl_(std::make_unique<Impl>(length, direction)) {}
template <class Real>
Plan<Real>::~Plan() = default;
template <class Real>
Plan<Real>::Plan(Plan&&) noexcept = default;
template <class Real>
Plan<Real>& Plan<Real>::operator=(Plan&&) noexcept = default;

template <class Real>
std::ptrdiff_t Plan<Real>::length() const {
    return impl_->length;
}

template <class Real>
void Plan<Real>::execute(std::complex<Real>* data) const {
    run(impl_->handle, data);
}

template class Plan<float>;
template class Plan<double>;

std::ptrdiff_t good_size(std::ptrdiff_t n) {
    if (n < 1) return 1;
    for (std::ptrdiff_t m = n;; ++m) {
        std::ptrdiff_t rest = m;
        for (const std::ptrdiff_t p : {2, 3, 5, 7})
            while (rest % p == 0) rest /= p;
        if (rest == 1) return m;
    }
}

void set_planner_lock(void (*lock)(), void (*unlock)()) {
    if ((lock == nullptr) != (unlock == nullptr)) throw ValueError("unlock", "both functions or neither", "one of them");
    host_lock = lock;
    host_unlock = unlock;
}

}  // namespace sarfocus::fft
