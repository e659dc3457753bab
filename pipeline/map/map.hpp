// The labelled voxel map: a fixed pool of blocks behind a hash, one writer, any number of readers without a
// lock.
//
// Who writes what: the writer is the spine thread (its fork-join helpers write disjoint blocks on its
// behalf); it alone calls the non-const members. Readers go through map::Reader. A block has a sequence
// counter, odd while the writer changes it. The writer computes a block's new content aside (BlockStaging, in
// L1) and publishes it in one burst of relaxed 64-bit atomic stores (about 100 cycles), so that the odd
// window is short; a reader copies what it needs by relaxed 64-bit loads and validates counter and key. No
// access is a data race in the sense of the language: all concurrent accesses to a block's words are atomic,
// and the writer's own plain reads race with nobody's writes.
//
// When the pool is full: evict.hpp frees blocks that are far and long unseen, ahead of need and a bounded
// number a frame; if none qualifies, allocation is refused and counted, and everything else goes on.
#pragma once

#include <atomic>
#include <bit>
#include <cstdint>
#include <span>

#include "pipeline/label/refined_word.hpp"
#include "pipeline/map/block.hpp"
#include "pipeline/map/block_hash.hpp"
#include "pipeline/map/occupancy.hpp"
#include "rt/slice.hpp"

#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC diagnostic ignored "-Wtsan"  // fences here order atomic accesses only, see block_hash.cpp
#endif

namespace tactus::map {

struct MapConfig {
  float voxel_size_m = 0.01f;
  float truncation_m = 0.04f;
  std::uint32_t blocks_capacity = 14336;
};

/// New content of one block, computed aside and then published.
struct BlockStaging {
  alignas(64) std::int16_t tsdf[kBlockVoxels];
  alignas(64) std::uint8_t weight[kBlockVoxels];
  alignas(64) ColorCell color[kBlockCells];
};

/// One block as it was at one moment.
struct BlockCopy {
  BlockKey key = kNoKey;
  std::uint32_t label_frame = 0;
  alignas(64) std::int16_t tsdf[kBlockVoxels];
  ColorCell color[kBlockCells];
  LabelWord labels[kBlockCells];
  label::RefinedWord refined[kBlockCells];
};

struct MapCounters {
  std::uint64_t allocated = 0;  // blocks, since boot
  std::uint64_t evicted = 0;
  std::uint64_t refused = 0;        // allocations, pool full and nothing evictable
  std::uint64_t out_of_extent = 0;  // allocations, beyond the key's range
  std::uint32_t used_high_water = 0;
};

class Map {
 public:
  static std::size_t bytes_needed(const MapConfig& config);
  /// All of the map's bytes over its voxel capacity.
  static double bytes_per_voxel(const MapConfig& config);

  /// Boot.
  void bind(rt::Slice memory, const MapConfig& config);

  [[nodiscard]] const MapConfig& config() const noexcept { return config_; }
  [[nodiscard]] const MapCounters& counters() const noexcept { return counters_; }
  [[nodiscard]] std::uint32_t blocks_used() const noexcept {
    return static_cast<std::uint32_t>(hash_.entries_count());
  }
  [[nodiscard]] std::uint32_t blocks_free() const noexcept { return config_.blocks_capacity - blocks_used(); }

  // Writer only.
  [[nodiscard]] BlockIndex find(BlockKey key) const noexcept { return hash_.find(key); }
  /// The block with this key, made (unknown everywhere) if need be; kNoBlock when refused.
  BlockIndex find_or_allocate(BlockKey key) noexcept;
  void evict(BlockIndex block) noexcept;
  /// Makes the staged voxels and colours visible to readers.
  void publish(BlockIndex block, const BlockStaging& staging, bool with_color = true) noexcept;
  /// Makes new label words visible; `frame` is the keyframe's index.
  void publish_labels(BlockIndex block, std::span<const LabelWord, kBlockCells> labels,
                      std::uint32_t frame) noexcept;
  /// Makes what the CRF found visible; 0 where a cell was not refined. Pinned cells stay as they are.
  void publish_refined(BlockIndex block, std::span<const label::RefinedWord, kBlockCells> refined) noexcept;

