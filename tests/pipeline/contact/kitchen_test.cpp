// Fifty bodies on the map of a real kitchen.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>
#include <vector>

#include "hal/replay/replay.hpp"
#include "pipeline/contact/map_field.hpp"
#include "pipeline/spine.hpp"
#include "rt/worker_pool.hpp"
#include "tests/pipeline/contact/analytic_field.hpp"
#include "tests/pipeline/contact/level_drops.hpp"
#include "tests/support/shared_data.hpp"

namespace tactus::contact {
namespace {

struct Free {
  void operator()(std::byte* p) const { ::operator delete (p, std::align_val_t{64}); }
};
using Memory = std::unique_ptr<std::byte, Free>;

rt::Slice allocate(Memory& memory, std::size_t bytes) {
  bytes = rt::round_up(bytes, 64);
  memory.reset(static_cast<std::byte*>(::operator new (bytes, std::align_val_t{64})));
  return rt::Slice({memory.get(), bytes});
}

/// Upright in a world whose y is against gravity.
T_WorldDepth upright(const Vec3d& gravity_depth) {
  const Vec3d up = gravity_depth.normalized() * -1.0;
  const Vec3d x = (Vec3d{1, 0, 0} - up * up.x).normalized();
  const Vec3d z = x.cross(up);
  return {{{x.x, x.y, x.z, up.x, up.y, up.z, z.x, z.y, z.z}}, {}};
}

TEST(Kitchen, FiftyMixedBodiesSettleOnTheMapOfFortyFramesAndStayThere) {
  const auto folder = test::shared_data("kitchen_7scenes");
  if (!folder) GTEST_SKIP() << "the kitchen recording is absent";
  auto opened = hal::open_replay(*folder, {.last = 40});
  ASSERT_TRUE(opened.has_value());
  hal::Sensor sensor = std::move(opened.value());
  const hal::Intrinsics& camera = sensor.calibration.depth;
  std::vector<std::uint16_t> raw(static_cast<std::size_t>(camera.width) *
                                 static_cast<std::size_t>(camera.height));
  std::vector<std::uint8_t> rgb(static_cast<std::size_t>(sensor.calibration.color.width) *
                                static_cast<std::size_t>(sensor.calibration.color.height) * 3);
  ASSERT_TRUE(sensor.gravity_depth.has_value());
  Memory map_memory, memory;
  rt::WorkerPool pool;
  Spine spine;
  const SpineConfig config;
  const rt::Slice map_slice = allocate(map_memory, map::Map::bytes_needed(config.map));
  const rt::Slice slice = allocate(memory, Spine::bytes_needed(sensor.calibration, config));
  spine.bind(map_slice, slice, sensor.calibration, config, upright(*sensor.gravity_depth), pool);
  int tracked = 0;
  hal::FrameHeader header;
  for (int i = 0; i < 40 && sensor.depth->read(raw, header, {}) == rt::Status::ok; ++i) {
    ASSERT_EQ(sensor.color->read(rgb, header, {}), rt::Status::ok);
    static_cast<void>(spine.register_frame(raw, rgb));
    tracked += spine.track() == rt::Status::ok ? 1 : 0;
    static_cast<void>(spine.integrate());
    static_cast<void>(spine.predict());
  }
  ASSERT_GE(tracked, 38);

  // Onto level surfaces that the camera sees, wherever a ray meets one.
  const map::Reader reader(spine.map());
  const T_WorldDepth& T_world_depth = spine.result().T_world_depth;
  const unsigned seed = 31;
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  test::BoundWorld sut(field_of(reader));
  std::vector<BodyId> ids;
  for (const BodySpec& spec : test::level_drops(reader, camera, T_world_depth, 50, random))
    ids.push_back(sut.spawn(spec));
  ASSERT_EQ(ids.size(), 50U);
  sut.run(10);
  const std::vector<BodyState> settled(sut.world.bodies().begin(), sut.world.bodies().end());
  sut.run(10);
  const auto moved_mm = [&] {
    std::vector<double> moved;
    for (const BodyState& before : settled) {
      const BodyState* after = sut.find(before.id);
      if (before.resting && after != nullptr)
        moved.push_back(1e3 * (after->position_world_m - before.position_world_m).norm());
    }
    std::sort(moved.begin(), moved.end());
    return moved;
  };
  const std::vector<double> asleep = moved_mm();
  // Sleep alone would prove little: woken every second, they stay too, but for what can roll.
  for (int second = 0; second < 10; ++second) {
    sut.world.wake_all();
    sut.run(1);
  }
  const std::vector<double> woken = moved_mm();
  ASSERT_FALSE(woken.empty());
  std::printf(
      "of 50 bodies %zu rest, %zu fell off into unseen space; moves in 10 s: %.3f mm at most, woken every "
      "second "
      "p90 %.3f mm, %.1f at most\n",
      asleep.size(), 50 - sut.world.bodies().size(), asleep.back(), woken[woken.size() * 9 / 10],
      woken.back());
  EXPECT_GE(asleep.size(), 35U);
  EXPECT_EQ(woken.size(), asleep.size()) << "one that had come to rest was lost";
  EXPECT_LT(asleep.back(), 1);
  EXPECT_LT(woken[woken.size() * 9 / 10], 1);
  EXPECT_LT(woken.back(), 10);
}

}  // namespace
}  // namespace tactus::contact
