// Numbers and lines out of text files from outside: no locale, no exceptions, every failure is seen by the
// caller.
#pragma once

#include <charconv>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <system_error>

#include "rt/status.hpp"

namespace tactus::evaluate {

/// The whole file as bytes. bad_input when it is missing, not a regular file, or larger than bytes_max.
/// Boot; may wait for the disk.
rt::Result<std::string> read_file(const std::filesystem::path& path,
                                  std::size_t bytes_max = std::size_t{2} << 30);

/// Cuts the next line from the front of `text` (without its end, a trailing CR removed).
inline std::string_view take_line(std::string_view& text) {
  const std::size_t end = text.find('\n');
  std::string_view line = text.substr(0, end);
  text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
  if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
  return line;
}

/// Cuts the next word (separated by blanks or tabs) from the front of `line`; empty when there is none.
inline std::string_view take_word(std::string_view& line) {
  const std::size_t begin = line.find_first_not_of(" \t");
  if (begin == std::string_view::npos) {
    line = {};
    return {};
  }
  line.remove_prefix(begin);
  const std::size_t end = line.find_first_of(" \t");
  const std::string_view word = line.substr(0, end);
  line.remove_prefix(word.size());
  return word;
}

/// True when the whole word is one number of type Number. A double may come out as NaN or infinite; the
/// caller checks.
template <typename Number>
bool parse_number(std::string_view word, Number& number) {
  if (!word.empty() && word.front() == '+') word.remove_prefix(1);
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), number);
  return error == std::errc() && end == word.data() + word.size() && !word.empty();
}

/// Reads exactly numbers.size() finite numbers from `line`; false when there are fewer, more, or other
/// things.
inline bool parse_numbers(std::string_view line, std::span<double> numbers) {
  for (double& number : numbers)
    if (!parse_number(take_word(line), number) || !std::isfinite(number)) return false;
  return take_word(line).empty();
}

}  // namespace tactus::evaluate
