// Where the map has nothing, in few bits that stay in the cache: rays cross a room mostly through empty
// space.
//
// Two bit sets by hashed key, one for blocks and one for cubes of 4x4x4 of them. A clear bit is certain:
// nothing is there. A set bit says "perhaps", and the block hash knows. The writer counts behind every bit,
// so that eviction clears it again; a count that is full stays, and costs readers time only. One writer, any
// number of readers without a lock: the bit of a live block is set throughout its life.
#pragma once

#include <atomic>
#include <bit>
#include <cstdint>
#include <span>

#include "pipeline/map/block.hpp"
#include "rt/slice.hpp"

namespace tactus::map {

class Occupancy {
 public:
  static constexpr int kCubeSideBlocks = 4;

  static constexpr std::size_t bytes_needed(std::size_t blocks_capacity) {
    return Level::bytes_needed(block_bits(blocks_capacity)) + Level::bytes_needed(cube_bits(blocks_capacity));
  }
  /// Boot.
  void bind(rt::Slice& memory, std::size_t blocks_capacity) {
    blocks_.bind(memory, block_bits(blocks_capacity));
    cubes_.bind(memory, cube_bits(blocks_capacity));
  }

  /// Writer only; once for each block that is made, and evicted.
  void add(const BlockCoord& block) noexcept {
    blocks_.add(key_of(block));
    cubes_.add(cube_key(block));
  }
  void remove(const BlockCoord& block) noexcept {
    blocks_.remove(key_of(block));
    cubes_.remove(cube_key(block));
  }

  /// Any thread, wait-free.
  [[nodiscard]] bool may_hold(BlockKey key) const noexcept { return blocks_.may_hold(key); }
  /// The cube that the block lies in.
  [[nodiscard]] bool may_hold_cube(const BlockCoord& block) const noexcept {
    return cubes_.may_hold(cube_key(block));
  }

 private:
  class Level {
   public:
    static constexpr std::size_t bytes_needed(std::size_t bits_count) {
      return rt::bytes_of<std::uint64_t>(bits_count / 64) + rt::bytes_of<std::uint8_t>(bits_count);
    }
    void bind(rt::Slice& memory, std::size_t bits_count) {
      words_ = memory.take<std::uint64_t>(bits_count / 64);
      count_ = memory.take<std::uint8_t>(bits_count);
      shift_ = 32 - std::countr_zero(bits_count);
    }
    void add(std::uint32_t key) noexcept {
      const std::uint32_t bit = place(key);
      if (count_[bit] == 0) store(bit, words_[bit / 64] | 1ULL << (bit % 64));
      if (count_[bit] < kCountMax) ++count_[bit];
    }
    void remove(std::uint32_t key) noexcept {
      const std::uint32_t bit = place(key);
      if (count_[bit] == kCountMax) return;
      if (--count_[bit] == 0) store(bit, words_[bit / 64] & ~(1ULL << (bit % 64)));
    }
    [[nodiscard]] bool may_hold(std::uint32_t key) const noexcept {
      const std::uint32_t bit = place(key);
      // Relaxed: a reader that sees the bit late answers as it would have a moment ago.
      const std::uint64_t word =
          std::atomic_ref(const_cast<std::uint64_t&>(words_[bit / 64])).load(std::memory_order_relaxed);
      return (word >> (bit % 64) & 1U) != 0;
    }

   private:
    static constexpr std::uint8_t kCountMax = 255;
    [[nodiscard]] std::uint32_t place(std::uint32_t key) const noexcept {
      return (key * 2654435769U) >> shift_;
    }
    void store(std::uint32_t bit, std::uint64_t word) noexcept {
      std::atomic_ref(words_[bit / 64]).store(word, std::memory_order_relaxed);
    }
    std::span<std::uint64_t> words_;
    std::span<std::uint8_t> count_;
    int shift_ = 0;
  };

  // Two to four bits a block: of a full pool's empty blocks at most 40 % look occupied, and five bytes a
  // voxel still pay for it. A cube that a surface passes holds ten blocks and more.
  static constexpr std::size_t block_bits(std::size_t blocks_capacity) {
    return std::bit_ceil(64 + 2 * blocks_capacity);
  }
  static constexpr std::size_t cube_bits(std::size_t blocks_capacity) {
    return std::bit_ceil(64 + blocks_capacity / 4);
  }
  static constexpr std::uint32_t cube_key(const BlockCoord& block) {
    return key_of({block.x >> 2, block.y >> 2, block.z >> 2});
  }

  Level blocks_, cubes_;
};

}  // namespace tactus::map