  /// Gives the cells of a mask this word: pinned_word(), or 0 to take a pin back. Counts as labelled in
  /// `frame`, or in the frame after the last label if that is later, so that refinement looks at the block
  /// again.
  void publish_pins(BlockIndex block, std::uint64_t cells, label::RefinedWord word,
                    std::uint32_t frame) noexcept;

  [[nodiscard]] const BlockHash& hash() const noexcept { return hash_; }
  [[nodiscard]] BlockKey key(BlockIndex block) const noexcept { return headers_[block].key; }
  [[nodiscard]] const std::int16_t* tsdf(BlockIndex block) const noexcept {
    return reinterpret_cast<const std::int16_t*>(&tsdf_[block * kTsdfWords]);
  }
  [[nodiscard]] const std::uint8_t* weight(BlockIndex block) const noexcept {
    return reinterpret_cast<const std::uint8_t*>(&weight_[block * kWeightWords]);
  }
  [[nodiscard]] const ColorCell* color(BlockIndex block) const noexcept {
    return reinterpret_cast<const ColorCell*>(&color_[block * kColorWords]);
  }
  [[nodiscard]] std::span<const LabelWord, kBlockCells> labels(BlockIndex block) const noexcept {
    return std::span<const LabelWord, kBlockCells>(&label_[std::size_t{block} * kBlockCells], kBlockCells);
  }
  /// Blocks at offset (m & 1, m >> 1 & 1, m >> 2) for m in 0..7; [0] is the block itself.
  [[nodiscard]] const BlockIndex* neighbours(BlockIndex block) const noexcept {
    return &neighbours_[block * 8u];
  }
  [[nodiscard]] std::uint32_t last_seen_frame(BlockIndex block) const noexcept {
    return headers_[block].last_seen;
  }
  /// How often the block's voxels were published since it was made; stays at 255.
  [[nodiscard]] std::uint8_t updates_count(BlockIndex block) const noexcept { return updates_[block]; }
  void set_last_seen_frame(BlockIndex block, std::uint32_t frame) noexcept {
    headers_[block].last_seen = frame;
  }

  // Any thread, lock-free: the reader's primitives (reader.cpp).
  [[nodiscard]] BlockIndex find_concurrent(BlockKey key) const noexcept {
    return occupancy_.may_hold(key) ? hash_.find_concurrent(key) : kNoBlock;
  }
  /// False: nothing is mapped in the cube of blocks that this one lies in (Occupancy::kCubeSideBlocks).
  [[nodiscard]] bool may_hold_cube(const BlockCoord& block) const noexcept {
    return occupancy_.may_hold_cube(block);
  }
  /// Asks the cache for what a cell holds besides its voxels.
  void prefetch_cell(BlockIndex block, int cell) const noexcept {
    const auto c = static_cast<std::size_t>(cell);
    __builtin_prefetch(&label_[std::size_t{block} * kBlockCells + c]);
    __builtin_prefetch(&color_[block * kColorWords + c / 2]);
    __builtin_prefetch(&refined_low_[block * kRefinedLowWords + c / 8]);
    __builtin_prefetch(&refined_high_[block * kRefinedHighWords + c / 4]);
  }
  /// Even and unchanged around a read that also saw key(block) == the key asked for: the read is good.
  [[nodiscard]] std::uint32_t sequence_begin(BlockIndex block) const noexcept {
    // Pairs with the release store of write_end(): who sees the even counter sees all words of that state.
    return std::atomic_ref(const_cast<std::uint32_t&>(headers_[block].sequence))
        .load(std::memory_order_acquire);
  }
  [[nodiscard]] bool sequence_validate(BlockIndex block, std::uint32_t begun) const noexcept {
    // The words read before may not be read after the counter. Pairs with the release fence of write_begin():
    // who saw any new word sees the odd counter.
    std::atomic_thread_fence(std::memory_order_acquire);
    return (begun & 1u) == 0 && std::atomic_ref(const_cast<std::uint32_t&>(headers_[block].sequence))
                                        .load(std::memory_order_relaxed) == begun;
  }
  [[nodiscard]] BlockKey key_concurrent(BlockIndex block) const noexcept {
    return std::atomic_ref(const_cast<BlockKey&>(headers_[block].key)).load(std::memory_order_relaxed);
  }
  [[nodiscard]] std::int16_t tsdf_concurrent(BlockIndex block, int voxel) const noexcept {
    const auto v = static_cast<std::size_t>(voxel);
    const std::uint64_t word = load_word(tsdf_, block * kTsdfWords + v / 4);
    return static_cast<std::int16_t>(word >> (16 * (v % 4)));
  }
  [[nodiscard]] std::uint8_t weight_concurrent(BlockIndex block, int voxel) const noexcept;
  [[nodiscard]] ColorCell color_concurrent(BlockIndex block, int cell) const noexcept {
    const auto c = static_cast<std::size_t>(cell);
    return std::bit_cast<ColorCell>(
        static_cast<std::uint32_t>(load_word(color_, block * kColorWords + c / 2) >> (32 * (c % 2))));
  }
  [[nodiscard]] LabelWord label_concurrent(BlockIndex block, int cell) const noexcept {
    return load_word(label_, std::size_t{block} * kBlockCells + static_cast<std::size_t>(cell));
  }
  [[nodiscard]] label::RefinedWord refined_concurrent(BlockIndex block, int cell) const noexcept {
    const auto c = static_cast<std::size_t>(cell);
    const std::uint64_t low = load_word(refined_low_, block * kRefinedLowWords + c / 8) >> (8 * (c % 8));
    const std::uint64_t high = load_word(refined_high_, block * kRefinedHighWords + c / 4) >> (16 * (c % 4));
    return static_cast<label::RefinedWord>((low & 0xFFU) | (high & 0xFFFFU) << 8);
  }
  [[nodiscard]] std::uint32_t label_frame_concurrent(BlockIndex block) const noexcept {
    return std::atomic_ref(const_cast<std::uint32_t&>(headers_[block].label_frame))
        .load(std::memory_order_relaxed);
  }
  /// The whole block; false when it is not live or the writer changed it at every try. About 0.3 us.
  [[nodiscard]] bool copy_concurrent(BlockIndex block, BlockCopy& out) const noexcept;
  [[nodiscard]] std::uint32_t frame_concurrent() const noexcept {
    return frame_.load(std::memory_order_relaxed);
  }
  void set_frame(std::uint32_t frame) noexcept { frame_.store(frame, std::memory_order_relaxed); }

