#include "pipeline/evaluate/text.hpp"

#include <cstdio>
#include <memory>

namespace tactus::evaluate {

rt::Result<std::string> read_file(const std::filesystem::path& path, std::size_t bytes_max) {
  const auto bad = [&](const std::string& what) {
    return rt::Error{rt::ExitCode::bad_input, path.string() + ": " + what};
  };
  std::error_code error;
  if (!std::filesystem::exists(path, error)) return bad("there is no such file.");
  if (!std::filesystem::is_regular_file(path, error)) return bad("this is not a file.");
  const auto bytes_count = std::filesystem::file_size(path, error);
  if (error) return bad("the size cannot be read (" + error.message() + ").");
  if (bytes_count > bytes_max) {
    return bad("the file has " + std::to_string(bytes_count) + " bytes; at most " +
               std::to_string(bytes_max) + " are read.");
  }
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(path.c_str(), "rb"), std::fclose);
  if (!file) return bad("the file cannot be opened for reading.");
  std::string bytes(static_cast<std::size_t>(bytes_count), '\0');
  const std::size_t bytes_read = std::fread(bytes.data(), 1, bytes.size(), file.get());
  if (bytes_read != bytes.size()) return bad("the file ended or failed while it was being read.");
  return bytes;
}

}  // namespace tactus::evaluate
