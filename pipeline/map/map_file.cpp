#include "pipeline/map/map_file.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <vector>

#include "pipeline/label/label_cell.hpp"

namespace tactus::map {
namespace {

static_assert(std::endian::native == std::endian::little);

constexpr std::array<char, 8> kMagic = {'t', 'a', 'c', 't', 'u', 's', 'M', 'P'};
constexpr std::uint32_t kVersion = 1;

#pragma pack(push, 1)
struct Header {
  std::array<char, 8> magic = kMagic;
  std::uint32_t version = kVersion;
  float voxel_size_m = 0, truncation_m = 0;
  std::uint32_t blocks_count = 0, frame = 0, zero = 0;
  std::uint64_t geometry_hash = 0, labels_hash = 0;
};
struct Record {
  BlockKey key = kNoKey;
  std::uint32_t label_frame = 0;
  std::array<std::int16_t, kBlockVoxels> tsdf;
  std::array<std::uint8_t, kBlockVoxels> weight;
  std::array<ColorCell, kBlockCells> color;
  std::array<LabelWord, kBlockCells> labels;
  std::array<std::array<std::uint8_t, 3>, kBlockCells> refined;
};
#pragma pack(pop)
static_assert(sizeof(Header) == 48 && sizeof(Record) == 2504);

rt::Error damaged(const std::string& name, const std::string& what) {
  return {rt::ExitCode::bad_input,
          name + ": " + what + "; make it again with `tactus run SOURCE --out DIR`."};
}

}  // namespace

std::string encode_map(const Map& map) {
  std::vector<BlockIndex> blocks;
  for (std::uint32_t b = 0; b < map.config().blocks_capacity; ++b)
    if (map.key(static_cast<BlockIndex>(b)) != kNoKey) blocks.push_back(static_cast<BlockIndex>(b));
  std::sort(blocks.begin(), blocks.end(),
            [&](BlockIndex a, BlockIndex b) { return map.key(a) < map.key(b); });
  const Map::Hash hash = map.hash_content();
  Header header;
  header.voxel_size_m = map.config().voxel_size_m;
  header.truncation_m = map.config().truncation_m;
  header.blocks_count = static_cast<std::uint32_t>(blocks.size());
  header.frame = map.frame_concurrent();
  header.geometry_hash = hash.geometry;
  header.labels_hash = hash.labels;
  std::string bytes(sizeof header + blocks.size() * sizeof(Record), '\0');
  std::memcpy(bytes.data(), &header, sizeof header);
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    const BlockIndex block = blocks[i];
    Record record;
    record.key = map.key(block);
    record.label_frame = map.label_frame_concurrent(block);
    std::copy_n(map.tsdf(block), kBlockVoxels, record.tsdf.begin());
    std::copy_n(map.weight(block), kBlockVoxels, record.weight.begin());
    std::copy_n(map.color(block), kBlockCells, record.color.begin());
    std::copy_n(map.labels(block).begin(), kBlockCells, record.labels.begin());
    for (int c = 0; c < kBlockCells; ++c) {
      const label::RefinedWord word = map.refined_concurrent(block, c);
      record.refined[static_cast<std::size_t>(c)] = {static_cast<std::uint8_t>(word),
                                                     static_cast<std::uint8_t>(word >> 8),
                                                     static_cast<std::uint8_t>(word >> 16)};
    }
    std::memcpy(bytes.data() + sizeof header + i * sizeof record, &record, sizeof record);
  }
  return bytes;
}

rt::Result<MapConfig> read_map_config(std::string_view bytes, const std::string& name) {
  Header header;
  if (bytes.size() >= sizeof header) std::memcpy(&header, bytes.data(), sizeof header);
  if (bytes.size() < sizeof header || header.magic != kMagic) return damaged(name, "is no map of tactus");
  if (header.version != kVersion)
    return damaged(name, "is a map of version " + std::to_string(header.version) +
                             ", this program reads version " + std::to_string(kVersion));
  if (header.zero != 0) return damaged(name, "holds something where a map holds nothing");
  if (!(header.voxel_size_m >= 0.001f && header.voxel_size_m <= 1 &&
        header.truncation_m >= header.voxel_size_m && header.truncation_m <= 100 * header.voxel_size_m))
    return damaged(name, "holds a voxel size or truncation that no map has");
  if (header.blocks_count > kBlocksCapacityMax ||
      bytes.size() != sizeof header + header.blocks_count * sizeof(Record))
    return damaged(name, "holds " + std::to_string(bytes.size()) + " bytes, which is not what its " +
                             std::to_string(header.blocks_count) + " blocks take");
  return MapConfig{header.voxel_size_m, header.truncation_m, std::max(header.blocks_count, 1u)};
}

rt::Result<void> decode_map(std::string_view bytes, const std::string& name, Map& map) {
  const auto config = read_map_config(bytes, name);
  if (!config) return config.error();
  TACTUS_ASSERT(map.blocks_used() == 0 && map.config().blocks_capacity >= config->blocks_capacity);
  Header header;
  std::memcpy(&header, bytes.data(), sizeof header);
  BlockKey before = 0;
  for (std::uint32_t i = 0; i < header.blocks_count; ++i) {
    Record record;
    std::memcpy(&record, bytes.data() + sizeof header + i * sizeof record, sizeof record);
    // y = 511 is outside the map's extent.
    if (key_of(coord_of(record.key)) != record.key || record.key == kNoKey || (i > 0 && record.key <= before))
      return damaged(name, "block " + std::to_string(i) + " is out of place");
    before = record.key;
    BlockStaging staging;
    std::copy_n(record.tsdf.begin(), kBlockVoxels, staging.tsdf);
    std::copy_n(record.weight.begin(), kBlockVoxels, staging.weight);
    std::copy_n(record.color.begin(), kBlockCells, staging.color);
    std::array<LabelWord, kBlockCells> labels;
    std::array<label::RefinedWord, kBlockCells> refined;
    for (std::size_t c = 0; c < kBlockCells; ++c) {
      labels[c] = record.labels[c];
      const auto& word = record.refined[c];
      refined[c] = word[0] | static_cast<label::RefinedWord>(word[1]) << 8 |
                   static_cast<label::RefinedWord>(word[2]) << 16;
      if (!label::is_label_word(labels[c]) || !label::is_refined_word(refined[c]))
        return damaged(name, "block " + std::to_string(i) + " holds labels that do not exist");
    }
    const BlockIndex block = map.find_or_allocate(record.key);
    map.publish(block, staging);
    map.publish_labels(block, labels, record.label_frame);
    map.publish_refined(block, refined);
  }
  map.set_frame(header.frame);
  const Map::Hash hash = map.hash_content();
  if (hash.geometry != header.geometry_hash || hash.labels != header.labels_hash)
    return damaged(name, "is damaged: its content is not what was written");
  return {};
}

}  // namespace tactus::map
