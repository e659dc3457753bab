#include "pipeline/render/resident.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <charconv>
#include <string_view>

namespace tactus::render {

std::optional<std::size_t> resident_bytes() noexcept {
  const int file = open("/proc/self/statm", O_RDONLY | O_CLOEXEC);
  if (file < 0) return std::nullopt;
  char text[128];
  const ssize_t read_count = read(file, text, sizeof(text));
  close(file);
  if (read_count <= 0) return std::nullopt;
  // "size resident shared ...", in pages.
  const std::string_view line(text, static_cast<std::size_t>(read_count));
  const std::size_t begin = line.find(' ');
  if (begin == std::string_view::npos) return std::nullopt;
  std::size_t pages_count = 0;
  const auto parsed = std::from_chars(line.data() + begin + 1, line.data() + line.size(), pages_count);
  if (parsed.ec != std::errc{}) return std::nullopt;
  return pages_count * static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
}

}  // namespace tactus::render
