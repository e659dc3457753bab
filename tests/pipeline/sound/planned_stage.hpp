// A sound stage with memory of its own.
#pragma once

#include <cstdlib>
#include <memory>

#include "pipeline/sound/sound_stage.hpp"
#include "tests/pipeline/sound/sounding_materials.hpp"

namespace tactus::sound::test {

class PlannedStage {
 public:
  explicit PlannedStage(const contact::DistanceField& rays = {}, const SoundConfig& config = {},
                        const contact::MaterialTable& table = sounding_materials()) {
    const std::size_t bytes = SoundStage::bytes_needed(config);
    memory_.reset(static_cast<std::byte*>(std::aligned_alloc(rt::kCacheLineBytes, bytes)));
    rt::Slice slice(std::span(memory_.get(), bytes));
    stage.bind(slice, config, table, rays);
  }
  SoundStage stage;

 private:
  struct Free {
    void operator()(std::byte* p) const { std::free(p); }
  };
  std::unique_ptr<std::byte, Free> memory_;
};

/// A head at `place`, level, looking along -z of the world.
inline T_WorldDepth level_head(const Vec3d& place) {
  return {Rotation{{1, 0, 0, 0, -1, 0, 0, 0, -1}}, place};
}

/// A thing of 100 g at 2 m/s.
inline Impact impact_of(std::string_view body, std::string_view surface, const Vec3d& place) {
  Impact impact;
  impact.position_world_m = place;
  impact.impulse_n_s = 0.3;
  impact.impact_speed_m_per_s = 2;
  impact.body_material = id_of(body);
  impact.surface_material = id_of(surface);
  return impact;
}

}  // namespace tactus::sound::test
