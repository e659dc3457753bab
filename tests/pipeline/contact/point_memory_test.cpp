// A body that remembers its far points touches as one that asks them all.
#include "pipeline/contact/point_memory.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <random>

#include "pipeline/contact/field_contacts.hpp"
#include "pipeline/contact/map_field.hpp"
#include "tests/pipeline/contact/filled_map.hpp"
#include "tests/pipeline/contact/test_shapes.hpp"

namespace tactus::contact {
namespace {

/// A field that counts the points that are asked.
struct Counted {
  DistanceField inner;
  mutable std::size_t asked_count = 0;

  [[nodiscard]] DistanceField field() const {
    DistanceField f = inner;
    f.context = this;
    f.sample_fn = [](const void* self, const Vec3f& p, map::DistanceSample& out) noexcept {
      const auto& counted = *static_cast<const Counted*>(self);
      return counted.inner.sample_fn(counted.inner.context, p, out);
    };
    f.distances_fn = [](const void* self, std::span<const Vec3f> points, std::span<float> out) noexcept {
      const auto& counted = *static_cast<const Counted*>(self);
      counted.asked_count += points.size();
      counted.inner.distances(points, out);
    };
    return f;
  }
};

TEST(PointMemory, SlowBodiesTouchTheSameAndAskHalfAsOften) {
  const test::FilledMap room([](const Vec3d& p) { return std::min(p.y, p.x + 0.1); }, {-0.3, -0.1, -0.3},
                             {0.3, 0.3, 0.3}, 0.002, 3);
  const map::Reader reader = room.reader();
  const Counted all{field_of(reader)}, few{field_of(reader)};
  constexpr unsigned kSeed = 17;
  std::mt19937 random(kSeed);
  const auto unit = [&random] { return static_cast<double>(random()) / 2147483648.0 - 1; };
  int touching_count = 0;
  for (int kind = 1; kind < 40; ++kind) {
    const Shape shape = test::small_shape(kind, random);
    if (shape.kind == ShapeKind::sphere) continue;
    PointMemory memory;
    Vec3d center{-0.1 + reach_m(shape) * (0.8 + 0.2 * unit()), reach_m(shape) * (0.8 + 0.2 * unit()),
                 0.1 * unit()};
    Quaternion q = Quaternion{1, unit(), unit(), unit()}.normalized();
    for (int step = 0; step < 60; ++step) {
      const double way_m = step % 20 == 19 ? 0.01 : 0.0002;  // a knock now and then
      center += Vec3d{unit(), unit(), unit()} * way_m;
      q = (Quaternion{1, 0.001 * unit(), 0.001 * unit(), 0.001 * unit()} * q).normalized();
      std::array<FieldContact, kFieldContactsMax> expected, found;
      const Rotation R = Rotation::from(q);
      const int expected_count =
          field_contacts(all.field(), shape, center, R, kImpactMarginM, {0, 1, 0}, expected);
      const int found_count =
          field_contacts(few.field(), shape, center, R, kImpactMarginM, {0, 1, 0}, found, &memory);
      ASSERT_EQ(found_count, expected_count) << "seed " << kSeed << " body " << kind << " step " << step;
      for (std::size_t i = 0; i < static_cast<std::size_t>(found_count); ++i) {
        EXPECT_EQ(found[i].position_world_m, expected[i].position_world_m);
        EXPECT_EQ(found[i].depth_m, expected[i].depth_m);
      }
      touching_count += found_count > 0 ? 1 : 0;
    }
  }
  EXPECT_GT(touching_count, 500);
  EXPECT_LT(few.asked_count, all.asked_count * 7 / 10);
}

}  // namespace
}  // namespace tactus::contact
