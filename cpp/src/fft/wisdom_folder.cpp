#include "wisdom_folder.hpp"

#include <cstdlib>
#include <fstream>
#include <iterator>
#include <random>
#include <system_error>

namespace sarfocus::fft::detail {
namespace {

namespace fs = std::filesystem;

std::string variable(const char* name) {
    const char* value = std::getenv(name);
    return value == nullptr ? std::string() : std::string(value);
}

fs::path chosen_folder() {
    std::string own = variable("SARFOCUS_WISDOM");
    if (own == "off") return {};
    if (!own.empty()) return own;
    if (const std::string cache = variable("XDG_CACHE_HOME"); !cache.empty()) return fs::path(cache) / "sarfocus";
    if (const std::string local = variable("LOCALAPPDATA"); !local.empty()) return fs::path(local) / "sarfocus";
    if (const std::string home = variable("HOME"); !home.empty()) return fs::path(home) / ".cache" / "sarfocus";
    return {};
}

fs::path beside(const fs::path& file) {
    return fs::path(file).concat("." + std::to_string(std::random_device{}()));
}

bool write(const fs::path& file, const std::string& text) {
    std::ofstream stream(file, std::ios::binary | std::ios::trunc);
    stream << text;
    stream.close();
    return !stream.fail();
}

}  // namespace

fs::path wisdom_folder() {
    const fs::path folder = chosen_folder();
    if (folder.empty()) return {};
    std::error_code problem;
    fs::create_directories(folder, problem);
    const fs::path trial = beside(folder / "trial");
    const bool writable = write(trial, "");
    fs::remove(trial, problem);
    return writable ? folder : fs::path();
}

std::string read_text(const fs::path& file) {
    std::ifstream stream(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

void replace_text(const fs::path& file, const std::string& text) {
    const fs::path fresh = beside(file);
    std::error_code problem;
    if (write(fresh, text)) fs::rename(fresh, file, problem);
    if (problem || fs::exists(fresh, problem)) fs::remove(fresh, problem);
}

}  // namespace sarfocus::fft::detail
