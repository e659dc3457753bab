#include "pipeline/contact/world.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <random>
#include <vector>

#include "tests/pipeline/contact/analytic_field.hpp"

namespace tactus::contact {
namespace {

using test::AnalyticField;
using test::BoundWorld;
using test::floor_scene;
using test::reference_properties;

BodySpec ball(double radius_m, const Vec3d& position, const Vec3d& velocity = {}) {
  BodySpec spec;
  spec.shape = Shape::sphere(radius_m);
  spec.position_world_m = position;
  spec.velocity_world_m_per_s = velocity;
  return spec;
}

BodySpec crate(const Vec3d& half, const Vec3d& position, const Vec3d& velocity = {}) {
  BodySpec spec;
  spec.shape = Shape::box(half);
  spec.position_world_m = position;
  spec.velocity_world_m_per_s = velocity;
  return spec;
}

/// Gravity tilted by atan(slope) about z: the floor becomes a ramp that falls towards +x.
WorldConfig ramp(double slope) {
  WorldConfig config;
  const double n = std::sqrt(1 + slope * slope);
  config.gravity_world_m_per_s2 = {9.81 * slope / n, -9.81 / n, 0};
  return config;
}

TEST(World, BallInFreeFallFollowsTheParabolaExactly) {
  auto scene = floor_scene();
  BoundWorld sut(scene.field());
  const BodyId id = sut.spawn(ball(0.05, {0, 10, 0}, {1, 2, 0}));
  sut.run(1.0);
  EXPECT_NEAR(sut.find(id)->position_world_m.y, 10 + 2 - 0.5 * 9.81, 1e-9);
  EXPECT_NEAR(sut.find(id)->position_world_m.x, 1, 1e-9);
}

class BallAtRest : public testing::TestWithParam<double> {};

TEST_P(BallAtRest, RestsOnTheSurfaceWithoutSinkingOrDrifting) {
  auto scene = floor_scene(material_from_name("wood"));
  BoundWorld sut(scene.field());
  const double radius = GetParam();
  const BodyId id = sut.spawn(ball(radius, {0.013, radius + 0.1, -0.007}));
  sut.run(5);
  const Vec3d settled = sut.find(id)->position_world_m;
  EXPECT_NEAR(settled.y, radius, 0.0006);
  EXPECT_TRUE(sut.find(id)->resting);
  sut.run(10);
  EXPECT_LT((sut.find(id)->position_world_m - settled).norm(), 0.001);
}
// From a fifth of the truncation distance to six times it.
INSTANTIATE_TEST_SUITE_P(Radii, BallAtRest, testing::Values(0.008, 0.03, 0.05, 0.12, 0.25));

class Restitution : public testing::TestWithParam<std::size_t> {};

TEST_P(Restitution, DropOfAHardBallReproducesTheTable) {
  const auto material = static_cast<MaterialId>(GetParam());
  auto scene = floor_scene(material);
  BoundWorld sut(scene.field());
  const ContactProperties hard = reference_properties();
  const double expected = default_material_table().of(material).restitution;
  for (const double height : {0.3, 1.0, 2.0}) {
    BodySpec spec = ball(0.05, {0, 0.05 + height, 0});
    spec.properties = &hard;
    const BodyId id = sut.spawn(spec);
    sut.sink.count = 0;
    double top = 0;
    const int steps = static_cast<int>(2.5 * kStepsPerSecond);
    int impacts_seen = 0;
    for (int i = 0; i < steps && impacts_seen < 2; ++i) {
      sut.run_step();
      impacts_seen = static_cast<int>(sut.sink.count);
      if (impacts_seen == 1) top = std::max(top, sut.find(id)->position_world_m.y - 0.05);
    }
    ASSERT_GE(sut.sink.count, 1U);
    EXPECT_NEAR(sut.sink.events[0].impact_speed_m_per_s, std::sqrt(2 * 9.81 * height),
                0.01 * std::sqrt(2 * 9.81 * height));
    EXPECT_EQ(sut.sink.events[0].material, material);
    // 5 % of the restitution is 10 % of the height; the ball turns up to a contact margin above the floor.
    const double height_expected = expected * expected * height;
    EXPECT_NEAR(top, height_expected, 0.1 * height_expected + 0.0005)
        << kMaterialNames[material] << " " << height;
    const double mass = sut.find(id)->mass_kg;
    const double speed = sut.sink.events[0].impact_speed_m_per_s;
    EXPECT_NEAR(sut.sink.events[0].impulse_n_s, mass * speed * (1 + expected),
                0.05 * mass * speed + mass * 9.81 * kStepS);
    ASSERT_EQ(sut.world.remove(id), rt::Status::ok);
  }
}
INSTANTIATE_TEST_SUITE_P(AllMaterials, Restitution,
                         testing::Range(std::size_t{0}, std::size_t{kMaterialCount}),
                         [](const auto& p) { return std::string(kMaterialNames[p.param]); });

TEST(World, SoftPlasticBallDoesNotBounceOnASofaButDoesOnWood) {
  for (const char* name : {"fabric", "wood"}) {
    auto scene = floor_scene(material_from_name(name));
    BoundWorld sut(scene.field());
    const BodyId id = sut.spawn(ball(0.04, {0, 0.54, 0}));
    double top = 0;
    for (int i = 0; i < 200; ++i) {
      sut.run_step();
      if (sut.sink.count >= 1) top = std::max(top, sut.find(id)->position_world_m.y - 0.04);
    }
    if (std::string(name) == "fabric")
      EXPECT_LT(top, 0.02);
    else
      EXPECT_GT(top, 0.1);
  }
}

TEST(World, BallSinksIntoASoftSurfaceByItsCompliance) {
  auto scene = floor_scene(material_from_name("fabric"));
  BoundWorld sut(scene.field());
  BodySpec spec = ball(0.08, {0, 0.09, 0});
  spec.mass_kg = 1;
  const BodyId id = sut.spawn(spec);
  sut.run(3);
  const MaterialTable table = default_material_table();
  const double give =
      table.of(material_from_name("fabric")).compliance_m_per_n + table.of(spec.material).compliance_m_per_n;
  EXPECT_NEAR(sut.find(id)->position_world_m.y, 0.08 - 9.81 * give, 0.1 * 9.81 * give + 0.0002);
}

TEST(World, ExpectationOverTheLabelsLiesBetweenTheMaterials) {
  MaterialDistribution half{};
  half[material_from_name("glass")] = 0.5F;
  half[material_from_name("carpet")] = 0.5F;
  auto scene = floor_scene();
  scene.set_materials(half);
  BoundWorld sut(scene.field());
  const ContactProperties hard = reference_properties();
  BodySpec spec = ball(0.05, {0, 1.05, 0});
  spec.properties = &hard;
  const BodyId id = sut.spawn(spec);
  double top = 0;
  for (int i = 0; i < 120; ++i) {
    sut.run_step();
    if (sut.sink.count == 1) top = std::max(top, sut.find(id)->position_world_m.y - 0.05);
  }
  EXPECT_NEAR(std::sqrt(top), 0.5 * (0.94 + 0.15), 0.02);
}

TEST(World, UnlabelledSurfaceActsAsOther) {
  auto scene = floor_scene(kUnknownMaterial);
  BoundWorld sut(scene.field());
  sut.spawn(ball(0.05, {0, 0.3, 0}));
  sut.run(1);
  ASSERT_GE(sut.sink.count, 1U);
  EXPECT_EQ(sut.sink.events[0].material, kUnknownMaterial);
}

class FrictionOnARamp : public testing::TestWithParam<std::size_t> {};

TEST_P(FrictionOnARamp, BoxHoldsBelowStaticAndSlidesAboveByKinetic) {
  const auto material = static_cast<MaterialId>(GetParam());
  const ContactProperties surface = default_material_table().of(material);
  if (surface.static_friction < 0.05) GTEST_SKIP() << "no grip to measure";
  auto scene = floor_scene(material);
  const ContactProperties rough = reference_properties(1.0);
  const double mu_static = std::sqrt(surface.static_friction),
               mu_kinetic = std::sqrt(surface.kinetic_friction);
  {
    BoundWorld sut(scene.field());
    BodySpec spec = crate({0.1, 0.02, 0.1}, {0, 0.02, 0});  // flat: does not topple
    spec.properties = &rough;
    const BodyId id = sut.spawn(spec);
    sut.run(1);  // a soft surface needs time to carry
    sut.world.set_gravity(ramp(0.93 * mu_static).gravity_world_m_per_s2);
    sut.run(2);
    EXPECT_LT(std::abs(sut.find(id)->position_world_m.x), 0.005) << kMaterialNames[material];
  }
  {
    const double slope = 1.1 * mu_static;
    BoundWorld sut(scene.field(), ramp(slope));
    BodySpec spec = crate({0.1, 0.02, 0.1}, {0, 0.02, 0}, {0.1, 0, 0});
    spec.properties = &rough;
    const BodyId id = sut.spawn(spec);
    sut.run(0.2);  // past the first contact
    const double v0 = sut.find(id)->velocity_world_m_per_s.x;
    sut.run(0.5);
    const double a = (sut.find(id)->velocity_world_m_per_s.x - v0) / 0.5;
    const double expected = 9.81 * (slope - mu_kinetic) / std::sqrt(1 + slope * slope);
    EXPECT_NEAR(a, expected, 0.05 * expected + 0.02) << kMaterialNames[material];
  }
}
INSTANTIATE_TEST_SUITE_P(AllMaterials, FrictionOnARamp,
                         testing::Range(std::size_t{0}, std::size_t{kMaterialCount}),
                         [](const auto& p) { return std::string(kMaterialNames[p.param]); });

TEST(World, SlidingBoxStopsAfterVSquaredOverTwoMuG) {
  for (const Vec3d& direction : {Vec3d{1, 0, 0}, Vec3d{0.6, 0, 0.8}}) {
    auto scene = floor_scene(material_from_name("wood"));
    BoundWorld sut(scene.field());
    const ContactProperties rough = reference_properties(1.0);
    BodySpec spec = crate({0.1, 0.03, 0.1}, {0, 0.03, 0}, direction * 2);
    spec.properties = &rough;
    const BodyId id = sut.spawn(spec);
    sut.run(3);
    const double mu = std::sqrt(default_material_table().of(material_from_name("wood")).kinetic_friction);
    const double expected = 4 / (2 * mu * 9.81);
    EXPECT_NEAR(sut.find(id)->position_world_m.norm(), expected, 0.05 * expected + 0.03);
  }
}

TEST(World, RollingBallComesToRestOnCarpet) {
  auto scene = floor_scene(material_from_name("carpet"));
  BoundWorld sut(scene.field());
  const ContactProperties rough = reference_properties(1.0);
  BodySpec spec = ball(0.05, {0, 0.05, 0}, {1, 0, 0});
  spec.angular_velocity_world_rad_per_s = {0, 0, -20};
  spec.properties = &rough;
  const BodyId id = sut.spawn(spec);
  sut.run(6);
  // Energy 7/10 m v^2 against the force c N.
  const double expected =
      0.7 / (default_material_table().of(material_from_name("carpet")).rolling_resistance * 9.81);
  EXPECT_NEAR(sut.find(id)->position_world_m.x, expected, 0.15 * expected);
  EXPECT_TRUE(sut.find(id)->resting);
}

TEST(World, BoxRestsOnFourCornersAndDoesNotDrift) {
  auto scene = floor_scene();
  BoundWorld sut(scene.field());
  const BodyId id = sut.spawn(crate({0.15, 0.1, 0.2}, {0.003, 0.15, 0.004}));
  sut.run(4);
  const BodyState settled = *sut.find(id);
  EXPECT_TRUE(settled.resting);
  EXPECT_NEAR(settled.position_world_m.y, 0.1, 0.0006);
  sut.run(10);
  EXPECT_LT((sut.find(id)->position_world_m - settled.position_world_m).norm(), 0.001);
  // Woken every step, it still does not creep.
  for (int i = 0; i < 1200; ++i) {
    sut.world.wake_all();
    sut.run_step();
  }
  EXPECT_LT((sut.find(id)->position_world_m - settled.position_world_m).norm(), 0.001);
}

TEST(World, StackOfBoxesStandsAndSleeps) {
  auto scene = floor_scene();
  BoundWorld sut(scene.field());
  std::vector<BodyId> ids;
  for (int i = 0; i < 4; ++i) ids.push_back(sut.spawn(crate({0.1, 0.05, 0.1}, {0, 0.05 + 0.101 * i, 0})));
  sut.run(5);
  for (std::size_t i = 0; i < ids.size(); ++i) {
    EXPECT_NEAR(sut.find(ids[i])->position_world_m.y, 0.05 + 0.1 * static_cast<double>(i), 0.003);
    EXPECT_TRUE(sut.find(ids[i])->resting);
  }
  ASSERT_EQ(sut.world.remove(ids[0]), rt::Status::ok);
  sut.run(3);
  EXPECT_NEAR(sut.find(ids[1])->position_world_m.y, 0.05, 0.003)
      << "the stack comes down when its foot is taken";
}

/// A wall of two voxels, seen from both sides: |x| <= 1 cm, outside unseen beyond the band.
AnalyticField<double (*)(const Vec3d&)> thin_wall() {
  return AnalyticField<double (*)(const Vec3d&)>([](const Vec3d& p) { return std::abs(p.x) - 0.01; },
                                                 material_from_name("painted"));
}

struct Shot {
  double speed, radius;
  bool box;
};
class Tunnelling : public testing::TestWithParam<Shot> {};

TEST_P(Tunnelling, ThinWallStopsAFastBodyFromEitherSide) {
  const Shot shot = GetParam();
  auto scene = thin_wall();
  WorldConfig weightless;
  weightless.gravity_world_m_per_s2 = {};
  std::mt19937 random(7);
  std::uniform_real_distribution<double> offset(0, 0.5), across(-0.4, 0.4);
  for (int round = 0; round < 24; ++round) {
    BoundWorld sut(scene.field(), weightless);
    const double side = round % 2 == 0 ? -1 : 1;
    const Vec3d from{side * (1 + offset(random)), 0, 0};
    const Vec3d velocity = Vec3d{-side, across(random), across(random)}.normalized() * shot.speed;
    const Vec3d half{shot.radius, shot.radius * 0.8, shot.radius * 0.6};
    const BodyId id = sut.spawn(shot.box ? crate(half, from, velocity) : ball(shot.radius, from, velocity));
    sut.run(0.6);
    if (sut.find(id) == nullptr) continue;  // flown away: checked by the event below
    EXPECT_GT(sut.find(id)->position_world_m.x * side, 0) << "round " << round;
    EXPECT_GE(sut.sink.count, 1U);
  }
}
INSTANTIATE_TEST_SUITE_P(Shots, Tunnelling,
                         testing::Values(Shot{15, 0.02, false}, Shot{15, 0.05, false}, Shot{15, 0.15, false},
                                         Shot{100, 0.005, false}, Shot{15, 0.05, true},
                                         Shot{40, 0.02, true}));

TEST(World, FastRollingBallIsStoppedByTheWallAtTheEndOfTheFloor) {
  AnalyticField scene([](const Vec3d& p) { return std::min(p.y, 1 - p.x); }, material_from_name("wood"));
  BoundWorld sut(scene.field());
  const BodyId id = sut.spawn(ball(0.05, {0, 0.05, 0}, {15, 0, 0}));
  sut.run(0.5);
  EXPECT_LT(sut.find(id)->position_world_m.x, 0.96);
}

TEST(World, NeverSeenSpaceIsNotSolid) {
  auto scene = floor_scene();
  scene.set_seen([](const Vec3d& p) { return p.x > 0; });
  BoundWorld sut(scene.field());
  const BodyId over_seen = sut.spawn(ball(0.05, {0.3, 0.3, 0}));
  const BodyId over_unseen = sut.spawn(ball(0.05, {-0.3, 0.3, 0}));
  sut.run(1.0);
  EXPECT_GT(sut.find(over_seen)->position_world_m.y, 0.049);
  EXPECT_NEAR(sut.find(over_unseen)->position_world_m.y, 0.3 - 0.5 * 9.81, 1e-6);
}

TEST(World, BackOfASurfaceNeitherStopsNorSucks) {
  // One-sided: seen from +x only, as a camera sees a wall. A body comes from behind.
  AnalyticField scene([](const Vec3d& p) { return p.x; });
  WorldConfig weightless;
  weightless.gravity_world_m_per_s2 = {};
  BoundWorld sut(scene.field(), weightless);
  const BodyId behind = sut.spawn(ball(0.05, {-0.06, 0, 0}));
  const BodyId coming = sut.spawn(ball(0.05, {-0.5, 1, 0}, {1, 0, 0}));
  sut.run(0.45);
  EXPECT_NEAR(sut.find(behind)->position_world_m.x, -0.06, 1e-12);
  EXPECT_NEAR(sut.find(coming)->position_world_m.x, -0.05, 1e-9);
  sut.run(1);
  // It leaves on the front: helped out by no more than the ease-out speed.
  EXPECT_GT(sut.find(coming)->position_world_m.x, 0.5);
  EXPECT_LT(sut.find(coming)->velocity_world_m_per_s.x, 1.2);
}

TEST(World, SleeperFallsWhenTheMapTakesItsSupportAway) {
  auto scene = floor_scene();
  BoundWorld sut(scene.field());
  const BodyId id = sut.spawn(ball(0.05, {0, 0.06, 0}));
  sut.run(3);
  ASSERT_TRUE(sut.find(id)->resting);
  scene.set_empty(true);
  sut.run(1.5);
  EXPECT_LT(sut.find(id)->position_world_m.y, -0.5);
}

TEST(World, SleeperStaysWhereTheMapHasForgottenItsSupport) {
  auto scene = floor_scene();
  BoundWorld sut(scene.field());
  const BodyId id = sut.spawn(ball(0.05, {0, 0.06, 0}));
  sut.run(3);
  ASSERT_TRUE(sut.find(id)->resting);
  scene.set_solid(false);
  sut.run(3);
  EXPECT_NEAR(sut.find(id)->position_world_m.y, 0.05, 0.001);
  scene.set_solid(true);
  sut.world.wake_all();
  sut.run(3);
  EXPECT_NEAR(sut.find(id)->position_world_m.y, 0.05, 0.001);
}

TEST(World, SurfaceThatGrowsOverABodyEasesItOut) {
  double floor_y = 0;
  AnalyticField scene([&floor_y](const Vec3d& p) { return p.y - floor_y; });
  BoundWorld sut(scene.field());
  const BodyId id = sut.spawn(ball(0.05, {0, 0.05, 0}));
  sut.run(1);
  floor_y = 0.02;
  sut.world.wake_all();
  double top_speed = 0;
  for (int i = 0; i < 240; ++i) {
    sut.run_step();
    top_speed = std::max(top_speed, sut.find(id)->velocity_world_m_per_s.norm());
  }
  EXPECT_LT(top_speed, 1.1);
  EXPECT_NEAR(sut.find(id)->position_world_m.y, 0.07, 0.001);
}

TEST(World, BodyThatFallsForEverIsRemovedAndCounted) {
  auto scene = floor_scene();
  scene.set_solid(false);
  BoundWorld sut(scene.field());
  const BodyId id = sut.spawn(ball(0.05, {0, 0, 0}));
  sut.run(5);
  EXPECT_EQ(sut.find(id), nullptr);
  EXPECT_EQ(sut.world.counters().bodies_lost, 1U);
  EXPECT_EQ(sut.world.remove(id), rt::Status::stale);
}

TEST(World, FullPoolRefusesCountsAndGoesOn) {
  auto scene = floor_scene();
  WorldConfig config;
  config.bodies_capacity = 4;
  config.contacts_capacity = 24;
  BoundWorld sut(scene.field(), config);
  for (int i = 0; i < 4; ++i) sut.spawn(ball(0.05, {0.2 * i, 0.1, 0}));
  BodyId id;
  EXPECT_EQ(sut.world.spawn(ball(0.05, {0, 1, 0}), id), rt::Status::full);
  EXPECT_FALSE(id.is_body());
  EXPECT_EQ(sut.world.counters().spawns_refused, 1U);
  EXPECT_EQ(sut.world.counters().bodies_max, 4U);
  sut.run(1);
  EXPECT_EQ(sut.world.bodies().size(), 4U);
  // A slot that is used again has a new name.
  const BodyId first = sut.world.bodies()[0].id;
  ASSERT_EQ(sut.world.remove(first), rt::Status::ok);
  const BodyId again = sut.spawn(ball(0.05, {0, 1, 0}));
  EXPECT_EQ(again.index, first.index);
  EXPECT_NE(again, first);
}

TEST(World, ContactsBeyondThePlanAreDroppedAndCounted) {
  auto scene = floor_scene();
  WorldConfig config;
  config.bodies_capacity = 8;
  config.contacts_capacity = 8;
  BoundWorld sut(scene.field(), config);
  for (int i = 0; i < 8; ++i) sut.spawn(crate({0.05, 0.05, 0.05}, {0.3 * i, 0.05, 0}));
  sut.run(0.1);
  EXPECT_GT(sut.world.counters().contacts_dropped, 0U);
  EXPECT_EQ(sut.world.counters().steps_failed, 0U);
  EXPECT_EQ(sut.world.counters().contacts_max, 8U);
}

TEST(World, SpecThatCannotBeIsRefused) {
  auto scene = floor_scene();
  BoundWorld sut(scene.field());
  BodyId id;
  EXPECT_EQ(sut.world.spawn(ball(0, {}), id), rt::Status::unsupported);
  EXPECT_EQ(sut.world.spawn(ball(0.1, {NAN, 0, 0}), id), rt::Status::unsupported);
  EXPECT_EQ(sut.world.spawn(crate({0.1, -0.1, 0.1}, {}), id), rt::Status::unsupported);
  EXPECT_EQ(sut.world.counters().spawns_refused, 3U);
}

TEST(World, LongPauseIsDroppedAndCountedNotCaughtUp) {
  auto scene = floor_scene();
  BoundWorld sut(scene.field());
  EXPECT_EQ(sut.world.step({1'000'000'000}, sut.sink), rt::Status::late);
  EXPECT_EQ(sut.world.counters().steps, 8U);
  EXPECT_EQ(sut.world.counters().steps_dropped, 112U);
  EXPECT_EQ(sut.world.step({8'333'334}, sut.sink), rt::Status::ok);
  EXPECT_EQ(sut.world.counters().steps, 9U);
}

TEST(World, FramesOfAThirtiethMakeFourStepsOnAverage) {
  auto scene = floor_scene();
  BoundWorld sut(scene.field());
  for (int i = 0; i < 300; ++i) ASSERT_EQ(sut.world.step({33'333'333}, sut.sink), rt::Status::ok);
  EXPECT_EQ(sut.world.counters().steps, 1199U);  // 300 * 33333333 ns is 100 ns short of 10 s
}

TEST(World, FullSinkCountsWhatItDrops) {
  auto scene = floor_scene();
  BoundWorld sut(scene.field());
  ContactEvent one[1];
  ContactSink small{one};
  sut.spawn(ball(0.05, {0, 0.2, 0}));
  sut.spawn(ball(0.05, {1, 0.2, 0}));
  for (int i = 0; i < 60; ++i) ASSERT_EQ(sut.world.step({8'333'334}, small), rt::Status::ok);
  EXPECT_EQ(small.count, 1U);
  EXPECT_GE(small.dropped, 1U);
}

TEST(World, TwoBallsThatMeetConserveMomentumAndReportEachOther) {
  auto scene = floor_scene();
  WorldConfig weightless;
  weightless.gravity_world_m_per_s2 = {};
  BoundWorld sut(scene.field(), weightless);
  const BodyId a = sut.spawn(ball(0.05, {-0.3, 1, 0}, {1, 0, 0}));
  const BodyId b = sut.spawn(ball(0.05, {0.3, 1, 0}, {-1, 0, 0}));
  sut.run(0.5);
  const double mass = sut.find(a)->mass_kg;
  EXPECT_NEAR(sut.find(a)->velocity_world_m_per_s.x + sut.find(b)->velocity_world_m_per_s.x, 0, 1e-6);
  ASSERT_EQ(sut.sink.count, 1U);
  const ContactEvent& event = sut.sink.events[0];
  EXPECT_TRUE((event.body == a && event.other == b) || (event.body == b && event.other == a));
  EXPECT_NEAR(event.impact_speed_m_per_s, 2, 1e-6);
  const double restitution = default_material_table().of(material_from_name("plastic")).restitution;
  EXPECT_NEAR(event.impulse_n_s, mass * (1 + restitution), 0.02 * mass);
}

/// A heap of mixed bodies on a floor with a step, dropped at random; the seed is printed.
std::vector<BodyState> tumble(unsigned seed, int bodies_count, double seconds) {
  AnalyticField scene([](const Vec3d& p) { return std::min(p.y, std::max(p.y - 0.1, -p.x)); });
  BoundWorld sut(scene.field());
  std::mt19937 random(seed);
  const auto uniform = [&random](double a, double b) {
    return a + (b - a) * (static_cast<double>(random()) / 4294967296.0);
  };
  for (int i = 0; i < bodies_count; ++i) {
    BodySpec spec =
        i % 2 == 0 ? ball(uniform(0.02, 0.1), {}) : crate({uniform(0.03, 0.1), uniform(0.03, 0.1), 0.05}, {});
    spec.position_world_m = {uniform(-0.7, 0.7), 0.5 + 0.1 * (i / 5), uniform(-0.7, 0.7)};
    spec.q_world_body = Quaternion{1, uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)}.normalized();
    spec.material = static_cast<MaterialId>(random() % 17);
    sut.spawn(spec);
  }
  sut.run(seconds);
  return {sut.world.bodies().begin(), sut.world.bodies().end()};
}

TEST(World, SameInputsGiveTheSameBits) {
  const auto first = tumble(11, 20, 3);
  const auto second = tumble(11, 20, 3);
  ASSERT_EQ(first.size(), second.size());
  for (std::size_t i = 0; i < first.size(); ++i) {
    EXPECT_EQ(first[i].position_world_m, second[i].position_world_m);
    EXPECT_EQ(first[i].velocity_world_m_per_s, second[i].velocity_world_m_per_s);
    EXPECT_EQ(first[i].q_world_body.w, second[i].q_world_body.w);
  }
}

TEST(World, FiftyMixedBodiesComeToRestAboveTheGround) {
  for (const unsigned seed : {1U, 2U, 3U}) {
    const auto bodies = tumble(seed, 50, 12);
    EXPECT_EQ(bodies.size(), 50U) << "seed " << seed;
    int resting = 0;
    for (const BodyState& body : bodies) {
      EXPECT_GT(body.position_world_m.y, 0.015) << "seed " << seed;
      resting += body.resting ? 1 : 0;
    }
    EXPECT_GE(resting, 45) << "seed " << seed;
  }
}

TEST(World, ConfigBeyondTheLimitsIsOneSentence) {
  auto scene = floor_scene();
  WorldConfig config;
  config.contacts_capacity = 3;
  World sut;
  const auto result = sut.bind({}, config, scene.field(), default_material_table());
  ASSERT_FALSE(result.has_value());
  EXPECT_EQ(result.error().code, rt::ExitCode::bad_usage);
  EXPECT_NE(result.error().message.find("contacts_capacity is 3"), std::string::npos);
}

TEST(World, PlanHoldsTheWorstCaseAtSeveralCapacities) {
  auto scene = floor_scene();
  for (const std::size_t bodies : {1U, 7U, 64U, 200U, 1000U}) {
    for (const std::size_t contacts_per_body : {1U, 6U, 20U}) {
      WorldConfig config;
      config.bodies_capacity = bodies;
      config.contacts_capacity = bodies * contacts_per_body;
      BoundWorld sut(scene.field(), config);  // bind() proves the plan
      const OdeMemoryUse& use = sut.world.memory_use();
      EXPECT_EQ(use.refused, 0U);
      EXPECT_LE(use.carved_bytes, use.capacity_bytes);
      if (bodies == 64)
        RecordProperty("carved_bytes_64_" + std::to_string(contacts_per_body),
                       std::to_string(use.carved_bytes));
    }
  }
}

}  // namespace
}  // namespace tactus::contact
