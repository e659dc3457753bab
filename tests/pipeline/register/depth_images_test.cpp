#include "pipeline/register/depth_images.hpp"

#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

namespace tactus {
namespace {

template <typename Check>
void for_each_instruction_set(Check check) {
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    hwy::SetSupportedTargetsForTest(target);
    hwy::GetChosenTarget().Update(hwy::SupportedTargets());
    check(hwy::TargetName(target));
  }
  hwy::SetSupportedTargetsForTest(0);
  hwy::GetChosenTarget().Update(hwy::SupportedTargets());
}

TEST(NormalizeDepth, EveryLengthIsDoneToItsLastPixel) {
  std::mt19937 random(2);
  for_each_instruction_set([&](const char* name) {
    SCOPED_TRACE(name);
    for (std::size_t count = 1; count <= 70; ++count) {
      std::vector<std::uint16_t> raw(count), depth(count + 1, 0xABCD);
      for (auto& r : raw) r = static_cast<std::uint16_t>(random() % 7000);
      const std::uint32_t valid = normalize_depth(raw, 0.001, 5.0f, std::span(depth).first(count));
      std::uint32_t expected_valid = 0;
      for (std::size_t i = 0; i < count; ++i) {
        const int expected = raw[i] <= 5000 ? raw[i] * 8 : 0;
        ASSERT_EQ(depth[i], expected) << "raw " << raw[i] << " at " << i << " of " << count;
        expected_valid += expected > 0;
      }
      ASSERT_EQ(valid, expected_valid);
      ASSERT_EQ(depth[count], 0xABCD) << "written past the end";
    }
  });
}

TEST(NormalizeDepth, NothingAndBeyondTheLimitBecomeZero) {
  const std::vector<std::uint16_t> raw = {0, 1, 4999,  5000, 5001, 8191, 8192, 65534, 65535,
                                          0, 3, 65535, 4,    5,    6,    7,    65535};
  std::vector<std::uint16_t> depth(raw.size());
  EXPECT_EQ(normalize_depth(raw, 0.001, 5.0f, depth), 8U);
  EXPECT_EQ(depth[0], 0);
  EXPECT_EQ(depth[1], 8);
  EXPECT_EQ(depth[2], 39992);
  EXPECT_EQ(depth[3], 40000) << "the limit itself counts";
  for (const std::size_t i : {std::size_t{4}, std::size_t{5}, std::size_t{6}, std::size_t{7}, std::size_t{8},
                              std::size_t{11}, std::size_t{16}})
    EXPECT_EQ(depth[i], 0) << raw[i];
}

TEST(NormalizeDepth, LimitBeyondSixteenBitsIsTheirs) {
  const std::vector<std::uint16_t> raw = {8191, 8192, 20000, 65535};
  std::vector<std::uint16_t> depth(raw.size());
  EXPECT_EQ(normalize_depth(raw, 0.001, 100.0f, depth), 1U);
  EXPECT_EQ(depth[0], 65528);
  EXPECT_EQ(depth[1], 0);
}

TEST(NormalizeDepth, FineUnitsAreRoundedToTheNearest) {
  std::vector<std::uint16_t> raw(64), depth(64);
  for (std::size_t i = 0; i < raw.size(); ++i) raw[i] = static_cast<std::uint16_t>(5000 + i);
  normalize_depth(raw, 0.0002, 5.0f, depth);
  for (std::size_t i = 0; i < raw.size(); ++i) EXPECT_NEAR(depth[i], raw[i] * 1.6, 0.501);
}

TEST(HalfDepth, IsTheMeanOfWhatIsValidAndZeroAcrossAnEdge) {
  constexpr int kWidth = 64, kHeight = 8;
  std::vector<std::uint16_t> depth(kWidth * kHeight, 12000);  // 1.5 m
  const auto set = [&](int x, int y, std::uint16_t a, std::uint16_t b, std::uint16_t c, std::uint16_t d) {
    const auto at = static_cast<std::size_t>(2 * y * kWidth + 2 * x);
    depth[at] = a;
    depth[at + 1] = b;
    depth[at + kWidth] = c;
    depth[at + kWidth + 1] = d;
  };
  set(3, 1, 8000, 8010, 8020, 8030);
  set(4, 1, 0, 8000, 0, 8016);
  set(5, 1, 0, 0, 0, 0);
  set(6, 1, 0, 0, 0, 8008);
  set(31, 3, 8000, 8000, 16000, 16000);  // an edge
  set(30, 3, 8000, 8000, 8150, 8150);    // a slope: 19 mm at one metre, limit 21.3 mm
  set(29, 3, 8000, 8000, 8180, 8180);    // 22.5 mm: an edge
  for_each_instruction_set([&](const char* name) {
    SCOPED_TRACE(name);
    std::vector<float> half(kWidth * kHeight / 4, -1.0f);
    half_depth(depth, kWidth, kHeight, half);
    const auto at = [&](int x, int y) { return half[static_cast<std::size_t>(y * kWidth / 2 + x)]; };
    EXPECT_FLOAT_EQ(at(3, 1), 8015 * kDepthUnitM);
    EXPECT_FLOAT_EQ(at(4, 1), 8008 * kDepthUnitM);
    EXPECT_EQ(at(5, 1), 0);
    EXPECT_FLOAT_EQ(at(6, 1), 8008 * kDepthUnitM);
    EXPECT_EQ(at(31, 3), 0);
    EXPECT_FLOAT_EQ(at(30, 3), 8075 * kDepthUnitM);
    EXPECT_EQ(at(29, 3), 0);
    EXPECT_FLOAT_EQ(at(0, 0), 1.5f);
  });
}

TEST(HalfDepth, WidthsThatFillNoVectorAreDoneToTheEnd) {
  for (const int width : {32, 34, 38, 46, 62, 66}) {
    std::vector<std::uint16_t> depth(static_cast<std::size_t>(width) * 2);
    for (std::size_t i = 0; i < depth.size(); ++i)
      depth[i] = static_cast<std::uint16_t>(8000 + i % static_cast<std::size_t>(width));
    for_each_instruction_set([&](const char* name) {
      SCOPED_TRACE(name);
      std::vector<float> half(static_cast<std::size_t>(width) / 2, -1.0f);
      half_depth(depth, width, 2, half);
      for (std::size_t x = 0; x < half.size(); ++x)
        EXPECT_FLOAT_EQ(half[x], (8000.5f + 2.0f * static_cast<float>(x)) * kDepthUnitM)
            << "width " << width << " x " << x;
    });
  }
}

TEST(HalfResolution, PixelCentresLieBetweenTheirFour) {
  hal::Intrinsics full;
  full.width = 640;
  full.height = 480;
  full.fx = 525;
  full.fy = 520;
  full.cx = 319.5;
  full.cy = 239.5;
  const auto half = half_resolution(full);
  // The ray of half pixel i is that of full coordinate 2 i + 0.5.
  for (const int i : {0, 17, 319}) {
    EXPECT_NEAR((i - half.cx) / half.fx, (2 * i + 0.5 - full.cx) / full.fx, 1e-12);
    EXPECT_NEAR((i - half.cy) / half.fy, (2 * i + 0.5 - full.cy) / full.fy, 1e-12);
  }
}

struct Image {
  hal::Intrinsics camera;
  std::vector<std::uint16_t> depth, tiles;
  std::vector<float> half, scratch;
  std::vector<std::uint32_t> pixels;

