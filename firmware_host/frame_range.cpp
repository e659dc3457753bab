#include "firmware_host/frame_range.hpp"

#include <charconv>
#include <string>

namespace tactus::firmware {

rt::Result<FrameRange> parse_frame_range(std::string_view text) {
  const auto bad = [&](const std::string& why) {
    return rt::Error{rt::ExitCode::bad_usage,
                     "--frames " + std::string(text) + ": " + why + "; A:B means frames A to B - 1."};
  };
  FrameRange range;
  const auto number = [](std::string_view word, std::uint64_t& value) {
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    return error == std::errc() && end == word.data() + word.size() && !word.empty();
  };
  const std::size_t colon = text.find(':');
  const std::string_view first = colon == std::string_view::npos ? "" : text.substr(0, colon);
  const std::string_view last = colon == std::string_view::npos ? text : text.substr(colon + 1);
  if (first.empty() && last.empty()) return bad("there is no number");
  if (!first.empty() && !number(first, range.first)) return bad("A is not a number");
  if (!last.empty() && !number(last, range.last)) return bad("B is not a number");
  if (range.first >= range.last) return bad("the range is empty");
  return range;
}

}  // namespace tactus::firmware
