#include "tests/house/source_file.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <fstream>
#include <iterator>

namespace tactus::house {
namespace {

enum class In { kCode, kLineComment, kBlockComment, kString, kCharacter, kRawString };

bool is_word(char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_'; }

bool is_include(std::string_view code) {
  const auto hash = code.find_first_not_of(" \t");
  if (hash == std::string_view::npos || code[hash] != '#') return false;
  const auto word = code.find_first_not_of(" \t", hash + 1);
  return word != std::string_view::npos && code.substr(word).starts_with("include");
}

}  // namespace

SourceFile split_source(std::string_view path, std::string_view text) {
  SourceFile file{std::string(path), {}};
  Line line;
  In in = In::kCode;
  bool include_quote = false;
  std::string raw_end;

  const auto put = [&line](char raw, std::string Line::*view, char shown) {
    line.raw += raw;
    line.code += ' ';
    line.comment += ' ';
    line.literals += ' ';
    if (view != nullptr) (line.*view).back() = shown;
  };

  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    const char next = i + 1 < text.size() ? text[i + 1] : '\0';
    if (c == '\n') {
      if (in == In::kLineComment || in == In::kString || in == In::kCharacter) in = In::kCode;
      file.lines.push_back(std::move(line));
      line = {};
      continue;
    }
    switch (in) {
      case In::kCode: {
        const char before = line.code.empty() ? ' ' : line.code.back();
        if (c == '/' && (next == '/' || next == '*')) {
          in = next == '/' ? In::kLineComment : In::kBlockComment;
          put(c, nullptr, c);
          put(next, nullptr, c);
          ++i;
        } else if (c == '"' && before == 'R') {
          const auto open = text.find('(', i);
          raw_end = ")" + std::string(text.substr(i + 1, open - i - 1)) + "\"";
          for (; i < open; ++i) put(text[i], nullptr, c);
          put('(', nullptr, c);
          in = In::kRawString;
        } else if (c == '"') {
          include_quote = is_include(line.code);
          in = In::kString;
          put(c, &Line::code, c);
        } else if (c == '\'' && !is_word(before)) {
          in = In::kCharacter;
          put(c, &Line::code, c);
        } else {
          put(c, &Line::code, c);
        }
        break;
      }
      case In::kLineComment:
        put(c, &Line::comment, c);
        break;
      case In::kBlockComment:
        if (c == '*' && next == '/') {
          in = In::kCode;
          put(c, nullptr, c);
          put(next, nullptr, c);
          ++i;
        } else {
          put(c, &Line::comment, c);
        }
        break;
      case In::kString:
      case In::kCharacter:
        if (c == '\\' && next != '\n') {
          put(c, &Line::literals, c);
          put(next, &Line::literals, next);
          ++i;
        } else if (c == (in == In::kString ? '"' : '\'')) {
          in = In::kCode;
          put(c, &Line::code, c);
        } else {
          put(c, include_quote && in == In::kString ? &Line::code : &Line::literals, c);
        }
        break;
      case In::kRawString:
        if (text.substr(i).starts_with(raw_end)) {
          for (std::size_t k = 0; k < raw_end.size(); ++k) put(raw_end[k], nullptr, c);
          i += raw_end.size() - 1;
          in = In::kCode;
        } else {
          put(c, &Line::literals, c);
        }
        break;
    }
  }
  if (!line.raw.empty()) file.lines.push_back(std::move(line));
  return file;
}

std::vector<SourceFile> read_tree(const std::filesystem::path& root) {
  constexpr std::array kFolders{"rt", "hal", "pipeline", "firmware_host", "tests"};
  std::vector<SourceFile> files;
  for (const char* folder : kFolders) {
    for (const auto& entry : std::filesystem::recursive_directory_iterator(root / folder)) {
      const auto extension = entry.path().extension();
      if (!entry.is_regular_file() || (extension != ".hpp" && extension != ".cpp")) continue;
      std::ifstream in(entry.path(), std::ios::binary);
      const std::string text{std::istreambuf_iterator<char>(in), {}};
      files.push_back(split_source(entry.path().lexically_relative(root).generic_string(), text));
    }
  }
  std::sort(files.begin(), files.end(), [](const auto& a, const auto& b) { return a.path < b.path; });
  return files;
}

}  // namespace tactus::house
