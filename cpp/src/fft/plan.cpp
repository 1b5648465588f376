// The only source file that knows FFTW.
#include <sarfocus/fft/plan.hpp>

#include <filesystem>
#include <map>
#include <mutex>
#include <string>
#include <type_traits>
#include <utility>

#include <fftw3.h>

#include <sarfocus/core/array.hpp>
#include <sarfocus/core/error.hpp>

#include "wisdom_folder.hpp"

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

fftwf_plan make_plan(int n, std::complex<float>* x, int sign, unsigned how) {
    auto* p = reinterpret_cast<fftwf_complex*>(x);
    return fftwf_plan_dft_1d(n, p, p, sign, how);
}
fftw_plan make_plan(int n, std::complex<double>* x, int sign, unsigned how) {
    auto* p = reinterpret_cast<fftw_complex*>(x);
    return fftw_plan_dft_1d(n, p, p, sign, how);
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

// What the two precisions of FFTW call differently.
template <class Real>
constexpr bool is_single = std::is_same_v<Real, float>;
template <class Real>
constexpr const char* wisdom_name = is_single<Real> ? "single.wisdom" : "double.wisdom";

template <class Real>
void import_wisdom(const std::string& text) {
    if (text.empty()) return;  // what FFTW can't read, of another version or machine, it leaves alone
    if constexpr (is_single<Real>)
        fftwf_import_wisdom_from_string(text.c_str());
    else
        fftw_import_wisdom_from_string(text.c_str());
}

template <class Real>
std::string export_wisdom() {
    char* text = nullptr;
    if constexpr (is_single<Real>)
        text = fftwf_export_wisdom_to_string();
    else
        text = fftw_export_wisdom_to_string();
    std::string out = text == nullptr ? "" : text;
    fftwf_free(text);
    return out;
}

// Under the lock: the folder, looked for once.
const std::filesystem::path& folder() {
    static const std::filesystem::path found = detail::wisdom_folder();
    return found;
}

// Under the lock. Long transforms are measured, once for a user: what was found is read from the folder, and added to it. A plan once
// made, the process keeps its wisdom, so every later one of the same length is the same, to the bit. Short ones gain little.
template <class Real>
auto plan_of(int n, std::complex<Real>* x, int sign) {
    constexpr int shortest = 1024;
    constexpr int longest = 1 << 20;
    if (n < shortest || n > longest || folder().empty()) return make_plan(n, x, sign, FFTW_ESTIMATE);
    static bool read = false;
    const std::filesystem::path file = folder() / wisdom_name<Real>;
    if (!read) import_wisdom<Real>(detail::read_text(file));  // once: what others measure meanwhile must not change this process
    read = true;
    if (const auto known = make_plan(n, x, sign, FFTW_MEASURE | FFTW_WISDOM_ONLY)) return known;
    const auto measured = make_plan(n, x, sign, FFTW_MEASURE);
    detail::replace_text(file, export_wisdom<Real>());
    return measured;
}

template <class Real>
using Handle = std::conditional_t<is_single<Real>, fftwf_plan, fftw_plan>;

// Under the lock: the plans the process keeps, for planning takes as long as some transforms. Never destroyed: the host's lock may be
// gone by the end of the process.
template <class Real>
std::map<std::pair<int, int>, Handle<Real>>& kept_plans() {
    static auto& plans = *new std::map<std::pair<int, int>, Handle<Real>>;
    return plans;
}

bool worth_keeping(std::ptrdiff_t length, std::size_t kept) {
    constexpr std::ptrdiff_t longest = 1 << 17;
    constexpr std::size_t most = 64;
    return length <= longest && kept < most;
}

}  // namespace

template <class Real>
struct Plan<Real>::Impl {
    Handle<Real> handle = nullptr;
    std::ptrdiff_t length = 0;
    bool kept = false;

    Impl(std::ptrdiff_t n, Direction direction) : length(n) {
        if (n < 1 || n > (1 << 30)) throw ValueError("length", "a transform length from 1 to 2^30", std::to_string(n));
        const int sign = direction == Direction::forward ? FFTW_FORWARD : FFTW_BACKWARD;
        const std::pair<int, int> key(static_cast<int>(n), sign);
        const PlannerGuard guard;
        auto& plans = kept_plans<Real>();
        if (const auto found = plans.find(key); found != plans.end()) {
            handle = found->second;
            kept = true;
            return;
        }
        Array<std::complex<Real>, 1> scratch({n});
        handle = plan_of<Real>(static_cast<int>(n), scratch.data(), sign);
        if (handle == nullptr) throw NumericalError("no transform of length " + std::to_string(n) + " could be planned");
        kept = worth_keeping(n, plans.size());
        if (kept) plans.emplace(key, handle);
    }
    ~Impl() {
        if (kept) return;
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
