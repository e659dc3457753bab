// Shadows of virtual bodies on real surfaces against rays in float64.
#include "pipeline/render/shadow.hpp"

#include <gtest/gtest.h>

#include <array>
#include <random>
#include <vector>

#include "tests/pipeline/render/drawing.hpp"
#include "tests/pipeline/render/golden.hpp"
#include "tests/pipeline/render/picture.hpp"
#include "tests/pipeline/render/scene.hpp"

namespace tactus::render {
namespace {

constexpr int kWidth = 320, kHeight = 240;
constexpr Rgb8 kGrey{160, 160, 160};

class ShadowTest : public test::DrawingTest {
 protected:
  void SetUp() override {
    RenderConfig config;
    config.camera = test::pinhole(kWidth, kHeight, 280);
    config.bodies_count_max = 32;
    open(config);
    for (int i = 0; i < kWidth * kHeight; ++i) video_.insert(video_.end(), {kGrey.r, kGrey.g, kGrey.b});
    inputs_.video_rgb = video_;
    inputs_.T_world_depth = test::look_at({0.1, 1.1, 1.4}, {0, 0.1, 0});
    inputs_.light.toward_world = {0.5F, 0.8F, 0.2F};
  }

  void see(std::span<const test::Plane> planes) {
    depth_m_ = test::depth_of_planes(drawing_->config.camera, inputs_.T_world_depth, planes);
    inputs_.depth_m = depth_m_;
  }

  /// Noise of a Kinect v1 (1.425 mm z^2, one sigma), and holes.
  void disturb_depth(unsigned seed) {
    std::mt19937 random(seed);
    std::normal_distribution<float> normal;
    for (float& z : depth_m_) z = random() % 200 == 0 ? 0.0F : z + 0.001425F * z * z * normal(random);
  }

  test::Picture picture() {
    test::Picture drawn(kWidth, kHeight);
    EXPECT_EQ(draw(inputs_, drawn.rgb), rt::Status::ok);
    return drawn;
  }

  [[nodiscard]] Vec3d eye_ray(int u, int v) const {
    return inputs_.T_world_depth.rotation * test::pixel_ray(drawing_->config.camera, u, v);
  }
  [[nodiscard]] Vec3d real_point(int u, int v) const {
    return inputs_.T_world_depth.translation +
           eye_ray(u, v) * static_cast<double>(depth_m_[static_cast<std::size_t>(v * kWidth + u)]);
  }

