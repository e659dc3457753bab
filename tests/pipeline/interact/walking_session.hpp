// A game with its world in a room of boxes, for scripts with walkers.
#pragma once

#include <optional>
#include <utility>
#include <vector>

#include "pipeline/interact/game.hpp"
#include "tests/pipeline/interact/agent_room.hpp"
#include "tests/rt/aligned_memory.hpp"

namespace tactus::test {

/// Level at this place, looking along -z; the picture is wide enough for the floor a metre on.
inline interact::View looking_ahead(const Vec3d& eye_m) {
  T_WorldDepth T;
  T.rotation.m = {1, 0, 0, 0, -1, 0, 0, 0, -1};
  T.translation = eye_m;
  hal::Intrinsics picture;
  picture.width = 640;
  picture.height = 480;
  picture.fx = picture.fy = 150;
  picture.cx = 320;
  picture.cy = 240;
  return {T, picture, T};
}

/// Any field as a room, `field` outlives the session.
class WalkingSession {
 public:
  WalkingSession(const contact::DistanceField& room, interact::Script script) {
    contact::WorldConfig world_config;
    game_memory_.emplace(interact::Game::bytes_needed(config_));
    world_memory_.emplace(contact::World::bytes_needed(world_config));
    const auto table = contact::default_material_table();
    auto bound = world.bind(world_memory_->slice(), world_config, room, table);
    TACTUS_ASSERT(bound.has_value());
    bound = game.bind(game_memory_->slice(), config_, std::move(script), table, room);
    TACTUS_ASSERT(bound.has_value());
  }
  void run(int frames, bool is_tracked = true) {
    for (int i = 0; i < frames; ++i) {
      ++header_.sequence;
      TACTUS_ASSERT(game.step(view, is_tracked, header_, {33'333'333}, world) == rt::Status::ok);
    }
  }
  [[nodiscard]] const interact::AgentPose& pose(std::size_t i = 0) const {
    return game.walkers().agents()[i].pose();
  }
  [[nodiscard]] std::vector<interact::GameEvent> walks() const {
    std::vector<interact::GameEvent> found;
    for (const interact::GameEvent& event : game.events())
      if (event.kind == interact::GameEventKind::walk) found.push_back(event);
    return found;
  }

  interact::View view = looking_ahead({0, 1.2, 0.5});

 private:
  interact::GameConfig config_;
  std::optional<AlignedMemory> game_memory_, world_memory_;
  hal::FrameHeader header_;

 public:
  contact::World world;  // closed before its memory goes
  interact::Game game;
};

inline interact::Walker walker_at(const Vec3d& position_m, std::optional<Vec3d> goal_m = {}) {
  interact::Walker walker;
  walker.when.at_frame = 1;
  walker.position_world_m = position_m;
  walker.goal_world_m = goal_m;
  return walker;
}

inline interact::Script script_of(std::initializer_list<interact::Walker> walkers) {
  interact::Script script;
  script.walkers = walkers;
  return script;
}

}  // namespace tactus::test
