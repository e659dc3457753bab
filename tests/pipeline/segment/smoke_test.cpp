// Small enough for an emulator: the same bytes must come out on every processor, from the network as from the
// stage.
#include <gtest/gtest.h>

#include "pipeline/segment/segmenter.hpp"
#include "tests/pipeline/segment/bound_network.hpp"

namespace tactus::segment::test {
namespace {

std::uint64_t fnv1a(std::span<const std::uint8_t> bytes) {
  std::uint64_t hash = 14695981039346656037ULL;
  for (const std::uint8_t byte : bytes) hash = (hash ^ byte) * 1099511628211ULL;
  return hash;
}

std::vector<std::uint8_t> image_of(int width, int height) {
  std::vector<std::uint8_t> image;
  for (std::uint32_t i = 0; i < static_cast<std::uint32_t>(width * height * 3); ++i)
    image.push_back(static_cast<std::uint8_t>((i * 2654435761U) >> 24));
  return image;
}

TEST(SegmentSmoke, MiniatureNetworkAgreesWithIntegerReference) {
  for (std::uint32_t seed = 1; seed <= 5; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    BoundNetwork sut(miniature(seed));
    EXPECT_EQ(sut.largest_difference(seed), 0);
  }
}

TEST(SegmentSmoke, StageGivesTheSameBytesOnEveryProcessor) {
  const FileBytes bytes = miniature(3, 23);
  const auto model = read_tflite(bytes, "net.tflite");
  ClassMap map;
  map.temperature = 1.5F;
  map.mean = {127, 120, 110};
  map.std = {127.5F, 100, 90};
  for (std::size_t c = 0; c < 23; ++c) {
    MaterialDistribution materials{};
    materials[c] = 0.75F;
    materials[(c * 5 + 2) % kMaterialCount] += 0.25F;
    map.materials.push_back(materials);
  }
  const SegmenterConfig config{&*model, &map, 70, 50};
  const Memory memory(Segmenter::bytes_needed(config).value());
  auto sut = Segmenter::bind(config, memory.slice());
  ASSERT_TRUE(sut);
  const Memory out_memory(MaterialScores::bytes_needed(12, 8));
  rt::Slice slice = out_memory.slice();
  MaterialScores out = MaterialScores::take(slice, 12, 8);
  ASSERT_EQ(sut->step(image_of(70, 50), out), rt::Status::ok);
  EXPECT_EQ(fnv1a(out.probability), 12147012140076876690ULL);
}

}  // namespace
}  // namespace tactus::segment::test