  /// FNV-1a over the live blocks in key order, geometry (tsdf, weight, colour) and labels apart. Boot or
  /// exit: it sorts.
  struct Hash {
    std::uint64_t geometry = 0, labels = 0;
  };
  [[nodiscard]] Hash hash_content() const;

 private:
  static constexpr std::size_t kTsdfWords = kBlockVoxels * sizeof(std::int16_t) / 8;
  static constexpr std::size_t kWeightWords = kBlockVoxels / 8;
  static constexpr std::size_t kColorWords = kBlockCells * sizeof(ColorCell) / 8;
  static constexpr std::size_t kRefinedLowWords = kBlockCells / 8;   // bits 0-7 of each cell's word
  static constexpr std::size_t kRefinedHighWords = kBlockCells / 4;  // bits 8-23

  static std::uint64_t load_word(std::span<const std::uint64_t> words, std::size_t i) noexcept {
    return std::atomic_ref(const_cast<std::uint64_t&>(words[i])).load(std::memory_order_relaxed);
  }
  void store_refined(BlockIndex block, std::span<const label::RefinedWord, kBlockCells> refined) noexcept;
  void write_begin(BlockIndex block) noexcept;
  void write_end(BlockIndex block) noexcept;

  MapConfig config_;
  MapCounters counters_;
  BlockHash hash_;
  Occupancy occupancy_;
  std::span<std::uint64_t> tsdf_, weight_, color_, refined_low_, refined_high_;
  std::span<LabelWord> label_;
  // What a reader of a block looks at first: one line of the cache holds four.
  struct alignas(16) Header {
    BlockKey key = kNoKey;
    std::uint32_t sequence = 0, label_frame = 0, last_seen = 0;
  };
  std::span<Header> headers_;
  std::span<std::uint8_t> updates_;
  std::span<BlockIndex> neighbours_;
  std::span<BlockIndex> free_;  // stack of free blocks
  std::size_t free_count_ = 0;
  std::atomic<std::uint32_t> frame_{0};
};

}  // namespace tactus::map
