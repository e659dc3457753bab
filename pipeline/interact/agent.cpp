#include "pipeline/interact/agent.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "rt/assert.hpp"

namespace tactus::interact {
namespace {

constexpr std::size_t kCellsAhead =
    8;  // of the path, looked at anew every step: 0.3 m, more than a second's walk
constexpr std::size_t kStraightMax = 32;  // cells of the path that one straight line may replace
constexpr double kLookAgainS = 0.5;       // between searches while there is no way
constexpr double kBetterWayS = 2;         // between searches while walking, when the grid has changed
constexpr double kRestS = 0.5;            // of a wanderer at its goal
constexpr double kFeetMPerS = 0.4;        // a step of 3 cm is climbed in the time of two cells
constexpr double kFacingMin = 0.5;        // turns on the spot until it faces its way to 60 degrees
constexpr double kAboveStepM = 0.01;
constexpr std::int32_t kWanderCells = 45;  // within the window around it
constexpr std::int32_t kWanderMinCells = 10;
constexpr int kWanderTries = 32;

}  // namespace

const char* name(AgentState state) {
  constexpr std::array<const char*, 4> kNames{"waiting", "walking", "arrived", "stuck"};
  return kNames[static_cast<std::size_t>(state)];
}

std::size_t Agent::bytes_needed() {
  return WalkGrid::bytes_needed() + AgentPlanner::bytes_needed() + rt::bytes_of<CellCoord>(kPathMax);
}

void Agent::bind(rt::Slice& memory, const contact::DistanceField& scene, const Vec3d& gravity_world,
                 const AgentConfig& config) {
  TACTUS_ASSERT(gravity_world.norm() > 0);
  scene_ = scene;
  frame_ = GroundFrame::from_gravity(gravity_world);
  config_ = config;
  grid_.bind(memory, scene, frame_, config.body);
  planner_.bind(memory);
  path_ = memory.take<CellCoord>(kPathMax);
}

void Agent::place(const Vec3d& position_world_m) noexcept {
  drop_world_m_ = position_world_m;
  is_dropped_ = true;
  pose_ = {};
  stop();
}

void Agent::stop() noexcept {
  goal_ = {};
  is_wandering_ = false;
  planner_.stop();
  drop_path();
  pose_.state = AgentState::waiting;
}

void Agent::set_goal(const Vec3d& position_world_m) noexcept {
  stop();
  goal_.is_set = true;
  goal_.u_m = frame_.u.dot(position_world_m);
  goal_.v_m = frame_.v.dot(position_world_m);
  goal_.height_m = frame_.up.dot(position_world_m);
  goal_.cell = cell_at(goal_.u_m, goal_.v_m);
  without_way_s_ = 0;
  since_plan_s_ = kLookAgainS;  // at once
}

void Agent::wander(std::uint64_t seed) noexcept {
  stop();
  is_wandering_ = true;
  random_ = seed * 2 + 1;  // xorshift stays at 0
  rest_s_ = kRestS;
}

// xorshift64* (Vigna 2016).
std::uint64_t Agent::random() noexcept {
  random_ ^= random_ >> 12;
  random_ ^= random_ << 25;
  random_ ^= random_ >> 27;
  return (random_ * 0x2545F4914F6CDD1DULL) >> 32;
}

bool Agent::find_ground() noexcept {
  map::SurfacePoint ground;
  if (!scene_.raycast(drop_world_m_, -frame_.up, kDropMaxM, ground)) return false;
  u_m_ = frame_.u.dot(drop_world_m_);
  v_m_ = frame_.v.dot(drop_world_m_);
  height_m_ = frame_.up.dot(ground.position_world_m.cast<double>());
  grid_.start(here(), height_m_);
  pose_.is_placed = true;
  return true;
}

void Agent::choose_goal() noexcept {
  const CellCoord at = here();
  for (int attempt = 0; attempt < kWanderTries; ++attempt) {
    const auto off = [this] {
      return static_cast<std::int32_t>(random() % (2 * kWanderCells + 1)) - kWanderCells;
    };
    const std::int32_t di = off(), dj = off();
    const CellCoord c{at.i + di, at.j + dj};
    if (!grid_.is_free(c) || di * di + dj * dj < kWanderMinCells * kWanderMinCells) continue;
    goal_ = {true, false, c, center_of(c.i), center_of(c.j), static_cast<double>(grid_.at(c).height_m)};
    without_way_s_ = 0;
    pose_.state = AgentState::waiting;
    begin_plan();
    return;
  }
}

void Agent::begin_plan() noexcept {
  planner_.begin(grid_, here(), goal_.cell);
  path_changes_ = grid_.changes();
  since_plan_s_ = 0;
  ++counters_.plans;
}

bool Agent::goal_is_here() const noexcept {
  const WalkCell& cell = grid_.at(goal_.cell);
  const double off_m = static_cast<double>(cell.height_m) - goal_.height_m;
  return cell.state == CellState::free && off_m < kStoreyM && off_m > -kStoreyM;
}

void Agent::take_path() noexcept {
  path_count_ = planner_.path(grid_, path_);
  path_at_ = 0;
  path_reaches_goal_ = planner_.end() == goal_.cell && goal_is_here() && path_[path_count_ - 1] == goal_.cell;
  choose_target();
}

// The farthest cell of the path that a straight line reaches at no more cost takes the place of those before
// it.
void Agent::choose_target() noexcept {
  const std::size_t last = std::min(path_at_ + kStraightMax, path_count_ - 1);
  const auto aim_at = [this](std::size_t at) {
    const bool is_goal = at + 1 == path_count_ && path_reaches_goal_;
    target_u_m_ = is_goal ? goal_.u_m : center_of(path_[at].i);
    target_v_m_ = is_goal ? goal_.v_m : center_of(path_[at].j);
  };
  const auto leg = [this](std::size_t from, std::size_t to) {
    return grid_.line_cost(center_of(path_[from].i), center_of(path_[from].j), center_of(path_[to].i),
                           center_of(path_[to].j));
  };
  // From where it stands to the next cell, and along the path from there: what a straight line has to beat.
  std::array<double, kStraightMax + 1> along{};
  aim_at(path_at_);
  along[0] = grid_.line_cost(u_m_, v_m_, target_u_m_, target_v_m_);
  for (std::size_t k = path_at_; k < last; ++k) {
    const double cost = leg(k, k + 1);
    along[k + 1 - path_at_] = cost < 0 || along[k - path_at_] < 0 ? -1 : along[k - path_at_] + cost;
  }
  for (std::size_t at = last; at > path_at_; --at) {
    aim_at(at);
    const double straight = grid_.line_cost(u_m_, v_m_, target_u_m_, target_v_m_);
    // Half a cell of the cheapest ground: the goal need not be its cell's middle.
    constexpr double kSlack = 0.5 * kWalkCellM * kCostUnit;
    if (straight < 0 || along[at - path_at_] < 0 || straight > along[at - path_at_] + kSlack) continue;
    path_at_ = at;
    return;
  }
  aim_at(path_at_);
}

void Agent::finish_plan(PlanState done) noexcept {
  const bool is_reached = done == PlanState::found && goal_is_here();
  if (!is_reached && is_wandering_) {
    ++counters_.goals_dropped;
    goal_ = {};
    drop_path();
    pose_.state = AgentState::waiting;
  } else if (!is_reached && planner_.end() == here()) {
    drop_path();  // nowhere is nearer than here
  } else {
    take_path();
    pose_.state = AgentState::walking;
  }
}

void Agent::plan(double dt_s) noexcept {
  since_plan_s_ += dt_s;
  if (!goal_.is_set) return;
  const bool is_searching = planner_.state() == PlanState::searching;
  if (has_path() && grid_.line_cost(u_m_, v_m_, target_u_m_, target_v_m_) < 0) {
    drop_path();
    begin_plan();
    ++counters_.replans_blocked;
    pose_.state = AgentState::waiting;
  } else if (!is_searching) {
    const bool is_due = has_path() ? since_plan_s_ >= kBetterWayS && grid_.changes() != path_changes_
                                   : since_plan_s_ >= kLookAgainS;
    if (is_due) begin_plan();
  }
  if (planner_.state() == PlanState::searching) {
    const PlanState done = planner_.step(grid_, config_.expansions_per_step);
    if (done != PlanState::searching) finish_plan(done);
  }
  without_way_s_ = has_path() || grid_.is_growing() ? 0 : without_way_s_ + dt_s;
  if (without_way_s_ <= kPatience.seconds() || !goal_.is_set) return;
  pose_.state = AgentState::stuck;
  if (!goal_.is_given_up) ++counters_.stuck;
  goal_.is_given_up = true;
}

void Agent::walk(double dt_s) noexcept {
  if (!has_path()) return;
  double left_m = config_.speed_m_per_s * dt_s, turn = config_.turn_rad_per_s * dt_s;
  while (left_m > 0 && has_path()) {
    const double du = target_u_m_ - u_m_, dv = target_v_m_ - v_m_;
    const double off_m = std::sqrt(du * du + dv * dv);
    if (off_m > 1e-6) {
      const double to_u = du / off_m, to_v = dv / off_m;
      const double facing = heading_u_ * to_u + heading_v_ * to_v;
      const double side = heading_u_ * to_v - heading_v_ * to_u;
      // A turn by t radians about the vertical with tan(t / 2) ~ t / 2; done when the way lies within it.
      const double half = 0.5 * turn, scale = 1 / (1 + half * half);
      const double c = (1 - half * half) * scale, s = 2 * half * scale * (side < 0 ? -1 : 1);
      if (facing >= c) {
        heading_u_ = to_u;
        heading_v_ = to_v;
      } else {
        const double u = heading_u_ * c - heading_v_ * s, v = heading_u_ * s + heading_v_ * c;
        const double norm = std::sqrt(u * u + v * v);
        heading_u_ = u / norm;
        heading_v_ = v / norm;
      }
      turn = 0;
      const double faces = heading_u_ * to_u + heading_v_ * to_v;
      if (faces < kFacingMin) return;
      const double go_m = std::min(off_m, left_m * faces);
      u_m_ += to_u * go_m;
      v_m_ += to_v * go_m;
      pose_.walked_m += go_m;
      left_m -= go_m / faces;
      if (go_m < off_m) return;
    }
    ++path_at_;
    if (has_path()) {
      choose_target();
      if (grid_.line_cost(u_m_, v_m_, target_u_m_, target_v_m_) < 0) return;  // plan() sees to it
    } else if (path_reaches_goal_) {
      drop_path();
      planner_.stop();
      goal_ = {};
      rest_s_ = 0;
      ++counters_.arrivals;
      pose_.state = AgentState::arrived;
    } else {
      drop_path();
      begin_plan();  // on from here
      pose_.state = AgentState::waiting;
    }
  }
}

// Feet onto the ground below; between cells the ground itself says how high.
void Agent::settle(double dt_s) noexcept {
  const double reach_m = config_.body.step_m + kAboveStepM;
  map::SurfacePoint ground;
  double to_m = height_m_;
  if (scene_.raycast(frame_.point(u_m_, v_m_, height_m_ + reach_m), -frame_.up, 2 * reach_m, ground)) {
    to_m = frame_.up.dot(ground.position_world_m.cast<double>());
  } else if (grid_.is_free(here())) {
    to_m = static_cast<double>(grid_.at(here()).height_m);
  } else {
    ++counters_.steps_without_ground;
  }
  const double climb_m = kFeetMPerS * dt_s;
  height_m_ += std::clamp(to_m - height_m_, -climb_m, climb_m);
}

void Agent::publish() noexcept {
  const Vec3d forward = frame_.u * heading_u_ + frame_.v * heading_v_;
  const Vec3d right = forward.cross(frame_.up);
  pose_.position_world_m = frame_.point(u_m_, v_m_, height_m_);
  pose_.heading_world = forward;
  const Rotation R_world_agent{
      {right.x, frame_.up.x, -forward.x, right.y, frame_.up.y, -forward.y, right.z, frame_.up.z, -forward.z}};
  pose_.q_world_agent = R_world_agent.quaternion();
}

rt::Status Agent::step(rt::Duration dt) noexcept {
  ++counters_.steps;
  if (!is_dropped_) return rt::Status::skipped;
  if (dt > kStepMax) {
    dt = kStepMax;
    ++counters_.steps_cut;
  }
  if (!pose_.is_placed && !find_ground()) {
    ++counters_.steps_without_ground;
    return rt::Status::lost;
  }
  const double dt_s = dt.seconds();
  if (grid_.follow(here())) {
    ++counters_.windows_moved;
    // Nodes of cells that left the window now belong to others.
    if (planner_.state() == PlanState::searching) begin_plan();
  }
  std::array<CellCoord, kCellsAhead + 1> first{here()};
  std::size_t count = 1;
  const double du = target_u_m_ - u_m_, dv = target_v_m_ - v_m_;
  const double off_m = has_path() ? std::sqrt(du * du + dv * dv) : 0;
  for (double at_m = kWalkCellM; count < first.size() && has_path() && at_m < off_m + kWalkCellM;
       at_m += kWalkCellM) {
    const double along = std::min(at_m / off_m, 1.0);
    first[count++] = cell_at(u_m_ + du * along, v_m_ + dv * along);
  }
  grid_.fill({first.data(), count}, config_.probes_per_step);

  if (is_wandering_ && !goal_.is_set) {
    rest_s_ += dt_s;
    if (rest_s_ >= kRestS) choose_goal();
  }
  plan(dt_s);
  const std::uint64_t lost_before = counters_.steps_without_ground;
  walk(dt_s);
  settle(dt_s);
  publish();
  return counters_.steps_without_ground == lost_before ? rt::Status::ok : rt::Status::lost;
}

}  // namespace tactus::interact
