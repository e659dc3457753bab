#include "hal/iio/sysfs.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <string_view>
#include <system_error>

namespace tactus::hal::iio {
namespace {

rt::Error cannot_read(const std::filesystem::path& file, int error) {
  std::string why = std::generic_category().message(error);
  if (error == EBUSY) why += "; another program streams from it (iio-sensor-proxy does), stop that one";
  if (error == EACCES) why += "; run as a user who may read it";
  return {rt::ExitCode::device_unavailable, file.string() + ": cannot be read: " + why + "."};
}

}  // namespace

rt::Result<std::string> read_text(const std::filesystem::path& file) {
  const int fd = open(file.c_str(), O_RDONLY | O_CLOEXEC);
  if (fd < 0) return cannot_read(file, errno);
  std::array<char, 4096> bytes{};  // sysfs gives a page at most
  const ssize_t count = read(fd, bytes.data(), bytes.size());
  const int error = errno;
  close(fd);
  if (count < 0) return cannot_read(file, error);
  std::string text(bytes.data(), static_cast<std::size_t>(count));
  while (!text.empty() && (text.back() == '\n' || text.back() == ' ' || text.back() == '\0')) text.pop_back();
  return text;
}

std::optional<double> parse_number(std::string_view text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) return std::nullopt;
  return value;
}

rt::Result<double> read_number(const std::filesystem::path& file) {
  const auto text = read_text(file);
  if (!text) return text.error();
  const auto value = parse_number(*text);
  if (!value) return rt::Error{rt::ExitCode::device_unavailable, file.string() + ": \"" + *text + "\" is not a number."};
  return *value;
}

rt::Result<std::optional<double>> read_number_if_any(const std::filesystem::path& file) {
  std::error_code error;
  if (!std::filesystem::exists(file, error)) return std::optional<double>();
  const auto value = read_number(file);
  if (!value) return value.error();
  return std::optional<double>(*value);
}

}  // namespace tactus::hal::iio
