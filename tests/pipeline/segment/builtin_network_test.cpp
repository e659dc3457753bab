// The network that ships: it must read, fit, run, and give the same bytes everywhere.
#include "pipeline/segment/builtin_network.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <numeric>

#include "pipeline/segment/builtin_class_maps.hpp"
#include "pipeline/segment/segmenter.hpp"
#include "rt/heap_guard.hpp"
#include "tests/pipeline/segment/model_builder.hpp"

namespace tactus::segment::test {
namespace {

constexpr int kWidth = 480, kHeight = 270;

ClassMap builtin_map() {
  for (const BuiltinClassMap& map : kBuiltinClassMaps)
    if (map.model_name_part == kBuiltinNetworkName) return parse_class_map(map.toml, map.file).value();
  return {};
}

std::vector<std::uint8_t> picture() {
  std::vector<std::uint8_t> rgb;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x)
      for (const int v : {x / 2, y / 2 + 60, ((x / 40 + y / 30) % 2) * 180})
        rgb.push_back(static_cast<std::uint8_t>(v));
  return rgb;
}

std::uint64_t fnv1a(std::span<const std::uint8_t> bytes) {
  std::uint64_t hash = 14695981039346656037ULL;
  for (const std::uint8_t byte : bytes) hash = (hash ^ byte) * 1099511628211ULL;
  return hash;
}

/// The stage with the built-in network, bound and warm.
class BuiltinStage : public ::testing::Test {
 protected:
  void SetUp() override {
    auto read = read_tflite(builtin_network(), "tactus_materials");
    ASSERT_TRUE(read) << read.error().message;
    model_ = std::move(*read);
    map_ = builtin_map();
    const SegmenterConfig config{&model_, &map_, kWidth, kHeight};
    const auto bytes = Segmenter::bytes_needed(config);
    ASSERT_TRUE(bytes) << bytes.error().message;
    bytes_ = *bytes;
    memory_.emplace(bytes_);
    auto bound = Segmenter::bind(config, memory_->slice());
    ASSERT_TRUE(bound) << bound.error().message;
    sut_.emplace(std::move(*bound));
    out_memory_.emplace(MaterialScores::bytes_needed(sut_->scores_width(), sut_->scores_height()));
    rt::Slice slice = out_memory_->slice();
    out_ = MaterialScores::take(slice, sut_->scores_width(), sut_->scores_height());
    ASSERT_EQ(sut_->warm_up(out_), rt::Status::ok);
  }

  Model model_;
  ClassMap map_;
  std::size_t bytes_ = 0;
  std::optional<Memory> memory_, out_memory_;
  std::optional<Segmenter> sut_;
  MaterialScores out_;
};

TEST(BuiltinNetwork, IsTheFileThatShipsAndAtMostFourMegabytes) {
  const std::filesystem::path file = TACTUS_SOURCE_DIR "/pipeline/segment/models/tactus_materials.tflite";
  EXPECT_EQ(builtin_network().size(), std::filesystem::file_size(file));
  EXPECT_LE(builtin_network().size(), 4'000'000U);
  EXPECT_EQ(reinterpret_cast<std::uintptr_t>(builtin_network().data()) % 16, 0U);
}

TEST(BuiltinNetwork, ClassMapIsTheIdentityWithAFittedTemperature) {
  const ClassMap map = builtin_map();
  ASSERT_EQ(map.materials.size(), static_cast<std::size_t>(kMaterialCount));
  for (std::size_t i = 0; i < kMaterialCount; ++i) {
    EXPECT_EQ(map.class_names[i], kMaterialNames[i]);
    EXPECT_EQ(map.materials[i][i], 1.0F);
  }
  EXPECT_GT(map.temperature, 0.3F);
  EXPECT_LT(map.temperature, 3.0F);
}

TEST_F(BuiltinStage, TakesAMultipleOf16AndScoresAtAnEighth) {
  const Shape& input = sut_->network().input().shape;
  EXPECT_EQ(input.width() % 16, 0);
  EXPECT_EQ(input.height() % 16, 0);
  EXPECT_EQ(sut_->scores_width(), input.width() / 8);
  EXPECT_EQ(sut_->scores_height(), input.height() / 8);
  EXPECT_EQ(sut_->network().scores().shape.channels(), kMaterialCount);
}

TEST_F(BuiltinStage, FitsTheMemoryThatProfilesPlanForANetwork) { EXPECT_LE(bytes_, std::size_t{48} << 20); }

TEST_F(BuiltinStage, SpreadsItsProbabilitiesOverMaterialsThatSumToOne) {
  ASSERT_EQ(sut_->step(picture(), out_), rt::Status::ok);
  MaterialDistribution p{};
  out_.sample(240, 135, p);
  EXPECT_NEAR(std::accumulate(p.begin(), p.end(), 0.0F), 1.0F, 1e-4F);
}

// A change of the network changes this constant (the failure prints the new one); a change of the machine
// must not.
TEST_F(BuiltinStage, GivesTheSameBytesOnEveryProcessor) {
  ASSERT_EQ(sut_->step(picture(), out_), rt::Status::ok);
  const std::uint64_t first = fnv1a(out_.probability);
  ASSERT_EQ(sut_->step(picture(), out_), rt::Status::ok);
  EXPECT_EQ(fnv1a(out_.probability), first);
  EXPECT_EQ(first, 11668693828601223145ULL);
}

TEST_F(BuiltinStage, StepsMakeNoHeapCall) {
  if (!rt::heap_guard::is_active()) GTEST_SKIP() << "the sanitizer owns the heap in this build";
  const auto image = picture();
  rt::heap_guard::seal();
  const std::uint64_t before = rt::heap_guard::was_total_calls();
  {
    const rt::RtScope scope;
    for (int i = 0; i < 3; ++i) ASSERT_EQ(sut_->step(image, out_), rt::Status::ok);
  }
  const std::uint64_t after = rt::heap_guard::was_total_calls();
  rt::heap_guard::unseal();
  EXPECT_EQ(after, before);
}

}  // namespace
}  // namespace tactus::segment::test
