// Label words against eq. (1) in float64: by hand on one cell, and over the synthetic rooms as the built-in
// network sees them.
#include "firmware_host/exact_fusion.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "firmware_host/label_methods.hpp"

namespace tactus::firmware {
namespace {

/// A wall at 1 m, filling a 64 x 48 depth image, said to be `first` with probability 200 / 255 and `second`
/// with the rest.
class OneCell {
 public:
  OneCell() {
    rig.has_color = rig.registered = true;
    rig.depth = rig.color = {64, 48, 60, 60, 31.5, 23.5};
    half_camera = {32, 24, 30, 30, 15.5, 11.5};
    cell.position_world_m = {0, 0, 1};
    cell.normal_world = {0, 0, -1};
  }

  void observe(ExactFusion& fusion, MaterialId first, MaterialId second, float depth_m = 1,
               std::span<const std::uint64_t> pane_bits = {}) {
    const std::vector<float> half_depth_m(32 * 24, depth_m);
    std::vector<std::uint8_t> probability(4 * 3 * kMaterialCount, 0);
    for (std::size_t pixel = 0; pixel < 12; ++pixel) {
      probability[pixel * kMaterialCount + first] = 200;
      probability[pixel * kMaterialCount + second] = 55;
    }
    fusion.add(T_WorldDepth{}, half_depth_m, pane_bits, {4, 3, probability, {1.0F / 16, 0}, {1.0F / 16, 0}});
  }

  [[nodiscard]] FusedTwice fuse(const ExactFusion& fusion) const {
    return fusion.fuse(std::span(&cell, 1), rig, half_camera, 0.01F);
  }

  map::SurfaceCell cell;
  hal::RigCalibration rig;
  hal::Intrinsics half_camera;
};

TEST(ExactFusion, KeyframesMultiply) {
  OneCell one;
  ExactFusion sut;
  one.observe(sut, 3, 22);
  one.observe(sut, 3, 12);
  const FusedTwice fused = one.fuse(sut);
  // P(3) ~ 200 * 200, P(22) ~ 55 * 0.5, P(12) ~ 0.5 * 55, others 0.5 * 0.5: nothing is below half a byte.
  EXPECT_EQ(fused.unary_nat[3], 0);
  EXPECT_NEAR(fused.unary_nat[22], std::log(200.0 * 200 / (55 * 0.5)), 1e-5);
  EXPECT_NEAR(fused.unary_nat[12], std::log(200.0 * 200 / (55 * 0.5)), 1e-5);
  EXPECT_NEAR(fused.unary_nat[0], std::log(200.0 * 200 / (0.5 * 0.5)), 1e-5);
  EXPECT_EQ(label::best(fused.words[0]), 3);
  EXPECT_EQ(label::observations(fused.words[0]), 2);
  const FusionLoss loss = loss_of(fused.words, fused);
  EXPECT_EQ(loss.cells_count, 1u);
  EXPECT_EQ(loss.winner_share(), 1);
  EXPECT_EQ(loss.probability_share(), 1);
}

TEST(ExactFusion, APaneCarriesItsEvidence) {
  OneCell one;
  ExactFusion sut;
  const std::vector<std::uint64_t> pane_bits(32 * 24 / 64, ~std::uint64_t{0});
  one.observe(sut, 3, 10, 1, pane_bits);   // fabric, perhaps a mirror
  one.observe(sut, 3, 22, 1, pane_bits);
  const FusedTwice fused = one.fuse(sut);
  // P(fabric) ~ 200/255 * 0.02 twice; P(mirror) ~ 55/255 * 0.9, then 0.1 * 0.9.
  EXPECT_EQ(fused.unary_nat[10], 0);
  EXPECT_NEAR(fused.unary_nat[3], std::log(55.0 / 255 * 0.1 * 0.81 / (200.0 * 200 / 255 / 255 * 0.0004)), 1e-4);
  EXPECT_EQ(label::best(fused.words[0]), 10);
  const FusionLoss loss = loss_of(fused.words, fused);
  EXPECT_EQ(loss.probability_share(), 1);
}

TEST(ExactFusion, WhatNoKeyframeSawIsLeftOut) {
  OneCell one;
  ExactFusion sut;
  one.observe(sut, 3, 22, 1.3F);  // something else was measured there
  one.cell.normal_world = {0, 0, 1};
  one.observe(sut, 3, 22);  // seen from behind
  const FusedTwice fused = one.fuse(sut);
  EXPECT_EQ(fused.words[0], 0u);
  for (const float cost : fused.unary_nat) EXPECT_EQ(cost, 0);
  EXPECT_EQ(loss_of(fused.words, fused).cells_count, 0u);
}

TEST(ExactFusion, LossCountsOtherWinnersAndOtherProbabilities) {
  OneCell one;
  ExactFusion sut;
  one.observe(sut, 3, 22);
  const FusedTwice fused = one.fuse(sut);
  MaterialDistribution other;
  other.fill(0.001F);
  other[22] = 1;
  const label::LabelWord wrong = label::encode(other, 1);
  EXPECT_EQ(loss_of(std::span(&wrong, 1), fused).winner_equal_count, 0u);
  other[22] = 0.3F;
  other[3] = 0.6F;  // the right one, but 0.6 where it should be 0.78
  const label::LabelWord unsure = label::encode(other, 1);
  const FusionLoss loss = loss_of(std::span(&unsure, 1), fused);
  EXPECT_EQ(loss.winner_equal_count, 1u);
  EXPECT_EQ(loss.probability_near_count, 0u);
}

class ExactFusionRooms : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Synthetic, ExactFusionRooms, testing::Values("bedroom", "office"));

// What four materials in 64 bits lose; the network is unsure there, far from its training pictures.
TEST_P(ExactFusionRooms, LabelWordsAgreeWithFloat64) {
  LabelStudyRequest request;
  request.session.source = std::string("synthetic:") + GetParam();
  request.session.model = "builtin";
  auto settings = read_settings("x86", {});
  ASSERT_TRUE(settings);
  request.settings = *settings;
  request.settings.label_source = LabelSource::network;
  request.has_method = {false, false, false, true, false};
  request.has_exact_fusion = true;
  request.every = 100;
  const auto study = study_labels(request);
  ASSERT_TRUE(study) << study.error().message;
  const FusionLoss &words = *study->word_loss, &map = *study->map_loss;
  std::printf("%s: %llu cells; words: winner %.2f %%, probability %.2f %%; in the map: %.2f %%, %.2f %%\n",
              GetParam(), static_cast<unsigned long long>(words.cells_count), 100 * words.winner_share(),
              100 * words.probability_share(), 100 * map.winner_share(), 100 * map.probability_share());
  EXPECT_GT(words.cells_count, 80000u);
  EXPECT_GE(words.winner_share(), 0.99);
  EXPECT_GE(words.probability_share(), 0.95);
  // The map fuses while its surface still moves: measured, a fifth of the cells hear of fewer keyframes, or
  // of more, than saw their place at the end; of the others 99.6 % agree.
  EXPECT_GE(map.winner_share(), 0.90);
  EXPECT_GE(map.probability_share(), 0.80);
}

}  // namespace
}  // namespace tactus::firmware
