// What must hold for every shape of body.
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "pipeline/contact/body_contacts.hpp"
#include "pipeline/contact/field_contacts.hpp"
#include "pipeline/contact/world.hpp"
#include "tests/pipeline/contact/analytic_field.hpp"
#include "tests/pipeline/contact/test_shapes.hpp"

namespace tactus::contact {
namespace {

using test::AnalyticField;
using test::BoundWorld;
using test::floor_scene;
using test::Lying;
using test::lying_shapes;
using test::reference_properties;

BodySpec spec_of(const Lying& lying, const Vec3d& position) {
  BodySpec spec;
  spec.shape = lying.shape;
  spec.q_world_body = lying.q_world_body;
  spec.position_world_m = position;
  return spec;
}

class EveryShape : public testing::TestWithParam<std::size_t> {
 protected:
  const Lying lying_ = lying_shapes()[GetParam()];
};
INSTANTIATE_TEST_SUITE_P(Shapes, EveryShape, testing::Range(std::size_t{0}, lying_shapes().size()),
                         test::NameOfLying{});

void expect_rest(BoundWorld& sut, BodyId id, double height_m) {
  sut.run(5);
  ASSERT_NE(sut.find(id), nullptr) << "fell";
  const BodyState settled = *sut.find(id);
  EXPECT_NEAR(settled.position_world_m.y, height_m, 0.0006);
  EXPECT_TRUE(settled.resting);
  for (int i = 0; i < 1200; ++i) {
    if (i % 2 == 0) sut.world.wake_all();
    sut.run_step();
  }
  ASSERT_NE(sut.find(id), nullptr) << "fell";
  EXPECT_LT((sut.find(id)->position_world_m - settled.position_world_m).norm(), 0.001);
  sut.run(1);
  EXPECT_TRUE(sut.find(id)->resting);
}

TEST_P(EveryShape, RestsOnTheFloorAndSleepsAndDoesNotDriftWhenWoken) {
  auto scene = floor_scene();
  BoundWorld sut(scene.field());
  expect_rest(sut, sut.spawn(spec_of(lying_, {0.003, lying_.height_m + 0.05, -0.002})), lying_.height_m);
}

TEST_P(EveryShape, RestsOnATableOverItsEdge) {
  // A board of 4 cm at 0.7 m that ends at x = 0, rounded by its exact distance.
  AnalyticField scene([](const Vec3d& p) {
    const Vec3d q{p.x, std::abs(p.y - 0.68) - 0.02, 0};
    const Vec3d outside{std::max(q.x, 0.0), std::max(q.y, 0.0), 0};
    return outside.norm() + std::min(std::max(q.x, q.y), 0.0);
  });
  BoundWorld sut(scene.field());
  const double overhang_m = lying_.shape.kind == ShapeKind::sphere ? 0.01 : 0.4 * lying_.half_width_m;
  const double x = overhang_m - lying_.half_width_m;
  expect_rest(sut, sut.spawn(spec_of(lying_, {x, 0.7 + lying_.height_m + 0.002, 0})), 0.7 + lying_.height_m);
}

TEST_P(EveryShape, RestsInACornerOfThreeWalls) {
  AnalyticField scene([](const Vec3d& p) { return std::min({p.x, p.y, p.z}); });
  BoundWorld sut(scene.field());
  // Where the shape meets the wall in z, found by sweeping it there.
  const double far_m = reach_m(lying_.shape) + 0.01;
  const double z = far_m * (1 - free_fraction(scene.field(), lying_.shape, {1, 1, far_m},
                                              Rotation::from(lying_.q_world_body), {0, 0, -far_m}));
  const Vec3d at{lying_.half_width_m + 0.0003, lying_.height_m + 0.01, z + 0.0003};
  expect_rest(sut, sut.spawn(spec_of(lying_, at)), lying_.height_m);
}

TEST_P(EveryShape, LevelDropBouncesByTheCombinedRestitution) {
  for (const char* name : {"wood", "carpet", "glass"}) {
    const MaterialId material = material_from_name(name);
    auto scene = floor_scene(material);
    BoundWorld sut(scene.field());
    const ContactProperties hard = reference_properties();
    BodySpec spec = spec_of(lying_, {0, lying_.height_m + 0.6, 0});
    spec.properties = &hard;
    const BodyId id = sut.spawn(spec);
    double top_m = 0;
    for (int i = 0; i < 240 && sut.sink.count < 2; ++i) {
      sut.run_step();
      if (sut.sink.count == 1) top_m = std::max(top_m, sut.find(id)->position_world_m.y - lying_.height_m);
    }
    const double expected = combine(hard, default_material_table().of(material)).restitution;
    const double expected_m = expected * expected * 0.6;
    // 5 % of the restitution is 10 % of the height.
    EXPECT_NEAR(top_m, expected_m, 0.1 * expected_m + 0.0005) << name;
  }
}

/// A wall of two voxels, seen from both sides.
AnalyticField<double (*)(const Vec3d&)> thin_wall() {
  return AnalyticField<double (*)(const Vec3d&)>([](const Vec3d& p) { return std::abs(p.x) - 0.01; },
                                                 material_from_name("painted"));
}

void shoot_at_the_thin_wall(const Shape& shape, double speed, int rounds) {
  const unsigned seed = 7;
  SCOPED_TRACE("seed " + std::to_string(seed));
  auto scene = thin_wall();
  WorldConfig weightless;
  weightless.gravity_world_m_per_s2 = {};
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> offset(0, 0.5), across(-0.4, 0.4), turn(-1, 1);
  for (int round = 0; round < rounds; ++round) {
    BoundWorld sut(scene.field(), weightless);
    const double side = round % 2 == 0 ? -1 : 1;
    BodySpec spec;
    spec.shape = shape;
    spec.position_world_m = {side * (1 + offset(random)), 0, 0};
    spec.velocity_world_m_per_s = Vec3d{-side, across(random), across(random)}.normalized() * speed;
    spec.q_world_body = Quaternion{turn(random), turn(random), turn(random), 0.1}.normalized();
    const BodyId id = sut.spawn(spec);
    sut.run(0.4);
    const BodyState* state = sut.find(id);
    EXPECT_TRUE(state == nullptr || state->position_world_m.x * side > 0) << round;
    EXPECT_GE(sut.sink.count, 1U) << round;
  }
}

TEST_P(EveryShape, FifteenMetresASecondAreStoppedByAWallOfTwoVoxels) {
  shoot_at_the_thin_wall(lying_.shape, 15, 16);
}
TEST(Bullet, HundredMetresASecondAreStoppedByAWallOfTwoVoxels) {
  shoot_at_the_thin_wall(Shape::sphere(0.0045), 100, 24);
}
TEST(Pebble, FifteenMetresASecondAreStoppedByAWallOfTwoVoxels) {
  shoot_at_the_thin_wall(Shape::convex(test::pebble_hull()), 15, 16);
}

TEST_P(EveryShape, BehindASurfaceOrInUnseenSpaceTouchesNothing) {
  auto scene = floor_scene();
  std::array<FieldContact, kFieldContactsMax> contacts;
  const Rotation R = Rotation::from(lying_.q_world_body);
  const auto touches = [&](double y) {
    return field_contacts(scene.field(), lying_.shape, {0, y, 0}, R, kContactMarginM, {0, 1, 0}, contacts);
  };
  EXPECT_GT(touches(lying_.height_m), 0);
  EXPECT_EQ(touches(lying_.height_m + 0.01), 0);
  EXPECT_EQ(touches(-0.005), 0) << "centre behind the surface";
  EXPECT_EQ(touches(-lying_.height_m - 0.01), 0) << "wholly behind the surface";
  scene.set_seen([](const Vec3d&) { return false; });
  EXPECT_EQ(touches(lying_.height_m), 0);
}

TEST(CylinderOnAPlane, TouchesAtTheExactDepthInAnyAttitude) {
  const unsigned seed = 8;
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  std::normal_distribution<double> n;
  for (int round = 0; round < 400; ++round) {
    const bool capsule = round % 2 == 0;
    const double r = 0.01 + 0.0001 * round, h = 0.02 + 0.0002 * round;
    const Shape shape = capsule ? Shape::capsule(r, h) : Shape::cylinder(r, h);
    const Rotation R = Rotation::from(Quaternion{n(random), n(random), n(random), n(random)}.normalized());
    const Vec3d axis = R * Vec3d{0, 0, 1};
    const double along = std::abs(axis.y), across = std::sqrt(1 - along * along);
    const double reach = capsule ? h * along + r : h * along + r * across;
    auto scene = floor_scene();
    std::array<FieldContact, kFieldContactsMax> contacts;
    const int count =
        field_contacts(scene.field(), shape, {0, reach - 0.001, 0}, R, kContactMarginM, {0, 1, 0}, contacts);
    ASSERT_GE(count, 1) << round;
    double deepest = 0;
    for (int i = 0; i < count; ++i)
      deepest = std::max(deepest, contacts[static_cast<std::size_t>(i)].depth_m);
    EXPECT_NEAR(deepest, 0.001 + kContactMarginM, across < 0.06 ? 1.5e-4 : 2e-5) << round;
  }
}

TEST(Cylinder, RollsToRestByItsRollingResistance) {
  auto scene = floor_scene(material_from_name("carpet"));
  const ContactProperties rough = reference_properties(1.0);
  const double c = default_material_table().of(material_from_name("carpet")).rolling_resistance;
  for (const bool capsule : {false, true}) {
    BoundWorld sut(scene.field());
    BodySpec spec;
    spec.shape = capsule ? Shape::capsule(0.04, 0.05) : Shape::cylinder(0.04, 0.05);
    spec.position_world_m = {0, 0.04, 0};
    spec.velocity_world_m_per_s = {1, 0, 0};
    spec.angular_velocity_world_rad_per_s = {0, 0, -25};
    spec.properties = &rough;
    const BodyId id = sut.spawn(spec);
    sut.run(6);
    // Energy 3/4 m v^2 of a cylinder against the force c N; a capsule's caps weigh a little nearer to the
    // axis.
    const double expected = 0.75 / (c * 9.81);
    EXPECT_NEAR(sut.find(id)->position_world_m.x, expected, 0.15 * expected) << capsule;
    EXPECT_NEAR(sut.find(id)->position_world_m.z, 0, 0.02 * expected) << capsule;
    EXPECT_NEAR(sut.find(id)->position_world_m.y, 0.04, 0.001) << "carpet gives" << capsule;
    EXPECT_TRUE(sut.find(id)->resting) << capsule;
  }
}

TEST(Cylinder, WithoutResistanceRollsOnEvenly) {
  auto scene = floor_scene();
  MaterialTable table = default_material_table();
  for (ContactProperties& p : table.properties) p.rolling_resistance = 0;
  BoundWorld sut(scene.field(), {}, table);
  const ContactProperties rough = reference_properties(1.0);
  BodySpec spec;
  spec.shape = Shape::cylinder(0.03, 0.05);
  spec.position_world_m = {0, 0.03, 0};
  spec.velocity_world_m_per_s = {1, 0, 0};
  spec.angular_velocity_world_rad_per_s = {0, 0, -1 / 0.03};
  spec.properties = &rough;
  const BodyId id = sut.spawn(spec);
  for (int i = 0; i < 360; ++i) {
    sut.run_step();
    ASSERT_NEAR(sut.find(id)->position_world_m.y, 0.03, 0.0006) << "a polygon would climb 2 mm";
  }
  EXPECT_NEAR(sut.find(id)->velocity_world_m_per_s.x, 1, 0.03);
}

TEST(Cylinder, OnItsFlatSideSlidesByKineticFriction) {
  auto scene = floor_scene(material_from_name("wood"));
  const ContactProperties rough = reference_properties(1.0);
  const double mu = std::sqrt(default_material_table().of(material_from_name("wood")).kinetic_friction);
  for (const Vec3d& direction : {Vec3d{1, 0, 0}, Vec3d{0.6, 0, 0.8}}) {
    BoundWorld sut(scene.field());
    BodySpec spec;
    spec.shape = Shape::cylinder(0.1, 0.02);
    spec.q_world_body = test::kZUp;
    spec.position_world_m = {0, 0.02, 0};
    spec.velocity_world_m_per_s = direction * 2;
    spec.properties = &rough;
    const BodyId id = sut.spawn(spec);
    sut.run(0.1);
    const double v0 = sut.find(id)->velocity_world_m_per_s.norm();
    sut.run(0.15);
    const double a = (v0 - sut.find(id)->velocity_world_m_per_s.norm()) / 0.15;
    EXPECT_NEAR(a, mu * 9.81, 0.05 * mu * 9.81);
    sut.run(3);
    const double expected = 4 / (2 * mu * 9.81);
    EXPECT_NEAR(sut.find(id)->position_world_m.norm(), expected, 0.05 * expected + 0.02);
  }
}

class EveryPair : public testing::TestWithParam<int> {
 protected:
  const Lying a_ = lying_shapes()[static_cast<std::size_t>(GetParam()) / 7];
  const Lying b_ = lying_shapes()[static_cast<std::size_t>(GetParam()) % 7];
};
INSTANTIATE_TEST_SUITE_P(Pairs, EveryPair, testing::Range(0, 49), [](const auto& pair) {
  const auto i = static_cast<std::size_t>(pair.param);
  return std::string(lying_shapes()[i / 7].name) + "_and_" + lying_shapes()[i % 7].name;
});

TEST_P(EveryPair, MeetBounceAndKeepTheirMomentum) {
  auto scene = floor_scene();
  WorldConfig weightless;
  weightless.gravity_world_m_per_s2 = {};
  BoundWorld sut(scene.field(), weightless);
  BodySpec a = spec_of(a_, {-0.3, 1, 0.004});
  BodySpec b = spec_of(b_, {0.3, 1.003, 0});
  a.velocity_world_m_per_s = {1, 0, 0};
  b.velocity_world_m_per_s = {-1, 0, 0};
  const BodyId ia = sut.spawn(a), ib = sut.spawn(b);
  const double ma = sut.find(ia)->mass_kg, mb = sut.find(ib)->mass_kg;
  sut.run(0.6);
  const Vec3d momentum =
      sut.find(ia)->velocity_world_m_per_s * ma + sut.find(ib)->velocity_world_m_per_s * mb;
  EXPECT_NEAR(momentum.x, ma - mb, 1e-6);
  EXPECT_NEAR(momentum.y, 0, 1e-6);
  EXPECT_LT(sut.find(ia)->position_world_m.x, sut.find(ib)->position_world_m.x) << "they pass through";
  ASSERT_GE(sut.sink.count, 1U);
  EXPECT_TRUE(sut.sink.events[0].other.is_body());
}

TEST_P(EveryShape, RestsOnABoxAndSleeps) {
  auto scene = floor_scene();
  BoundWorld sut(scene.field());
  BodySpec base;
  base.shape = Shape::box({0.2, 0.05, 0.2});
  base.position_world_m = {0, 0.05, 0};
  sut.spawn(base);
  const BodyId id = sut.spawn(spec_of(lying_, {0.002, 0.1 + lying_.height_m + 0.01, 0.003}));
  sut.run(4);
  EXPECT_NEAR(sut.find(id)->position_world_m.y, 0.1 + lying_.height_m, 0.002);
  EXPECT_NEAR(sut.find(id)->position_world_m.x, 0.002, 0.005);
  EXPECT_NEAR(sut.find(id)->position_world_m.z, 0.003, 0.005);
  EXPECT_TRUE(sut.find(id)->resting);
}

TEST(BodyContacts, CrossingEdgesAreLeftToOdeAndHold) {
  auto scene = floor_scene();
  BoundWorld sut(scene.field());
  // Two hulls like roof beams, one lying across the other's ridge.
  const ConvexHull beam = test::hull_from(
      {{-0.1, 0, -0.03}, {-0.1, 0, 0.03}, {-0.1, 0.03, 0}, {0.1, 0, -0.03}, {0.1, 0, 0.03}, {0.1, 0.03, 0}});
  BodySpec spec;
  spec.shape = Shape::convex(beam);
  spec.position_world_m = {0, 0.011, 0};
  const BodyId below = sut.spawn(spec);
  spec.q_world_body = Quaternion{0, 0.70710678118654752, 0, 0.70710678118654752};  // ridge down, along z
  spec.position_world_m = {0.004, 0.06, 0.005};
  const BodyId above = sut.spawn(spec);
  double least_m = 1;
  for (int i = 0; i < 40; ++i) {
    sut.run_step();
    least_m = std::min(least_m, sut.find(above)->position_world_m.y - sut.find(below)->position_world_m.y);
  }
  EXPECT_GT(least_m, 0.035) << "the ridges stand 4 cm apart when they touch";
  EXPECT_GE(sut.sink.count, 1U);
}

TEST(BodyContacts, DistanceOfEveryShapeIsTheOneToItsNearestSurfacePoint) {
  const unsigned seed = 13;
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(-0.15, 0.15);
  for (const Lying& lying : lying_shapes()) {
    for (int i = 0; i < 300; ++i) {
      const Vec3d p{unit(random), unit(random), unit(random)};
      Vec3d gradient, there;
      const double d = shape_distance(lying.shape, p, gradient);
      EXPECT_NEAR(gradient.norm(), 1, 1e-9);
      if (lying.shape.kind == ShapeKind::hull && d > 0) continue;  // too near in front of edges, by design
      EXPECT_NEAR(shape_distance(lying.shape, p - gradient * d, there), 0, 1e-9) << lying.name;
    }
  }
}

TEST(Debris, PassesThroughDebrisAndRestsOnBodies) {
  auto scene = floor_scene();
  BoundWorld sut(scene.field());
  BodySpec base;
  base.shape = Shape::box({0.2, 0.05, 0.2});
  base.position_world_m = {0, 0.05, 0};
  const BodyId box = sut.spawn(base);
  BodySpec chip;
  chip.shape = Shape::convex(test::pebble_hull());
  chip.is_debris = true;
  std::vector<BodyId> chips;
  for (int i = 0; i < 4; ++i) {
    chip.position_world_m = {0, 0.16 + 0.001 * i, 0};
    chips.push_back(sut.spawn(chip));
  }
  chip.position_world_m = {1, 0.06, 0};
  const BodyId on_floor = sut.spawn(chip);
  sut.run(4);
  for (const BodyId id : chips) {
    EXPECT_GT(sut.find(id)->position_world_m.y, 0.11);
    EXPECT_LT(sut.find(id)->position_world_m.y, 0.15) << "they lie in each other, not on each other";
  }
  EXPECT_GT(sut.find(on_floor)->position_world_m.y, 0.01);
  for (std::size_t i = 0; i < sut.sink.count; ++i) {
    const BodyId other = sut.sink.events[i].other;
    EXPECT_TRUE(!other.is_body() || other == box || sut.sink.events[i].body == box);
  }
}

TEST(Shapes, HullIsSpawnedRemovedAndSpawnedAgainInTheSameSlot) {
  auto scene = floor_scene();
  WorldConfig one;
  one.bodies_capacity = 1;
  one.contacts_capacity = 12;
  BoundWorld sut(scene.field(), one);
  for (int round = 0; round < 4; ++round) {
    BodySpec spec;
    spec.shape =
        round == 2 ? Shape::sphere(0.03) : Shape::convex(round == 0 ? test::nut_hull() : test::pebble_hull());
    spec.position_world_m = {0, 0.06, 0};
    const BodyId id = sut.spawn(spec);
    sut.run(2);
    EXPECT_GT(sut.find(id)->position_world_m.y, 0.015);
    EXPECT_LT(sut.find(id)->position_world_m.y, 0.045);
    ASSERT_EQ(sut.world.remove(id), rt::Status::ok);
  }
}

TEST(Shapes, WithoutSizeOrHullAreRefused) {
  auto scene = floor_scene();
  BoundWorld sut(scene.field());
  const ConvexHull empty;
  Shape no_hull;
  no_hull.kind = ShapeKind::hull;
  for (const Shape& shape : {Shape::capsule(0, 0.1), Shape::capsule(0.1, 0), Shape::cylinder(0.1, 0),
                             Shape::cylinder(-0.1, 0.1), Shape::convex(empty), no_hull}) {
    BodySpec spec;
    spec.shape = shape;
    BodyId id;
    EXPECT_EQ(sut.world.spawn(spec, id), rt::Status::unsupported);
  }
}

/// A heap of all shapes on a floor with a step, dropped at random.
std::vector<BodyState> tumble(unsigned seed, double seconds) {
  AnalyticField scene([](const Vec3d& p) { return std::min(p.y, std::max(p.y - 0.1, -p.x)); });
  BoundWorld sut(scene.field());
  std::mt19937 random(seed);
  const auto uniform = [&random](double a, double b) {
    return a + (b - a) * (static_cast<double>(random()) / 4294967296.0);
  };
  for (int i = 0; i < 50; ++i) {
    BodySpec spec;
    spec.shape = test::small_shape(i, random);
    spec.position_world_m = {uniform(-0.4, 0.4), 0.3 + 0.08 * (i / 5), uniform(-0.4, 0.4)};
    spec.q_world_body = Quaternion{1, uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)}.normalized();
    spec.material = static_cast<MaterialId>(random() % 17);
    sut.spawn(spec);
  }
  sut.run(seconds);
  return {sut.world.bodies().begin(), sut.world.bodies().end()};
}

TEST(Shapes, FiftyMixedBodiesComeToRestAboveTheGround) {
  for (const unsigned seed : {1U, 2U, 3U}) {
    const auto bodies = tumble(seed, 12);
    EXPECT_EQ(bodies.size(), 50U) << "seed " << seed;
    int resting = 0;
    for (const BodyState& body : bodies) {
      EXPECT_GT(body.position_world_m.y, 0.005) << "seed " << seed;
      resting += body.resting ? 1 : 0;
    }
    EXPECT_GE(resting, 45) << "seed " << seed;
  }
}

TEST(Shapes, SameInputsGiveTheSameBits) {
  const auto first = tumble(11, 3), second = tumble(11, 3);
  ASSERT_EQ(first.size(), second.size());
  for (std::size_t i = 0; i < first.size(); ++i) {
    EXPECT_EQ(first[i].position_world_m, second[i].position_world_m);
    EXPECT_EQ(first[i].velocity_world_m_per_s, second[i].velocity_world_m_per_s);
  }
}

}  // namespace
}  // namespace tactus::contact
