// How throws are followed and judged, on logs written by hand and rooms whose surfaces are known.
#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <set>
#include <vector>

#include "firmware_host/plausible_throws.hpp"
#include "firmware_host/true_room.hpp"

namespace tactus::firmware {
namespace {

using interact::GameEvent;
using interact::GameEventKind;

GameEvent event_of(GameEventKind kind, std::int32_t order, std::uint64_t frame, Vec3d position) {
  GameEvent event;
  event.kind = kind;
  event.order_index = order;
  event.frame = {{static_cast<std::int64_t>(frame) * 33'333'333}, frame};
  event.position_world_m = position;
  return event;
}

TEST(FollowedOrder, IsItsFirstImpactOnWhatIsReal) {
  std::vector<GameEvent> log;
  log.push_back(event_of(GameEventKind::thrown, 4, 1, {}));
  log.push_back(event_of(GameEventKind::shot, 4, 1, {}));
  log.push_back(event_of(GameEventKind::thrown, 2, 2, {}));
  log.push_back(event_of(GameEventKind::contact, 4, 3, {1, 0, 0}));
  log.back().other_body_index = 7;
  log.push_back(event_of(GameEventKind::broke, 4, 4, {2, 0, 0}));
  log.back().outcome = contact::Outcome::broke;
  log.push_back(event_of(GameEventKind::contact, 4, 5, {3, 0, 0}));
  log.push_back(event_of(GameEventKind::hit, 4, 5, {4, 0, 0}));
  log.push_back(event_of(GameEventKind::contact, -1, 5, {5, 0, 0}));
  const auto throws = follow_throws(log), shots = follow_shots(log);
  ASSERT_EQ(throws.size(), 2U);
  EXPECT_EQ(throws[0].index, 2U);
  EXPECT_EQ(throws[0].outcome(), contact::Outcome::through);
  EXPECT_FALSE(throws[0].met_body_first);
  ASSERT_NE(throws[1].impact, nullptr);
  EXPECT_EQ(throws[1].impact->position_world_m.x, 2);
  EXPECT_EQ(throws[1].outcome(), contact::Outcome::broke);
  EXPECT_TRUE(throws[1].met_body_first);
  ASSERT_EQ(shots.size(), 1U);
  EXPECT_EQ(shots[0].impact->position_world_m.x, 4);
}

TEST(PlausibilityScript, CoversPictureAndSessionAndIsTheSameForTheSameSeed) {
  hal::Intrinsics picture;
  picture.width = 640;
  picture.height = 480;
  for (const std::uint64_t seed : {1U, 2U, 77U}) {
    const auto sut = plausibility_script(40, 300, picture, seed),
               again = plausibility_script(40, 300, picture, seed);
    ASSERT_EQ(sut.throws.size(), 40U);
    std::set<std::pair<int, int>> parts;  // of 4 x 3
    for (std::size_t i = 0; i < 40; ++i) {
      const interact::Throw& one = sut.throws[i];
      EXPECT_EQ(*one.aim.pixel, *again.throws[i].aim.pixel);
      EXPECT_EQ(one.speed_m_per_s, again.throws[i].speed_m_per_s);
      EXPECT_GE(*one.when.at_frame, 30U);
      EXPECT_LT(*one.when.at_frame, 300U - kTailFrames);
      const double u = (*one.aim.pixel)[0], v = (*one.aim.pixel)[1];
      EXPECT_TRUE(u > 0 && u < 640 && v > 0 && v < 480) << u << " " << v;
      parts.emplace(static_cast<int>(u / 160), static_cast<int>(v / 160));
    }
    EXPECT_EQ(parts.size(), 12U) << "seed " << seed;
  }
}

/// The wall of `synthetic:wall`, in a world that is turned and shifted against the room's.
class WallRoom : public testing::Test {
 protected:
  void SetUp() override {
    const auto options = hal::parse_synthetic_name("synthetic:wall?frames=2");
    ASSERT_TRUE(options);
    scene_.emplace(hal::synthetic::make_scene(options->scene));
    T_scene_first_ = hal::open_synthetic(*options)->truth.front().T_world_depth;
    T_world_first_.rotation = Rotation::from(Quaternion{0.9, 0, std::sqrt(1 - 0.81), 0});
    T_world_first_.translation = {3, -1, 2};
    auto room = TrueRoom::of("synthetic:wall?frames=2", T_world_first_);
    ASSERT_TRUE(room);
    room_.emplace(std::move(*room));
    forward_ = T_world_first_.rotation * Vec3d{0, 0, 1};
    // Along the view, without gravity.
    flight_ = {T_world_first_.translation, forward_ * 5.0, {}};
    touch_ = *room_->first_touch(flight_, 10);
    things_[0] = {{0.005, 0.11, 1.9e-4}, material_from_name("ceramic")};
    script_.throws.resize(1);
    thrown_ = event_of(GameEventKind::thrown, 0, 0, flight_.start_world_m);
    thrown_.normal_world = forward_;
    thrown_.impact_speed_m_per_s = 200;  // so fast that it flies straight
  }
  [[nodiscard]] GameEvent impact_at(double along_m, contact::Outcome outcome) const {
    GameEvent event = event_of(GameEventKind::broke, 0, 3, touch_.position_world_m + forward_ * along_m);
    event.outcome = outcome;
    event.energy_j = 5;
    return event;
  }
  [[nodiscard]] JudgedThrows judge(const std::vector<GameEvent>& uniform,
                                   const std::vector<GameEvent>& semantic) const {
    const std::vector<GameEvent> none = {thrown_};
    const rt::SensorTime end{1'000'000'000};
    return judge_throws(*room_, script_, things_, contact::default_material_table(), {none, end},
                        {uniform, end}, {semantic, end});
  }
  [[nodiscard]] contact::Outcome expected(double energy_j) const {
    return outcome_on(things_[0], room_->material(touch_.position_world_m), energy_j,
                      contact::default_material_table());
  }

  std::optional<hal::synthetic::Scene> scene_;
  std::optional<TrueRoom> room_;
  T_WorldDepth T_scene_first_, T_world_first_;
  Vec3d forward_;
  Flight flight_;
  TrueTouch touch_;
  ThingBuilds things_;
  interact::Script script_;
  GameEvent thrown_;
};
using TrueRoomTest = WallRoom;
using JudgeThrowsTest = WallRoom;

TEST_F(TrueRoomTest, IsTheSceneSeenFromTheRunsWorld) {
  for (const Vec3d offset : {Vec3d{}, Vec3d{0.1, 0.2, 0.3}, Vec3d{-0.4, 0, 0.5}}) {
    const Vec3d in_camera = offset + Vec3d{0, 0, 0.5};
    EXPECT_NEAR(room_->distance(T_world_first_ * in_camera), scene_->distance(T_scene_first_ * in_camera),
                1e-9);
    EXPECT_EQ(room_->material(T_world_first_ * in_camera),
              static_cast<MaterialId>(scene_->material(T_scene_first_ * in_camera)));
  }
  EXPECT_NEAR(room_->distance(touch_.position_world_m), 0, 0.0015);
  EXPECT_NEAR((touch_.position_world_m - flight_.start_world_m).norm(), 5 * touch_.time_s, 1e-9);
  EXPECT_GT(touch_.approach_m_per_s, 1);
  EXPECT_LE(touch_.approach_m_per_s, 5);
  EXPECT_NEAR(flight_.nearest_s(flight_.at(0.25), 1), 0.25, 0.001);
  EXPECT_FALSE(room_->first_touch({flight_.start_world_m, -flight_.velocity_world_m_per_s, {}}, 1));
}

TEST_F(JudgeThrowsTest, ImpactIsHeldAgainstTheTrueMaterial) {
  const JudgedThrows sut = judge({thrown_, impact_at(0.01, contact::Outcome::broke)},
                                 {thrown_, impact_at(0.01, contact::Outcome::intact)});
  ASSERT_EQ(sut.judged.size(), 1U);
  EXPECT_EQ(sut.judged[0].kind, ThrowKind::impact);
  EXPECT_EQ(sut.judged[0].expected, expected(5));
  EXPECT_EQ(sut.judged[0].uniform, contact::Outcome::broke);
  EXPECT_EQ(sut.judged[0].semantic, contact::Outcome::intact);
  EXPECT_EQ(sut.judged[0].true_material, room_->material(touch_.position_world_m));
}

TEST_F(JudgeThrowsTest, WhatTheMapDoesNotHaveIsFlownThrough) {
  const std::vector<GameEvent> through = {thrown_},
                               behind = {thrown_, impact_at(0.5, contact::Outcome::broke)};
  for (const auto& log : {through, behind}) {
    const JudgedThrows sut = judge(log, log);
    ASSERT_EQ(sut.judged.size(), 1U);
    EXPECT_EQ(sut.judged[0].kind, ThrowKind::missing_surface);
    EXPECT_NE(sut.judged[0].expected, contact::Outcome::through);
    EXPECT_EQ(sut.judged[0].semantic, contact::Outcome::through);
  }
}

TEST_F(JudgeThrowsTest, WhatStopsInTheAirShouldHaveFlownOn) {
  const std::vector<GameEvent> log = {thrown_, impact_at(-0.2, contact::Outcome::broke)};
  const JudgedThrows sut = judge(log, log);
  ASSERT_EQ(sut.judged.size(), 1U);
  EXPECT_EQ(sut.judged[0].kind, ThrowKind::nothing_there);
  EXPECT_EQ(sut.judged[0].expected, contact::Outcome::through);
  EXPECT_EQ(sut.judged[0].semantic, contact::Outcome::broke);
}

TEST_F(JudgeThrowsTest, WhatDoesNotCompareIsLeftOutAndCounted) {
  const std::vector<GameEvent> hit = {thrown_, impact_at(0, contact::Outcome::broke)};
  std::vector<GameEvent> body_first = hit;
  body_first.insert(body_first.begin() + 1, impact_at(-0.3, contact::Outcome::intact));
  body_first[1].other_body_index = 3;
  EXPECT_EQ(judge(body_first, hit).met_body, 1U);
  EXPECT_EQ(judge(hit, body_first).met_body, 1U);
  std::vector<GameEvent> elsewhere = hit;
  elsewhere[1].position_world_m.x += 0.01;
  EXPECT_EQ(judge(elsewhere, hit).differed, 1U);
  std::vector<GameEvent> left_otherwise = hit;
  left_otherwise[0].position_world_m.x += 0.01;
  EXPECT_EQ(judge(left_otherwise, hit).differed, 1U);
  std::vector<GameEvent> away = {thrown_};
  thrown_.normal_world = away[0].normal_world = -forward_;
  EXPECT_EQ(judge(away, away).met_nothing, 1U);
  thrown_.normal_world = away[0].normal_world = forward_;
  const double distance_m = (touch_.position_world_m - flight_.start_world_m).norm();
  thrown_.impact_speed_m_per_s = away[0].impact_speed_m_per_s =
      distance_m / 1.2;  // the session ends after one second
  EXPECT_EQ(judge(away, away).in_the_air, 1U);
}

}  // namespace
}  // namespace tactus::firmware
