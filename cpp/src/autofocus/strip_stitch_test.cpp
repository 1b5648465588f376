#include <cmath>
#include <numeric>

#include <gtest/gtest.h>

#include <sarfocus/core/error.hpp>

#include "strip_scene_test.hpp"

namespace sarfocus::autofocus {
namespace {

using namespace test;

// Apertures of 200 samples, one every 40: five partners behind each.
std::vector<Line> chain(int count, std::ptrdiff_t step = 40, std::ptrdiff_t first = 0) {
    std::vector<Line> out;
    for (int i = 0; i < count; ++i) {
        Line line;
        line.start = first + step * i;
        line.count = 200;
        line.slope = 0.03 * std::sin(1.3 * i) + 0.01 * i;
        line.constant = 0.9 * i;
        out.push_back(line);
    }
    return out;
}

// A seam that says what is true, with the deviation of a good one.
Seam seam_between(const Apertures& a, const std::vector<Line>& lines, std::ptrdiff_t i, std::ptrdiff_t j) {
    Seam out;
    out.first = i;
    out.second = j;
    out.overlap = a.start[at(i)] + a.count[at(i)] - a.start[at(j)];
    out.slope = lines[at(i)].slope - lines[at(j)].slope;
    out.slope_std = 1e-3;
    out.coherence = 0.9;
    return out;
}

std::vector<Seam> all_seams(const Apertures& a, const std::vector<Line>& lines) {
    std::vector<Seam> out;
    for (std::ptrdiff_t i = 0; i < a.size(); ++i)
        for (std::ptrdiff_t j = i + 1; j < a.size(); ++j)
            if (a.start[at(i)] + a.count[at(i)] - a.start[at(j)] > 20) out.push_back(seam_between(a, lines, i, j));
    return out;
}

std::vector<double> without_mean(const std::vector<Line>& lines, std::size_t begin, std::size_t end) {
    std::vector<double> out;
    for (std::size_t i = begin; i < end; ++i) out.push_back(lines[i].slope);
    const double mean = std::accumulate(out.begin(), out.end(), 0.0) / static_cast<double>(out.size());
    for (double& s : out) s -= mean;
    return out;
}

TEST(StripStitch, RecoversTheLinearTerms) {
    const auto lines = chain(12);
    const Apertures a = make_apertures(lines, 700, {});
    const auto expected = without_mean(lines, 0, 12);
    for (const bool neighbours : {false, true}) {
        std::vector<Seam> seams = all_seams(a, lines);
        if (neighbours) std::erase_if(seams, [](const Seam& s) { return s.second != s.first + 1; });
        const Stitching out = stitch(a, seams);
        EXPECT_EQ(out.segments, 1);
        for (std::size_t i = 0; i < 12; ++i) {
            EXPECT_NEAR(out.slope[i], expected[i], 1e-9);  // an exactly solvable system, its condition below 1e4
            EXPECT_EQ(out.segment[i], 0);
        }
        double weights = 0.0;
        for (const Seam& seam : out.seams) {
            EXPECT_NEAR(seam.residual, 0.0, 1e-9);
            weights += seam.weight;
        }
        EXPECT_NEAR(weights, 1.0, 1e-12);
    }
}

TEST(StripStitch, OutvotesASeamThatIsWrong) {
    const auto lines = chain(12);
    const Apertures a = make_apertures(lines, 700, {});
    const auto expected = without_mean(lines, 0, 12);
    // Two that sit on another peak of their periodogram, by 10 and 40 cells of 2 pi / 200, and say they are sure.
    std::vector<Seam> seams = all_seams(a, lines);
    const auto index = [&](std::int64_t first, std::int64_t second) {
        return static_cast<std::size_t>(
            std::find_if(seams.begin(), seams.end(), [&](const Seam& s) { return s.first == first && s.second == second; }) -
            seams.begin());
    };
    const std::size_t wrong[] = {index(3, 4), index(7, 9)};
    seams[wrong[0]].slope += 0.3;
    seams[wrong[1]].slope -= 1.2;
    const Stitching out = stitch(a, seams);
    // Weight (1 + x^2)^-2 with x = 0.3 / (pi / 160) = 15: 2e-5 of an ordinary seam, times 0.3.
    for (std::size_t i = 0; i < 12; ++i) EXPECT_NEAR(out.slope[i], expected[i], 1e-4) << i;
    EXPECT_NEAR(out.seams[wrong[0]].residual, 0.3, 1e-4);
    EXPECT_NEAR(out.seams[wrong[1]].residual, -1.2, 1e-4);
    const double usual = out.seams[5].weight;
    for (const std::size_t w : wrong) EXPECT_LT(out.seams[w].weight, 1e-4 * usual);
    EXPECT_EQ(out.segments, 1);
}

TEST(StripStitch, WeighsSeamsByTheirVariance) {
    // Two seams between the same two points, and nothing else: the weighted mean, as far as the robust weights leave it alone.
    const auto lines = chain(2);
    const Apertures a = make_apertures(lines, 300, {});
    Seam good = seam_between(a, lines, 0, 1);
    Seam poor = good;
    good.slope = 0.010;
    poor.slope = 0.013;
    poor.slope_std = 2e-3;
    const Stitching out = stitch(a, {good, poor});
    // pi / 160 = 0.02 is the robust scale: 0.0024 of it changes a weight by 3 %, the mean by 5e-5.
    EXPECT_NEAR(out.slope[0] - out.slope[1], 0.8 * 0.010 + 0.2 * 0.013, 1e-4);
    EXPECT_NEAR(out.seams[1].weight, 0.2, 0.02);
}

TEST(StripStitch, SegmentsAreWhatHangsTogether) {
    auto lines = chain(5);
    for (const Line& line : chain(4, 40, 600)) lines.push_back(line);
    const Apertures a = make_apertures(lines, 1000, {});
    const Stitching out = stitch(a, all_seams(a, lines));
    EXPECT_EQ(out.segments, 2);
    EXPECT_EQ(out.segment, (std::vector<int>{0, 0, 0, 0, 0, 1, 1, 1, 1}));
    auto expected = without_mean(lines, 0, 5);
    for (const double s : without_mean(lines, 5, 9)) expected.push_back(s);
    for (std::size_t i = 0; i < 9; ++i) EXPECT_NEAR(out.slope[i], expected[i], 1e-9);

    const Stitching alone = stitch(a, {});
    // Nothing hangs together: apertures of 200 samples that others cover for more than half are dropped, those left are segments.
    EXPECT_EQ(alone.segment, (std::vector<int>{0, -1, -1, 1, -1, 2, -1, -1, 3}));
    for (const double s : alone.slope) EXPECT_EQ(s, 0.0);
    EXPECT_EQ(stitch(make_apertures({}, 100, {}), {}).segments, 0);
    EXPECT_EQ(stitch(make_apertures({chain(1)}, 300, {}), {}).segment, std::vector<int>{0});
}

TEST(StripStitch, DropsPointsThatFitNothing) {
    const auto lines = chain(12);
    const Apertures a = make_apertures(lines, 700, {});
    std::vector<Seam> seams = all_seams(a, lines);
    for (Seam& seam : seams)
        if (seam.first == 6 || seam.second == 6) seam.coherence = 0.02;  // 0.02 of 160 samples: no tone that stands out of noise
    const Stitching out = stitch(a, seams);
    EXPECT_EQ(out.segments, 1);
    for (std::size_t i = 0; i < 12; ++i) EXPECT_EQ(out.segment[i], i == 6 ? -1 : 0) << i;
    for (const Seam& seam : out.seams)
        if (seam.first == 6 || seam.second == 6) EXPECT_EQ(seam.weight, 0.0);

    // At the end of the strip the same point reaches where no other does: it hangs on its own.
    auto far = chain(5);
    far.push_back({320, 200, 0.0, 0.0, 1.0, 0.0});
    const Apertures b = make_apertures(far, 700, {});
    seams = all_seams(b, far);
    for (Seam& seam : seams)
        if (seam.second == 5) seam.coherence = 0.02;
    const Stitching apart = stitch(b, seams);
    EXPECT_EQ(apart.segments, 2);
    EXPECT_EQ(apart.segment[5], 1);
}

TEST(StripStitch, RefusesSeamsOfOtherPoints) {
    const auto lines = chain(3);
    const Apertures a = make_apertures(lines, 300, {});
    Seam seam = seam_between(a, lines, 0, 1);
    for (const auto& [first, second] : {std::pair{-1, 1}, std::pair{0, 3}, std::pair{1, 1}}) {
        seam.first = first;
        seam.second = second;
        EXPECT_THROW((void)stitch(a, {seam}), ValueError);
    }
    // Seams that say nothing: deviation or coherence zero.
    seam = seam_between(a, lines, 0, 1);
    seam.slope_std = 0.0;
    EXPECT_EQ(stitch(a, {seam}).seams[0].weight, 0.0);
    seam = seam_between(a, lines, 0, 1);
    seam.coherence = 0.0;
    EXPECT_EQ(stitch(a, {seam}).seams[0].weight, 0.0);
}

}  // namespace
}  // namespace sarfocus::autofocus
