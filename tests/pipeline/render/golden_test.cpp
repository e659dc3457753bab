// Whole pictures against pictures that somebody has looked at (golden.hpp).
#include "tests/pipeline/render/golden.hpp"

#include <gtest/gtest.h>

#include <array>
#include <string>
#include <vector>

#include "tests/pipeline/render/drawing.hpp"
#include "tests/pipeline/render/picture.hpp"
#include "tests/pipeline/render/scene.hpp"

namespace tactus::render {
namespace {

constexpr int kWidth = 160, kHeight = 120;

/// A corner of a room as the video shows it: floor of tiles below, wall of stripes above.
test::Picture room_video() {
  test::Picture video(kWidth, kHeight);
  for (int v = 0; v < kHeight; ++v)
    for (int u = 0; u < kWidth; ++u) {
      const bool is_floor = v >= 80;
      const bool is_odd = is_floor ? (((u / 16) ^ ((v - 80) / 8)) & 1) != 0 : (u / 20) % 2 != 0;
      const int fade = is_floor ? v - 80 : v / 2;
      video.set(u, v,
                is_floor ? Rgb8{static_cast<std::uint8_t>((is_odd ? 150 : 110) + fade),
                                static_cast<std::uint8_t>((is_odd ? 110 : 80) + fade), 70}
                         : Rgb8{static_cast<std::uint8_t>((is_odd ? 170 : 190) - fade),
                                static_cast<std::uint8_t>((is_odd ? 180 : 195) - fade), 200});
    }
  return video;
}

// An octahedron with a flattened tip, about its centre.
constexpr std::array<Vec3f, 6> kGemVertices = {Vec3f{0.09F, 0, 0}, {-0.09F, 0, 0}, {0, 0.12F, 0},
                                               {0, -0.07F, 0},     {0, 0, 0.09F},  {0, 0, -0.09F}};
constexpr std::array<std::array<std::uint16_t, 3>, 8> kGemTriangles = {
    {{0, 2, 4}, {4, 2, 1}, {1, 2, 5}, {5, 2, 0}, {4, 3, 0}, {1, 3, 4}, {5, 3, 1}, {0, 3, 5}}};
constexpr std::array<HullMesh, 1> kHulls = {HullMesh{kGemVertices, kGemTriangles}};

class GoldenTest : public test::DrawingTest {
 protected:
  void SetUp() override {
    RenderConfig config;
    config.camera = test::pinhole(kWidth, kHeight, 140);
    config.bodies_count_max = 16;
    config.hulls = kHulls;
    open(config);
    video_ = room_video();
    inputs_.video_rgb = video_.rgb;
    // World y is up: the camera looks along world -z.
    inputs_.T_world_depth.rotation = Rotation{{1, 0, 0, 0, -1, 0, 0, 0, -1}};
  }

  void expect_golden(const std::string& name) {
    test::Picture drawn(kWidth, kHeight);
    ASSERT_EQ(draw(inputs_, drawn.rgb), rt::Status::ok);
    test::expect_golden(drawn, name);
  }

