#include "pipeline/track/brightness.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <hwy/targets.h>
#include <random>
#include <vector>

#include "pipeline/register/depth_images.hpp"
#include "rt/worker_pool.hpp"
#include "tests/pipeline/track/plane_room.hpp"

namespace tactus::track {
namespace {

constexpr int kWidth = 120, kHeight = 90;  // no multiple of 16: the last group of a row overlaps
constexpr std::size_t kPixels = std::size_t{kWidth} * kHeight;
const hal::Intrinsics kCamera{kWidth, kHeight, 100, 100, 59.5, 44.5};

float texture(double x, double y) {
  return static_cast<float>(120 + 60 * std::sin(4 * x) * std::cos(3 * y) + 20 * std::sin(2 * x + 3 * y));
}

// What a camera at T_world_depth sees of the textured wall z = wall_z.
struct WallImage {
  std::vector<float> z_m = std::vector<float>(kPixels);
  std::vector<Luma> luma = std::vector<Luma>(kPixels + kLumaPadding);
  std::vector<std::uint16_t> depth = std::vector<std::uint16_t>(kPixels + 1);

  explicit WallImage(const T_WorldDepth& T_world_depth, double wall_z = 2.0, double extra_grey = 0) {
    for (int v = 0; v < kHeight; ++v)
      for (int u = 0; u < kWidth; ++u) {
        const Vec3d ray = T_world_depth.rotation * Vec3d{(u - kCamera.cx) / kCamera.fx, (v - kCamera.cy) / kCamera.fy, 1};
        const double z = (wall_z - T_world_depth.translation.z) / ray.z;
        const Vec3d hit = T_world_depth.translation + ray * z;
        const auto i = static_cast<std::size_t>(v * kWidth + u);
        z_m[i] = static_cast<float>(z);
        luma[i] = static_cast<Luma>(std::lround(static_cast<double>(texture(hit.x, hit.y)) + extra_grey));
        depth[i] = static_cast<std::uint16_t>(std::lround(z / static_cast<double>(kDepthUnitM)));
      }
  }
};

T_WorldDepth pose(const Vec3d& turn, const Vec3d& shift) {
  const auto T = test::motion(turn, shift);
  return {T.rotation, T.translation};
}

TEST(RenderQuarters, ShowsTheTextureWhereTheViewSeesIt) {
  const T_WorldDepth key = pose({0.02, -0.05, 0.03}, {0.1, -0.05, 0.1}), at = pose({-0.03, 0.04, 0}, {-0.1, 0.02, 0});
  const WallImage keyframe(key), view(at);
  std::vector<std::uint16_t> sut(kPixels);
  const auto counts = render_quarters({kCamera, keyframe.luma, keyframe.depth}, key.inverse() * at, view.z_m, 0,
                                      kHeight, sut);
  EXPECT_EQ(counts.surface, kPixels);
  EXPECT_GT(counts.known, kPixels * 6 / 10);
  std::uint32_t known = 0;
  for (std::size_t i = 0; i < kPixels; ++i) {
    if (sut[i] == 0) continue;
    ++known;
    // Rounding to grey levels, and the bilinear read's error: half a pixel's curvature of the texture.
    EXPECT_NEAR(sut[i] / 4.0, static_cast<double>(view.luma[i]), 1.6) << i;
  }
  EXPECT_EQ(known, counts.known);
}

TEST(RenderQuarters, WhatStandsBeforeTheSurfaceHidesIt) {
  const T_WorldDepth at;
  const WallImage wall(at, 2.0);
  WallImage keyframe(at, 2.0);
  const WallImage box(at, 1.7);
  for (int v = 20; v < 40; ++v)
    for (int u = 30; u < 60; ++u) {
      const auto i = static_cast<std::size_t>(v * kWidth + u);
      keyframe.depth[i] = box.depth[i];
    }
  std::vector<std::uint16_t> sut(kPixels);
  render_quarters({kCamera, keyframe.luma, keyframe.depth}, {}, wall.z_m, 0, kHeight, sut);
  EXPECT_EQ(sut[30 * kWidth + 45], 0);
  EXPECT_GT(sut[30 * kWidth + 80], 0);
}

TEST(RenderQuarters, EqualsTheReferenceBitForBitOnEveryInstructionSet) {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<float> uniform(-1, 1);
  const T_WorldDepth key = pose({0.1, -0.05, 0.2}, {0.1, -0.05, 0.1});
  WallImage keyframe(key), view(T_WorldDepth{});
  for (std::size_t i = 0; i < kPixels; ++i) {
    view.z_m[i] += 0.1f * uniform(random);
    if (random() % 10 == 0) view.z_m[i] = 0;
    if (random() % 10 == 0) keyframe.luma[i] = 0;
    if (random() % 10 == 0) keyframe.depth[i] = 0;
  }
  const KeyframeImage image{kCamera, keyframe.luma, keyframe.depth};
  const auto T_key_view = key.inverse() * T_WorldDepth{};
  std::vector<std::uint16_t> expected(kPixels), sut(kPixels);
  const auto expected_counts =
      render_quarters_reference(image, T_key_view, view.z_m, 0, kHeight, expected);
  ASSERT_GT(expected_counts.known, 2000u);
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    hwy::SetSupportedTargetsForTest(target);
    hwy::GetChosenTarget().Update(hwy::SupportedTargets());
    const auto counts = render_quarters(image, T_key_view, view.z_m, 0, kHeight, sut);
    EXPECT_EQ(sut, expected) << hwy::TargetName(target);
    EXPECT_EQ(counts.known, expected_counts.known);
    EXPECT_EQ(counts.surface, expected_counts.surface);
  }
  hwy::SetSupportedTargetsForTest(0);
  hwy::GetChosenTarget().Update(hwy::SupportedTargets());
}

TEST(TakeDifferences, PacksNeighboursAndLeavesOutWhatIsUnknown) {
  std::vector<std::uint16_t> quarters(kPixels);
  std::mt19937_64 random(6);
  for (auto& q : quarters) q = random() % 8 == 0 ? std::uint16_t{0} : static_cast<std::uint16_t>(4 + random() % 1017);
  std::vector<BrightnessWord> sut(kPixels, 0xFFFFFFFFu);
  take_differences(quarters, kWidth, kHeight, 0, kHeight, sut);
  for (int v = 0; v < kHeight; ++v)
    for (int u = 0; u < kWidth; ++u) {
      const auto i = static_cast<std::size_t>(v * kWidth + u);
      const bool border = u == 0 || v == 0 || u == kWidth - 1 || v == kHeight - 1;
      if (border || quarters[i] == 0 || quarters[i - 1] == 0 || quarters[i + 1] == 0 || quarters[i - kWidth] == 0 ||
          quarters[i + kWidth] == 0) {
        ASSERT_EQ(sut[i], 0u) << u << ' ' << v;
        continue;
      }
      const auto bits = static_cast<std::int32_t>(sut[i]);
      ASSERT_EQ(sut[i] & 0x3FFu, quarters[i]);
      ASSERT_EQ(static_cast<std::int32_t>(sut[i] << 11) >> 21, quarters[i + 1] - quarters[i - 1]) << u << ' ' << v;
      ASSERT_EQ(bits >> 21, quarters[i + kWidth] - quarters[i - kWidth]) << u << ' ' << v;
    }
}

TEST(LumaOf, MatchesTheFormulaAndMarksTheUnknown) {
  std::mt19937_64 random(7);
  std::vector<std::uint32_t> color(1003);
  for (auto& c : color)
    c = (static_cast<std::uint32_t>(random()) & 0xFFFFFFu) | (random() % 5 == 0 ? 0u : 0xFF000000u);
  color[0] = 0xFF000000u;  // black is known
  std::vector<Luma> sut(color.size() + kLumaPadding);
  luma_of(color, sut);
  for (std::size_t i = 0; i < color.size(); ++i) {
    const std::uint32_t c = color[i], grey = ((c & 255u) + 2 * (c >> 8 & 255u) + (c >> 16 & 255u) + 2) / 4;
    ASSERT_EQ(sut[i], c >> 24 == 0 ? 0u : std::max(grey, 1u)) << i;
  }
}

class BrightnessKeyframesTest : public testing::Test {
 protected:
  BrightnessKeyframesTest() : memory_(BrightnessKeyframes::bytes_needed(kCamera, {}) / 64 + 1) {
    rt::Slice slice(std::as_writable_bytes(std::span(memory_)));
    sut.bind(slice, kCamera, {});
    view_.camera = kCamera;
  }
  // The camera looks at the wall from x; true when a rendering came of it.
  bool look_from(double x, bool with_color = true, double extra_grey = 0) {
    view_.T_world_view = pose({}, {x, 0, 0});
    image_ = WallImage(view_.T_world_view, 2.0, extra_grey);
    view_.z_m = image_.z_m;
    sut.follow(view_, with_color ? std::span<const Luma>(image_.luma) : std::span<const Luma>{}, image_.z_m, pool_);
    return !sut.rendered().empty();
  }

