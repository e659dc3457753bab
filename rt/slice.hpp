// A component's share of the arena, cut front to back at bind time.
#pragma once

#include <cstddef>
#include <cstdint>
#include <new>
#include <span>
#include <type_traits>

#include "rt/assert.hpp"

namespace tactus::rt {

inline constexpr std::size_t kCacheLineBytes = 64;

constexpr std::size_t round_up(std::size_t bytes, std::size_t alignment) {
  return (bytes + alignment - 1) / alignment * alignment;
}

/// Bytes that Slice::take<T>(count) uses: every array starts on a cache line.
template <typename T>
constexpr std::size_t bytes_of(std::size_t count) {
  return round_up(sizeof(T) * count, kCacheLineBytes);
}

/// A contiguous piece of planned memory. The owner of the piece cuts its arrays from it once, at boot; what
/// is cut is value-initialised and lives as long as the arena. Not thread-safe; boot only.
class Slice {
 public:
  Slice() = default;
  explicit Slice(std::span<std::byte> memory) : memory_(memory) {
    TACTUS_ASSERT(reinterpret_cast<std::uintptr_t>(memory.data()) % kCacheLineBytes == 0);
  }

  template <typename T>
  std::span<T> take(std::size_t count) {
    static_assert(alignof(T) <= kCacheLineBytes);
    static_assert(std::is_trivially_destructible_v<T>, "planned memory is never destroyed piece by piece");
    const std::size_t bytes = bytes_of<T>(count);
    TACTUS_ASSERT(bytes <= memory_.size());
    T* first = reinterpret_cast<T*>(memory_.data());
    for (std::size_t i = 0; i < count; ++i) new (first + i) T();
    memory_ = memory_.subspan(bytes);
    return {first, count};
  }

  [[nodiscard]] std::size_t bytes_left() const { return memory_.size(); }

 private:
  std::span<std::byte> memory_;
};

}  // namespace tactus::rt