  test::Picture video_;
  RenderInputs inputs_;
};

TEST_F(GoldenTest, Background) { expect_golden("background"); }

TEST_F(GoldenTest, SphereInFront) {
  const std::array<Body, 1> bodies = {
      Body{Shape::sphere, {220, 60, 40}, {0.22F, 0.22F, 0.22F}, {0.05, -0.05, -1.2}, {}}};
  inputs_.bodies = bodies;
  expect_golden("sphere_in_front");
}

TEST_F(GoldenTest, SphereHalfBehindARealStep) {
  // A cupboard at 0.9 m on the left, the wall at 2.5 m on the right; the ball is at 1.2 m.
  std::vector<float> depth_m(kWidth * kHeight);
  for (int v = 0; v < kHeight; ++v)
    for (int u = 0; u < kWidth; ++u) depth_m[static_cast<std::size_t>(v * kWidth + u)] = u < 80 ? 0.9F : 2.5F;
  const std::array<Body, 1> bodies = {
      Body{Shape::sphere, {220, 60, 40}, {0.22F, 0.22F, 0.22F}, {0, 0, -1.2}, {}}};
  inputs_.depth_m = depth_m;
  inputs_.bodies = bodies;
  expect_golden("sphere_half_behind_step");
}

TEST_F(GoldenTest, Box) {
  const std::array<Body, 1> bodies = {Body{Shape::box,
                                           {60, 120, 220},
                                           {0.25F, 0.12F, 0.18F},
                                           {-0.05, -0.1, -1.3},
                                           Quaternion{0.88, 0.2, 0.4, 0.1}.normalized()}};
  inputs_.bodies = bodies;
  expect_golden("box");
}

TEST_F(GoldenTest, OverlayUnderASphere) {
  std::vector<MaterialId> labels(kWidth * kHeight, kUnknownMaterial);
  for (int v = 0; v < kHeight; ++v)
    for (int u = 0; u < kWidth; ++u) {
      MaterialId& label = labels[static_cast<std::size_t>(v * kWidth + u)];
      if (v >= 80)
        label = u < 100 ? material_from_name("wood") : material_from_name("carpet");
      else if (u >= 20 && u < 60 && v >= 15 && v < 60)
        label = material_from_name("glass");
      else if (u >= 110)
        label = material_from_name("fabric");
      else if (u < 90)
        label = material_from_name("painted");
    }
  const std::array<Body, 1> bodies = {
      Body{Shape::sphere, {220, 220, 220}, {0.15F, 0.15F, 0.15F}, {0, -0.15, -1.2}, {}}};
  inputs_.labels = labels;
  inputs_.bodies = bodies;
  expect_golden("overlay");
}

// Every shape, dull to metal, above a floor and a wall that their shadows fall on; a real edge hides a part.
TEST_F(GoldenTest, ShapesAndTheirShadows) {
  inputs_.T_world_depth = test::look_at({0, 0.75, 1.5}, {0, 0.15, 0});
  const std::array<test::Plane, 2> room = {test::Plane{{0, 1, 0}, 0}, test::Plane{{0, 0, 1}, -0.5}};
  std::vector<float> depth_m = test::depth_of_planes(drawing_->config.camera, inputs_.T_world_depth, room);
  for (int v = 70; v < 105; ++v)
    for (int u = 8; u < 24; ++u) depth_m[static_cast<std::size_t>(v * kWidth + u)] = 0.9F;
  std::array<Body, 6> bodies;
  bodies[0] = {Shape::sphere, {200, 60, 50}, {0.1F, 0, 0}, {-0.45, 0.1, 0.25}, {}, 0, 0, 0.25F, 0};
  bodies[1] = {Shape::box,
               {190, 150, 90},
               {0.08F, 0.08F, 0.08F},
               {-0.2, 0.2, -0.1},
               Quaternion{0.9, 0.2, 0.4, 0.1}.normalized(),
               0,
               0,
               0.8F,
               0};
  bodies[2] = {Shape::capsule,
               {70, 160, 90},
               {0.06F, 0, 0},
               {0.05, 0.12, 0.3},
               Quaternion{0.8, 0.2, 0.5, 0.1}.normalized(),
               0.1F,
               0,
               0.4F,
               0};
  bodies[3] = {Shape::cylinder,
               {220, 215, 210},
               {0.07F, 0, 0},
               {0.25, 0.13, 0},
               Quaternion{0.7071, -0.7071, 0, 0}.normalized(),
               0.1F,
               0,
               0.3F,
               1};
  bodies[4] = {
      Shape::hull, {80, 120, 210}, {}, {0.45, 0.15, 0.25}, Quaternion{0.95, 0.1, 0.3, 0}.normalized(), 0,
      0,           0.35F,          0};
  bodies[5] = {Shape::sphere, {230, 180, 60}, {0.07F, 0, 0}, {0.1, 0.5, -0.25}, {}, 0, 0, 0.3F, 1};
  inputs_.bodies = bodies;
  inputs_.depth_m = depth_m;
  expect_golden("shapes_and_shadows");
}

}  // namespace
}  // namespace tactus::render
