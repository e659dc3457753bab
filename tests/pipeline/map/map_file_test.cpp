#include "pipeline/map/map_file.hpp"

#include <gtest/gtest.h>

#include <cstring>
#include <random>

#include "pipeline/label/label_cell.hpp"
#include "pipeline/map/reader.hpp"
#include "tests/pipeline/map/analytic_map.hpp"

namespace tactus::map {
namespace {

using test::OwnedMap;

constexpr std::size_t kHeaderBytes = 48, kBlockBytes = 2504;

/// A sphere with random labels, some refined, some pinned.
class MapFile : public testing::Test {
 protected:
  MapFile() {
    test::fill(owned_.map, {-0.3, -0.3, -0.3}, {0.3, 0.3, 0.3},
               [](const Vec3d& p) { return p.norm() - 0.2; });
    std::mt19937_64 random(4);
    for (std::uint32_t b = 0; b < owned_.map.config().blocks_capacity; ++b) {
      const auto block = static_cast<BlockIndex>(b);
      if (owned_.map.key(block) == kNoKey) continue;
      std::array<LabelWord, kBlockCells> labels{};
      std::array<label::RefinedWord, kBlockCells> refined{};
      for (std::size_t c = 0; c < kBlockCells; ++c) {
        MaterialDistribution p;
        for (float& v : p) v = static_cast<float>(random() % 1000 + 1);
        if (random() % 4 > 0) labels[c] = label::encode(p, 1 + static_cast<std::uint32_t>(random() % 20));
        if (random() % 2 > 0) refined[c] = label::refined_word(p);
      }
      owned_.map.publish_labels(block, labels, 7 + b);
      owned_.map.publish_refined(block, refined);
      owned_.map.publish_pins(block, random() & random() & random(), label::pinned_word(6), 7);
    }
    owned_.map.set_frame(3000);
    bytes_ = encode_map(owned_.map);
  }

  /// The sentence, or nothing.
  static std::string read(const std::string& bytes) {
    const auto config = read_map_config(bytes, "room.map");
    if (!config) {
      EXPECT_EQ(config.error().code, rt::ExitCode::bad_input);
      return config.error().message;
    }
    OwnedMap into(*config);
    const auto done = decode_map(bytes, "room.map", into.map);
    if (done) return {};
    EXPECT_EQ(done.error().code, rt::ExitCode::bad_input);
    return done.error().message;
  }

  OwnedMap owned_{{0.01F, 0.04F, 2048}};
  std::string bytes_;
};

TEST_F(MapFile, ReadBackAnswersAsTheMapDidAndIsTheSameFile) {
  const auto config = read_map_config(bytes_, "room.map");
  ASSERT_TRUE(config);
  EXPECT_EQ(config->blocks_capacity, owned_.map.blocks_used());
  OwnedMap again(*config);
  ASSERT_TRUE(decode_map(bytes_, "room.map", again.map));
  EXPECT_EQ(encode_map(again.map), bytes_);
  std::mt19937_64 random(9);
  std::uniform_real_distribution<float> uniform(-1, 1);
  int labelled = 0, pinned = 0;
  for (int i = 0; i < 3000; ++i) {
    const Vec3f p = Vec3f{uniform(random), uniform(random), uniform(random)}.normalized() * 0.205F;
    SurfacePoint a, b;
    ASSERT_EQ(Reader(owned_.map).nearest_surface(p, a), Reader(again.map).nearest_surface(p, b));
    EXPECT_EQ(a.position_world_m, b.position_world_m);
    EXPECT_EQ(a.material, b.material);
    EXPECT_EQ(a.materials, b.materials);
    EXPECT_EQ(a.label_age_frames, b.label_age_frames);
    EXPECT_EQ(a.label_observations, b.label_observations);
    EXPECT_EQ(a.is_pinned, b.is_pinned);
    labelled += a.material != kUnknownMaterial;
    pinned += a.is_pinned;
  }
  EXPECT_GT(labelled, 1000);
  EXPECT_GT(pinned, 100);
}

TEST_F(MapFile, EmptyMapIsAFileToo) {
  OwnedMap empty({0.02F, 0.08F, 64});
  const std::string bytes = encode_map(empty.map);
  EXPECT_EQ(bytes.size(), kHeaderBytes);
  EXPECT_EQ(read(bytes), "");
}

TEST_F(MapFile, WhatIsNoMapIsToldInOneSentence) {
  const auto with = [this](std::size_t offset, const auto& value) {
    std::string bytes = bytes_;
    std::memcpy(bytes.data() + offset, &value, sizeof value);
    return read(bytes);
  };
  ASSERT_EQ(read(bytes_), "");
  EXPECT_NE(read("").find("room.map: is no map of tactus"), std::string::npos);
  EXPECT_NE(read("ply\nformat ascii 1.0\nelement vertex 8\nproperty float x end_header\n").find("is no map"),
            std::string::npos);
  EXPECT_NE(with(8, std::uint32_t{2}).find("version 2"), std::string::npos);
  EXPECT_NE(with(12, 0.0F).find("voxel size"), std::string::npos);
  EXPECT_NE(with(12, std::nanf("")).find("voxel size"), std::string::npos);
  EXPECT_NE(with(16, 1e9F).find("truncation"), std::string::npos);
  EXPECT_NE(with(20, std::uint32_t{0xFFFFFFFF}).find("4294967295 blocks"), std::string::npos);
  EXPECT_NE(with(28, std::uint32_t{1}).find("where a map holds nothing"), std::string::npos);
  EXPECT_NE(read(bytes_.substr(0, bytes_.size() - 1)).find("bytes"), std::string::npos);
  EXPECT_NE(read(bytes_ + "x").find("bytes"), std::string::npos);
  EXPECT_NE(with(kHeaderBytes + kBlockBytes, BlockKey{0}).find("block 1 is out of place"), std::string::npos);
  EXPECT_NE(with(kHeaderBytes, BlockKey{0xFFFFFFFF}).find("block 0 is out of place"), std::string::npos);
  constexpr std::size_t kLabels = kHeaderBytes + 8 + 512 * 3 + 64 * 4;
  EXPECT_NE(with(kLabels, std::uint64_t{31}).find("labels that do not exist"), std::string::npos);
  constexpr std::size_t kRefined = kLabels + 64 * 8;
  EXPECT_NE(with(kRefined, std::uint16_t{0x3FF}).find("labels that do not exist"), std::string::npos);
  EXPECT_NE(with(kHeaderBytes + 8 + 100, std::int16_t{77}).find("damaged"), std::string::npos);
}

}  // namespace
}  // namespace tactus::map
