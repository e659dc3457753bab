#include "firmware_host/output_file.hpp"

#include <cerrno>
#include <cstring>

namespace tactus::firmware {

rt::Result<OutputFile> OutputFile::create(const std::filesystem::path& path) {
  std::FILE* file = std::fopen(path.c_str(), "wb");
  if (file == nullptr) {
    return rt::Error{rt::ExitCode::failed,
                     path.string() + ": the file cannot be created (" + std::strerror(errno) + ")."};
  }
  return OutputFile(file, path);
}

OutputFile::OutputFile(OutputFile&& other) noexcept
    : file_(other.file_), path_(std::move(other.path_)), has_failed_(other.has_failed_) {
  other.file_ = nullptr;
}

OutputFile::~OutputFile() {
  if (file_ != nullptr) std::fclose(file_);
}

void OutputFile::write(std::string_view bytes) {
  TACTUS_ASSERT(file_ != nullptr);
  if (std::fwrite(bytes.data(), 1, bytes.size(), file_) != bytes.size()) has_failed_ = true;
}

void OutputFile::print(const char* format, ...) {
  TACTUS_ASSERT(file_ != nullptr);
  va_list arguments;
  va_start(arguments, format);
  if (std::vfprintf(file_, format, arguments) < 0) has_failed_ = true;
  va_end(arguments);
}

void OutputFile::seek(long offset) {
  TACTUS_ASSERT(file_ != nullptr);
  if (std::fseek(file_, offset, SEEK_SET) != 0) has_failed_ = true;
}

long OutputFile::tell() {
  TACTUS_ASSERT(file_ != nullptr);
  return std::ftell(file_);
}

rt::Result<void> OutputFile::close() {
  TACTUS_ASSERT(file_ != nullptr);
  has_failed_ = std::fclose(file_) != 0 || has_failed_;
  file_ = nullptr;
  if (has_failed_) {
    return rt::Error{rt::ExitCode::failed, path_.string() + ": writing failed; is the disk full?"};
  }
  return {};
}

rt::Result<void> write_file(const std::filesystem::path& path, std::string_view bytes) {
  auto file = OutputFile::create(path);
  if (!file) return file.error();
  file->write(bytes);
  return file->close();
}

}  // namespace tactus::firmware
