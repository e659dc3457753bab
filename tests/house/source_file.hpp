// A source file as the house rules see it: its path, and its lines with comments and strings told apart from
// code.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace tactus::house {

// One line, three views of it; each has the others' characters replaced by spaces, so that columns agree.
struct Line {
  std::string raw;
  std::string code;      // without comments and without what stands between quotes
  std::string comment;   // the text of comments alone, without the slashes
  std::string literals;  // the text between quotes alone
};

struct SourceFile {
  std::string path;  // relative to the root, with slashes
  std::vector<Line> lines;
};

// Splits C++ text. Knows line and block comments, escapes, raw strings and digit separators; preprocessor
// lines are code, and the path of an #include counts as code, too.
SourceFile split_source(std::string_view path, std::string_view text);

// All .hpp and .cpp files below the product's folders and tests/, sorted by path.
std::vector<SourceFile> read_tree(const std::filesystem::path& root);

}  // namespace tactus::house
