// Small enough for an emulator: the table is read, a ball bounces, rests and sleeps.
#include <gtest/gtest.h>

#include "tests/pipeline/contact/analytic_field.hpp"

namespace tactus::contact {
namespace {

TEST(ContactSmoke, BallBouncesByTheTableAndRests) {
  auto scene = test::floor_scene(material_from_name("wood"));
  test::BoundWorld sut(scene.field());
  const ContactProperties hard = test::reference_properties();
  BodySpec spec;
  spec.position_world_m = {0, 0.55, 0};
  spec.properties = &hard;
  const BodyId id = sut.spawn(spec);
  double top = 0;
  for (int i = 0; i < 120; ++i) {
    sut.run_step();
    if (sut.sink.count == 1) top = std::max(top, sut.find(id)->position_world_m.y - 0.05);
  }
  EXPECT_NEAR(top, 0.5 * 0.6 * 0.6, 0.01);
  sut.run(4);
  EXPECT_TRUE(sut.find(id)->resting);
  EXPECT_NEAR(sut.find(id)->position_world_m.y, 0.05, 0.0006);
}

}  // namespace
}  // namespace tactus::contact
