// The one piece of memory the program runs in: reserved at boot, touched, locked, carved in order, sealed.
#pragma once

#include <cstddef>
#include <string>

#include "rt/slice.hpp"
#include "rt/status.hpp"

namespace tactus::rt {

/// Boot only, one thread. After seal() there is no way to get memory from it: carve() asserts.
class Arena {
 public:
  /// Maps `bytes` (rounded up to pages, zeroed), touches every page so that no step ever faults one in, and
  /// asks the system to keep them in memory. A refusal to lock is no failure: lock_refusal() says it in one
  /// sentence.
  static Result<Arena> reserve(std::size_t bytes);

  Arena(Arena&& other) noexcept;
  Arena& operator=(Arena&& other) noexcept;
  ~Arena();

  /// The next `bytes` of the arena. `alignment`: a power of two up to a page; never less than a cache line.
  Slice carve(std::size_t bytes, std::size_t alignment = kCacheLineBytes);
  void seal() { is_sealed_ = true; }

  [[nodiscard]] bool is_sealed() const { return is_sealed_; }
  [[nodiscard]] std::size_t bytes_reserved() const { return memory_.size(); }
  /// Carved so far, padding included. Nothing is ever given back, so this is the high-water mark.
  [[nodiscard]] std::size_t bytes_high_water() const { return bytes_used_; }
  [[nodiscard]] bool is_locked() const { return lock_refusal_.empty(); }
  /// Empty when the pages are locked, else why not and what to do.
  [[nodiscard]] const std::string& lock_refusal() const { return lock_refusal_; }

 private:
  explicit Arena(std::span<std::byte> memory) : memory_(memory) {}
  void release() noexcept;

  std::span<std::byte> memory_;
  std::size_t bytes_used_ = 0;
  bool is_sealed_ = false;
  std::string lock_refusal_;
};

}  // namespace tactus::rt
