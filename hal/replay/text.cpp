#include "hal/replay/text.hpp"

#include <charconv>
#include <cmath>
#include <limits>

namespace tactus::hal::replay {
namespace {

constexpr std::string_view kSeparators = " \t,\r\v\f";

bool is_digit(char c) { return c >= '0' && c <= '9'; }

}  // namespace

bool LineReader::next(std::string_view& line) {
  if (rest_.empty()) return false;
  const std::size_t end = rest_.find('\n');
  line = rest_.substr(0, end);
  rest_ = end == std::string_view::npos ? std::string_view{} : rest_.substr(end + 1);
  if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
  if (line_number_ < std::numeric_limits<int>::max()) ++line_number_;
  return true;
}

std::string_view next_word(std::string_view& rest) {
  const std::size_t begin = rest.find_first_not_of(kSeparators);
  if (begin == std::string_view::npos) return rest = {};
  const std::size_t end = rest.find_first_of(kSeparators, begin);
  const std::string_view word = rest.substr(begin, end == std::string_view::npos ? end : end - begin);
  rest = end == std::string_view::npos ? std::string_view{} : rest.substr(end);
  return word;
}

bool is_blank_or_comment(std::string_view line) {
  const std::string_view word = next_word(line);
  return word.empty() || word.front() == '#';
}

std::optional<double> parse_number(std::string_view word) {
  if (!word.empty() && word.front() == '+') word.remove_prefix(1);
  double value = 0;
  const char* end = word.data() + word.size();
  const auto [stop, error] = std::from_chars(word.data(), end, value);
  if (word.empty() || error != std::errc{} || stop != end || !std::isfinite(value)) return std::nullopt;
  return value;
}

std::optional<std::uint64_t> parse_count(std::string_view word) {
  std::uint64_t value = 0;
  const char* end = word.data() + word.size();
  const auto [stop, error] = std::from_chars(word.data(), end, value);
  if (word.empty() || error != std::errc{} || stop != end) return std::nullopt;
  return value;
}

std::optional<std::int64_t> parse_seconds_as_ns(std::string_view word) {
  if (!word.empty() && word.front() == '+') word.remove_prefix(1);
  // The mantissa's digits with the point's place among them, then the exponent.
  std::size_t i = 0;
  const std::size_t digits_begin = 0;
  std::optional<std::size_t> point;
  std::size_t digits_count = 0;
  for (; i < word.size(); ++i) {
    if (is_digit(word[i]))
      ++digits_count;
    else if (word[i] == '.' && !point)
      point = digits_count;
    else
      break;
  }
  if (digits_count == 0) return std::nullopt;
  const std::string_view mantissa = word.substr(digits_begin, i);
  int exponent = 0;
  if (i < word.size()) {
    if (word[i] != 'e' && word[i] != 'E') return std::nullopt;
    std::string_view text = word.substr(i + 1);
    if (!text.empty() && text.front() == '+') text.remove_prefix(1);
    const auto [stop, error] = std::from_chars(text.data(), text.data() + text.size(), exponent);
    if (text.empty() || error != std::errc{} || stop != text.data() + text.size()) return std::nullopt;
    if (exponent < -100 || exponent > 100) return std::nullopt;
  }
  // Digits that stand before the ninth place after the point are kept; missing ones are zeros.
  const auto kept = static_cast<std::int64_t>(point.value_or(digits_count)) + exponent + 9;
  std::int64_t ns = 0;
  std::int64_t taken = 0;
  constexpr std::int64_t kMax = std::numeric_limits<std::int64_t>::max();
  const auto push = [&](int digit) {
    if (ns > (kMax - digit) / 10) return false;
    ns = ns * 10 + digit;
    return true;
  };
  for (const char c : mantissa) {
    if (c == '.') continue;
    if (taken >= kept) break;
    if (!push(c - '0')) return std::nullopt;
    ++taken;
  }
  for (; taken < kept && ns != 0; ++taken)
    if (!push(0)) return std::nullopt;
  return ns;
}

std::string quote(std::string_view text) {
  constexpr std::size_t kMost = 40;
  std::string out = "\"";
  for (const char c : text.substr(0, kMost)) out += c >= ' ' && c <= '~' ? c : '?';
  return out + (text.size() > kMost ? "...\"" : "\"");
}

rt::Error bad_input(std::string_view file, int line, std::string_view what) {
  std::string message(file);
  if (line > 0) message += ":" + std::to_string(line);
  return {rt::ExitCode::bad_input, message + ": " + std::string(what)};
}

}  // namespace tactus::hal::replay
