#include <sarfocus/core/array.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <fstream>
#include <new>
#include <string>
#include <utility>

#include <gtest/gtest.h>

namespace sarfocus {
namespace {

// Pages this process holds, MiB; 0 where the kernel does not say.
double resident() {
    std::ifstream status("/proc/self/status");
    for (std::string line; std::getline(status, line);)
        if (line.rfind("VmRSS:", 0) == 0) return std::stod(line.substr(6)) / 1024.0;
    return 0.0;
}

TEST(Array, IsZeroAndAlignedWhateverItsSize) {
    for (const std::ptrdiff_t n : {1, 7, 1000, 262143, 262144, 262145, 3000000}) {
        Array<cfloat, 1> first({n});
        std::fill(first.begin(), first.end(), cfloat(1.0f, 2.0f));
        first = {};  // what follows may get its memory
        const Array<cfloat, 1> array({n});
        EXPECT_EQ(reinterpret_cast<std::uintptr_t>(array.data()) % memory_alignment, 0U) << n;
        EXPECT_TRUE(std::all_of(array.begin(), array.end(), [](cfloat x) { return x == cfloat{}; })) << n;
    }
    EXPECT_TRUE((Array<float, 2>({0, 5}).empty()));
    EXPECT_TRUE((Array<float, 2>().empty()));
}

TEST(Array, MovesAndCopies) {
    Array<double, 2> a({600, 700});
    a(599, 699) = 3.0;
    const Array<double, 2> copy = a.copy();
    const double* place = a.data();
    const Array<double, 2> moved = std::move(a);
    EXPECT_EQ(moved.data(), place);
    EXPECT_EQ(moved(599, 699), 3.0);
    EXPECT_EQ(copy(599, 699), 3.0);
    EXPECT_NE(copy.data(), place);
}

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
// The sanitisers end the process instead.
TEST(Array, MoreThanThereIsIsRefused) {
    EXPECT_THROW((Array<double, 2>({std::ptrdiff_t{1} << 40, 1 << 10})), std::bad_alloc);
}

TEST(Array, MemoryOfALargeOneGoesBackToTheSystem) {
    const double before = resident();
    if (before == 0.0) GTEST_SKIP() << "the kernel does not say what a process holds";
    {
        Array<float, 2> big({64, 1 << 20});
        EXPECT_LT(resident() - before, 16.0);  // until it is touched
        std::fill(big.begin(), big.end(), 1.0f);
        EXPECT_GT(resident() - before, 250.0);
    }
    EXPECT_LT(resident() - before, 16.0);
}
#endif

}  // namespace
}  // namespace sarfocus
