// Scripts of users: whatever the text, an accepted script keeps every number inside its range.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "pipeline/interact/script.hpp"
#include "rt/assert.hpp"

using namespace tactus;

namespace {

bool is_timed(const interact::Moment& when) { return when.at_frame.has_value() != when.at_time.has_value(); }
bool is_within(const Vec3d& v, double most) {
  return std::abs(v.x) <= most && std::abs(v.y) <= most && std::abs(v.z) <= most;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t bytes) {
  const std::string_view text(reinterpret_cast<const char*>(data), bytes);
  const auto script = interact::parse_script(text, "script.toml");
  if (!script) {
    TACTUS_ASSERT(script.error().code == rt::ExitCode::bad_usage && !script.error().message.empty());
    return 0;
  }
  const auto& [throws, shots, walkers] = script.value();
  TACTUS_ASSERT(throws.size() + shots.size() + walkers.size() > 0);
  TACTUS_ASSERT(throws.size() <= interact::kEntriesMax && shots.size() <= interact::kEntriesMax);
  TACTUS_ASSERT(walkers.size() <= interact::kWalkersMax);
  for (const interact::Throw& what : throws) {
    TACTUS_ASSERT(is_timed(what.when) && what.material < kMaterialCount);
    TACTUS_ASSERT(what.shape.kind != contact::ShapeKind::hull && contact::volume_m3(what.shape) > 0);
    TACTUS_ASSERT(what.speed_m_per_s >= 0 && what.speed_m_per_s <= 200 && what.in_front_m > 0);
    TACTUS_ASSERT(is_within(what.velocity_world_m_per_s, 200) && is_within(what.spin_world_rad_per_s, 200));
    TACTUS_ASSERT(!what.aim.pixel || !what.aim.target_world_m);
  }
  for (const interact::Shot& shot : shots)
    TACTUS_ASSERT(is_timed(shot.when) && shot.energy_j > 0 && shot.projectile_m_per_s >= 0);
  for (const interact::Walker& walker : walkers) {
    TACTUS_ASSERT(is_timed(walker.when) && walker.in_front_m >= 0 && walker.in_front_m <= 20);
    TACTUS_ASSERT(is_within(walker.position_world_m.value_or(Vec3d{}), 1000));
    TACTUS_ASSERT(is_within(walker.goal_world_m.value_or(Vec3d{}), 1000));
  }
  return 0;
}
