#include "wisdom_folder.hpp"

#include <cstdlib>
#include <filesystem>
#include <iterator>
#include <string>

#include <gtest/gtest.h>

namespace sarfocus::fft::detail {
namespace {

namespace fs = std::filesystem;

class WisdomFolder : public testing::Test {
protected:
    void SetUp() override {
        fs::remove_all(top_);
        fs::create_directories(top_);
        unsetenv("SARFOCUS_WISDOM");
        unsetenv("LOCALAPPDATA");
        setenv("XDG_CACHE_HOME", (top_ / "cache").c_str(), 1);
    }
    void TearDown() override { fs::remove_all(top_); }

    fs::path top_ = fs::temp_directory_path() / ("sarfocus-" + std::string(testing::UnitTest::GetInstance()->current_test_info()->name()));
};

TEST_F(WisdomFolder, LiesInTheCacheOfTheUser) {
    EXPECT_EQ(wisdom_folder(), top_ / "cache" / "sarfocus");
    EXPECT_TRUE(fs::is_empty(top_ / "cache" / "sarfocus"));
    unsetenv("XDG_CACHE_HOME");
    setenv("HOME", top_.c_str(), 1);
    EXPECT_EQ(wisdom_folder(), top_ / ".cache" / "sarfocus");
    unsetenv("HOME");
    EXPECT_EQ(wisdom_folder(), fs::path());
}

TEST_F(WisdomFolder, LiesWhereTheUserSaysOrNowhere) {
    setenv("SARFOCUS_WISDOM", (top_ / "own" / "place").c_str(), 1);
    EXPECT_EQ(wisdom_folder(), top_ / "own" / "place");
    setenv("SARFOCUS_WISDOM", "off", 1);
    EXPECT_EQ(wisdom_folder(), fs::path());
    EXPECT_FALSE(fs::exists(top_ / "cache"));
}

TEST_F(WisdomFolder, IsNoneWhereNothingCanBeWritten) {
    replace_text(top_ / "file", "no folder");
    setenv("SARFOCUS_WISDOM", (top_ / "file").c_str(), 1);
    EXPECT_EQ(wisdom_folder(), fs::path());
}

TEST_F(WisdomFolder, ReplacesATextAndLeavesNothingElse) {
    const fs::path file = top_ / "text";
    EXPECT_EQ(read_text(file), "");
    replace_text(file, "first");
    replace_text(file, "second");
    EXPECT_EQ(read_text(file), "second");
    EXPECT_EQ(std::distance(fs::directory_iterator(top_), fs::directory_iterator()), 1);
    replace_text(top_ / "missing" / "text", "lost");
    EXPECT_EQ(read_text(top_ / "missing" / "text"), "");
}

}  // namespace
}  // namespace sarfocus::fft::detail
