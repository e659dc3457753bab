// Holds the whole tree to the house rules.
#include <gtest/gtest.h>

#include <array>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "tests/house/rules.hpp"

namespace tactus::house {
namespace {

// Files of rt/ and pipeline/ that work at boot or after the session, where these words are in their place.
constexpr std::array kBootFiles{
    Exception{"rt/assert.hpp", "fprintf(", "the last words before the program aborts"},
    Exception{"rt/clock.cpp", "::now", "defines the one clock"},
    Exception{"rt/clock.cpp", "clock_gettime", "the one place that asks the system for the time"},
    Exception{"rt/clock.cpp", "sleep_until", "defines the one wait"},
    Exception{"rt/clock.hpp", "sleep_until", "declares the one wait"},
    Exception{"rt/heap_guard/", "malloc(", "defines the counted heap calls"},
    Exception{"rt/heap_guard/", "calloc(", "defines the counted heap calls"},
    Exception{"rt/heap_guard/", "realloc(", "defines the counted heap calls"},
    Exception{"rt/heap_guard/", "aligned_alloc", "defines the counted heap calls"},
    Exception{"rt/heap_guard/", "posix_memalign", "defines the counted heap calls"},
    Exception{"rt/thread.cpp", "fprintf(", "says once at boot that real-time scheduling was refused"},
    Exception{"rt/thread.cpp", "make_unique", "hands a new thread its start arguments, at boot"},
    Exception{"pipeline/contact/ode_memory.cpp", "free(", "defines the fenced pool's own free"},
    Exception{"pipeline/contact/ode_memory.hpp", "free(", "declares the fenced pool's own free"},
};
constexpr std::array<Exception, 0> kInexactFiles{};

const std::vector<SourceFile>& tree() {
  static const std::vector<SourceFile> files = read_tree(TACTUS_SOURCE_DIR);
  return files;
}

template <class Rule>
void expect_holds(const Rule& rule) {
  ASSERT_GT(tree().size(), 30u) << "the tree was not found below " << TACTUS_SOURCE_DIR;
  for (const SourceFile& file : tree())
    for (const Finding& finding : rule(file)) ADD_FAILURE() << to_string(finding);
}

TEST(House, IncludesRunOneWay) { expect_holds(check_include_direction); }

TEST(House, StepPathsHoldNoBannedWord) {
  expect_holds([](const SourceFile& file) { return check_step_words(file, kBootFiles); });
}

TEST(House, NothingGrowsInsideNoexcept) {
  expect_holds([](const SourceFile& file) { return check_noexcept_bodies(file, kBootFiles); });
}

TEST(House, ResultsAreTheSameOnEveryMachine) {
  expect_holds([](const SourceFile& file) { return check_determinism_words(file, kInexactFiles); });
}

TEST(House, CommentsHoldNoCodeNoBannerNoDebt) { expect_holds(check_comments); }

TEST(House, AtomicsNameTheirPartners) { expect_holds(check_atomics); }

TEST(House, HeadersSayWhatTheyAreFor) { expect_holds(check_header); }

TEST(House, EveryTestAsserts) { expect_holds(check_tests); }

TEST(House, NamesAreSnakeCase) {
  expect_holds([](const SourceFile& file) { return check_file_name(file.path); });
}

TEST(House, NoPathOfOneMachine) {
  const std::filesystem::path root = TACTUS_SOURCE_DIR;
  int files_count = 0;
  for (auto it = std::filesystem::recursive_directory_iterator(root);
       it != std::filesystem::recursive_directory_iterator(); ++it) {
    const std::string path = it->path().lexically_relative(root).generic_string();
    if (path == ".git" || path == "build" || path == "out" || path == "tests/house") {
      it.disable_recursion_pending();
      continue;
    }
    constexpr std::array<std::string_view, 9> kText{".hpp",  ".cpp", ".cmake", ".txt", ".sh",
                                                    ".json", ".md",  ".toml",  ".py"};
    const std::string extension = it->path().extension().string();
    if (!it->is_regular_file() || std::find(kText.begin(), kText.end(), extension) == kText.end()) continue;
    std::ifstream in(it->path(), std::ios::binary);
    const std::string text{std::istreambuf_iterator<char>(in), {}};
    ++files_count;
    for (const Finding& finding : check_absolute_paths(path, text)) ADD_FAILURE() << to_string(finding);
  }
  EXPECT_GT(files_count, 30);
}

TEST(House, EveryExceptionIsStillNeeded) {
  for (const Exception& exception : kBootFiles) {
    EXPECT_FALSE(exception.reason.empty()) << exception.path;
    bool is_needed = false;
    for (const SourceFile& file : tree()) {
      if (file.path != exception.path &&
          !(exception.path.ends_with('/') && file.path.starts_with(exception.path)))
        continue;
      for (const auto& finding : check_step_words(file, {}))
        is_needed |= finding.what.starts_with(std::string(exception.word) + ":");
      for (const auto& finding : check_noexcept_bodies(file, {}))
        is_needed |= finding.what.starts_with(std::string(exception.word) + ":");
    }
    EXPECT_TRUE(is_needed) << exception.path << " no longer uses " << exception.word;
  }
}

}  // namespace
}  // namespace tactus::house
