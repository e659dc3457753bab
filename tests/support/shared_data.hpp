// Where the recordings beside the project are, for tests that use them when they are there.
#pragma once

#include <cstdlib>
#include <filesystem>
#include <optional>

namespace tactus::test {

/// The folder or file `relative` under TACTUS_SHARED_DATA (default: ../shared/data beside the source tree), or nothing
/// when it is absent: then GTEST_SKIP() with a sentence.
inline std::optional<std::filesystem::path> shared_data(const char* relative) {
  const char* root = std::getenv("TACTUS_SHARED_DATA");
  const std::filesystem::path base =
      root != nullptr ? std::filesystem::path(root) : std::filesystem::path(TACTUS_SOURCE_DIR) / "../shared/data";
  std::error_code error;
  const auto path = std::filesystem::weakly_canonical(base / relative, error);
  if (error || !std::filesystem::exists(path)) return std::nullopt;
  return path;
}

}  // namespace tactus::test
