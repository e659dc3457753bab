// Decals against the disc they stand for: where they may be, and that each looks like itself.
#include "pipeline/render/decal.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "tests/pipeline/render/drawing.hpp"
#include "tests/pipeline/render/golden.hpp"
#include "tests/pipeline/render/picture.hpp"
#include "tests/pipeline/render/scene.hpp"

namespace tactus::render {
namespace {

constexpr int kWidth = 320, kHeight = 240;
constexpr Rgb8 kGrey{150, 150, 150};
constexpr std::array<DecalKind, 5> kKinds = {DecalKind::crater, DecalKind::cracks, DecalKind::tear,
                                             DecalKind::splinter, DecalKind::dent};

class DecalTest : public test::DrawingTest {
 protected:
  void SetUp() override {
    RenderConfig config;
    config.camera = test::pinhole(kWidth, kHeight, 280);
    config.bodies_count_max = 8;
    open(config);
    for (int i = 0; i < kWidth * kHeight; ++i) video_.insert(video_.end(), {kGrey.r, kGrey.g, kGrey.b});
    inputs_.video_rgb = video_;
    inputs_.T_world_depth = test::look_at({0.1, 0.9, 1.0}, {0, 0.05, 0});
    see(std::array{test::Plane{{0, 1, 0}, 0}});
  }

  void see(std::span<const test::Plane> planes) {
    depth_m_ = test::depth_of_planes(drawing_->config.camera, inputs_.T_world_depth, planes);
    inputs_.depth_m = depth_m_;
  }

  test::Picture picture(std::span<const Decal> decals) {
    inputs_.decals = decals;
    test::Picture drawn(kWidth, kHeight);
    EXPECT_EQ(draw(inputs_, drawn.rgb), rt::Status::ok);
    return drawn;
  }

  [[nodiscard]] Vec3d real_point(int u, int v) const {
    return inputs_.T_world_depth.translation +
           inputs_.T_world_depth.rotation * test::pixel_ray(drawing_->config.camera, u, v) *
               static_cast<double>(depth_m_[static_cast<std::size_t>(v * kWidth + u)]);
  }

