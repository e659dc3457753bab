// Shards and chips: thinner than what a rolling ball may sink in.
#include <gtest/gtest.h>

#include <vector>

#include "pipeline/contact/hull.hpp"
#include "tests/pipeline/contact/analytic_field.hpp"

namespace tactus::contact {
namespace {

TEST(World, ThinShardDrivenIntoTheFloorStaysInFrontOfIt) {
  const std::vector<Vec3d> corners = {{0.02, 0.001, 0}, {-0.01, 0.001, 0.017}, {-0.01, 0.001, -0.017},
                                      {0.02, -0.001, 0}, {-0.01, -0.001, 0.017}, {-0.01, -0.001, -0.017}};
  const auto shard = make_hull(corners);
  ASSERT_TRUE(shard.has_value());
  for (const double speed : {0.5, 2.0, 7.0}) {
    auto scene = test::floor_scene(material_from_name("stone"));
    test::BoundWorld sut(scene.field());
    BodySpec spec;
    spec.shape = Shape::convex(*shard);
    spec.material = material_from_name("glass");
    spec.position_world_m = {0, 0.0011, 0};  // touches where it starts
    spec.velocity_world_m_per_s = {0.3, -speed, 0.1};
    const BodyId id = sut.spawn(spec);
    for (int i = 0; i < 120; ++i) {
      sut.run_step();
      ASSERT_NE(sut.find(id), nullptr);
      ASSERT_GT(sut.find(id)->position_world_m.y, 0) << "at " << speed << " m/s, step " << i;
    }
  }
}

TEST(World, PushGivesTheImpulseAndWakes) {
  auto scene = test::floor_scene();
  test::BoundWorld sut(scene.field());
  BodySpec spec;
  spec.shape = Shape::sphere(0.05);
  spec.position_world_m = {0, 0.05, 0};
  spec.mass_kg = 0.5;
  const BodyId id = sut.spawn(spec);
  sut.run(2);
  ASSERT_TRUE(sut.find(id)->resting);
  EXPECT_EQ(sut.world.push(id, {0.2, 0.5, 0}, sut.find(id)->position_world_m), rt::Status::ok);
  sut.run_step();
  EXPECT_NEAR(sut.find(id)->velocity_world_m_per_s.x, 0.4, 0.02);
  EXPECT_NEAR(sut.find(id)->velocity_world_m_per_s.y, 1 - 9.81 * kStepS, 0.02);
  EXPECT_EQ(sut.world.push({}, {1, 0, 0}, {}), rt::Status::stale);
}

}  // namespace
}  // namespace tactus::contact
