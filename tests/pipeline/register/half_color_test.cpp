#include "pipeline/register/half_color.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "pipeline/register/depth_images.hpp"

namespace tactus {
namespace {

hal::Intrinsics lens() {
  hal::Intrinsics camera;
  camera.width = 320;
  camera.height = 240;
  camera.fx = 269;
  camera.fy = 268.5;
  camera.cx = 162;
  camera.cy = 118;
  camera.k1 = 0.09;
  camera.k2 = -0.16;
  camera.p1 = 0.0008;
  camera.p2 = -0.0006;
  camera.k3 = 0.05;
  return camera;
}

TEST(HalfColorRegistered, IsTheRoundedMeanOfFour) {
  constexpr int kWidth = 38, kHeight = 6;
  std::mt19937 random(9);
  std::vector<std::uint8_t> rgb(kWidth * kHeight * 3);
  for (auto& c : rgb) c = static_cast<std::uint8_t>(random());
  std::vector<PackedColor> half(kWidth * kHeight / 4);
  half_color_registered(rgb, kWidth, kHeight, half);
  for (int y = 0; y < kHeight / 2; ++y)
    for (int x = 0; x < kWidth / 2; ++x) {
      const PackedColor word = half[static_cast<std::size_t>(y * kWidth / 2 + x)];
      ASSERT_EQ(word >> 24, 255U);
      for (int c = 0; c < 3; ++c) {
        int sum = 0;
        for (int j = 0; j < 2; ++j)
          for (int i = 0; i < 2; ++i)
            sum += rgb[static_cast<std::size_t>(((2 * y + j) * kWidth + 2 * x + i) * 3 + c)];
        ASSERT_EQ(static_cast<int>(word >> (8 * c) & 255), (sum + 2) / 4) << x << ' ' << y << ' ' << c;
      }
    }
}

TEST(Distortion, UndistortBringsEveryPixelBack) {
  const auto camera = lens();
  double worst_px = 0;
  for (int v = 0; v < camera.height; v += 3)
    for (int u = 0; u < camera.width; u += 3) {
      const Normalized seen{static_cast<float>((u - camera.cx) / camera.fx),
                            static_cast<float>((v - camera.cy) / camera.fy)};
      const Normalized again = distort(camera, undistort(camera, seen));
      worst_px = std::max(worst_px, std::hypot(static_cast<double>(again.x - seen.x) * camera.fx,
                                               static_cast<double>(again.y - seen.y) * camera.fy));
    }
  EXPECT_LT(worst_px, 1e-3);
}

TEST(Distortion, IsBrownsFormula) {
  const auto c = lens();
  const double x = 0.31, y = -0.22, r2 = x * x + y * y;
  const double radial = 1 + c.k1 * r2 + c.k2 * r2 * r2 + c.k3 * r2 * r2 * r2;
  const Normalized sut = distort(c, {0.31f, -0.22f});
  EXPECT_NEAR(sut.x, x * radial + 2 * c.p1 * x * y + c.p2 * (r2 + 2 * x * x), 1e-6);
  EXPECT_NEAR(sut.y, y * radial + c.p1 * (r2 + 2 * y * y) + 2 * c.p2 * x * y, 1e-6);
}

TEST(Distortion, NoCoefficientsChangeNothing) {
  hal::Intrinsics ideal = lens();
  ideal.k1 = ideal.k2 = ideal.k3 = ideal.p1 = ideal.p2 = 0;
  const Normalized sut = distort(ideal, {0.4f, 0.3f});
  EXPECT_EQ(sut.x, 0.4f);
  EXPECT_EQ(sut.y, 0.3f);
}

// A box before a wall, two cameras 20 cm apart, so that the box hides a strip of wall from the colour camera.
class TwoCameras : public testing::Test {
 protected:
  TwoCameras() {
    rig_.depth.width = 320;
    rig_.depth.height = 240;
    rig_.depth.fx = rig_.depth.fy = 262.5;
    rig_.depth.cx = 159.5;
    rig_.depth.cy = 119.5;
    rig_.has_color = true;
    rig_.color = lens();
    rig_.T_color_depth = {Rotation::from(Quaternion{1, 0.004, -0.01, 0.002}.normalized()),
                          {-0.2, 0.01, 0.02}};
    half_camera_ = half_resolution(rig_.depth);
    for (int y = 0; y < half_camera_.height; ++y)
      for (int x = 0; x < half_camera_.width; ++x) half_m_.push_back(static_cast<float>(depth_at(x, y)));
    for (int v = 0; v < 240; ++v)
      for (int u = 0; u < 320; ++u) {
        rgb_.push_back(static_cast<std::uint8_t>(u));
        rgb_.push_back(static_cast<std::uint8_t>(v));
        rgb_.push_back(static_cast<std::uint8_t>(u / 256 + 7));
      }
    nearest_.resize(color_bins_count(rig_.color));
    color_.assign(half_m_.size(), 0x12345678u);
    pixel_.assign(half_m_.size(), 0x12345678u);
    half_color_projected(rgb_, rig_, half_m_, half_camera_, nearest_, color_, pixel_);
  }

  static double depth_at(int x, int y) {
    if (x % 23 == 5 && y % 17 == 3) return 0;
    const bool is_box = x > 60 && x < 100 && y > 40 && y < 80;
    return is_box ? 1.0 : 2.2;
  }

