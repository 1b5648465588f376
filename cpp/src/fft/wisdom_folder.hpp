#pragma once

#include <filesystem>
#include <string>

namespace sarfocus::fft::detail {

/// Where the user's wisdom is kept: $SARFOCUS_WISDOM, or sarfocus/ in the user's cache folder; made where it is missing. Empty where
/// $SARFOCUS_WISDOM is `off`, where no cache folder is known, and where nothing can be written into it.
[[nodiscard]] std::filesystem::path wisdom_folder();

/// The whole file; empty where there is none.
[[nodiscard]] std::string read_text(const std::filesystem::path& file);

/// Replaces the file in one step, so that no reader sees half of it. Failure leaves what was there: the wisdom is measured again next time.
void replace_text(const std::filesystem::path& file, const std::string& text);

}  // namespace sarfocus::fft::detail
