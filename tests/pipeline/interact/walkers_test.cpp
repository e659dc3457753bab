#include "pipeline/interact/walkers.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/pipeline/interact/walking_session.hpp"

namespace tactus::interact {
namespace {

using test::script_of;
using test::walker_at;
using test::WalkingSession;

double level_distance_m(const Vec3d& a, const Vec3d& b) {
  return std::sqrt((a.x - b.x) * (a.x - b.x) + (a.z - b.z) * (a.z - b.z));
}

class WalkersTest : public testing::Test {
 protected:
  WalkersTest() { room.enclose(-1.5, -1.5, 1.5, 1.5); }
  test::BoxRoom room;
};

TEST_F(WalkersTest, GoesOverCarpetToItsGoalAndAroundWater) {
  room.patches.push_back({-0.2, -0.6, 0.2, 0.6, test::only("water")});
  WalkingSession session(room.scene(), script_of({walker_at({-0.8, 0.3, 0}, Vec3d{0.8, 0, 0})}));
  double nearest_m = 1;
  for (int i = 0; i < 600 && session.game.walkers().counters().arrivals == 0; ++i) {
    session.run(1);
    const Vec3d p = session.pose().position_world_m;
    if (!session.pose().is_placed) continue;
    nearest_m = std::min(nearest_m, std::max(std::abs(p.x) - 0.2, std::abs(p.z) - 0.6));
    EXPECT_NEAR(p.y, 0, 1e-3);
  }
  EXPECT_GT(nearest_m, 0) << "never in the water";
  EXPECT_LT(level_distance_m(session.pose().position_world_m, {0.8, 0, 0}), 0.02);
  const auto walks = session.walks();
  ASSERT_EQ(walks.size(), 2U);
  EXPECT_EQ(walks[0].walker_state, AgentState::waiting);
  EXPECT_LT(level_distance_m(walks[0].position_world_m, {-0.8, 0, 0}), 0.05);
  EXPECT_EQ(walks[1].walker_state, AgentState::arrived);
  EXPECT_EQ(walks[1].order_index, 0);
  EXPECT_EQ(walks[1].material, material_from_name("carpet"));
  EXPECT_GT(walks[1].walked_m, 1.9) << "straight on is 1.6 m, through the water";
  EXPECT_DOUBLE_EQ(session.game.walkers().walked_m(), session.pose().walked_m);
}

TEST_F(WalkersTest, WithoutMaterialsItGoesStraightThroughTheWater) {
  room.patches.push_back({-0.2, -0.6, 0.2, 0.6, test::only("water")});
  room.is_labelled = false;  // as the uniform condition answers
  WalkingSession session(room.scene(), script_of({walker_at({-0.8, 0.3, 0}, Vec3d{0.8, 0, 0})}));
  session.run(400);
  EXPECT_EQ(session.game.walkers().counters().arrivals, 1U);
  EXPECT_LT(session.pose().walked_m, 1.7);
}

TEST_F(WalkersTest, IsPutOntoTheFloorInFrontOfTheView) {
  Walker walker;
  walker.when.at_frame = 10;
  WalkingSession session(room.scene(), script_of({walker}));
  session.run(9);
  EXPECT_FALSE(session.pose().is_placed) << "not before its moment";
  session.run(60);
  ASSERT_TRUE(session.pose().is_placed);
  const auto walks = session.walks();
  ASSERT_FALSE(walks.empty());
  EXPECT_LT(level_distance_m(walks[0].position_world_m, {0, 0, -0.5}), 0.1) << "a metre along the view";
}

TEST_F(WalkersTest, TakesTheFloorBesideABedAndNotTheBed) {
  room.solids.push_back({{-0.6, 0, -1.2}, {0.6, 0.5, 0.1}, test::only("fabric")});
  Walker walker;
  walker.when.at_frame = 1;
  WalkingSession session(room.scene(), script_of({walker}));
  session.run(200);
  ASSERT_FALSE(session.walks().empty());
  EXPECT_NEAR(session.walks()[0].position_world_m.y, 0, 1e-3);
  EXPECT_EQ(session.walks()[0].material, material_from_name("carpet"));
}

TEST_F(WalkersTest, TakesTheBedWhereNoFloorIsKnown) {
  room.solids.push_back({{-1.5, 0, -1.5}, {1.5, 0.5, 1.5}, test::only("fabric")});
  room.is_seen = [](const Vec3d& p) { return std::abs(p.x) < 1.51 && std::abs(p.z) < 1.51; };
  Walker walker;
  walker.when.at_frame = 1;
  WalkingSession session(room.scene(), script_of({walker}));
  session.run(200);
  ASSERT_FALSE(session.walks().empty());
  EXPECT_NEAR(session.walks()[0].position_world_m.y, 0.5, 1e-3);
}

TEST_F(WalkersTest, WaitsForTheMapAndCountsWhatItTried) {
  bool is_known = false;
  room.is_seen = [&](const Vec3d&) { return is_known; };
  WalkingSession session(room.scene(), script_of({walker_at({0, 0, 0})}));
  session.run(100);
  EXPECT_FALSE(session.pose().is_placed);
  const std::uint64_t tried = session.game.walkers().counters().places_tried;
  EXPECT_GE(tried, 100U);
  EXPECT_LE(tried, 100 * Walkers::kPlacesPerRound);
  is_known = true;
  session.run(10);
  EXPECT_TRUE(session.pose().is_placed);
}

TEST_F(WalkersTest, StandsWhileTrackingIsLost) {
  WalkingSession session(room.scene(), script_of({walker_at({-0.8, 0, 0}, Vec3d{0.8, 0, 0})}));
  session.run(60);
  const Vec3d before = session.pose().position_world_m;
  session.run(60, false);
  EXPECT_EQ(session.pose().position_world_m, before);
  session.run(30);
  EXPECT_GT(level_distance_m(session.pose().position_world_m, before), 0.1);
}

TEST_F(WalkersTest, GoalBehindWaterIsSaidToHaveNoWay) {
  room.patches.push_back({-0.2, -2, 0.2, 2, test::only("water")});
  WalkingSession session(room.scene(), script_of({walker_at({-0.8, 0, 0}, Vec3d{0.8, 0, 0})}));
  session.run(400);
  EXPECT_EQ(session.game.walkers().counters().stuck, 1U);
  ASSERT_EQ(session.walks().size(), 2U);
  EXPECT_EQ(session.walks()[1].walker_state, AgentState::stuck);
  EXPECT_LT(session.pose().position_world_m.x, -0.2);
}

TEST_F(WalkersTest, GoesAroundAVirtualBallThatLiesInItsWay) {
  Script script = script_of({walker_at({-0.8, 0, 0}, Vec3d{0.8, 0, 0})});
  script.walkers[0].when.at_frame = 60;  // the ball has come to rest
  Throw ball;
  ball.when.at_frame = 1;
  ball.shape = contact::Shape::sphere(0.1);
  ball.material = material_from_name("leather");
  ball.position_world_m = Vec3d{0, 0.105, 0};
  script.throws.push_back(ball);
  WalkingSession session(room.scene(), std::move(script));
  double nearest_m = 1;
  for (int i = 0; i < 600 && session.game.walkers().counters().arrivals == 0; ++i) {
    session.run(1);
    if (session.pose().is_placed)
      nearest_m = std::min(nearest_m, level_distance_m(session.pose().position_world_m,
                                                       session.world.bodies()[0].position_world_m));
  }
  EXPECT_EQ(session.game.walkers().counters().arrivals, 1U);
  EXPECT_GT(nearest_m, 0.1 + WalkerBody{}.radius_m - 0.005);
}

TEST_F(WalkersTest, TwoOnTheSameWayPassEachOther) {
  WalkingSession session(room.scene(), script_of({walker_at({-0.6, 0, 0}, Vec3d{0.6, 0, 0}),
                                                  walker_at({0.6, 0, 0.02}, Vec3d{-0.6, 0, 0.02})}));
  double nearest_m = 1;
  for (int i = 0; i < 900; ++i) {
    session.run(1);
    if (session.pose(0).is_placed && session.pose(1).is_placed)
      nearest_m = std::min(
          nearest_m, level_distance_m(session.pose(0).position_world_m, session.pose(1).position_world_m));
  }
  EXPECT_EQ(session.game.walkers().counters().arrivals, 2U);
  EXPECT_GT(nearest_m, 0.06);
}

TEST_F(WalkersTest, SameScriptGivesTheSameWay) {
  const auto play = [&] {
    Walker wanderer;
    wanderer.when.at_frame = 3;
    wanderer.wander_seed = 5;
    Script script = script_of({wanderer, walker_at({0.5, 0, 0.5})});
    script.throws = default_script(App::plates, 640, 480).throws;
    WalkingSession session(room.scene(), std::move(script));
    std::vector<AgentPose> poses;
    for (int i = 0; i < 400; ++i) {
      session.run(1);
      poses.push_back(session.pose(0));
      poses.push_back(session.pose(1));
    }
    return poses;
  };
  const auto first = play(), second = play();
  ASSERT_GT(first.back().walked_m, 0.5);
  for (std::size_t i = 0; i < first.size(); ++i) {
    ASSERT_EQ(first[i].position_world_m, second[i].position_world_m) << i;
    ASSERT_EQ(first[i].heading_world, second[i].heading_world) << i;
  }
}

}  // namespace
}  // namespace tactus::interact
