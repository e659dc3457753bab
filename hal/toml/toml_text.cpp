// toml++ 3.3 asserts (or, with NDEBUG and clang, assumes) what a malformed table header breaks, just before it checks
// and reports it; without the assertion the report is what we get. A fuzzer found it.
#undef NDEBUG
#define TOML_ASSERT(expression) static_assert(true)
#define TOML_IMPLEMENTATION
#include "hal/toml/toml_text.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <memory>

namespace tactus::hal {

rt::Result<toml::table> parse_toml(std::string_view text, const std::string& file, rt::ExitCode code) {
  const auto complaint = [&](std::ptrdiff_t line, const std::string& what) {
    return rt::Error{code, file + ":" + std::to_string(line) + ": not valid TOML: " + what};
  };
  const auto foreign = std::ranges::find_if(text, [](char c) { return static_cast<unsigned char>(c) > 127; });
  if (foreign != text.end())
    return complaint(1 + std::count(text.begin(), foreign, '\n'), "holds a character outside ASCII");
  toml::parse_result result = toml::parse(text, file);
  if (!result)
    return complaint(static_cast<std::ptrdiff_t>(result.error().source().begin.line),
                     std::string(result.error().description()));
  return std::move(result).table();
}

rt::Result<std::string> read_settings_file(const std::string& file, std::string_view what) {
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> stream(std::fopen(file.c_str(), "rb"), std::fclose);
  const auto refused = [&](const char* why) {
    return rt::Error{rt::ExitCode::bad_usage, file + ": the " + std::string(what) + why};
  };
  if (stream == nullptr) return refused(" cannot be read");
  constexpr std::size_t kBytesMax = 1 << 20;
  std::string text;
  std::array<char, 4096> chunk{};
  for (std::size_t n = 0; (n = std::fread(chunk.data(), 1, chunk.size(), stream.get())) > 0;) {
    text.append(chunk.data(), n);
    if (text.size() > kBytesMax) return refused(" is larger than 1 MB");
  }
  if (std::ferror(stream.get()) != 0) return refused(" cannot be read");  // a folder opens, but does not read
  return text;
}

}  // namespace tactus::hal
