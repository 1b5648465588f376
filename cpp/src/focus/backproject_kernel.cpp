#include "backproject_kernel.hpp"

#include <cstdlib>
#include <string_view>

namespace sarfocus::focus::detail {
namespace {

const Kernels& choose() {
    const char* wanted = std::getenv("SARFOCUS_KERNELS");
    const std::string_view limit = wanted != nullptr ? wanted : "";
    if (limit == "baseline") return kernels_baseline;
#if defined(__x86_64__)
    const bool avx512 = __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl");
    if (avx512 && limit != "avx2") return kernels_avx512;
    if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) return kernels_avx2;
#endif
    return kernels_baseline;
}

}  // namespace

const Kernels& select_kernels() {
    static const Kernels& chosen = choose();
    return chosen;
}

}  // namespace sarfocus::focus::detail
