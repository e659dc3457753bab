// A person's corrections while the pipeline runs.
#include <gtest/gtest.h>

#include <memory>
#include <optional>

#include "firmware_host/first_pose.hpp"
#include "firmware_host/open_source.hpp"
#include "pipeline/pipeline.hpp"
#include "rt/arena.hpp"

namespace tactus {
namespace {

constexpr MaterialId kGlass = 6;

/// A short lockstep session in the synthetic bedroom, with its exact labels.
class Session {
 public:
  explicit Session(int frames_count) {
    auto opened =
        firmware::open_source("synthetic:bedroom?mode=320x240&frames=" + std::to_string(frames_count));
    EXPECT_TRUE(opened);
    sensor_ = std::move(*opened);
    PipelineSetup setup;
    setup.profile = x86_profile();
    setup.sensor = &*sensor_;
    setup.T_world_first = firmware::level_pose({0, 1, 0});
    setup.labels_from_source = true;
    setup.collision = contact::Collision::none;
    setup.materials = contact::default_material_table();
    EXPECT_TRUE(Pipeline::plan(setup, plan_));
    arena_.emplace(std::move(*rt::Arena::reserve(plan_.arena_bytes())));
    plan_.carve(*arena_);
    EXPECT_TRUE(pipeline.bind(setup, plan_));
    arena_->seal();
  }

  /// One frame; false at the end.
  bool frame() {
    const rt::Clock clock = rt::Clock::monotonic();
    if (pipeline.capture_round(clock) != rt::Status::ok) return false;
    EXPECT_EQ(pipeline.spine_round(clock, rt::kNoDeadline), rt::Status::ok);
    (void)pipeline.segment_round(clock);
    (void)pipeline.refine_round(clock);
    return true;
  }

  /// Somewhere on the surface in the middle of the newest view.
  map::SurfacePoint in_view() {
    const T_WorldDepth pose = pipeline.spine().result().T_world_depth;
    map::SurfacePoint point;
    EXPECT_TRUE(pipeline.reader().raycast(pose.translation.cast<float>(),
                                          (pose.rotation * Vec3d{0.05, 0.3, 1}).cast<float>(), 6, point));
    return point;
  }
  map::SurfacePoint at(const Vec3f& p) {
    map::SurfacePoint point;
    EXPECT_TRUE(pipeline.reader().nearest_surface(p, point));
    return point;
  }

 private:
  std::optional<hal::Sensor> sensor_;
  rt::MemoryPlan plan_;
  std::optional<rt::Arena> arena_;

 public:
  Pipeline pipeline;
};

TEST(PipelinePins, SurfacePinnedWhileRunningStaysSoThroughKeyframesAndCrfUntilItIsTakenBack) {
  auto session = std::make_unique<Session>(61);
  Pipeline& sut = session->pipeline;
  for (int i = 0; i < 20; ++i) ASSERT_TRUE(session->frame());
  const map::SurfacePoint before = session->in_view();
  ASSERT_NE(before.material, kUnknownMaterial);
  ASSERT_NE(before.material, kGlass);
  ASSERT_EQ(sut.pin_surface({before.position_world_m, kGlass}), rt::Status::ok);
  int frames = 0;
  for (; sut.pinner().counters().pinned == 0 && frames < 20; ++frames) ASSERT_TRUE(session->frame());
  EXPECT_LT(frames, 20);
  EXPECT_GT(sut.pinner().counters().cells, 100U);
  while (session->frame()) {
  }
  sut.finish_labels();
  ASSERT_GE(sut.counts().keyframes_segmented, 4U);
  const map::SurfacePoint pinned = session->at(before.position_world_m);
  EXPECT_TRUE(pinned.is_pinned);
  EXPECT_EQ(pinned.material, kGlass);

  ASSERT_EQ(sut.pin_surface({before.position_world_m, kUnknownMaterial}), rt::Status::ok);
  sut.finish_labels();
  const map::SurfacePoint after = session->at(before.position_world_m);
  EXPECT_FALSE(after.is_pinned);
  EXPECT_EQ(after.material, before.material);
  EXPECT_EQ(sut.pinner().counters().taken_back, 1U);
}

TEST(PipelinePins, SameCallsAtTheSameFramesGiveTheSameMap) {
  std::optional<std::uint64_t> first;
  for (int run = 0; run < 2; ++run) {
    auto session = std::make_unique<Session>(30);
    for (int i = 0; i < 20; ++i) ASSERT_TRUE(session->frame());
    ASSERT_EQ(session->pipeline.pin_surface({session->in_view().position_world_m, kGlass, 0.3F}),
              rt::Status::ok);
    while (session->frame()) {
    }
    session->pipeline.finish_labels();
    EXPECT_EQ(session->pipeline.pinner().counters().pinned, 1U);
    const std::uint64_t labels = session->pipeline.spine().map().hash_content().labels;
    EXPECT_EQ(labels, first.value_or(labels));
    first = labels;
  }
}

TEST(PipelinePins, MoreThanMayWaitAreRefusedAndWhatHitsNothingIsCounted) {
  auto session = std::make_unique<Session>(3);
  Pipeline& sut = session->pipeline;
  for (std::size_t i = 0; i < kPinsWaiting; ++i)
    ASSERT_EQ(sut.pin_surface({{50, 0, 0}, kGlass}), rt::Status::ok);
  EXPECT_EQ(sut.pin_surface({{50, 0, 0}, kGlass}), rt::Status::full);
  ASSERT_TRUE(session->frame());
  EXPECT_EQ(sut.pinner().counters().refused, kPinsWaiting);
  EXPECT_EQ(sut.pin_surface({{50, 0, 0}, kGlass}), rt::Status::ok);
}

}  // namespace
}  // namespace tactus
