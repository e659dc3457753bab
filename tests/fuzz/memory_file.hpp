// A file that lives in memory, for fuzzing readers that want a path; its content is replaced for each input.
#pragma once

#include <sys/mman.h>
#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <string>

#include "rt/assert.hpp"

namespace tactus::test {

class MemoryFile {
 public:
  MemoryFile() : descriptor_(memfd_create("fuzz", 0)), path_("/proc/self/fd/" + std::to_string(descriptor_)) {
    TACTUS_ASSERT(descriptor_ >= 0);
  }
  ~MemoryFile() { close(descriptor_); }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;

  const std::string& holding(const std::uint8_t* data, std::size_t bytes) {
    TACTUS_ASSERT(ftruncate(descriptor_, 0) == 0);
    TACTUS_ASSERT(pwrite(descriptor_, data, bytes, 0) == static_cast<ssize_t>(bytes));
    return path_;
  }

 private:
  int descriptor_;
  std::string path_;
};

}  // namespace tactus::test
