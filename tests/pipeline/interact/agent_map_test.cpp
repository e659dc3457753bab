// The agent on the real map's voxels: the built-in bedroom, with noise, against its exact distances and
// materials.
#include <gtest/gtest.h>

#include <array>
#include <cstdio>

#include "hal/synthetic/scene.hpp"
#include "pipeline/contact/map_field.hpp"
#include "tests/pipeline/contact/filled_map.hpp"
#include "tests/pipeline/interact/agent_room.hpp"

namespace tactus::interact {
namespace {

TEST(AgentMap, SixtySecondsInTheBedroomTouchNothingAndTreadOnNothingAvoided) {
  const auto scene = hal::synthetic::make_scene(hal::synthetic::SceneId::bedroom);
  const Vec3d low = scene.room_min_m(), high = scene.room_max_m();
  const test::FilledMap map([&](const Vec3d& p) { return scene.distance(p); },
                            [&](const Vec3d& p) { return static_cast<MaterialId>(scene.material(p)); },
                            {low.x, -0.05, low.z}, {high.x, 0.3, high.z}, 0.0007, 5);
  const map::Reader reader = map.reader();
  test::BoundAgent sut(contact::field_of(reader));
  sut.agent.place({-0.3, 0.3, 0.9});
  sut.agent.wander(3);
  double nearest_m = 1, headroom_m = 1, off_m = 0;
  bool was_blocked = false;
  std::array<bool, kMaterialCount> trodden{};
  sut.run(60, [&](const AgentPose& pose) {
    const Vec3d p = pose.position_world_m;
    was_blocked = was_blocked || sut.agent.grid().at(cell_at(p.x, p.z)).state == CellState::blocked;
    // It also walks under the bed, 15 cm high: above its head less room is asked for than beside it.
    for (const double z : {0.045, 0.08}) nearest_m = std::min(nearest_m, scene.distance(p + Vec3d{0, z, 0}));
    headroom_m = std::min(headroom_m, scene.distance(p + Vec3d{0, 0.12, 0}));
    off_m = std::max(off_m, std::abs(scene.distance(p)));
    trodden[static_cast<std::size_t>(scene.material(p))] = true;
  });
  const AgentCounters& counters = sut.agent.counters();
  std::printf(
      "walked %.1f m to %llu goals, %llu dropped, %llu replans; nearest thing %.1f cm from the axis, feet at "
      "most %.1f mm off the ground, on",
      sut.agent.pose().walked_m, static_cast<unsigned long long>(counters.arrivals),
      static_cast<unsigned long long>(counters.goals_dropped),
      static_cast<unsigned long long>(counters.replans_blocked), 100 * nearest_m, 1000 * off_m);
  for (std::size_t m = 0; m < trodden.size(); ++m) {
    if (!trodden[m]) continue;
    std::printf(" %s", std::string(kMaterialNames[m]).c_str());
    EXPECT_FALSE(kWalkability[m].is_avoided) << kMaterialNames[m];
  }
  std::printf("\n");
  EXPECT_FALSE(was_blocked);
  EXPECT_GT(nearest_m, 0.03);
  EXPECT_GT(headroom_m, 0.008);
  EXPECT_LT(off_m, 0.015);
  EXPECT_GE(counters.arrivals, 4U);
  EXPECT_GT(sut.agent.pose().walked_m, 8);
}

}  // namespace
}  // namespace tactus::interact
