#include "pipeline/contact/field_contacts.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>

#include "tests/pipeline/contact/analytic_field.hpp"

namespace tactus::contact {
namespace {

using test::AnalyticField;
using Contacts = std::array<FieldContact, kFieldContactsMax>;

int contacts_of(const DistanceField& field, const Shape& shape, const Vec3d& center, Contacts& contacts) {
  return field_contacts(field, shape, center, {}, kContactMarginM, {0, 1, 0}, contacts);
}

Vec3d random_direction(std::mt19937& random) {
  std::normal_distribution<double> n;
  return Vec3d{n(random), n(random), n(random)}.normalized();
}

TEST(SphereContacts, PlaneInAnyDirectionGivesOneExactContact) {
  const unsigned seed = 3;
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  for (int i = 0; i < 500; ++i) {
    const Vec3d normal = random_direction(random);
    AnalyticField scene([&normal](const Vec3d& p) { return normal.dot(p); });
    const double radius = 0.01 + 0.29 * (i / 500.0);
    const double depth = std::min(0.003, 0.1 * radius);
    Contacts contacts;
    ASSERT_EQ(contacts_of(scene.field(), Shape::sphere(radius), normal * (radius - depth), contacts), 1)
        << "radius " << radius;
    EXPECT_GT(contacts[0].normal_world.dot(normal), 0.9999);
    EXPECT_NEAR(contacts[0].depth_m, depth + kContactMarginM, 2e-5);
    EXPECT_NEAR((contacts[0].position_world_m + normal * depth).norm(), 0, 0.015 * radius);
  }
}

TEST(SphereContacts, CornerOfThreeWallsGivesThree) {
  AnalyticField scene([](const Vec3d& p) { return std::min({p.x, p.y, p.z}); });
  Contacts contacts;
  ASSERT_EQ(contacts_of(scene.field(), Shape::sphere(0.05), {0.049, 0.049, 0.049}, contacts), 3);
  for (int i = 0; i < 3; ++i)
    EXPECT_NEAR(contacts[static_cast<std::size_t>(i)].depth_m, 0.001 + kContactMarginM, 1e-5);
}

TEST(SphereContacts, BumpSharperThanTheSphereIsFound) {
  const unsigned seed = 4;
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  // A bump of 3 cm under a ball of 8 cm: the full fixed-point step would diverge (8 > 3).
  AnalyticField scene([](const Vec3d& p) { return p.norm() - 0.03; });
  for (int i = 0; i < 200; ++i) {
    const Vec3d direction = random_direction(random);
    Contacts contacts;
    ASSERT_EQ(contacts_of(scene.field(), Shape::sphere(0.08), direction * 0.108, contacts), 1);
    EXPECT_NEAR(contacts[0].depth_m, 0.002 + kContactMarginM, 4e-4);
    EXPECT_GT(contacts[0].normal_world.dot(direction), 0.98);
  }
}

TEST(SphereContacts, ApartOrUnseenOrBehindGivesNone) {
  auto scene = test::floor_scene();
  Contacts contacts;
  EXPECT_EQ(contacts_of(scene.field(), Shape::sphere(0.05), {0, 0.06, 0}, contacts), 0);
  EXPECT_EQ(contacts_of(scene.field(), Shape::sphere(0.05), {0, -0.02, 0}, contacts), 0) << "centre behind the surface";
  EXPECT_EQ(contacts_of(scene.field(), Shape::sphere(0.05), {0, -0.08, 0}, contacts), 0) << "wholly behind the surface";
  scene.set_seen([](const Vec3d&) { return false; });
  EXPECT_EQ(contacts_of(scene.field(), Shape::sphere(0.05), {0, 0.045, 0}, contacts), 0);
}

TEST(BoxContacts, FlatBoxTouchesWithItsFourCorners) {
  auto scene = test::floor_scene();
  Contacts contacts;
  const Vec3d half{0.15, 0.05, 0.1};
  ASSERT_EQ(contacts_of(scene.field(), Shape::box(half), {0, 0.0499, 0}, contacts), 4);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_NEAR(std::abs(contacts[i].position_world_m.x), 0.15, 1e-9);
    EXPECT_NEAR(std::abs(contacts[i].position_world_m.z), 0.1, 1e-9);
    EXPECT_NEAR(contacts[i].depth_m, 0.0001 + kContactMarginM, 1e-6);
    EXPECT_GT(contacts[i].normal_world.y, 0.999);
    for (std::size_t k = 0; k < i; ++k)
      EXPECT_GT((contacts[i].position_world_m - contacts[k].position_world_m).norm(), 0.19);
  }
}

TEST(BoxContacts, FloorAndWallBothHold) {
  AnalyticField scene([](const Vec3d& p) { return std::min(p.x, p.y); });
  Contacts contacts;
  const int count =
      contacts_of(scene.field(), Shape::box({0.1, 0.05, 0.1}), {0.0999, 0.0499, 0}, contacts);
  int floor = 0, wall = 0;
  for (int i = 0; i < count; ++i) {
    const Vec3d n = contacts[static_cast<std::size_t>(i)].normal_world;
    floor += n.y > 0.9 ? 1 : 0;
    wall += n.x > 0.9 ? 1 : 0;
  }
  EXPECT_GE(floor, 2);
  EXPECT_GE(wall, 2);
}

TEST(BoxContacts, ThinBoxDoesNotTouchWithItsTop) {
  auto scene = test::floor_scene();
  Contacts contacts;
  // A board of 1 cm whose underside is 4 mm deep: top and bottom corners are both in the band.
  const int count =
      contacts_of(scene.field(), Shape::box({0.1, 0.005, 0.1}), {0, 0.001, 0}, contacts);
  ASSERT_EQ(count, 4);
  for (std::size_t i = 0; i < 4; ++i) EXPECT_LT(contacts[i].position_world_m.y, 0);
}

TEST(FreeFraction, StopsAtFirstTouchWithinHalfAMillimetre) {
  const unsigned seed = 6;
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(0, 1);
  for (int i = 0; i < 300; ++i) {
    const Vec3d normal = random_direction(random);
    AnalyticField scene([&normal](const Vec3d& p) { return normal.dot(p); });
    const double radius = 0.01 + 0.1 * unit(random);
    const double height = radius + 0.3 * unit(random) + 0.001;
    Vec3d direction = random_direction(random);
    if (direction.dot(normal) > -0.25) direction = (direction - normal * 2.0).normalized();
    const Vec3d travel = direction * (2 * unit(random));
    const double expected = std::min(1.0, (height - radius) / -travel.dot(normal));
    const double fraction = free_fraction(scene.field(), Shape::sphere(radius), normal * height, {}, travel);
    EXPECT_NEAR(height + fraction * travel.dot(normal), height + expected * travel.dot(normal),
                kContactMarginM)
        << i;
  }
}

TEST(FreeFraction, ProjectiveDistanceDoesNotOvershoot) {
  // A surface seen at 60 degrees reads twice its distance, saturated at the truncation distance.
  AnalyticField scene([](const Vec3d& p) { return 2 * p.y; });
  const double fraction = free_fraction(scene.field(), Shape::sphere(0.03), {0, 0.5, 0}, {}, {0.3, -0.9, 0});
  EXPECT_NEAR(0.5 - 0.9 * fraction, 0.03, 0.0005);
}

TEST(FreeFraction, SlidingAlongTheFloorIsFree) {
  auto scene = test::floor_scene();
  EXPECT_EQ(free_fraction(scene.field(), Shape::sphere(0.05), {0, 0.05, 0}, {}, {0.1, -0.0005, 0}), 1);
  EXPECT_EQ(free_fraction(scene.field(), Shape::box({0.05, 0.05, 0.05}), {0, 0.05, 0}, {}, {0.1, -0.0005, 0}),
            1);
}

TEST(FreeFraction, NoTravelIsFree) {
  auto scene = test::floor_scene();
  EXPECT_EQ(free_fraction(scene.field(), Shape::sphere(0.05), {0, 0.01, 0}, {}, {}), 1);
}

}  // namespace
}  // namespace tactus::contact
