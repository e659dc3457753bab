#include "pipeline/track/tracker.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>

#include "rt/worker_pool.hpp"
#include "tests/pipeline/track/plane_room.hpp"

namespace tactus::track {
namespace {

using test::corner;
using test::live_view;
using test::ModelOfPlanes;
using test::motion;

TrackResult track(const ModelOfPlanes& model, const std::vector<float>& live, rt::WorkerPool& pool) {
  return track_frame({&model.view, live, 2.0f}, kTrackLevels, {}, {}, pool);
}

TEST(Tracker, FollowsTheMotionOfAFastHead) {
  rt::WorkerPool pool;
  const ModelOfPlanes model(corner());
  // 30 Hz: 1.5 m/s and 90 degrees/s.
  const T_ViewLive truth = motion({0.02, -0.045, 0.015}, {0.03, -0.02, 0.035});
  const TrackResult sut = track(model, live_view(corner(), truth), pool);
  EXPECT_EQ(sut.status, rt::Status::ok);
  EXPECT_EQ(sut.held_count, 0);
  EXPECT_LT((sut.T_view_live.translation - truth.translation).norm(), 2e-4);
  EXPECT_LT(small_angle(sut.T_view_live.rotation.transposed() * truth.rotation), 2e-4);
  EXPECT_GT(sut.inlier_share, 0.95);
}

TEST(Tracker, OneAndTwoThreadsGiveTheSameBits) {
  rt::WorkerPool one, two;
  ASSERT_TRUE(two.start(2, rt::ThreadSpec{.name = "lane"}));
  const ModelOfPlanes model(corner());
  const auto live = live_view(corner(), motion({0.01, -0.02, 0.015}, {0.01, -0.02, 0.015}));
  const TrackResult expected = track(model, live, one);
  for (int round = 0; round < 20; ++round) {
    const TrackResult sut = track(model, live, two);
    for (std::size_t i = 0; i < 9; ++i)
      ASSERT_EQ(std::bit_cast<std::uint64_t>(sut.T_view_live.rotation.m[i]),
                std::bit_cast<std::uint64_t>(expected.T_view_live.rotation.m[i]));
    ASSERT_EQ(sut.T_view_live.translation, expected.T_view_live.translation);
    ASSERT_EQ(sut.residual_m, expected.residual_m);
  }
}

TEST(Tracker, MotionCarriedOnIsThatOfSoManyFrames) {
  const T_ViewLive one = motion({0.02, -0.03, 0.01}, {0.01, 0.02, -0.03});
  EXPECT_EQ(scaled(one, 1).rotation.m, one.rotation.m) << "the same bits";
  EXPECT_EQ(scaled(one, 1).translation, one.translation);
  EXPECT_EQ(scaled(T_ViewLive{}, 7).rotation.m, Rotation{}.m);
  Rotation six;
  for (int i = 0; i < 6; ++i) six = six * one.rotation;
  const T_ViewLive sut = scaled(one, 6);
  EXPECT_LT(small_angle(sut.rotation.transposed() * six), 0.002) << "of 0.22";
  EXPECT_LT((sut.translation - one.translation * 6).norm(), 1e-12);
  EXPECT_LT(small_angle(scaled(sut, 1.0 / 6).rotation.transposed() * one.rotation), 1e-9);
  EXPECT_TRUE(scaled(one, 1000).is_finite());
}

TEST(Tracker, BlankFrameIsLost) {
  rt::WorkerPool pool;
  const ModelOfPlanes model(corner());
  EXPECT_EQ(track(model, std::vector<float>(model.view.z_m.size(), 0.0f), pool).status, rt::Status::lost);
}

TEST(Tracker, EmptyModelIsLost) {
  rt::WorkerPool pool;
  ModelOfPlanes model(corner());
  std::fill(model.view.z_m.begin(), model.view.z_m.end(), 0.0f);
  EXPECT_EQ(track(model, live_view(corner(), {}), pool).status, rt::Status::lost);
}

TEST(Tracker, AnotherRoomIsLost) {
  rt::WorkerPool pool;
  const ModelOfPlanes model(corner());
  const std::vector<test::Plane> other = {test::plane_through({0, 0, 0.9}, {0.7, 0, -1}),
                                          test::plane_through({0, 0, 0.9}, {-0.7, 0.3, -1})};
  EXPECT_EQ(track(model, live_view(other, {}), pool).status, rt::Status::lost);
}

TEST(Tracker, FlatWallHoldsThreeDirectionsAndIsNotLost) {
  rt::WorkerPool pool;
  const auto planes = test::wall({0.2, 0.1, -1});
  const ModelOfPlanes model(planes);
  const TrackResult sut = track(model, live_view(planes, motion({0, 0, 0}, planes[0].normal * 0.01)), pool);
  EXPECT_EQ(sut.status, rt::Status::ok);
  EXPECT_EQ(sut.held_count, 3);
  EXPECT_LT((sut.T_view_live.translation - planes[0].normal * 0.01).norm(), 5e-4);
}

TEST(SmallAngle, IsTheAngle) {
  for (const double angle : {0.0, 0.001, 0.1, 0.3, 0.5}) {
    const Rotation r = {{std::cos(angle), -std::sin(angle), 0, std::sin(angle), std::cos(angle), 0, 0, 0, 1}};
    EXPECT_NEAR(small_angle(r), angle, 1e-3);
  }
}

}  // namespace
}  // namespace tactus::track
