#include "pipeline/spine.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "pipeline/label/material.hpp"
#include "tests/pipeline/spine/session.hpp"

namespace tactus {
namespace {

using test::Session;

double rotation_difference(const Rotation& a, const Rotation& b) {
  return track::small_angle(a.transposed() * b);
}

TEST(Spine, SixtyFramesWithoutNoiseStayOnTheTruePath) {
  Session sut("synthetic:bedroom?mode=320x240&frames=60&noise=0");
  double sum2 = 0;
  while (sut.step()) {
    ASSERT_EQ(sut.status, rt::Status::ok) << "frame " << sut.frame();
    sum2 += sut.error_m() * sut.error_m();
  }
  const double rmse_m = std::sqrt(sum2 / 60);
  RecordProperty("ate_rmse_um", static_cast<int>(rmse_m * 1e6));
  std::printf("first-pose-aligned ATE RMSE %.3f mm\n", rmse_m * 1e3);
  EXPECT_LT(rmse_m, 0.0015);  // 0.96 mm measured
}

// A flat wall's shape says nothing of two shifts and a turn; its texture does (track_test holds it without).
TEST(Spine, FlatWallDoesNotSlideWhileTheCameraStands) {
  Session sut("synthetic:wall?mode=320x240&frames=60&trajectory=still");
  double sideways_m = 0;
  const Vec3d normal = sut.truth(0).rotation * Vec3d{0, 0, 1};  // the camera looks at the wall, nearly
  while (sut.step()) {
    ASSERT_EQ(sut.status, rt::Status::ok) << "frame " << sut.frame();
    const Vec3d off = sut.poses.back().translation - sut.truth(0).translation;
    sideways_m = std::max(sideways_m, (off - normal * off.dot(normal)).norm());
  }
  std::printf("sideways %.3f mm, all %.3f mm\n", sideways_m * 1e3, sut.error_m() * 1e3);
  EXPECT_LT(sideways_m, 0.001);
  EXPECT_LT(rotation_difference(sut.poses.back().rotation, sut.truth(0).rotation), 0.002);
}

TEST(Spine, BlankFramesHoldTheMapAndThePose) {
  Session sut("synthetic:bedroom?mode=320x240&frames=24&blank=10:4");
  map::Map::Hash held;
  while (sut.step()) {
    const int i = sut.frame();
    if (i == 9) held = sut.spine.map().hash_content();
    if (i >= 10 && i < 14) {
      EXPECT_EQ(sut.status_registered, rt::Status::corrupt);
      EXPECT_EQ(sut.status, rt::Status::corrupt);
      EXPECT_EQ(sut.spine.map().hash_content().geometry, held.geometry);
      EXPECT_EQ(sut.poses.back().translation, sut.poses[9].translation);
    } else {
      EXPECT_EQ(sut.status, rt::Status::ok) << "frame " << i;
    }
  }
  EXPECT_LT(sut.error_m(), 0.005);
}

TEST(Spine, TwoRunsAndTwoThreadsGiveTheSameBits) {
  const std::string source = "synthetic:office?mode=320x240&frames=12&seed=4";
  Session first(source), again(source), threaded(source, 2);
  ASSERT_TRUE(threaded.is_started());
  while (first.step()) {
    ASSERT_TRUE(again.step());
    ASSERT_TRUE(threaded.step());
    ASSERT_EQ(test::hash_of(first.poses), test::hash_of(again.poses)) << "frame " << first.frame();
    ASSERT_EQ(test::hash_of(first.poses), test::hash_of(threaded.poses)) << "frame " << first.frame();
  }
  EXPECT_EQ(first.poses.size(), 12U);
  const auto expected = first.spine.map().hash_content();
  EXPECT_EQ(again.spine.map().hash_content().geometry, expected.geometry);
  EXPECT_EQ(threaded.spine.map().hash_content().geometry, expected.geometry);
}

// The wardrobe's mirror gives no depth; the map holds it all the same, where it is.
TEST(Spine, MirrorIsASurfaceOfTheMap) {
  const std::string source = "synthetic:bedroom?mode=320x240&frames=300";
  const auto share_of_mirror = [&](bool closes_panes) {
    SpineConfig config;
    config.closes_panes = closes_panes;
    Session sut(source, 1, config);
    while (sut.frame() < 74 && sut.step()) EXPECT_EQ(sut.status, rt::Status::ok) << "frame " << sut.frame();
    const auto options = hal::parse_synthetic_name(source);
    hal::synthetic::FrameRenderer renderer(
        std::make_shared<const hal::synthetic::Scene>(hal::synthetic::make_scene(options->scene)), *options);
    std::vector<float> exact_m(320 * 240), planes(6 * 160 * 120);
    std::vector<std::uint8_t> material(320 * 240);
    renderer.exact_depth(74, exact_m);
    renderer.labels(74, material);
    map::ModelView view;
    view.camera = sut.spine.half_camera();
    view.T_world_view = sut.poses.back();
    view.z_m = std::span(planes).subspan(0, 160 * 120);
    view.nx = std::span(planes).subspan(160 * 120, 160 * 120);
    view.ny = std::span(planes).subspan(2 * 160 * 120, 160 * 120);
    view.nz = std::span(planes).subspan(3 * 160 * 120, 160 * 120);
    predict_marching(sut.spine.map(), 0, 120, 1, 5.0f, view);
    double mirror = 0, there = 0;
    for (std::size_t v = 0; v < 120; ++v)
      for (std::size_t u = 0; u < 160; ++u) {
        const std::size_t pixel = 2 * v * 320 + 2 * u;
        if (material[pixel] != material_from_name("mirror")) continue;
        mirror += 1;
        there += std::fabs(view.z_m[v * 160 + u] - exact_m[pixel]) < 0.02f;
      }
    EXPECT_GT(mirror, 2000);
    return there / mirror;
  };
  const double closed = share_of_mirror(true), open = share_of_mirror(false);
  std::printf("%.1f %% of the mirror within 2 cm of the truth, %.1f %% without panes\n", 100 * closed, 100 * open);
  EXPECT_GT(closed, 0.97);
  EXPECT_LT(open, 0.75);  // what came back here and there
}

// Another colour camera, beside the depth camera, with a lens: surfaces get its colour.
TEST(Spine, SecondCameraColoursTheMap) {
  Session sut("synthetic:bedroom?mode=320x240&frames=6&registered=0");
  while (sut.step()) ASSERT_EQ(sut.status, rt::Status::ok);
  Session registered("synthetic:bedroom?mode=320x240&frames=6");
  while (registered.step()) continue;
  const auto known = static_cast<std::size_t>(std::count_if(
      sut.spine.half_color().begin(), sut.spine.half_color().end(), [](auto c) { return c >> 24 != 0; }));
  const auto measured = static_cast<std::size_t>(std::count_if(
      sut.spine.half_depth_m().begin(), sut.spine.half_depth_m().end(), [](float z) { return z > 0; }));
  // The rest lies out of the colour image, is hidden, or shares a bin with something nearer.
  EXPECT_GT(known, measured * 70 / 100);
  // The same places of the room, seen by two lenses: their colours agree.
  double difference = 0, count = 0;
  for (std::size_t i = 0; i < sut.spine.half_color().size(); ++i) {
    const std::uint32_t a = sut.spine.half_color()[i], b = registered.spine.half_color()[i];
    if (a >> 24 == 0 || b >> 24 == 0) continue;
    for (int channel = 0; channel < 3; ++channel)
      difference +=
          std::abs(static_cast<int>(a >> (8 * channel) & 255) - static_cast<int>(b >> (8 * channel) & 255));
    count += 3;
  }
  EXPECT_LT(difference / count, 12);
}

// A pool that is too small for the room: evicting, refusing, counting, and going on.
TEST(Spine, SmallPoolEvictsAndGoesOn) {
  SpineConfig config;
  config.map.blocks_capacity = 1200;
  config.evict_free_min = 100;
  Session sut("synthetic:bedroom?mode=320x240&frames=90", 1, config);
  int lost_count = 0;
  while (sut.step()) lost_count += sut.status != rt::Status::ok;
  std::printf("evicted %llu, refused %llu, lost %d, error %.2f mm\n",
              static_cast<unsigned long long>(sut.spine.map().counters().evicted),
              static_cast<unsigned long long>(sut.spine.map().counters().refused), lost_count,
              sut.error_m() * 1e3);
  EXPECT_LE(sut.spine.map().blocks_used(), 1200U);
  EXPECT_GT(sut.spine.map().counters().evicted + sut.spine.map().counters().refused, 0U);
}

// The map has a row of its own in the memory table: counted here too it would be planned twice.
TEST(SpineMemory, DoesNotCountTheMap) {
  const auto rig = hal::synthetic::calibration_of({});
  SpineConfig small, large;
  small.map.blocks_capacity = 1024;
  large.map.blocks_capacity = 8192;
  EXPECT_EQ(Spine::bytes_needed(rig, large) - Spine::bytes_needed(rig, small),
            map::ActiveSet::bytes_needed(8192) - map::ActiveSet::bytes_needed(1024));
}

TEST(Spine, DepthOnlyRuns) {
  Session sut("synthetic:bedroom?mode=320x240&frames=2");
  static_cast<void>(sut.step());
  std::vector<std::uint16_t> raw(320 * 240, 5000);
  EXPECT_EQ(sut.spine.register_frame(raw, {}), rt::Status::ok);
}

}  // namespace
}  // namespace tactus