  std::vector<std::uint8_t> video_;
  std::vector<float> depth_m_;
  RenderInputs inputs_;
};

constexpr test::Plane kFloor{{0, 1, 0}, 0};

TEST_F(ShadowTest, SphereAndBoxDarkenTheFloorInsideTheirAnalyticOutlineOnly) {
  see(std::array{kFloor});
  const Vec3d ball{-0.25, 0.3, 0.1}, crate{0.3, 0.25, -0.1}, half{0.1, 0.06, 0.12};
  const std::array<Body, 2> bodies = {Body{Shape::sphere, {200, 60, 40}, {0.12F, 0, 0}, ball, {}},
                                      Body{Shape::box, {40, 60, 200}, half.cast<float>(), crate, {}}};
  inputs_.bodies = bodies;
  const test::Picture drawn = picture();
  const Vec3d light = inputs_.light.toward_world.cast<double>();
  std::vector<bool> shadow, covered;
  for (int v = 0; v < kHeight; ++v)
    for (int u = 0; u < kWidth; ++u) {
      const Vec3d p = real_point(u, v), eye = inputs_.T_world_depth.translation, ray = eye_ray(u, v);
      shadow.push_back(test::meets_sphere(p, light, ball, 0.12) || test::meets_box(p, light, crate, half));
      covered.push_back(test::meets_sphere(eye, ray, ball, 0.12) || test::meets_box(eye, ray, crate, half));
    }
  const auto in_shadow = test::without_band(shadow, kWidth, kHeight, 2);
  const auto on_body = test::without_band(covered, kWidth, kHeight, 2);
  // Up: direct 0.7 n.l of lamp beside 0.34 of ambient light, then the root of the sRGB curve.
  const double n_l = light.y / light.norm();
  const double expected = 160 * std::sqrt(0.34 / (0.34 + 0.7 * n_l));
  int inside = 0, darkened = 0, outside = 0;
  for (int v = 0; v < kHeight; ++v)
    for (int u = 0; u < kWidth; ++u) {
      const auto i = static_cast<std::size_t>(v * kWidth + u);
      if (on_body[i] != 0) continue;
      if (in_shadow[i] == 1) {
        ++inside;
        if (std::fabs(drawn.at(u, v).g - expected) < 3) ++darkened;
      } else if (in_shadow[i] == 0) {
        ++outside;
        EXPECT_EQ(drawn.at(u, v), kGrey) << u << ' ' << v;
      }
    }
  EXPECT_GT(inside, 1000);
  EXPECT_GT(outside, 50000);
  EXPECT_GE(darkened, 0.95 * inside);
}

TEST_F(ShadowTest, NoisyDepthLeavesNoSpecksOutsideTheShadowAndFewInside) {
  see(std::array{kFloor});
  disturb_depth(4);
  const Vec3d ball{0, 0.4, 0}, light = inputs_.light.toward_world.cast<double>();
  const std::array<Body, 1> bodies = {Body{Shape::sphere, {200, 60, 40}, {0.15F, 0, 0}, ball, {}}};
  inputs_.bodies = bodies;
  const test::Picture drawn = picture();
  std::vector<bool> shadow, covered;
  const Vec3d eye = inputs_.T_world_depth.translation;
  for (int v = 0; v < kHeight; ++v)
    for (int u = 0; u < kWidth; ++u) {
      const Vec3d on_floor = eye - eye_ray(u, v) * (eye.y / eye_ray(u, v).y);
      shadow.push_back(test::meets_sphere(on_floor, light, ball, 0.15));
      covered.push_back(test::meets_sphere(eye, eye_ray(u, v), ball, 0.15));
    }
  const auto in_shadow = test::without_band(shadow, kWidth, kHeight, 2);
  const auto on_body = test::without_band(covered, kWidth, kHeight, 2);
  int inside = 0, darkened = 0;
  for (std::size_t i = 0; i < depth_m_.size(); ++i) {
    if (on_body[i] != 0) continue;
    const int g = drawn.rgb[3 * i + 1];
    EXPECT_TRUE(in_shadow[i] != 0 || g == 160) << i;
    if (in_shadow[i] != 1) continue;
    ++inside;
    darkened += g < 125 ? 1 : 0;
  }
  EXPECT_GT(inside, 700);
  EXPECT_GE(darkened, 0.95 * inside);
}

// What one frame of the product looks like: noisy depth, bodies on and above the floor, marks, help.
TEST_F(ShadowTest, RoomWithEverythingInItLooksLikeItsGoldenPicture) {
  inputs_.T_world_depth = test::look_at({0.1, 1.0, 1.3}, {0, 0.25, -0.2});
  see(std::array{kFloor, test::Plane{{0, 0, 1}, -0.7}});
  for (int v = 0; v < kHeight; ++v)
    for (int u = 0; u < kWidth; ++u) {
      const Vec3d p = real_point(u, v);
      const bool is_wall = p.z < -0.69;
      const bool is_odd =
          is_wall
              ? static_cast<int>(std::floor(p.y * 10)) % 2 != 0
              : ((static_cast<int>(std::floor(p.x * 8)) ^ static_cast<int>(std::floor(p.z * 8))) & 1) != 0;
      const Rgb8 color = is_wall ? (is_odd ? Rgb8{196, 190, 176} : Rgb8{204, 198, 184})
                                 : (is_odd ? Rgb8{168, 132, 92} : Rgb8{182, 146, 104});
      const std::size_t i = 3 * static_cast<std::size_t>(v * kWidth + u);
      video_[i] = color.r;
      video_[i + 1] = color.g;
      video_[i + 2] = color.b;
    }
  disturb_depth(9);
  std::array<Body, 5> bodies;
  bodies[0] = {Shape::sphere, {200, 60, 50}, {0.1F, 0, 0}, {-0.4, 0.1, 0.1}, {}, 0, 0, 0.25F, 0};
  bodies[1] = {Shape::box,
               {190, 150, 90},
               {0.08F, 0.08F, 0.08F},
               {-0.1, 0.08, -0.2},
               Quaternion{0.9, 0, 0.4, 0}.normalized(),
               0,
               0,
               0.8F,
               0};
  bodies[2] = {Shape::capsule,
               {70, 160, 90},
               {0.05F, 0, 0},
               {0.1, 0.3, 0.2},
               Quaternion{0.8, 0.2, 0.5, 0.1}.normalized(),
               0.1F,
               0,
               0.4F,
               0};
  bodies[3] = {Shape::cylinder,
               {220, 215, 210},
               {0.06F, 0, 0},
               {0.3, 0.1, -0.1},
               Quaternion{0.7071, -0.7071, 0, 0}.normalized(),
               0.1F,
               0,
               0.3F,
               1};
  bodies[4] = {Shape::sphere, {230, 180, 60}, {0.07F, 0, 0}, {0.05, 0.55, -0.5}, {}, 0, 0, 0.3F, 1};
  const std::array<Decal, 4> decals = {
      Decal{DecalKind::crater, {-0.45, 0.45, -0.7}, {0, 0, 1}, 0.12F, {190, 185, 175}, 2},
      Decal{DecalKind::cracks, {0.4, 0.5, -0.7}, {0, 0, 1}, 0.14F, {210, 220, 220}, 5},
      Decal{DecalKind::splinter, {0.15, 0, 0.35}, {0, 1, 0}, 0.12F, {200, 150, 90}, 7},
      Decal{DecalKind::tear, {-0.25, 0, 0.4}, {0, 1, 0}, 0.1F, {170, 120, 80}, 8}};
  const std::array<TextLine, 1> text = {TextLine{"H: help  Q: leave", 6, 6, {255, 255, 255}, 1}};
  inputs_.bodies = bodies;
  inputs_.decals = decals;
  inputs_.text = text;
  inputs_.crosshair = Crosshair{kWidth / 2, kHeight / 2, {255, 255, 255}};
  inputs_.light.toward_world = {0.5F, 0.8F, 0.5F};
  test::expect_golden(picture(), "room");
}

TEST_F(ShadowTest, SurfacesBetweenTheLightAndTheBodyStayLit) {
  // A ceiling above the ball: the sweep runs the other way.
  inputs_.T_world_depth = test::look_at({0, 1, 1.4}, {0, 1.6, 0});
  see(std::array{test::Plane{{0, 1, 0}, 2}});
  const std::array<Body, 1> bodies = {Body{Shape::sphere, {200, 60, 40}, {0.12F, 0, 0}, {0.5, 0.4, 0.4}, {}}};
  inputs_.bodies = bodies;
  EXPECT_EQ(picture().rgb, video_);
}

TEST_F(ShadowTest, SurfacesThatFaceAwayFromTheLightKeepTheirColour) {
  // A wall seen from the side that the lamp does not reach; a ball between lamp and wall.
  inputs_.T_world_depth = test::look_at({0, 0.5, 1.5}, {0, 0.5, 0});
  inputs_.light.toward_world = {0, 0.3F, -1};
  see(std::array{test::Plane{{0, 0, 1}, 0}});
  const std::array<Body, 1> bodies = {Body{Shape::sphere, {200, 60, 40}, {0.12F, 0, 0}, {0, 0.6, -0.4}, {}}};
  inputs_.bodies = bodies;
  EXPECT_EQ(picture().rgb, video_);
}

TEST_F(ShadowTest, BallOnTheFloorTouchesItsShadow) {
  see(std::array{kFloor});
  inputs_.light.toward_world = {0.9F, 0.5F, 0};
  const Vec3d ball{0, 0.1, 0};
  const std::array<Body, 1> bodies = {Body{Shape::sphere, {200, 60, 40}, {0.1F, 0, 0}, ball, {}}};
  inputs_.bodies = bodies;
  const test::Picture drawn = picture();
  // Floor 5 mm beside the point of contact, on the far side of the lamp, is hidden by the ball from above;
  // what is seen first next to its outline must be dark: walk from the ball to the left along the row of the
  // contact.
  const auto camera = drawing_->config.camera;
  const Vec3d contact = inputs_.T_world_depth.inverse() * Vec3d{0, 0.02, 0};
  const int v = static_cast<int>(std::lround(camera.fy * contact.y / contact.z + camera.cy));
  int u = static_cast<int>(std::lround(camera.fx * contact.x / contact.z + camera.cx));
  while (u > 0 && test::meets_sphere(inputs_.T_world_depth.translation, eye_ray(u, v), ball, 0.1)) --u;
  for (int i = 1; i <= 3; ++i) EXPECT_LT(drawn.at(u - i, v).g, 140) << i;
}

TEST_F(ShadowTest, OneBodyDarkensAnotherOnlyOnItsLitSide) {
  inputs_.light.toward_world = {0, 1, 0};
  inputs_.T_world_depth = test::look_at({0, 1.1, 1.4}, {0, 0.2, 0});
  const Body slab{Shape::box, {200, 200, 200}, {0.4F, 0.02F, 0.3F}, {0, 0, 0}, {}};
  const Body ball{Shape::sphere, {200, 60, 40}, {0.1F, 0, 0}, {0, 0.35, 0}, {}};
  const std::array<Body, 1> alone = {slab};
  const std::array<Body, 2> both = {slab, ball};
  inputs_.bodies = alone;
  const test::Picture lit = picture();
  inputs_.bodies = both;
  const test::Picture shaded = picture();
  const Vec3d under = inputs_.T_world_depth.inverse() * Vec3d{0.02, 0.02, 0.03};
  const auto camera = drawing_->config.camera;
  const int u = static_cast<int>(std::lround(camera.fx * under.x / under.z + camera.cx));
  const int v = static_cast<int>(std::lround(camera.fy * under.y / under.z + camera.cy));
  EXPECT_LT(shaded.at(u, v).g + 50, lit.at(u, v).g);
  // No acne: the slab beyond the shadow, and both alone, are as without shadows.
  inputs_.has_shadows = false;
  inputs_.bodies = alone;
  const test::Picture without = picture();
  const test::Difference difference = test::compare(lit, without);
  EXPECT_EQ(difference.part_far_off, 0);
  EXPECT_LT(difference.mean_abs, 0.05);
}

TEST_F(ShadowTest, BodyOutOfViewStillThrowsItsShadow) {
  see(std::array{kFloor});
  inputs_.light.toward_world = {0, 1, 1};
  // Above the picture's top edge and nearer than the floor it darkens.
  const std::array<Body, 1> bodies = {Body{Shape::sphere, {200, 60, 40}, {0.15F, 0, 0}, {0, 1.6, 1.6}, {}}};
  inputs_.bodies = bodies;
  const test::Picture drawn = picture();
  int darkened = 0;
  for (std::size_t i = 0; i < drawn.rgb.size(); i += 3) darkened += drawn.rgb[i] < 140 ? 1 : 0;
  EXPECT_GT(darkened, 1000);
}

TEST(FitShadow, RandomCastersLieInsideTheMapAndItsMarginIsClear) {
  constexpr unsigned kSeed = 5;
  SCOPED_TRACE(kSeed);
  std::mt19937 random(kSeed);
  std::uniform_real_distribution<double> place(-2, 2), size(0.02, 0.3);
  std::normal_distribution<double> normal;
  for (int round = 0; round < 200; ++round) {
    const T_WorldDepth T_world_depth{
        Rotation::from(
            Quaternion{normal(random), normal(random), normal(random), normal(random)}.normalized()),
        {place(random), place(random), place(random)}};
    const Vec3f light = Vec3d{normal(random), normal(random), normal(random)}.cast<float>();
    std::vector<Caster> casters;
    for (int i = 0; i < 1 + round % 7; ++i)
      casters.push_back({Vec3d{place(random), place(random), place(random)}.cast<float>(),
                         static_cast<float>(size(random)),
                         0,
                         0,
                         {}});
    const ShadowView sut = fit_shadow(casters, T_world_depth, light);
    const auto& m = sut.shadow_from_depth;
    for (const Caster& caster : casters)
      for (int i = 0; i < 20; ++i) {
        const Vec3f p = caster.center_depth_m +
                        Vec3d{normal(random), normal(random), normal(random)}.normalized().cast<float>() *
                            caster.radius_m;
        for (std::size_t row = 0; row < 3; ++row) {
          const float at = m[row] * p.x + m[4 + row] * p.y + m[8 + row] * p.z + m[12 + row];
          const float margin = row < 2 ? 2.0F / kShadowMapPixels : 0.001F;
          ASSERT_GT(at, margin) << round;
          ASSERT_LT(at, 1 - margin) << round;
        }
      }
    ASSERT_GT(sut.texel_m, 0);
  }
}

}  // namespace
}  // namespace tactus::render
