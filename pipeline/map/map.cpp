#include "pipeline/map/map.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <vector>

namespace tactus::map {
namespace {

constexpr std::size_t kRefinedBytes = 3;  // of a cell: 24 bits
constexpr std::size_t kBlockBytes = kBlockVoxels * (sizeof(std::int16_t) + sizeof(std::uint8_t)) +
                                    kBlockCells * (sizeof(ColorCell) + sizeof(LabelWord) + kRefinedBytes);
constexpr std::size_t kHeaderBytes =
    sizeof(BlockKey) + 3 * sizeof(std::uint32_t) + 8 * sizeof(BlockIndex) + sizeof(std::uint8_t);
constexpr std::size_t kListBytes =
    3 * sizeof(BlockIndex);  // free list here, active and previous list in integrate
constexpr std::size_t kHashBytesAtHalfLoad = 2 * sizeof(std::uint64_t);
static_assert(kBlockBytes + kHeaderBytes + kListBytes + kHashBytesAtHalfLoad <= 5 * kBlockVoxels);

// A block is changed once a frame, for a tenth of a microsecond: a second try nearly always succeeds.
constexpr int kCopyTries = 4;

void store_words(std::uint64_t* to, const void* from, std::size_t words_count) {
  for (std::size_t i = 0; i < words_count; ++i) {
    std::uint64_t word;
    std::memcpy(&word, static_cast<const std::byte*>(from) + i * 8, 8);
    std::atomic_ref(to[i]).store(word, std::memory_order_relaxed);
  }
}

void load_words(const std::uint64_t* from, void* to, std::size_t words_count) {
  for (std::size_t i = 0; i < words_count; ++i) {
    const std::uint64_t word =
        std::atomic_ref(const_cast<std::uint64_t&>(from[i])).load(std::memory_order_relaxed);
    std::memcpy(static_cast<std::byte*>(to) + i * 8, &word, 8);
  }
}

void fill_words(std::uint64_t* to, std::uint64_t word, std::size_t words_count) {
  for (std::size_t i = 0; i < words_count; ++i) std::atomic_ref(to[i]).store(word, std::memory_order_relaxed);
}

constexpr BlockCoord offset(const BlockCoord& c, unsigned m, int sign) {
  return {c.x + sign * static_cast<int>(m & 1u), c.y + sign * static_cast<int>(m >> 1 & 1u),
          c.z + sign * static_cast<int>(m >> 2)};
}

std::uint64_t fnv1a(std::uint64_t hash, const void* bytes, std::size_t count) {
  const auto* p = static_cast<const unsigned char*>(bytes);
  for (std::size_t i = 0; i < count; ++i) hash = (hash ^ p[i]) * 1099511628211ull;
  return hash;
}

}  // namespace

std::size_t Map::bytes_needed(const MapConfig& config) {
  const std::size_t n = config.blocks_capacity;
  return rt::bytes_of<std::uint64_t>(n * kTsdfWords) + rt::bytes_of<std::uint64_t>(n * kWeightWords) +
         rt::bytes_of<std::uint64_t>(n * kColorWords) + rt::bytes_of<LabelWord>(n * kBlockCells) +
         rt::bytes_of<std::uint64_t>(n * kRefinedLowWords) +
         rt::bytes_of<std::uint64_t>(n * kRefinedHighWords) + rt::bytes_of<Header>(n) +
         rt::bytes_of<BlockIndex>(n * 8) + rt::bytes_of<BlockIndex>(n) + rt::bytes_of<std::uint8_t>(n) +
         BlockHash::bytes_needed(n) + Occupancy::bytes_needed(n);
}

double Map::bytes_per_voxel(const MapConfig& config) {
  return static_cast<double>(bytes_needed(config)) / static_cast<double>(config.blocks_capacity) /
         kBlockVoxels;
}

void Map::bind(rt::Slice memory, const MapConfig& config) {
  TACTUS_ASSERT(config.blocks_capacity > 0 && config.blocks_capacity <= kBlocksCapacityMax);
  config_ = config;
  const std::size_t n = config.blocks_capacity;
  tsdf_ = memory.take<std::uint64_t>(n * kTsdfWords);
  weight_ = memory.take<std::uint64_t>(n * kWeightWords);
  color_ = memory.take<std::uint64_t>(n * kColorWords);
  label_ = memory.take<LabelWord>(n * kBlockCells);
  refined_low_ = memory.take<std::uint64_t>(n * kRefinedLowWords);
  refined_high_ = memory.take<std::uint64_t>(n * kRefinedHighWords);
  headers_ = memory.take<Header>(n);
  updates_ = memory.take<std::uint8_t>(n);
  neighbours_ = memory.take<BlockIndex>(n * 8);
  free_ = memory.take<BlockIndex>(n);
  hash_.bind(memory, n);
  occupancy_.bind(memory, n);
  std::fill(neighbours_.begin(), neighbours_.end(), kNoBlock);
  // Lowest index on top: a fresh map fills the pool in visit order, so that neighbours in space lie near in
  // memory.
  for (std::size_t i = 0; i < n; ++i) free_[i] = static_cast<BlockIndex>(n - 1 - i);
  free_count_ = n;
}

void Map::write_begin(BlockIndex block) noexcept {
  std::atomic_ref sequence(headers_[block].sequence);
  sequence.store(headers_[block].sequence + 1, std::memory_order_relaxed);
  // Pairs with the acquire fence of sequence_validate(): a reader that saw any new word sees the odd counter.
  std::atomic_thread_fence(std::memory_order_release);
}

void Map::write_end(BlockIndex block) noexcept {
  // Pairs with the acquire load of sequence_begin(): a reader that sees the even counter sees all words.
  std::atomic_ref(headers_[block].sequence).store(headers_[block].sequence + 1, std::memory_order_release);
}

BlockIndex Map::find_or_allocate(BlockKey key) noexcept {
  if (key == kNoKey) {
    ++counters_.out_of_extent;
    return kNoBlock;
  }
  if (const BlockIndex found = hash_.find(key); found != kNoBlock) return found;
  if (free_count_ == 0) {
    ++counters_.refused;
    return kNoBlock;
  }
  const BlockIndex block = free_[--free_count_];
  constexpr std::uint64_t kFourUnknown = 0x8000'8000'8000'8000ull;
  write_begin(block);
  fill_words(&tsdf_[block * kTsdfWords], kFourUnknown, kTsdfWords);
  fill_words(&weight_[block * kWeightWords], 0, kWeightWords);
  fill_words(&color_[block * kColorWords], 0, kColorWords);
  fill_words(&label_[std::size_t{block} * kBlockCells], 0, kBlockCells);
  fill_words(&refined_low_[block * kRefinedLowWords], 0, kRefinedLowWords);
  fill_words(&refined_high_[block * kRefinedHighWords], 0, kRefinedHighWords);
  std::atomic_ref(headers_[block].label_frame).store(0, std::memory_order_relaxed);
  std::atomic_ref(headers_[block].key).store(key, std::memory_order_relaxed);
  write_end(block);
  updates_[block] = 0;
  const BlockCoord c = coord_of(key);
  BlockIndex* own = &neighbours_[block * 8u];
  own[0] = block;
  for (unsigned m = 1; m < 8; ++m) {
    own[m] = hash_.find(key_of(offset(c, m, +1)));
    if (const BlockIndex lower = hash_.find(key_of(offset(c, m, -1))); lower != kNoBlock)
      neighbours_[lower * 8u + m] = block;
  }
  occupancy_.add(c);
  hash_.insert(key, block);
  ++counters_.allocated;
  counters_.used_high_water = std::max(counters_.used_high_water, blocks_used());
  return block;
}

void Map::evict(BlockIndex block) noexcept {
  const BlockKey key = headers_[block].key;
  TACTUS_ASSERT(key != kNoKey);
  hash_.erase(key);
  write_begin(block);
  std::atomic_ref(headers_[block].key).store(kNoKey, std::memory_order_relaxed);
  write_end(block);
  const BlockCoord c = coord_of(key);
  occupancy_.remove(c);
  for (unsigned m = 1; m < 8; ++m)
    if (const BlockIndex lower = hash_.find(key_of(offset(c, m, -1))); lower != kNoBlock)
      neighbours_[lower * 8u + m] = kNoBlock;
  std::fill_n(&neighbours_[block * 8u], 8, kNoBlock);
  free_[free_count_++] = block;
  ++counters_.evicted;
}

void Map::publish(BlockIndex block, const BlockStaging& staging, bool with_color) noexcept {
  write_begin(block);
  store_words(&tsdf_[block * kTsdfWords], staging.tsdf, kTsdfWords);
  store_words(&weight_[block * kWeightWords], staging.weight, kWeightWords);
  if (with_color) store_words(&color_[block * kColorWords], staging.color, kColorWords);
  write_end(block);
  if (updates_[block] < 255) ++updates_[block];
}

void Map::publish_labels(BlockIndex block, std::span<const LabelWord, kBlockCells> labels,
                         std::uint32_t frame) noexcept {
  write_begin(block);
  store_words(&label_[std::size_t{block} * kBlockCells], labels.data(), kBlockCells);
  std::atomic_ref(headers_[block].label_frame).store(frame, std::memory_order_relaxed);
  write_end(block);
}

void Map::store_refined(BlockIndex block, std::span<const label::RefinedWord, kBlockCells> refined) noexcept {
  std::uint8_t low[kBlockCells];
  std::uint16_t high[kBlockCells];
  for (std::size_t c = 0; c < kBlockCells; ++c) {
    low[c] = static_cast<std::uint8_t>(refined[c]);
    high[c] = static_cast<std::uint16_t>(refined[c] >> 8);
  }
  store_words(&refined_low_[block * kRefinedLowWords], low, kRefinedLowWords);
  store_words(&refined_high_[block * kRefinedHighWords], high, kRefinedHighWords);
}

void Map::publish_refined(BlockIndex block,
                          std::span<const label::RefinedWord, kBlockCells> refined) noexcept {
  std::array<label::RefinedWord, kBlockCells> words;
  for (int c = 0; c < kBlockCells; ++c) {
    const auto cell = static_cast<std::size_t>(c);
    const label::RefinedWord now = refined_concurrent(block, c);
    words[cell] = label::is_pinned(now) ? now : refined[cell];
  }
  write_begin(block);
  store_refined(block, words);
  write_end(block);
}

void Map::publish_pins(BlockIndex block, std::uint64_t cells, label::RefinedWord word,
                       std::uint32_t frame) noexcept {
  std::array<label::RefinedWord, kBlockCells> words;
  for (int c = 0; c < kBlockCells; ++c)
    words[static_cast<std::size_t>(c)] = (cells >> c & 1U) != 0 ? word : refined_concurrent(block, c);
  write_begin(block);
  store_refined(block, words);
  std::atomic_ref(headers_[block].label_frame)
      .store(std::max(frame, headers_[block].label_frame + 1), std::memory_order_relaxed);
  write_end(block);
}

std::uint8_t Map::weight_concurrent(BlockIndex block, int voxel) const noexcept {
  const auto v = static_cast<std::size_t>(voxel);
  return static_cast<std::uint8_t>(load_word(weight_, block * kWeightWords + v / 8) >> (8 * (v % 8)));
}

bool Map::copy_concurrent(BlockIndex block, BlockCopy& out) const noexcept {
  for (int attempt = 0; attempt < kCopyTries; ++attempt) {
    const std::uint32_t begun = sequence_begin(block);
    out.key = key_concurrent(block);
    if (out.key == kNoKey) return false;
    out.label_frame = label_frame_concurrent(block);
    load_words(&tsdf_[block * kTsdfWords], out.tsdf, kTsdfWords);
    load_words(&color_[block * kColorWords], out.color, kColorWords);
    load_words(&label_[std::size_t{block} * kBlockCells], out.labels, kBlockCells);
    for (int c = 0; c < kBlockCells; ++c) out.refined[c] = refined_concurrent(block, c);
    if (sequence_validate(block, begun)) return true;
  }
  return false;
}

Map::Hash Map::hash_content() const {
  std::vector<BlockKey> live;
  for (const Header& header : headers_)
    if (header.key != kNoKey) live.push_back(header.key);
  std::sort(live.begin(), live.end());
  Hash hash{14695981039346656037ull, 14695981039346656037ull};
  for (BlockKey k : live) {
    const BlockIndex b = hash_.find(k);
    hash.geometry = fnv1a(hash.geometry, &k, sizeof k);
    hash.geometry = fnv1a(hash.geometry, tsdf(b), kTsdfWords * 8);
    hash.geometry = fnv1a(hash.geometry, weight(b), kWeightWords * 8);
    hash.geometry = fnv1a(hash.geometry, color(b), kColorWords * 8);
    hash.labels = fnv1a(hash.labels, &k, sizeof k);
    hash.labels = fnv1a(hash.labels, labels(b).data(), kBlockCells * sizeof(LabelWord));
    hash.labels = fnv1a(hash.labels, &refined_low_[b * kRefinedLowWords], kRefinedLowWords * 8);
    hash.labels = fnv1a(hash.labels, &refined_high_[b * kRefinedHighWords], kRefinedHighWords * 8);
  }
  return hash;
}

}  // namespace tactus::map
