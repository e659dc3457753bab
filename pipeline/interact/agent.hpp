// A small walker that lives in the room: it plans over ground it likes, avoids the rest and stands on the
// real floor.
//
//   inputs    the room (contact/distance_field.hpp), a goal or leave to wander, a duration
//   outputs   pose and state
//   budget    0.3 ms a step at 30 Hz: probes_per_step cells looked at, expansions_per_step cells planned over; 0.13 ms
//             measured on the bedroom's map (agent_latency_test)
//   memory    one planned slice, 0.34 MB: the grid, the search and the path; no heap call after bind
//   late      a step longer than kStepMax walks kStepMax; the rest is dropped and counted
//   full      a path longer than kPathMax is walked to its end there and planned on from it
//   lost      without known ground under it the walker waits where it stands, and looks again every step
//
// The paper's case for semantics beside physics: path planning that reads materials. Ground costs its
// expected cost over the label posterior (agent_walkability.hpp), so that a doubtful puddle is gone around
// when the detour is short.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "hal/transform.hpp"
#include "pipeline/contact/distance_field.hpp"
#include "pipeline/interact/agent_grid.hpp"
#include "pipeline/interact/agent_planner.hpp"
#include "rt/slice.hpp"
#include "rt/status.hpp"
#include "rt/time.hpp"

namespace tactus::interact {

struct AgentConfig {
  WalkerBody body;
  double speed_m_per_s = 0.25;
  double turn_rad_per_s = 4;
  std::size_t probes_per_step = 64;
  std::size_t expansions_per_step = 160;
};

enum class AgentState : std::uint8_t {
  waiting,  // for ground, for a goal or for a plan
  walking,
  arrived,
  stuck  // no way to the goal is known and none was found for kPatience; it goes on looking
};
const char* name(AgentState state);

struct AgentPose {
  Vec3d position_world_m;        // of the feet
  Vec3d heading_world{1, 0, 0};  // unit, level
  Quaternion q_world_agent;      // agent frame: x to its right, y up, z backwards, as a camera of OpenGL
  double walked_m = 0;           // since it was placed: for the gait
  AgentState state = AgentState::waiting;
  bool is_placed = false;  // else the rest means nothing
};

struct AgentCounters {
  std::uint64_t steps = 0, steps_cut = 0;        // longer than kStepMax
  std::uint64_t plans = 0, replans_blocked = 0;  // searches begun; of these because the way was closed
  std::uint64_t arrivals = 0, stuck = 0;         // goals; a goal counts as stuck once
  std::uint64_t goals_dropped = 0;               // of wandering, unreachable
  std::uint64_t windows_moved = 0;
  std::uint64_t steps_without_ground = 0;
};

/// Thread-bound. The same calls over the same scene give the same bits.
class Agent {
 public:
  static std::size_t bytes_needed();
  /// Boot. The scene's context outlives the agent. `gravity_world` must not be zero.
  void bind(rt::Slice& memory, const contact::DistanceField& scene, const Vec3d& gravity_world,
            const AgentConfig& config = {});

  /// Puts the walker onto the first ground within kDropMax below this point as soon as the map knows one.
  /// Forgets goal and grid. Step phase, as all below.
  void place(const Vec3d& position_world_m) noexcept;
  /// Walks there, or as near as it gets. The height says which storey is meant, to kStoreyM.
  void set_goal(const Vec3d& position_world_m) noexcept;
  /// Picks goals by itself, and a new one half a second after each arrival.
  void wander(std::uint64_t seed) noexcept;
  void stop() noexcept;

  /// ok; skipped before place(); lost without known ground underfoot.
  rt::Status step(rt::Duration dt) noexcept;

  [[nodiscard]] const AgentPose& pose() const noexcept { return pose_; }
  [[nodiscard]] AgentState state() const noexcept { return pose_.state; }
  [[nodiscard]] const AgentCounters& counters() const noexcept { return counters_; }
  [[nodiscard]] const WalkGrid& grid() const noexcept { return grid_; }
  [[nodiscard]] const GroundFrame& frame() const noexcept { return frame_; }
  /// Cells still to be walked, for display.
  [[nodiscard]] std::span<const CellCoord> path() const noexcept {
    return path_.subspan(path_at_, path_count_ - path_at_);
  }

  static constexpr rt::Duration kStepMax{100'000'000};
  static constexpr rt::Duration kPatience{2'000'000'000};
  static constexpr std::size_t kPathMax = 1024;
  static constexpr double kDropMaxM = 2;
  static constexpr double kStoreyM = 0.1;

 private:
  struct Goal {
    bool is_set = false, is_given_up = false;  // given up: counted as stuck
    CellCoord cell;
    double u_m = 0, v_m = 0, height_m = 0;
  };

  bool find_ground() noexcept;
  void choose_goal() noexcept;
  void plan(double dt_s) noexcept;
  void begin_plan() noexcept;
  void finish_plan(PlanState done) noexcept;
  void take_path() noexcept;
  void choose_target() noexcept;
  [[nodiscard]] bool goal_is_here() const noexcept;
  void walk(double dt_s) noexcept;
  void settle(double dt_s) noexcept;
  void drop_path() noexcept { path_count_ = path_at_ = 0; }
  [[nodiscard]] bool has_path() const noexcept { return path_at_ < path_count_; }
  [[nodiscard]] CellCoord here() const noexcept { return cell_at(u_m_, v_m_); }
  std::uint64_t random() noexcept;
  void publish() noexcept;

  contact::DistanceField scene_;
  GroundFrame frame_;
  AgentConfig config_;
  WalkGrid grid_;
  AgentPlanner planner_;
  std::span<CellCoord> path_;                 // start_, ..., end
  std::size_t path_at_ = 0, path_count_ = 0;  // path_[path_at_] is what it walks towards, in a straight line
  bool path_reaches_goal_ = false;
  std::uint64_t path_changes_ = 0;  // of the grid when the search for it began
  double target_u_m_ = 0, target_v_m_ = 0;

  Vec3d drop_world_m_;
  bool is_dropped_ = false;  // place() was called
  double u_m_ = 0, v_m_ = 0, height_m_ = 0;
  double heading_u_ = 1, heading_v_ = 0;
  Goal goal_;
  bool is_wandering_ = false;
  std::uint64_t random_ = 0;
  double without_way_s_ = 0, since_plan_s_ = 0, rest_s_ = 0;
  AgentPose pose_;
  AgentCounters counters_;
};

}  // namespace tactus::interact
