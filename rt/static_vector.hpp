// A vector whose capacity is part of its type: no heap, and full is an answer.
#pragma once

#include <array>
#include <cstddef>
#include <initializer_list>
#include <span>

#include "rt/assert.hpp"

namespace tactus::rt {

/// Up to kCapacity values of T in place. All kCapacity values exist all the time (so that the type is
/// constexpr and trivially copyable when T is): keep large ones as members, not as locals of a step. Any
/// phase; one thread.
template <typename T, std::size_t kCapacity>
class StaticVector {
 public:
  using value_type = T;

  constexpr StaticVector() = default;
  constexpr StaticVector(std::initializer_list<T> values) {
    for (const T& value : values) push_back(value);
  }

  /// False, and unchanged, when full.
  [[nodiscard]] constexpr bool try_push_back(const T& value) {
    if (size_ == kCapacity) return false;
    items_[size_++] = value;
    return true;
  }
  /// For a caller who proved that there is room.
  constexpr T& push_back(const T& value) {
    TACTUS_ASSERT(size_ < kCapacity);
    items_[size_] = value;
    return items_[size_++];
  }
  constexpr void pop_back() {
    TACTUS_ASSERT(size_ > 0);
    items_[--size_] = T();
  }
  /// Constant time: the last one takes the place of the removed one.
  constexpr void erase_unordered(std::size_t index) {
    TACTUS_ASSERT(index < size_);
    items_[index] = items_[size_ - 1];
    pop_back();
  }
  /// Grows with T(), never past the capacity.
  constexpr void resize(std::size_t count) {
    TACTUS_ASSERT(count <= kCapacity);
    while (size_ > count) pop_back();
    size_ = count;
  }
  constexpr void clear() { resize(0); }

  [[nodiscard]] constexpr std::size_t size() const { return size_; }
  [[nodiscard]] static constexpr std::size_t capacity() { return kCapacity; }
  [[nodiscard]] constexpr bool empty() const { return size_ == 0; }
  [[nodiscard]] constexpr bool full() const { return size_ == kCapacity; }

  constexpr T& operator[](std::size_t index) {
    TACTUS_ASSERT(index < size_);
    return items_[index];
  }
  constexpr const T& operator[](std::size_t index) const {
    TACTUS_ASSERT(index < size_);
    return items_[index];
  }
  constexpr T& back() { return (*this)[size_ - 1]; }
  constexpr const T& back() const { return (*this)[size_ - 1]; }

  constexpr T* data() { return items_.data(); }
  constexpr const T* data() const { return items_.data(); }
  constexpr T* begin() { return items_.data(); }
  constexpr const T* begin() const { return items_.data(); }
  constexpr T* end() { return items_.data() + size_; }
  constexpr const T* end() const { return items_.data() + size_; }
  [[nodiscard]] constexpr std::span<T> span() { return {items_.data(), size_}; }
  [[nodiscard]] constexpr std::span<const T> span() const { return {items_.data(), size_}; }

 private:
  std::array<T, kCapacity> items_{};
  std::size_t size_ = 0;
};

}  // namespace tactus::rt
