#include "pipeline/label_view.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "pipeline/register/half_color.hpp"
#include "pipeline/source_scores.hpp"

namespace tactus {
namespace {

hal::RigCalibration two_cameras() {
  hal::RigCalibration rig;
  rig.depth = {320, 240, 260, 260, 159.5, 119.5, 0, 0, 0, 0, 0};
  rig.has_color = true;
  rig.color = {320, 240, 250, 252, 161, 118, 0.05, -0.1, 0.001, -0.002, 0};
  rig.T_color_depth.translation = {-0.03, 0.005, 0};
  return rig;
}

TEST(LabelView, ARayThroughAPixelIsSeenInThatPixel) {
  const hal::RigCalibration rig = two_cameras();
  const T_WorldDepth T_world_depth{{}, {0.3, -0.2, 1}};
  const PictureCamera sut = picture_camera_at(T_world_depth, rig);
  EXPECT_NEAR(sut.T_world_camera.translation.x, 0.33, 1e-12);
  EXPECT_NEAR(sut.T_world_camera.translation.y, -0.205, 1e-12);
  for (int v = 0; v < rig.color.height; v += 40)
    for (int u = 0; u < rig.color.width; u += 40) {
      const Vec3d world = sut.T_world_camera.translation + ray_of(sut, u, v) * 2.0;
      const Vec3d p = rig.T_color_depth * (T_world_depth.inverse() * world);
      EXPECT_NEAR(p.z, 2, 1e-9);
      const Normalized seen =
          distort(rig.color, {static_cast<float>(p.x / p.z), static_cast<float>(p.y / p.z)});
      EXPECT_NEAR(static_cast<double>(seen.x) * rig.color.fx + rig.color.cx, u, 0.01);
      EXPECT_NEAR(static_cast<double>(seen.y) * rig.color.fy + rig.color.cy, v, 0.01);
    }
}

TEST(LabelView, CamerasThatSharePixelsAreOne) {
  hal::RigCalibration rig = two_cameras();
  rig.registered = true;
  const T_WorldDepth T_world_depth{{}, {0.3, -0.2, 1}};
  const PictureCamera sut = picture_camera_at(T_world_depth, rig);
  EXPECT_EQ(sut.intrinsics, rig.depth);
  EXPECT_EQ(sut.T_world_camera.translation, T_world_depth.translation);
}

TEST(LabelView, ExactLabelsComeBackFromScoresWhereTheGridHasRoom) {
  constexpr int kWidth = 64, kHeight = 48;
  hal::Intrinsics camera{kWidth, kHeight, 50, 50, 31.5, 23.5, 0, 0, 0, 0, 0};
  std::vector<MaterialId> labels(kWidth * kHeight, 22), seen(labels.size());
  for (int v = 0; v < kHeight; ++v)
    for (int u = 32; u < kWidth; ++u)
      labels[static_cast<std::size_t>(v * kWidth + u)] = v < 24 ? 3 : kUnknownMaterial;
  std::vector<std::uint8_t> memory(16 * 12 * kMaterialCount);
  segment::MaterialScores scores{16, 12, memory, {}, {}};
  scores_of_labels(labels, camera, scores);
  labels_of_scores(scores, kWidth, kHeight, seen);
  for (int v = 0; v < kHeight; ++v)
    for (int u = 0; u < kWidth; ++u) {
      const auto i = static_cast<std::size_t>(v * kWidth + u);
      const bool is_near_edge = (u >= 28 && u < 36) || (u >= 28 && v >= 20 && v < 28);
      if (is_near_edge) continue;
      // All alike where nothing is known: the lowest id.
      EXPECT_EQ(seen[i], labels[i] == kUnknownMaterial ? 0 : labels[i]) << u << " " << v;
    }
}

}  // namespace
}  // namespace tactus
