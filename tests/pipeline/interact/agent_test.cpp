#include "pipeline/interact/agent.hpp"

#include <gtest/gtest.h>

#include <cstring>
#include <vector>

#include "tests/pipeline/interact/agent_room.hpp"

namespace tactus::interact {
namespace {

using test::BoundAgent;
using test::BoxRoom;
using test::mixed;
using test::only;

double level_distance(const Vec3d& a, const Vec3d& b) {
  return std::sqrt((a.x - b.x) * (a.x - b.x) + (a.z - b.z) * (a.z - b.z));
}

// Nothing of the room is nearer to the body's axis than its radius, less what a cell is off its middle.
void expect_fits(const BoxRoom& room, const AgentPose& pose) {
  for (const double z : {0.045, 0.08, 0.115})
    ASSERT_GT(room.distance(pose.position_world_m + Vec3d{0, z, 0}), 0.03)
        << pose.position_world_m.x << " " << pose.position_world_m.y << " " << pose.position_world_m.z;
}

TEST(Agent, OpenFloorIsCrossedInAStraightLineAtWalkingSpeed) {
  BoxRoom room;
  room.enclose(-1, -1, 1, 1);
  BoundAgent sut(room.scene());
  EXPECT_EQ(sut.bytes_left, 0U);
  EXPECT_EQ(sut.step(), rt::Status::skipped);
  sut.agent.place({-0.7, 0.5, -0.7});
  sut.run(1);
  const Vec3d goal{0.7, 0, 0.4};
  sut.agent.set_goal(goal);
  double fastest_m = 0;
  Vec3d last = sut.agent.pose().position_world_m;
  int steps = 0;
  ASSERT_TRUE(sut.walk(20, [&](const AgentPose& pose) {
    fastest_m = std::max(fastest_m, (pose.position_world_m - last).norm());
    last = pose.position_world_m;
    ++steps;
    expect_fits(room, pose);
    EXPECT_NEAR(pose.position_world_m.y, 0, 1e-4);
    EXPECT_NEAR(pose.heading_world.norm(), 1, 1e-9);
  }));
  EXPECT_LT(level_distance(last, goal), 1e-3);
  EXPECT_LT(fastest_m, 0.25 / 30 + 1e-6);
  const double straight_m = level_distance(goal, {-0.7, 0, -0.7});
  EXPECT_LT(sut.agent.pose().walked_m, 1.05 * straight_m);
  EXPECT_LT(steps / 30.0, straight_m / 0.25 + 3);
  EXPECT_EQ(sut.agent.counters().arrivals, 1U);
}

TEST(Agent, HeadingIsWhereItWalksAndTurnsNoFasterThanConfigured) {
  BoxRoom room;
  room.enclose(-1, -1, 1, 1);
  room.solids.push_back({{-0.05, 0, -1}, {0.05, 0.5, 0.4}});
  BoundAgent sut(room.scene());
  sut.agent.place({-0.6, 0.3, -0.6});
  sut.agent.set_goal({0.6, 0, -0.6});
  Vec3d heading = sut.agent.pose().heading_world, last = {-0.6, 0, -0.6};
  ASSERT_TRUE(sut.walk(30, [&](const AgentPose& pose) {
    // 4 rad/s over a thirtieth of a second: 0.134 rad, cosine 0.991.
    EXPECT_GT(pose.heading_world.dot(heading), 0.9910);
    heading = pose.heading_world;
    const Vec3d moved = pose.position_world_m - last;
    last = pose.position_world_m;
    if (moved.norm() > 1e-3) {
      EXPECT_GT(moved.normalized().dot(heading), 0.45);
    }
    const Rotation R = Rotation::from(pose.q_world_agent);
    EXPECT_LT((R * Vec3d{0, 0, -1} - heading).norm(), 1e-9);
    EXPECT_LT((R * Vec3d{0, 1, 0} - Vec3d{0, 1, 0}).norm(), 1e-9);
  }));
}

// A table of 60 x 80 cm across the whole width of a corridor.
void add_table(BoxRoom& room, double under_m) {
  room.solids.push_back({{-0.3, under_m, -0.5}, {0.3, under_m + 0.03, 0.5}});
}

TEST(Agent, HighTableIsWalkedUnderAndLowOneAround) {
  for (const double under_m : {0.25, 0.10}) {
    BoxRoom room;
    room.enclose(-1, -1, 1, 1);
    add_table(room, under_m);
    BoundAgent sut(room.scene());
    sut.agent.place({-0.7, 0.3, 0});
    sut.agent.set_goal({0.7, 0, 0});
    double widest_m = 0;
    ASSERT_TRUE(sut.walk(40, [&](const AgentPose& pose) {
      widest_m = std::max(widest_m, std::abs(pose.position_world_m.z));
      expect_fits(room, pose);
    })) << under_m;
    if (under_m > 0.12) {
      EXPECT_LT(widest_m, 0.1) << "straight below";
    } else {
      EXPECT_GT(widest_m, 0.5) << "around";
    }
  }
}

TEST(Agent, OnATableTopItStaysOnTheTableTop) {
  BoxRoom room;
  add_table(room, 0.4);
  BoundAgent sut(room.scene());
  sut.agent.place({-0.2, 0.6, 0});
  sut.run(2);
  sut.agent.set_goal({1.2, 0, 0});
  sut.run(15, [&](const AgentPose& pose) {
    ASSERT_NEAR(pose.position_world_m.y, 0.43, 1e-3);
    ASSERT_LE(std::abs(pose.position_world_m.x), 0.3);
  });
  EXPECT_EQ(sut.agent.state(), AgentState::stuck);
}

TEST(Agent, WallWithADoorIsPassedThroughTheDoor) {
  BoxRoom room;
  room.enclose(-1, -1, 1, 1);
  room.solids.push_back({{-0.02, 0, -1}, {0.02, 1, 0.5}});
  room.solids.push_back({{-0.02, 0, 0.75}, {0.02, 1, 1}});
  BoundAgent sut(room.scene());
  sut.agent.place({-0.6, 0.3, -0.6});
  sut.agent.set_goal({0.6, 0, -0.6});
  bool is_before = true;
  ASSERT_TRUE(sut.walk(40, [&](const AgentPose& pose) {
    expect_fits(room, pose);
    const Vec3d p = pose.position_world_m;
    if (is_before && p.x > 0) {
      EXPECT_GT(p.z, 0.53);
      EXPECT_LT(p.z, 0.72);
      is_before = false;
    }
  }));
}

TEST(Agent, AvoidedMaterialsAreGoneAroundHoweverLongTheWay) {
  for (const char* material : {"water", "glass", "mirror", "food", "skin", "hair", "sky", "foliage"}) {
    BoxRoom room;
    room.enclose(-1, -1, 1, 1);
    room.patches.push_back({-0.2, -1, 0.2, 0.8, only(material)});
    BoundAgent sut(room.scene());
    sut.agent.place({-0.6, 0.3, -0.6});
    sut.agent.set_goal({0.6, 0, -0.6});
    ASSERT_TRUE(sut.walk(60, [&](const AgentPose& pose) {
      const Vec3d p = pose.position_world_m;
      // A cell counts by what its middle is made of.
      ASSERT_FALSE(std::abs(p.x) < 0.18 && p.z < 0.78) << material << " at " << p.x << " " << p.z;
    })) << material;
    EXPECT_GT(sut.agent.pose().walked_m, 3.0);
  }
}

TEST(Agent, DoubtfulWaterIsCrossedOnlyWhereTheDetourCostsMore) {
  // 40 % water costs 0.6 * 1 + 0.4 * 10 = 4.6 times carpet: a strip of 40 cm is worth a detour of 1.44 m.
  for (const double open_at_m : {-0.2, 0.95}) {
    BoxRoom room;
    room.enclose(-1, -1, 1, 1.3);
    room.patches.push_back({-0.2, -1, 0.2, open_at_m, mixed("carpet", 0.6F, "water")});
    BoundAgent sut(room.scene());
    sut.agent.place({-0.4, 0.3, -0.6});
    sut.run(8);
    sut.agent.set_goal({0.4, 0, -0.6});
    bool was_wet = false;
    ASSERT_TRUE(sut.walk(40, [&](const AgentPose& pose) {
      const Vec3d p = pose.position_world_m;
      was_wet = was_wet || (std::abs(p.x) < 0.15 && p.z < open_at_m - 0.05);
    }));
    EXPECT_EQ(was_wet, open_at_m > 0);
  }
}

TEST(Agent, StripIsCrossedAtItsSurerSide) {
  BoxRoom room;
  room.enclose(-1, -0.5, 1, 0.5);
  room.patches.push_back({-0.2, -0.5, 0.2, 0, mixed("carpet", 0.6F, "water")});
  room.patches.push_back({-0.2, 0, 0.2, 0.5, mixed("carpet", 0.9F, "water")});
  BoundAgent sut(room.scene());
  sut.agent.place({-0.5, 0.3, -0.2});
  sut.run(6);
  sut.agent.set_goal({0.5, 0, -0.2});
  ASSERT_TRUE(sut.walk(30, [&](const AgentPose& pose) {
    const Vec3d p = pose.position_world_m;
    if (std::abs(p.x) < 0.15) {
      EXPECT_GT(p.z, -0.02);
    }
  }));
}

TEST(Agent, StepOfTwoCentimetresIsClimbedAndOneOfSixGoneAround) {
  for (const double rise_m : {0.02, 0.06}) {
    BoxRoom room;
    room.enclose(-1, -1, 1, 1);
    room.solids.push_back({{-0.2, -0.1, -1}, {0.2, rise_m, 0.5}});
    BoundAgent sut(room.scene());
    sut.agent.place({-0.6, 0.3, 0});
    sut.agent.set_goal({0.6, 0, 0});
    double highest_m = 0, off_m = 0;
    ASSERT_TRUE(sut.walk(40, [&](const AgentPose& pose) {
      const Vec3d p = pose.position_world_m;
      highest_m = std::max(highest_m, p.y);
      const double ground_m = std::abs(p.x) < 0.2 && p.z < 0.5 ? rise_m : 0;
      off_m = std::max(off_m, std::abs(p.y - ground_m));
    }));
    if (rise_m < 0.03) {
      EXPECT_NEAR(highest_m, rise_m, 1e-3);
      EXPECT_LT(off_m, rise_m + 1e-3) << "only while it climbs";
    } else {
      EXPECT_LT(highest_m, 1e-3);
    }
  }
}

TEST(Agent, UnseenSpaceIsNeverEntered) {
  BoxRoom room;
  room.enclose(-1, -1, 1, 1);
  room.is_seen = [](const Vec3d& p) { return p.x < 0.2 || p.z > 0.6; };
  BoundAgent sut(room.scene());
  sut.agent.place({-0.5, 0.3, -0.5});
  sut.agent.set_goal({0.7, 0, -0.5});
  const auto is_in_the_seen = [](const AgentPose& pose) {
    const Vec3d p = pose.position_world_m;
    ASSERT_TRUE(p.x < 0.2 || p.z > 0.6) << p.x << " " << p.z;
  };
  sut.run(20, is_in_the_seen);
  EXPECT_EQ(sut.agent.state(), AgentState::stuck);
  EXPECT_EQ(sut.agent.counters().stuck, 1U);
  room.is_seen = [](const Vec3d&) { return true; };
  EXPECT_TRUE(sut.walk(20)) << "goes on when the map grows";
  EXPECT_EQ(sut.agent.counters().stuck, 1U);
}

TEST(Agent, NothingKnownWaits) {
  BoxRoom room;
  room.is_seen = [](const Vec3d&) { return false; };
  BoundAgent sut(room.scene());
  sut.agent.place({0, 0.3, 0});
  sut.agent.set_goal({0.5, 0, 0});
  sut.run(3);
  EXPECT_EQ(sut.step(), rt::Status::lost);
  EXPECT_FALSE(sut.agent.pose().is_placed);
  EXPECT_EQ(sut.agent.state(), AgentState::waiting);
  room.is_seen = [](const Vec3d&) { return true; };
  EXPECT_TRUE(sut.walk(10));
}

TEST(Agent, WallThatAppearsOnTheWayIsGoneAround) {
  BoxRoom room;
  room.enclose(-1, -1, 1, 1);
  BoundAgent sut(room.scene());
  sut.agent.place({-0.7, 0.3, 0});
  sut.run(8);
  sut.agent.set_goal({0.7, 0, 0});
  sut.run(2);
  ASSERT_LT(sut.agent.pose().position_world_m.x, -0.05);
  ASSERT_GT(sut.agent.pose().walked_m, 0.3);
  room.solids.push_back({{0.1, 0, -0.6}, {0.14, 0.5, 0.6}});
  ASSERT_TRUE(sut.walk(40, [&](const AgentPose& pose) { expect_fits(room, pose); }));
  EXPECT_GE(sut.agent.counters().replans_blocked, 1U);
  EXPECT_GE(sut.agent.counters().plans, 2U);
}

TEST(Agent, GoalInAClosedRoomIsApproachedThenStuckAndCountedOnce) {
  BoxRoom room;
  room.enclose(-1, -1, 1, 1);
  room.enclose(0.3, -0.3, 0.9, 0.3);
  BoundAgent sut(room.scene());
  sut.agent.place({-0.7, 0.3, 0});
  sut.agent.set_goal({0.6, 0, 0});
  sut.run(30, [&](const AgentPose& pose) { expect_fits(room, pose); });
  EXPECT_EQ(sut.agent.state(), AgentState::stuck);
  EXPECT_EQ(sut.agent.counters().stuck, 1U);
  EXPECT_EQ(sut.agent.counters().arrivals, 0U);
  EXPECT_GT(sut.agent.pose().position_world_m.x, -0.1) << "as near as it gets";
  sut.agent.set_goal({-0.7, 0, 0.5});
  EXPECT_TRUE(sut.walk(20));
}

TEST(Agent, GoalBeyondTheWindowIsReached) {
  BoxRoom room;
  room.enclose(-3.5, -0.6, 3.5, 0.6);
  room.solids.push_back({{-0.1, 0, -0.6}, {0.1, 0.4, 0.3}});
  BoundAgent sut(room.scene());
  sut.agent.place({-3.2, 0.3, -0.3});
  sut.agent.set_goal({3.2, 0, -0.3});
  EXPECT_TRUE(sut.walk(90, [&](const AgentPose& pose) { expect_fits(room, pose); }));
  EXPECT_GE(sut.agent.counters().windows_moved, 6U);
}

TEST(Agent, UnlabelledFloorIsWalkedOn) {
  BoxRoom room;
  room.is_labelled = false;
  room.enclose(-1, -1, 1, 1);
  BoundAgent sut(room.scene());
  sut.agent.place({-0.5, 0.3, 0});
  sut.agent.set_goal({0.5, 0, 0});
  EXPECT_TRUE(sut.walk(15));
  EXPECT_EQ(sut.agent.grid().at({0, 0}).cost, kCostUnit * 3 / 2);
}

TEST(Agent, TooLongAStepIsCutAndCounted) {
  BoxRoom room;
  BoundAgent sut(room.scene());
  sut.agent.place({0, 0.3, 0});
  sut.run(2);
  sut.agent.set_goal({1, 0, 0});
  sut.run(1);
  const double before_m = sut.agent.pose().walked_m;
  EXPECT_EQ(sut.agent.step({2'000'000'000}), rt::Status::ok);
  EXPECT_LE(sut.agent.pose().walked_m - before_m, 0.025 + 1e-9);
  EXPECT_EQ(sut.agent.counters().steps_cut, 1U);
}

TEST(Agent, GravityAlongAnotherAxisChangesNothingButTheFrame) {
  const GroundFrame frame = GroundFrame::from_gravity({0, 0, 9.81});
  EXPECT_EQ(frame.up.z, -1);
  EXPECT_NEAR(frame.u.dot(frame.up), 0, 1e-12);
  EXPECT_NEAR(frame.v.dot(frame.up), 0, 1e-12);
  EXPECT_NEAR(frame.u.cross(frame.up).dot(frame.v), 1, 1e-12);
  const GroundFrame upright = GroundFrame::from_gravity({0, -9.81, 0});
  EXPECT_EQ(upright.u, (Vec3d{1, 0, 0}));
  EXPECT_EQ(upright.v, (Vec3d{0, 0, 1}));
}

TEST(Agent, SameSeedGivesTheSameBitsAndAnotherSeedOthers) {
  BoxRoom room;
  room.enclose(-1, -1, 1, 1);
  room.solids.push_back({{-0.3, 0, -0.3}, {0.2, 0.3, 0.1}});
  const auto trace = [&](std::uint64_t seed) {
    BoundAgent sut(room.scene());
    sut.agent.place({-0.6, 0.3, -0.6});
    sut.agent.wander(seed);
    std::vector<double> numbers;
    sut.run(20, [&](const AgentPose& pose) {
      numbers.insert(numbers.end(),
                     {pose.position_world_m.x, pose.position_world_m.y, pose.position_world_m.z,
                      pose.heading_world.x, pose.heading_world.z, pose.walked_m});
    });
    EXPECT_GE(sut.agent.counters().arrivals, 1U);
    return numbers;
  };
  const auto first = trace(7), again = trace(7), other = trace(8);
  ASSERT_EQ(first.size(), again.size());
  EXPECT_EQ(std::memcmp(first.data(), again.data(), first.size() * sizeof(double)), 0);
  EXPECT_NE(std::memcmp(first.data(), other.data(), first.size() * sizeof(double)), 0);
}

}  // namespace
}  // namespace tactus::interact
