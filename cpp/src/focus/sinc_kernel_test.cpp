#include "focus/sinc_kernel.hpp"

#include <cmath>
#include <complex>
#include <cstddef>
#include <vector>

#include <gtest/gtest.h>

#include <sarfocus/core/constants.hpp>

namespace sarfocus::focus {
namespace {

TEST(SincKernel, KeepsEveryComponentOfTheInnerHalfOfTheBand) {
    // -84 dB: the promise of the header; 1e-6 for single-precision products.
    const double bound = std::pow(10.0, -84.0 / 20.0) + 1e-6;
    const SincKernel kernel;
    std::vector<cfloat> line(64), out(1);
    for (int k = -16; k <= 16; ++k) {
        const double cycles = k / 64.0;
        for (std::size_t i = 0; i < line.size(); ++i) line[i] = cfloat(std::polar(1.0, two_pi * cycles * static_cast<double>(i)));
        for (int step = 0; step < 301; ++step) {
            const double place = 20.0 + step / 150.0;
            const double range = 7000.0 + 3.0 * place;
            kernel.interpolate(line.data(), -7000.0 / 3.0, 1.0 / 3.0, &range, 1, out.data());
            ASSERT_LT(std::abs(cdouble(out[0]) - std::polar(1.0, two_pi * cycles * place)), bound) << cycles << " " << place;
        }
    }
}

TEST(SincKernel, GivesTheSamplesThemselvesAndReadsNothingBeyondItsTaps) {
    const SincKernel kernel;
    std::vector<cfloat> line(SincKernel::before + 1 + SincKernel::after, cfloat(7.0f, -3.0f));
    line[SincKernel::before] = {0.5f, 2.0f};
    const double range = SincKernel::before;
    cfloat out;
    kernel.interpolate(line.data(), 0.0, 1.0, &range, 1, &out);
    EXPECT_LT(std::abs(out - line[SincKernel::before]), 1e-6f);  // sin(pi n) in double precision, times samples of size 7
}

}  // namespace
}  // namespace sarfocus::focus
