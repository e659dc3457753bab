// A file being written: every failure of the disk is seen, once, at close.
#pragma once

#include <cstdarg>
#include <cstdio>
#include <filesystem>
#include <string>
#include <string_view>

#include "rt/status.hpp"

namespace tactus::firmware {

/// Buffered, one thread. Nothing is reported before close(); a file that is never closed is closed silently.
class OutputFile {
 public:
  /// failed when the file cannot be created.
  static rt::Result<OutputFile> create(const std::filesystem::path& path);

  OutputFile(OutputFile&& other) noexcept;
  OutputFile& operator=(OutputFile&&) = delete;
  ~OutputFile();

  void write(std::string_view bytes);
  void write(const void* data, std::size_t bytes_count) {
    write({static_cast<const char*>(data), bytes_count});
  }
  __attribute__((format(printf, 2, 3))) void print(const char* format, ...);
  /// Moves to an absolute offset, to fill in what was not known before.
  void seek(long offset);
  [[nodiscard]] long tell();

  /// Flushes and closes; failed when any write or the close went wrong (disk full).
  rt::Result<void> close();

 private:
  OutputFile(std::FILE* file, std::filesystem::path path) : file_(file), path_(std::move(path)) {}
  std::FILE* file_;
  std::filesystem::path path_;
  bool has_failed_ = false;
};

/// Creates, writes and closes in one go.
rt::Result<void> write_file(const std::filesystem::path& path, std::string_view bytes);

}  // namespace tactus::firmware
