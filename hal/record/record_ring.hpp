// Records of different sizes from one thread to one other, through memory taken at boot.
//
// rt::SpscRing hands over items of one type; frames differ in size by a factor of ten (a JPEG, a 16-bit image), so here
// the memory itself is the ring: the producer writes a record where it will be read, and no slot is as large as the
// largest frame. Each record starts with its size; one that does not fit between the last and the end of the memory
// starts anew at its beginning, behind a mark that says so.
//
//        head_ (consumer writes)          tail_ (producer writes)
//          v                                v
//   [......][size|record][size|record][size][skip....]
//
// Positions only grow, as in rt::SpscRing, and change hands the same way: the release of a position pairs with the
// acquire of it on the other side.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace tactus::hal::record {

/// One producer, one consumer. Wait-free, no heap after it is made.
class RecordRing {
 public:
  /// Room for `bytes` in all, 16 bytes per record included. Boot.
  explicit RecordRing(std::size_t bytes);

  /// Where a record of so many bytes is to be written, aligned to 8; empty when there is no room now. Producer.
  [[nodiscard]] std::span<std::uint8_t> reserve(std::size_t bytes) noexcept;
  /// Hands over what the last reserve() gave. Producer.
  void commit() noexcept;

  /// The oldest record, until pop(); empty when there is none. Consumer.
  [[nodiscard]] std::span<const std::uint8_t> front() noexcept;
  void pop() noexcept;

  /// Larger ones may never find room.
  [[nodiscard]] std::size_t record_bytes_max() const { return memory_.size() * sizeof(std::uint64_t) / 2 - 8; }
  [[nodiscard]] std::size_t memory_bytes() const { return memory_.size() * sizeof(std::uint64_t); }

 private:
  std::vector<std::uint64_t> memory_;  // words of 8 bytes; positions count them
  // One cache line per writing side, so that they do not slow each other down.
  alignas(64) std::atomic<std::uint64_t> tail_{0};
  std::uint64_t next_tail_ = 0;  // behind what is reserved
  alignas(64) std::atomic<std::uint64_t> head_{0};
  std::uint64_t next_head_ = 0;  // behind what front() gave
};

}  // namespace tactus::hal::record
