// Reading text written by others: lines, words, exact decimal times. Pure functions; nothing here trusts its
// input.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "rt/status.hpp"

namespace tactus::hal::replay {

/// Lines of a text without their ends ("\n" or "\r\n"), counted from 1. The text must outlive the reader.
class LineReader {
 public:
  explicit LineReader(std::string_view text) : rest_(text) {}
  /// False at the end of the text.
  bool next(std::string_view& line);
  /// Number of the line that next() gave last.
  [[nodiscard]] int line_number() const { return line_number_; }

 private:
  std::string_view rest_;
  int line_number_ = 0;
};

/// Cuts the first word (blanks, tabs and commas separate) off `rest`; empty when there is none.
std::string_view next_word(std::string_view& rest);

/// True when the line has no word, or its first word starts with '#'.
bool is_blank_or_comment(std::string_view line);

/// A finite decimal number that is the whole word. Locale-free.
std::optional<double> parse_number(std::string_view word);

/// A non-negative decimal integer that is the whole word.
std::optional<std::uint64_t> parse_count(std::string_view word);

/// Seconds written as decimal text ("1305031229.528784", "1.3e9") to nanoseconds, digit by digit: a double
/// has only 53 bits and would move a Unix time by 100 ns. Digits beyond the ninth are cut off. Negative
/// times, other text and times beyond int64 are refused.
std::optional<std::int64_t> parse_seconds_as_ns(std::string_view word);

/// Words in quotes for a message: at most 40 printable characters, the rest replaced.
std::string quote(std::string_view text);

/// A bad-input error "file:line: what" (line 0: "file: what").
rt::Error bad_input(std::string_view file, int line, std::string_view what);

}  // namespace tactus::hal::replay