  // In double: the colour camera's pixel coordinates and depth of a half-resolution pixel.
  struct Projected {
    double u = 0, v = 0, z = 0;
  };
  [[nodiscard]] Projected project(int x, int y, double z) const {
    const Vec3d p{(x - half_camera_.cx) / half_camera_.fx * z, (y - half_camera_.cy) / half_camera_.fy * z,
                  z};
    const Vec3d q = rig_.T_color_depth * p;
    const double a = q.x / q.z, b = q.y / q.z, r2 = a * a + b * b;
    const auto& c = rig_.color;
    const double radial = 1 + c.k1 * r2 + c.k2 * r2 * r2 + c.k3 * r2 * r2 * r2;
    return {(a * radial + 2 * c.p1 * a * b + c.p2 * (r2 + 2 * a * a)) * c.fx + c.cx,
            (b * radial + c.p1 * (r2 + 2 * b * b) + 2 * c.p2 * a * b) * c.fy + c.cy, q.z};
  }

  // Exact occlusion: the line from the colour camera to the wall's point crosses the box's front in the depth
  // image.
  [[nodiscard]] bool is_hidden(int x, int y) const {
    const auto T_depth_color = rig_.T_color_depth.inverse();
    const double z = depth_at(x, y);
    const Vec3d p{(x - half_camera_.cx) / half_camera_.fx * z, (y - half_camera_.cy) / half_camera_.fy * z,
                  z};
    const Vec3d from = T_depth_color.translation;
    if (z < 1.5) return false;
    const double s = (1.0 - from.z) / (p.z - from.z);
    const Vec3d crossing = from + (p - from) * s;
    const double bx = crossing.x * half_camera_.fx + half_camera_.cx,
                 by = crossing.y * half_camera_.fy + half_camera_.cy;
    return bx > 60.5 && bx < 99.5 && by > 40.5 && by < 79.5;
  }

  hal::RigCalibration rig_;
  hal::Intrinsics half_camera_;
  std::vector<float> half_m_, nearest_;
  std::vector<std::uint8_t> rgb_;
  std::vector<PackedColor> color_;
  std::vector<std::uint32_t> pixel_;
};

TEST_F(TwoCameras, EveryColouredPixelIsWhereDoublePrecisionPutsIt) {
  int known_count = 0, moved_count = 0;
  for (int y = 0; y < half_camera_.height; ++y)
    for (int x = 0; x < half_camera_.width; ++x) {
      const auto i = static_cast<std::size_t>(y * half_camera_.width + x);
      if (depth_at(x, y) == 0) {
        ASSERT_EQ(pixel_[i], kNoColorPixel);
      }
      if (pixel_[i] == kNoColorPixel) {
        ASSERT_EQ(color_[i], 0U);
        continue;
      }
      ++known_count;
      const Projected expected = project(x, y, static_cast<double>(half_m_[i]));
      const int u = static_cast<int>(pixel_[i] & 0xFFFFu), v = static_cast<int>(pixel_[i] >> 16);
      ASSERT_LE(std::fabs(u - expected.u), 0.502) << x << ' ' << y;
      ASSERT_LE(std::fabs(v - expected.v), 0.502) << x << ' ' << y;
      moved_count += std::abs(u - 2 * x) > 10;
      ASSERT_EQ(color_[i], static_cast<std::uint32_t>(u & 255) | static_cast<std::uint32_t>(v) << 8 |
                               static_cast<std::uint32_t>(u / 256 + 7) << 16 | 0xFF000000u);
    }
  EXPECT_GT(known_count, half_camera_.width * half_camera_.height / 2);
  EXPECT_GT(moved_count, known_count / 2) << "the two cameras must differ for this to say anything";
}

TEST_F(TwoCameras, WhatTheBoxHidesHasNoColourAndTheRestHas) {
  int hidden_count = 0, leaked_count = 0, seen_count = 0, wrongly_hidden_count = 0;
  for (int y = 0; y < half_camera_.height; ++y)
    for (int x = 0; x < half_camera_.width; ++x) {
      if (depth_at(x, y) == 0) continue;
      const auto i = static_cast<std::size_t>(y * half_camera_.width + x);
      const Projected at = project(x, y, depth_at(x, y));
      const bool inside = at.u > 0 && at.v > 0 && at.u < 319 && at.v < 239;
      if (!inside) continue;
      if (is_hidden(x, y)) {
        ++hidden_count;
        leaked_count += pixel_[i] != kNoColorPixel;
      } else {
        ++seen_count;
        wrongly_hidden_count += pixel_[i] == kNoColorPixel;
      }
    }
  ASSERT_GT(hidden_count, 200);
  EXPECT_LE(leaked_count, hidden_count / 50) << "of " << hidden_count;
  // Bins of eight pixels hide up to a bin's width of wall beside the box.
  EXPECT_LE(wrongly_hidden_count, seen_count * 3 / 100) << "of " << seen_count;
}

TEST_F(TwoCameras, OutOfTheColourImageThereIsNoColour) {
  int outside_count = 0;
  for (int y = 0; y < half_camera_.height; ++y)
    for (int x = 0; x < half_camera_.width; ++x) {
      const Projected at = project(x, y, std::max(depth_at(x, y), 0.5));
      if (at.u > -1 && at.v > -1 && at.u < 320 && at.v < 240) continue;
      ++outside_count;
      EXPECT_EQ(pixel_[static_cast<std::size_t>(y * half_camera_.width + x)], kNoColorPixel);
    }
  EXPECT_GT(outside_count, 100);
}

}  // namespace
}  // namespace tactus