  struct alignas(64) Line {
    std::byte bytes[64];
  };
  std::vector<Line> memory_;
  rt::WorkerPool pool_;
  map::ModelView view_;
  WallImage image_{T_WorldDepth{}};
  BrightnessKeyframes sut;
};

TEST_F(BrightnessKeyframesTest, FirstFrameServesWhileItSeesEnoughAndAgainOnReturn) {
  ASSERT_TRUE(look_from(0.0));
  EXPECT_EQ(sut.serving(), 1u);
  look_from(0.3);  // an eighth of the view's 2.4 m lies outside
  EXPECT_EQ(sut.serving(), 1u);
  EXPECT_EQ(sut.keyframes_count(), 1u);
  look_from(1.2);  // half does
  EXPECT_EQ(sut.serving(), 3u);
  EXPECT_EQ(sut.keyframes_count(), 2u);
  look_from(0.1);
  EXPECT_EQ(sut.serving(), 1u);
  EXPECT_EQ(sut.keyframes_count(), 2u);
}

TEST_F(BrightnessKeyframesTest, WithoutColourNothingIsMadeButWhatIsThereServes) {
  EXPECT_FALSE(look_from(0.0, false));
  EXPECT_EQ(sut.keyframes_count(), 0u);
  EXPECT_TRUE(look_from(0.0));
  EXPECT_TRUE(look_from(0.2, false));
  EXPECT_EQ(sut.serving(), 2u);
  EXPECT_FALSE(look_from(5.0, false));
}

TEST_F(BrightnessKeyframesTest, FullStoreGivesUpItsOldestButTheFirst) {
  const auto capacity = static_cast<int>(BrightnessConfig{}.keyframes_capacity);
  for (int i = 0; i < capacity + 2; ++i) look_from(2.0 * i);
  EXPECT_EQ(sut.keyframes_count(), static_cast<std::uint32_t>(capacity));
  look_from(2.0);  // its keyframe was the second, and is gone
  EXPECT_EQ(sut.serving(), static_cast<std::uint32_t>(capacity) + 3);
  look_from(0.0);
  EXPECT_EQ(sut.serving(), 1u);
}

TEST_F(BrightnessKeyframesTest, ChangedLightDropsTheKeyframe) {
  look_from(0.0);
  EXPECT_TRUE(sut.agrees_with(image_.luma));
  const WallImage brighter(T_WorldDepth{}, 2.0, 10.0);
  EXPECT_TRUE(sut.agrees_with(brighter.luma));
  const WallImage lamp(T_WorldDepth{}, 2.0, 30.0);
  EXPECT_FALSE(sut.agrees_with(lamp.luma));
  EXPECT_TRUE(sut.rendered().empty());
  EXPECT_EQ(sut.keyframes_count(), 0u);
  EXPECT_TRUE(look_from(0.0, true, 30.0));
  EXPECT_TRUE(sut.agrees_with(lamp.luma));
}

}  // namespace
}  // namespace tactus::track