  std::vector<std::uint8_t> video_;
  std::vector<float> depth_m_;
  RenderInputs inputs_;
};

Decal on_floor(DecalKind kind, Vec3d at = {0, 0, 0}, std::uint32_t seed = 3) {
  return {kind, at, {0, 1, 0}, 0.2F, {150, 120, 90}, seed};
}

TEST_F(DecalTest, EveryKindStaysInsideItsDiscAndCoversAFairPartOfIt) {
  for (const DecalKind kind : kKinds) {
    const std::array<Decal, 1> decals = {on_floor(kind, {0.05, 0, 0.1})};
    const test::Picture drawn = picture(decals);
    int inside = 0, marked = 0;
    for (int v = 0; v < kHeight; ++v)
      for (int u = 0; u < kWidth; ++u) {
        const double r = (real_point(u, v) - decals[0].position_world_m).norm();
        const bool is_marked = drawn.at(u, v) != kGrey;
        ASSERT_TRUE(r <= 0.2001 || !is_marked) << static_cast<int>(kind) << ": " << u << ' ' << v;
        inside += r < 0.2 ? 1 : 0;
        marked += is_marked ? 1 : 0;
      }
    EXPECT_GT(inside, 3000);
    EXPECT_GT(marked, inside / 8) << static_cast<int>(kind);
  }
}

TEST_F(DecalTest, KindsDifferFromEachOtherByMoreThanSeedsDo) {
  // Share of dark and of bright pixels, and how much neighbours differ: what an eye tells kinds apart by.
  const auto describe = [this](DecalKind kind, std::uint32_t seed) {
    const std::array<Decal, 1> decals = {on_floor(kind, {0, 0, 0}, seed)};
    const test::Picture drawn = picture(decals);
    std::array<double, 3> sums{};
    double inside = 0;
    for (int v = 1; v + 1 < kHeight; ++v)
      for (int u = 1; u + 1 < kWidth; ++u) {
        if (real_point(u, v).norm() > 0.2) continue;
        ++inside;
        const int g = drawn.at(u, v).g;
        sums[0] += g < 70 ? 1 : 0;
        sums[1] += g > 175 ? 1 : 0;
        sums[2] += std::abs(g - drawn.at(u + 1, v).g) / 64.0;
      }
    for (double& sum : sums) sum /= inside;
    return sums;
  };
  const auto distance = [](const std::array<double, 3>& a, const std::array<double, 3>& b) {
    return std::max({std::fabs(a[0] - b[0]), std::fabs(a[1] - b[1]), std::fabs(a[2] - b[2])});
  };
  std::array<std::array<double, 3>, kKinds.size()> looks;
  for (std::size_t i = 0; i < kKinds.size(); ++i) {
    looks[i] = describe(kKinds[i], 3);
    EXPECT_GT(distance(looks[i], {}), 0.05) << i;  // of nothing all three are 0
  }
  for (std::size_t i = 0; i < kKinds.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) EXPECT_GT(distance(looks[i], looks[j]), 0.03) << i << ' ' << j;
}

TEST_F(DecalTest, SeedsOfOneKindDifferAndTheSameSeedDoesNot) {
  for (const DecalKind kind : kKinds) {
    const std::array<Decal, 1> one = {on_floor(kind, {}, 1)}, other = {on_floor(kind, {}, 2)};
    const test::Picture first = picture(one);
    EXPECT_GT(test::compare(first, picture(other)).part_far_off, 0.003) << static_cast<int>(kind);
    EXPECT_EQ(picture(one).rgb, first.rgb);
  }
}

TEST_F(DecalTest, SurfacesMoreThanTwoCentimetresOffThePlaneStayClean) {
  // A step of 5 cm through the disc: the upper floor is on the disc's plane on one side only.
  for (int v = 0; v < kHeight; ++v)
    for (int u = kWidth / 2; u < kWidth; ++u) {
      const Vec3d ray = inputs_.T_world_depth.rotation * test::pixel_ray(drawing_->config.camera, u, v);
      depth_m_[static_cast<std::size_t>(v * kWidth + u)] = static_cast<float>((0.05 - 0.9) / ray.y);
    }
  const std::array<Decal, 1> decals = {on_floor(DecalKind::crater)};
  const test::Picture drawn = picture(decals);
  int marked = 0;
  for (int v = 0; v < kHeight; ++v)
    for (int u = 0; u < kWidth; ++u) {
      const bool is_marked = drawn.at(u, v) != kGrey;
      ASSERT_TRUE(u < kWidth / 2 || !is_marked) << u << ' ' << v;
      marked += is_marked ? 1 : 0;
    }
  EXPECT_GT(marked, 500);
}

TEST_F(DecalTest, WithoutDepthOrPoseOrKindNothingIsDrawn) {
  const std::array<Decal, 3> nothing = {on_floor(DecalKind::none),
                                        Decal{DecalKind::dent, {}, {}, 0.2F, {}, 1},
                                        Decal{DecalKind::dent, {std::nan(""), 0, 0}, {0, 1, 0}, 0.2F, {}, 1}};
  EXPECT_EQ(picture(nothing).rgb, video_);
  const std::array<Decal, 1> decals = {on_floor(DecalKind::crater)};
  inputs_.is_tracked = false;
  EXPECT_EQ(picture(decals).rgb, video_);
  inputs_.is_tracked = true;
  std::fill(depth_m_.begin(), depth_m_.end(), 0.0F);
  EXPECT_EQ(picture(decals).rgb, video_);
  inputs_.depth_m = {};
  EXPECT_EQ(picture(decals).rgb, video_);
}

TEST_F(DecalTest, BodiesInFrontHideADecal) {
  const std::array<Body, 1> bodies = {Body{Shape::box, {20, 200, 30}, {0.5F, 0.01F, 0.5F}, {0, 0.2, 0}, {}}};
  inputs_.bodies = bodies;
  const test::Picture without = picture({});
  const std::array<Decal, 1> decals = {on_floor(DecalKind::crater)};
  const test::Picture with = picture(decals);
  EXPECT_EQ(with.at(kWidth / 2, kHeight / 2), without.at(kWidth / 2, kHeight / 2));
}

TEST_F(DecalTest, FiveKindsSideBySideLookLikeTheirGoldenPicture) {
  inputs_.T_world_depth = test::look_at({0, 0, 0.6}, {0, 0, 0});
  see(std::array{test::Plane{{0, 0, 1}, 0}});
  std::array<Decal, 6> decals;
  constexpr std::array<Rgb8, 6> kTints = {Rgb8{150, 140, 130}, {200, 220, 220}, {170, 60, 60},
                                          {190, 140, 80},      {170, 175, 180}, {200, 130, 90}};
  for (std::uint32_t i = 0; i < decals.size(); ++i)
    decals[i] = {kKinds[i % 5], {0.22 * static_cast<int>(i % 3) - 0.22, i < 3 ? 0.12 : -0.12, 0},
                 {0, 0, 1},     0.105F,
                 kTints[i],     17 * i};
  test::expect_golden(picture(decals), "decals");
}

TEST(BuildDecals, RunsByKindHoldAtMostTheFirst128) {
  std::vector<Decal> decals;
  for (int i = 0; i < 200; ++i)
    decals.push_back({kKinds[static_cast<std::size_t>(i % 5)],
                      {0, 0, 1},
                      {0, 0, -1},
                      0.05F,
                      {},
                      static_cast<std::uint32_t>(i)});
  std::vector<DecalInstance> instances(kDecalsMax);
  const DecalCounts sut = build_decals(decals, {}, test::pinhole(kWidth, kHeight, 280), {}, instances);
  EXPECT_EQ(sut.total_count, kDecalsMax);
  std::size_t next = 0;
  for (std::size_t kind = 1; kind < kDecalKindsCount; ++kind) {
    EXPECT_EQ(sut.first[kind], next);
    for (std::size_t i = 0; i < sut.count[kind]; ++i, ++next) {
      EXPECT_EQ(instances[next].seed % 5 + 1, kind);
      const auto& x = instances[next].axis_x_depth;
      EXPECT_NEAR(x.cross(instances[next].axis_y_depth).z, -1, 1e-5);
    }
  }
}

}  // namespace
}  // namespace tactus::render
