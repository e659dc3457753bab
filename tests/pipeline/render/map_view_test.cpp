#include "pipeline/render/map_view.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <vector>

namespace tactus::render {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

Rgb8 pixel(std::span<const std::uint8_t> rgb, std::size_t i) {
  return {rgb[3 * i], rgb[3 * i + 1], rgb[3 * i + 2]};
}

TEST(ShadeNormals, HeadOnIsWhiteEdgeOnIsDimAndNothingIsZero) {
  const std::array<Vec3f, 5> normals = {Vec3f{0, 0, -1}, Vec3f{1, 0, 0}, Vec3f{0, 0, 1}, Vec3f{},
                                        Vec3f{kNan, 0, 0}};
  std::array<Shade, 5> shades{};
  shade_normals(normals, {0, 0, -1}, shades);
  EXPECT_EQ(shades, (std::array<Shade, 5>{255, 64, 64, 0, 0}));
}

TEST(ShadeDepth, GoesFromNearToFarAndMarksHoles) {
  const std::array<float, 6> depth_m = {0.2F, 0.5F, 2.25F, 9.0F, 0.0F, kNan};
  std::array<Shade, 6> shades{};
  shade_depth(depth_m, 0.5F, 4.0F, shades);
  EXPECT_EQ(shades, (std::array<Shade, 6>{255, 255, 160, 64, 0, 0}));
}

TEST(NormalsOfDepth, TiltedPlaneHasItsNormalEverywhereInside) {
  hal::Intrinsics camera;
  camera.width = 32;
  camera.height = 24;
  camera.fx = camera.fy = 30;
  camera.cx = 15.5;
  camera.cy = 11.5;
  const Vec3f normal = Vec3f{0.3F, -0.5F, -0.8F}.normalized();  // plane n . p = -1.2, facing the camera
  std::vector<float> depth_m(32 * 24);
  for (int v = 0; v < 24; ++v)
    for (int u = 0; u < 32; ++u) {
      const Vec3f ray{(static_cast<float>(u) - 15.5F) / 30, (static_cast<float>(v) - 11.5F) / 30, 1};
      depth_m[static_cast<std::size_t>(v * 32 + u)] = -1.2F / normal.dot(ray);
    }
  std::vector<Vec3f> normals(depth_m.size());
  normals_of_depth(depth_m, camera, normals);
  std::size_t inside_count = 0;
  for (std::size_t v = 1; v < 23; ++v)
    for (std::size_t u = 1; u < 31; ++u)
      if (normals[v * 32 + u] != Vec3f{}) {
        ++inside_count;
        EXPECT_GT(normals[v * 32 + u].dot(normal), 0.9999F) << u << ' ' << v;
      }
  EXPECT_GT(inside_count, 22U * 30U / 2);
  EXPECT_EQ(normals[0], Vec3f{});
}

TEST(NormalsOfDepth, StepsAndHolesHaveNone) {
  hal::Intrinsics camera;
  camera.width = 8;
  camera.height = 5;
  camera.fx = camera.fy = 10;
  camera.cx = 3.5;
  camera.cy = 2;
  std::vector<float> depth_m(40, 1.0F);
  for (std::size_t v = 0; v < 5; ++v)
    for (std::size_t u = 4; u < 8; ++u) depth_m[v * 8 + u] = 1.5F;
  depth_m[2 * 8 + 1] = 0;
  std::vector<Vec3f> normals(depth_m.size());
  normals_of_depth(depth_m, camera, normals);
  EXPECT_EQ(normals[1 * 8 + 3], Vec3f{});  // beside the step
  EXPECT_EQ(normals[1 * 8 + 4], Vec3f{});
  EXPECT_EQ(normals[2 * 8 + 2], Vec3f{});  // beside the hole
  EXPECT_EQ(normals[2 * 8 + 1], Vec3f{});
  EXPECT_EQ(normals[1 * 8 + 5], (Vec3f{0, 0, -1}));
}

TEST(PaintLabels, FullShadeIsThePaletteAndNoSurfaceStaysDark) {
  const std::array<Shade, 4> shades = {255, 255, 128, 0};
  const std::array<MaterialId, 4> labels = {material_from_name("wood"), kUnknownMaterial,
                                            material_from_name("glass"), 6};
  std::array<std::uint8_t, 12> rgb{};
  paint_labels(shades, labels, rgb);
  EXPECT_EQ(pixel(rgb, 0), material_color(22));
  EXPECT_EQ(pixel(rgb, 1), kUnknownColor);
  EXPECT_EQ(pixel(rgb, 2), (Rgb8{20, 100, 35}));  // (40 200 70) x 128 / 255
  EXPECT_EQ(pixel(rgb, 3), kNoSurfaceColor);
}

TEST(PaintGreyAndColors, ShadeScalesTheColour) {
  const std::array<Shade, 2> shades = {51, 0};
  const std::array<Rgb8, 2> colors = {Rgb8{250, 100, 0}, Rgb8{1, 1, 1}};
  std::array<std::uint8_t, 6> rgb{};
  paint_grey(shades, rgb);
  EXPECT_EQ(pixel(rgb, 0), (Rgb8{51, 51, 51}));
  EXPECT_EQ(pixel(rgb, 1), kNoSurfaceColor);
  paint_colors(shades, colors, rgb);
  EXPECT_EQ(pixel(rgb, 0), (Rgb8{50, 20, 0}));
}

}  // namespace
}  // namespace tactus::render
