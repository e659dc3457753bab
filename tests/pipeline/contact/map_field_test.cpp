// Bodies on the real map: voxels of 1 cm, 16-bit distances, noise, seen from one side.
#include "pipeline/contact/map_field.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "tests/pipeline/contact/analytic_field.hpp"
#include "tests/pipeline/contact/filled_map.hpp"

namespace tactus::contact {
namespace {

/// A floor at 0.013, a table top of 3 cm at 0.4, and four walls; off the lattice on purpose.
double room(const Vec3d& p) {
  const Vec3d q{std::abs(p.x - 0.1) - 0.35, std::abs(p.y - 0.4) - 0.015, std::abs(p.z) - 0.3};
  const Vec3d outside{std::max(q.x, 0.0), std::max(q.y, 0.0), std::max(q.z, 0.0)};
  const double table = outside.norm() + std::min(std::max({q.x, q.y, q.z}), 0.0);
  return std::min({p.y - 0.013, table, p.z + 0.817, 0.834 - p.z, 0.851 - std::abs(p.x)});
}
constexpr Vec3d kLow{-1, -0.1, -1}, kHigh{1, 0.7, 1};

TEST(MapField, BallRestsAtTheSurfaceWithinAFractionOfAVoxel) {
  const test::FilledMap map(room, kLow, kHigh, 0, 1);
  const map::Reader reader = map.reader();
  for (const double radius : {0.02, 0.05, 0.12}) {
    test::BoundWorld sut(field_of(reader));
    BodySpec spec;
    spec.shape = Shape::sphere(radius);
    spec.position_world_m = {0.103, 0.415 + radius + 0.2, 0.017};
    const BodyId id = sut.spawn(spec);
    sut.run(5);
    ASSERT_NE(sut.find(id), nullptr);
    EXPECT_NEAR(sut.find(id)->position_world_m.y, 0.415 + radius, 0.001) << radius;
    EXPECT_TRUE(sut.find(id)->resting);
  }
}

TEST(MapField, ThrowsAtTableTopAndWallDoNotTunnel) {
  const test::FilledMap map(room, kLow, kHigh, 0.001, 2);
  const map::Reader reader = map.reader();
  std::mt19937 random(3);
  const auto uniform = [&random](double a, double b) {
    return a + (b - a) * (static_cast<double>(random()) / 4294967296.0);
  };
  for (int i = 0; i < 60; ++i) {
    test::BoundWorld sut(field_of(reader));
    BodySpec spec;
    const double size = uniform(0.015, 0.08);
    spec.shape = i % 3 == 0 ? Shape::box({size, size, 0.7 * size}) : Shape::sphere(size);
    const bool down = i % 2 == 0;
    spec.position_world_m =
        down ? Vec3d{uniform(-0.1, 0.3), 1.2, uniform(-0.15, 0.15)} : Vec3d{uniform(-0.5, 0.5), 0.2, 0.6};
    spec.velocity_world_m_per_s = down ? Vec3d{0, -15, 0} : Vec3d{0, 0, -15};
    const BodyId id = sut.spawn(spec);
    double lowest_y = 1, lowest_z = 1;
    for (int k = 0; k < 24; ++k) {
      sut.run_step();
      ASSERT_NE(sut.find(id), nullptr);
      lowest_y = std::min(lowest_y, sut.find(id)->position_world_m.y);
      lowest_z = std::min(lowest_z, sut.find(id)->position_world_m.z);
    }
    if (down)
      EXPECT_GT(lowest_y, 0.41) << "through the table, throw " << i;
    else
      EXPECT_GT(lowest_z, -0.817) << "through the wall, throw " << i;
  }
}

TEST(MapField, FiftyMixedBodiesOnNoisyVoxelsRestWithoutCreep) {
  const test::FilledMap map(room, kLow, kHigh, 0.0007, 4);
  const map::Reader reader = map.reader();
  test::BoundWorld sut(field_of(reader));
  std::mt19937 random(5);
  const auto uniform = [&random](double a, double b) {
    return a + (b - a) * (static_cast<double>(random()) / 4294967296.0);
  };
  for (int i = 0; i < 50; ++i) {
    BodySpec spec;
    spec.shape = i % 2 == 0 ? Shape::box({uniform(0.02, 0.06), uniform(0.02, 0.06), 0.04})
                            : Shape::sphere(uniform(0.02, 0.06));
    spec.position_world_m = {uniform(-0.5, 0.5), 0.6 + 0.08 * (i / 8), uniform(-0.5, 0.3)};
    spec.material = material_from_name(i % 3 == 0 ? "wood" : i % 3 == 1 ? "fabric" : "plastic");
    sut.spawn(spec);
  }
  sut.run(10);
  std::vector<BodyState> settled(sut.world.bodies().begin(), sut.world.bodies().end());
  std::erase_if(settled, [](const BodyState& s) { return !s.resting; });
  sut.run(10);
  double worst_m = 0;
  for (const BodyState& before : settled) {
    ASSERT_NE(sut.find(before.id), nullptr);
    worst_m = std::max(worst_m, (sut.find(before.id)->position_world_m - before.position_world_m).norm());
  }
  EXPECT_LT(worst_m, 0.001);
  EXPECT_GE(settled.size(), 45U);
  EXPECT_EQ(sut.world.bodies().size(), 50U);
  for (const BodyState& body : sut.world.bodies()) EXPECT_GT(body.position_world_m.y, 0.02);
}

TEST(MapField, RollingOnRoughVoxelsNeverGainsEnergy) {
  const test::FilledMap map(room, kLow, kHigh, 0.0007, 4);
  const map::Reader reader = map.reader();
  for (int i = 0; i < 8; ++i) {
    test::BoundWorld sut(field_of(reader));
    BodySpec spec;
    const double radius = i % 2 == 0 ? 0.036 : 0.06;
    spec.shape = Shape::sphere(radius);
    spec.position_world_m = {-0.5 + 0.03 * i, 0.3, -0.4};
    spec.velocity_world_m_per_s = {0.7, 0, 0.5 + 0.1 * i};
    const BodyId id = sut.spawn(spec);
    const auto energy = [&] {  // per mass
      const BodyState& body = *sut.find(id);
      const double v2 = body.velocity_world_m_per_s.dot(body.velocity_world_m_per_s);
      const double w2 = body.angular_velocity_world_rad_per_s.dot(body.angular_velocity_world_rad_per_s);
      return 0.5 * v2 + 0.2 * radius * radius * w2 + 9.81 * (body.position_world_m.y - 0.013 - radius);
    };
    double before = energy();
    for (int tenth = 0; tenth < 60; ++tenth) {
      sut.run(0.1);
      const double now = energy();
      EXPECT_LT(now, before + 0.02) << "ball " << i << " at " << 0.1 * tenth << " s";
      before = now;
    }
    EXPECT_LT(before, 0.05) << "ball " << i;
  }
}

TEST(MapField, UnlabelledMapAnswersNoMaterial) {
  const test::FilledMap map(room, kLow, kHigh, 0, 1);
  const map::Reader reader = map.reader();
  MaterialDistribution materials;
  EXPECT_FALSE(field_of(reader).materials({0.1, 0.416, 0}, materials));
}

}  // namespace
}  // namespace tactus::contact
