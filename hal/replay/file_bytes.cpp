#include "hal/replay/file_bytes.hpp"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>

#include "hal/replay/text.hpp"

namespace tactus::hal::replay {

rt::Result<void> read_file(const std::filesystem::path& path, std::size_t bytes_max, std::string& out,
                           bool only_head) {
  std::error_code error;
  const auto status = std::filesystem::status(path, error);
  if (!std::filesystem::exists(status)) return bad_input(path.string(), 0, "the file is missing");
  if (!std::filesystem::is_regular_file(status)) return bad_input(path.string(), 0, "not a regular file");
  const auto size = std::filesystem::file_size(path, error);
  if (error) return bad_input(path.string(), 0, "cannot be read: " + error.message());
  if (size > bytes_max && !only_head)
    return bad_input(path.string(), 0, "is larger than " + std::to_string(bytes_max >> 20) + " MiB");
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(path.c_str(), "rb"), std::fclose);
  if (!file) return bad_input(path.string(), 0, std::string("cannot be opened: ") + std::strerror(errno));
  out.resize(static_cast<std::size_t>(size < bytes_max ? size : bytes_max));
  const std::size_t got = std::fread(out.data(), 1, out.size(), file.get());
  if (got != out.size()) return bad_input(path.string(), 0, "cannot be read to its end");
  return {};
}

}  // namespace tactus::hal::replay