  template <typename Function>
  explicit Image(Function z_m_of) {
    camera.width = 320;
    camera.height = 240;
    camera.fx = 262.5;
    camera.fy = 260;
    camera.cx = 159.5;
    camera.cy = 119.5;
    for (int v = 0; v < camera.height; ++v)
      for (int u = 0; u < camera.width; ++u)
        depth.push_back(static_cast<std::uint16_t>(
            std::lround(z_m_of((u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy) * 8000)));
    half.resize(depth.size() / 4);
    half_depth(depth, camera.width, camera.height, half);
    pixels.resize(depth.size());
    tiles.resize(tiles_count(camera.width, camera.height) + 1);
    scratch.resize(tile_scratch_count(camera.width, camera.height));
    tactus::integration_image(depth, half, camera, scratch, {pixels, tiles});
  }
  [[nodiscard]] std::uint16_t tile(int tx, int ty) const {
    return tiles[static_cast<std::size_t>(ty * camera.width / 4 + tx)];
  }
  [[nodiscard]] std::uint32_t pixel(int u, int v) const {
    return pixels[static_cast<std::size_t>(v * camera.width + u)];
  }
};

struct Slant {
  double x, y;
};
class IntegrationImageOfAPlane : public testing::TestWithParam<Slant> {};

// z (n . ray) = d: closed forms of the slopes, of the cosine, and of the weight.
TEST_P(IntegrationImageOfAPlane, SlopesAndCosinesAreThePlanes) {
  const double gx = GetParam().x, gy = GetParam().y;
  constexpr double kAt = 1.4;
  const auto z_at = [&](double a, double b) { return kAt / (1 - gx * a - gy * b); };
  const Image sut(z_at);
  const double norm = std::sqrt(gx * gx + gy * gy + 1);
  for (int ty = 1; ty < 59; ++ty)
    for (int tx = 1; tx < 79; ++tx) {
      const double u = 4 * tx + 1.5, v = 4 * ty + 1.5;
      const double a = (u - sut.camera.cx) / sut.camera.fx, b = (v - sut.camera.cy) / sut.camera.fy;
      const double z = z_at(a, b);
      const double z_u = z * z / kAt * gx / sut.camera.fx, z_v = z * z / kAt * gy / sut.camera.fy;
      // n . (x / z, y / z, 1), the normal towards +z.
      const double cosine = (1 - gx * a - gy * b) / norm;
      const std::uint32_t pixel = sut.pixel(4 * tx + 1, 4 * ty + 2);
      const double slope_unit = static_cast<double>(kSlopeUnitM);
      ASSERT_EQ(pixel & 0xFFFFu, sut.depth[static_cast<std::size_t>((4 * ty + 2) * 320 + 4 * tx + 1)]);
      ASSERT_NEAR(static_cast<std::int8_t>(pixel >> 16) * slope_unit,
                  std::clamp(z_u, -127 * slope_unit, 127 * slope_unit), slope_unit)
          << tx << ' ' << ty;
      ASSERT_NEAR(static_cast<std::int8_t>(pixel >> 24) * slope_unit,
                  std::clamp(z_v, -127 * slope_unit, 127 * slope_unit), slope_unit)
          << tx << ' ' << ty;
      const double stored = (sut.tile(tx, ty) & 0xFF) * static_cast<double>(kTileCosineScale);
      ASSERT_NEAR(stored, std::clamp(cosine, 0.2, 1.27), 0.012) << tx << ' ' << ty;
      const double relative = static_cast<double>(depth_sigma_m(1.0f)) /
                              static_cast<double>(depth_sigma_m(static_cast<float>(z)));
      ASSERT_NEAR(sut.tile(tx, ty) >> 8, std::clamp(32 * relative * relative * cosine, 1.0, 32.0), 1.0)
          << tx << ' ' << ty;
    }
}

INSTANTIATE_TEST_SUITE_P(Slants, IntegrationImageOfAPlane,
                         testing::Values(Slant{0, 0}, Slant{0.3, 0}, Slant{0, -0.4}, Slant{0.5, 0.4},
                                         Slant{-0.8, 0.1}));

TEST(IntegrationImage, BesideATileWithAnEdgeTheSurfaceFacesTheCameraWithLittleWeight) {
  // The edge lies between columns 157 and 158: within tile 39, which then has no depth of its own.
  const Image sut([](double a, double) { return a * 262.5 + 159.5 < 157.5 ? 1.0 : 2.0; });
  for (const int tx : {38, 39, 40}) {
    EXPECT_EQ(sut.tile(tx, 20) & 0xFF, 200) << tx;
    EXPECT_EQ(sut.pixel(4 * tx, 80) >> 16, 0U) << "no slope";
  }
  EXPECT_LT(sut.tile(38, 20) >> 8, (sut.tile(10, 20) >> 8) * 0.5);
  EXPECT_LT(sut.tile(40, 20) >> 8, (sut.tile(70, 20) >> 8) * 0.5);
}

TEST(IntegrationImage, SlopesSaturateInsteadOfWrapping) {
  const Image sut([](double a, double) { return 2.0 / (1 - 2.4 * a); });  // 15.7 mm a pixel at the right
  for (int u = 8; u < 200; ++u) {
    const auto slope = static_cast<std::int8_t>(sut.pixel(u, 100) >> 16);
    EXPECT_GE(slope, 0) << u;
  }
}

}  // namespace
}  // namespace tactus
