// A line that says how far a long work has come; on a terminal only.
#pragma once

#include <cstdint>
#include <cstdio>
#include <string>

#include "rt/clock.hpp"

namespace tactus::firmware {

/// Writes to `stream` when that is a terminal, and nothing at all otherwise (piped output stays clean). The
/// line is rewritten at most 10 times a second and erased at the end. One thread.
class Progress {
 public:
  /// `total` 0: unknown, then only the count is shown.
  Progress(std::string what, std::uint64_t total, rt::Clock clock, std::FILE* stream = stderr);
  Progress(std::string what, std::uint64_t total, rt::Clock clock, std::FILE* stream, bool is_terminal);
  ~Progress() { finish(); }
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  void update(std::uint64_t done);
  /// Erases the line; called by the destructor too.
  void finish();

 private:
  std::string what_;
  std::uint64_t total_;
  rt::Clock clock_;
  std::FILE* stream_;
  bool is_terminal_;
  bool is_shown_ = false;
  rt::HostTime start_, next_;
};

}  // namespace tactus::firmware
