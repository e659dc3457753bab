// The light of rooms whose light is known.
#include "pipeline/render/light_estimate.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>
#include <vector>

#include "tests/pipeline/render/drawing.hpp"
#include "tests/pipeline/render/scene.hpp"

namespace tactus::render {
namespace {

constexpr int kWidth = 320, kHeight = 240;

/// A Lambert room (floor, back wall, side wall) with balls in it; tiles of 10 cm have albedos from 0.2 to 0.8
/// (mean kMeanAlbedo) and a tint of 10 % of their own.
struct Room {
  Light light;
  bool has_balls = true;
  unsigned seed = 1;
  std::vector<test::Plane> planes = {{{0, 1, 0}, 0}, {{0, 0, 1}, -1}, {{1, 0, 0}, -1.2}};

  std::vector<std::uint8_t> video;
  std::vector<float> depth_m;
  LightView view;

  void see() {
    const hal::Intrinsics camera = test::pinhole(kWidth, kHeight, 260);
    const T_WorldDepth T_world_depth = test::look_at({0.5, 1.4, 1.6}, {-0.1, 0.6, 0});
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> place(-0.9, 0.9), part(0, 1);
    std::vector<Vec3d> balls;
    for (int i = 0; i < 14; ++i) balls.push_back({place(random), 0.1 + part(random), 0.8 * place(random)});
    const Vec3d l = light.toward_world.cast<double>().normalized();
    const auto channel = [](const Vec3f& v, int c) {
      return static_cast<double>(c == 0 ? v.x : c == 1 ? v.y : v.z);
    };
    video.clear();
    depth_m.clear();
    for (int v = 0; v < kHeight; ++v)
      for (int u = 0; u < kWidth; ++u) {
        const Vec3d ray = T_world_depth.rotation * test::pixel_ray(camera, u, v);
        const Vec3d eye = T_world_depth.translation;
        double z = 1e9;
        Vec3d normal;
        for (const test::Plane& plane : planes) {
          const double at = (plane.offset_m - plane.normal.dot(eye)) / plane.normal.dot(ray);
          if (at > 0.1 && at < z) {
            z = at;
            normal = plane.normal;
          }
        }
        for (const Vec3d& ball : balls) {
          if (!has_balls) break;
          const Vec3d d = ray.normalized(), offset = ball - eye;
          const double along = offset.dot(d), inside = 0.04 - (offset.dot(offset) - along * along);
          if (inside <= 0) continue;
          const double at = (along - std::sqrt(inside)) / ray.norm();
          if (at > 0.1 && at < z) {
            z = at;
            normal = (eye + ray * at - ball).normalized();
          }
        }
        const Vec3d p = eye + ray * z;
        std::seed_seq tile{static_cast<int>(std::floor(p.x * 10)), static_cast<int>(std::floor(p.y * 10)),
                           static_cast<int>(std::floor(p.z * 10)), static_cast<int>(seed)};
        std::minstd_rand tile_random(tile);
        const double albedo = 0.2 + 0.6 * part(tile_random);
        for (int c = 0; c < 3; ++c) {
          const double tint = 0.9 + 0.2 * part(tile_random);
          const double up = channel(light.ambient_up, c), down = channel(light.ambient_down, c);
          const double sky = down + (up - down) * (0.5 + 0.5 * normal.y);
          const double linear =
              albedo * tint * (sky + channel(light.color, c) * std::max(normal.dot(l), 0.0));
          video.push_back(static_cast<std::uint8_t>(255 * std::sqrt(std::min(linear, 1.0)) + 0.5));
        }
        depth_m.push_back(static_cast<float>(z));
      }
    view = {video, depth_m, camera, T_world_depth};
  }
};

double angle_deg(const Vec3f& a, const Vec3f& b) {
  const double c = a.normalized().cast<double>().dot(b.normalized().cast<double>());
  return std::acos(std::min(c, 1.0)) * 180 / 3.14159265358979;
}

TEST(FitLight, LambertRoomsOfRandomAlbedosGiveTheirLampWithinTenDegreesAndTenPercent) {
  std::vector<LightSample> samples(light_samples_max(test::pinhole(kWidth, kHeight, 260)));
  for (unsigned seed = 1; seed <= 6; ++seed) {
    SCOPED_TRACE(seed);
    Room room;
    room.seed = seed;
    const Vec3f toward[3] = {{0.5F, 0.7F, 0.4F}, {-0.3F, 0.8F, 0.5F}, {0.7F, 0.5F, 0.6F}};
    room.light = {toward[seed % 3], {0.9F, 0.8F, 0.6F}, {0.25F, 0.27F, 0.33F}, {0.15F, 0.13F, 0.11F}};
    room.see();
    LightFit sut;
    ASSERT_EQ(fit_light(room.view, samples, sut), rt::Status::ok) << sut.spread;
    EXPECT_LT(angle_deg(sut.light.toward_world, room.light.toward_world), 10);
    EXPECT_NEAR(sut.light.color.x / sut.light.color.y, 0.9 / 0.8, 0.1 * 0.9 / 0.8);
    EXPECT_NEAR(sut.light.color.z / sut.light.color.y, 0.6 / 0.8, 0.1 * 0.6 / 0.8);
    EXPECT_NEAR(sut.light.color.y, 0.8, 0.25);
  }
}

TEST(FitLight, OneWallCannotTellAndAnswersTheDefaultLight) {
  Room room;
  room.has_balls = false;
  room.planes = {{{0, 0, 1}, -1}};
  room.see();
  std::vector<LightSample> samples(light_samples_max(room.view.camera));
  LightFit sut;
  EXPECT_EQ(fit_light(room.view, samples, sut), rt::Status::skipped);
  EXPECT_GE(sut.samples_count, kLightSamplesMin);
  EXPECT_LT(sut.spread, kLightSpreadMin);
  EXPECT_EQ(sut.light.toward_world, Light{}.toward_world);
  EXPECT_EQ(sut.light.color, Light{}.color);
}

TEST(FitLight, SaturatedAndUnmeasuredPixelsAreNoSamples) {
  Room room;
  room.see();
  std::vector<LightSample> samples(light_samples_max(room.view.camera));
  LightFit sut;
  std::fill(room.depth_m.begin(), room.depth_m.end(), std::nanf(""));
  EXPECT_EQ(fit_light(room.view, samples, sut), rt::Status::skipped);
  EXPECT_EQ(sut.samples_count, 0);
  room.see();
  std::fill(room.video.begin(), room.video.end(), std::uint8_t{255});
  EXPECT_EQ(fit_light(room.view, samples, sut), rt::Status::skipped);
  EXPECT_EQ(sut.samples_count, 0);
}

TEST(LightEstimate, LampNearTheHorizonIsRaisedAndKeepsItsHeading) {
  Room room;
  room.light = {{0.8F, 0.3F, 0.5F}, {0.6F, 0.6F, 0.6F}, {0.2F, 0.2F, 0.2F}, {0.15F, 0.15F, 0.15F}};
  room.see();
  std::vector<LightSample> samples(light_samples_max(room.view.camera));
  LightFit fit;
  ASSERT_EQ(fit_light(room.view, samples, fit), rt::Status::ok);
  EXPECT_LT(fit.light.toward_world.y, 0.5F) << "the fit says what it sees";
  const std::size_t bytes = LightEstimate::bytes_needed(room.view.camera);
  std::unique_ptr<std::byte, decltype(&std::free)> memory(
      static_cast<std::byte*>(std::aligned_alloc(rt::kCacheLineBytes, bytes)), std::free);
  LightEstimate sut;
  sut.bind(room.view.camera, rt::Slice({memory.get(), bytes}));
  ASSERT_EQ(sut.step(room.view, 0.033F), rt::Status::ok);
  const Vec3f toward = sut.light().toward_world;
  EXPECT_NEAR(toward.y, kLightElevationMin, 1e-5);
  EXPECT_NEAR(toward.norm(), 1, 1e-5);
  EXPECT_NEAR(toward.x / toward.z, fit.light.toward_world.x / fit.light.toward_world.z, 0.01);
}

TEST(LightEstimate, RedRoomDoesNotMakeRedShadows) {
  const Light seen{{0, 1, 0}, {0.1F, 0.8F, 0.9F}, {0.9F, 0.02F, 0.02F}, {0.5F, 0, 0}};
  const Light sut = believable(seen);
  for (const Vec3f& color : {sut.color, sut.ambient_up, sut.ambient_down}) {
    const float least = std::min({color.x, color.y, color.z}), most = std::max({color.x, color.y, color.z});
    EXPECT_LE(most, 1.51F * least);
  }
  EXPECT_GE(sut.ambient_up.y, kAmbientLeast * sut.color.y);
  const Light grey{{0.1F, 0.9F, 0}, {0.5F, 0.5F, 0.5F}, {0.4F, 0.4F, 0.4F}, {0.3F, 0.3F, 0.3F}};
  EXPECT_EQ(believable(grey).color, grey.color);
  EXPECT_EQ(believable(grey).ambient_up, grey.ambient_up);
}

TEST(LightEstimate, FollowsAChangeWithATimeConstantOfASecondAndKeepsWhatItKnew) {
  Room room;
  room.light = {{0.5F, 0.7F, 0.4F}, {0.4F, 0.4F, 0.4F}, {0.2F, 0.2F, 0.2F}, {0.15F, 0.15F, 0.15F}};
  room.see();
  const std::size_t bytes = LightEstimate::bytes_needed(room.view.camera);
  std::unique_ptr<std::byte, decltype(&std::free)> memory(
      static_cast<std::byte*>(std::aligned_alloc(rt::kCacheLineBytes, bytes)), std::free);
  LightEstimate sut;
  sut.bind(room.view.camera, rt::Slice({memory.get(), bytes}));
  ASSERT_EQ(sut.step(room.view, 0.033F), rt::Status::ok);
  const float before = sut.light().color.y;
  room.light.color = {0.8F, 0.8F, 0.8F};
  room.see();
  for (int i = 0; i < 30; ++i) ASSERT_EQ(sut.step(room.view, 1 / 30.0F), rt::Status::ok);
  const float after_one_s = sut.light().color.y;
  EXPECT_NEAR(after_one_s / before, 1 + 0.63, 0.12);  // 1 - 1/e of the way from once to twice
  room.planes = {{{0, 0, 1}, -1}};
  room.has_balls = false;
  room.see();
  EXPECT_EQ(sut.step(room.view, 0.033F), rt::Status::skipped);
  EXPECT_EQ(sut.light().color.y, after_one_s);
}

}  // namespace
}  // namespace tactus::render
