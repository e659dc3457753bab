#include "pipeline/interact/walkers.hpp"

#include <algorithm>
#include <cmath>

namespace tactus::interact {
namespace {

// Places lie on a sunflower's spiral around the point, nearest first: each a golden angle on from the one
// before.
constexpr double kSpiralM = 0.1;               // between neighbours 0.15 m
constexpr std::size_t kPlaces = 256;           // 1.6 m: over a bed to the floor beside it
constexpr std::size_t kPlacesAtPosition = 16;  // 0.4 m: a place given by numbers is meant
constexpr double kGoldenCos = -0.73736887807832, kGoldenSin = 0.67549029426152;
constexpr double kHalfRoot = 0.70710678118654752;
constexpr int kChoosySearches = 4;  // then a place out of view, or on another storey, will do
constexpr double kChestM = 0.06, kNearM = 0.3, kRimShare = 0.05;
constexpr std::array<CellCoord, 5> kStand{{{0, 0}, {1, 0}, {-1, 0}, {0, 1}, {0, -1}}};
constexpr double kFloorM = 0.1;        // what lies higher than this above the lowest is not the floor
constexpr double kLevelMin = 0.9;      // cosine of the steepest floor
constexpr double kAbovePlaceM = 0.05;  // so that a point given on the floor itself is above it
constexpr Quaternion kUpright{kHalfRoot, -kHalfRoot, 0,
                              0};  // turns z, along which shapes stand, to an agent's y

}  // namespace

std::size_t Walkers::bytes_needed() { return kWalkersMax * Agent::bytes_needed(); }

void Walkers::bind(rt::Slice& slice, std::span<const Walker> script, const contact::DistanceField& room,
                   const Vec3d& gravity_world) {
  TACTUS_ASSERT(script.size() <= kWalkersMax);
  count_ = script.size();
  for (std::size_t i = 0; i < count_; ++i) {
    script_[i] = script[i];
    surroundings_[i].bind(room);
    agents_[i].bind(slice, surroundings_[i].field(), gravity_world);
  }
}

double Walkers::walked_m() const {
  double sum_m = 0;
  for (const Agent& agent : agents()) sum_m += agent.pose().walked_m;
  return sum_m;
}

void Walkers::look_around(std::size_t index, const Vec3d& middle_world_m,
                          std::span<const contact::BodyState> bodies) noexcept {
  Surroundings& around = surroundings_[index];
  around.clear(middle_world_m);
  for (const contact::BodyState& body : bodies) around.add(body);
  for (std::size_t other = 0; other < count_; ++other) {
    const AgentPose& pose = agents_[other].pose();
    if (other == index || !pose.is_placed) continue;
    const WalkerBody body;
    around.add(contact::Shape::cylinder(body.radius_m, body.height_m / 2),
               pose.position_world_m + agents_[other].frame().up * (body.height_m / 2),
               pose.q_world_agent * kUpright);
  }
}

std::optional<double> Walkers::ground_below(std::size_t index, CellCoord cell, double from_m) const noexcept {
  const GroundFrame& frame = agents_[index].frame();
  map::SurfacePoint ground;
  const bool is_hit = surroundings_[index].field().raycast(
      frame.point(center_of(cell.i), center_of(cell.j), from_m), -frame.up, Agent::kDropMaxM, ground);
  if (!is_hit || frame.up.dot(ground.normal_world.cast<double>()) < kLevelMin) return std::nullopt;
  return frame.up.dot(ground.position_world_m.cast<double>());
}

/// Not onto the top of a post either: it must be able to leave.
bool Walkers::fits(std::size_t index, CellCoord cell, double height_m) const noexcept {
  const contact::DistanceField room = surroundings_[index].field();
  return std::all_of(kStand.begin(), kStand.end(), [&](CellCoord off) {
    return probe_ground(room, agents_[index].frame(), WalkerBody{}, {cell.i + off.i, cell.j + off.j},
                        height_m, false)
               .state == CellState::free;
  });
}

/// Whether a figure there stands in the picture, clear of its rim, and nothing real hides it.
bool Walkers::is_in_view(std::size_t index, CellCoord cell, double height_m,
                         const View& view) const noexcept {
  const hal::Intrinsics& camera = view.picture_camera;
  const Vec3d at = agents_[index].frame().point(center_of(cell.i), center_of(cell.j), height_m + kChestM);
  const Vec3d p = view.T_world_picture.inverse() * at;
  if (!(p.z > kNearM)) return false;
  const double u = p.x / p.z * camera.fx + camera.cx, v = p.y / p.z * camera.fy + camera.cy;
  const double rim_u = kRimShare * camera.width, rim_v = kRimShare * camera.height;
  if (!(u > rim_u && v > rim_v && u < camera.width - rim_u && v < camera.height - rim_v)) return false;
  const Vec3d eye = view.T_world_picture.translation, way = at - eye;
  map::SurfacePoint between;
  return !surroundings_[index].field().raycast(eye, way.normalized(), way.norm(), between);
}

/// True when the walker was put down.
bool Walkers::find_place(std::size_t index, const View& view) noexcept {
  const Walker& wanted = script_[index];
  const GroundFrame& frame = agents_[index].frame();
  Search& search = searches_[index];
  const bool is_exact = wanted.position_world_m.has_value();
  if (!search.is_begun) {
    Vec3d at = view.T_world_picture.translation;
    if (is_exact) {
      at = *wanted.position_world_m + frame.up * kAbovePlaceM;
    } else {
      // Level along the view; who looks straight down sees what is before them upwards in the picture.
      Vec3d ahead = view.T_world_picture.rotation * Vec3d{0, 0, 1};
      if (std::abs(frame.up.dot(ahead)) > 0.95) ahead = view.T_world_picture.rotation * Vec3d{0, -1, 0};
      at += (ahead - frame.up * frame.up.dot(ahead)).normalized() * wanted.in_front_m;
    }
    const int searches = search.searches;
    search = {};
    search.searches = searches + 1;
    search.is_begun = true;
    search.u_m = frame.u.dot(at);
    search.v_m = frame.v.dot(at);
    search.from_m = search.lowest_m = frame.up.dot(at);
  }
  const std::size_t places = is_exact ? kPlacesAtPosition : kPlaces;
  const bool is_choosy = !is_exact && search.searches < kChoosySearches;
  for (std::size_t i = 0; i < kPlacesPerRound && search.next < places; ++i) {
    const double out_m = kSpiralM * std::sqrt(static_cast<double>(search.next++));
    const CellCoord cell = cell_at(search.u_m + out_m * search.way_u, search.v_m + out_m * search.way_v);
    const double way_u = search.way_u * kGoldenCos - search.way_v * kGoldenSin;
    search.way_v = search.way_u * kGoldenSin + search.way_v * kGoldenCos;
    search.way_u = way_u;
    ++counters_.places_tried;
    const auto height_m = ground_below(index, cell, search.from_m);
    if (!height_m) continue;
    search.lowest_m = std::min(search.lowest_m, *height_m);
    if (search.is_found && *height_m > search.best_height_m - kFloorM) continue;
    if (!fits(index, cell, *height_m)) continue;
    if (is_choosy && !is_in_view(index, cell, *height_m, view)) continue;
    search.is_found = true;
    search.best = cell;
    search.best_height_m = *height_m;
    if (is_exact) search.next = places;
  }
  if (search.next < places) return false;
  search.is_begun = false;
  const bool is_floor = search.best_height_m < search.lowest_m + kFloorM;
  if (!search.is_found || (is_choosy && !is_floor)) return false;
  search.is_done = true;
  agents_[index].place(
      frame.point(center_of(search.best.i), center_of(search.best.j), search.best_height_m + kAbovePlaceM));
  if (wanted.goal_world_m)
    agents_[index].set_goal(*wanted.goal_world_m);
  else
    agents_[index].wander(wanted.wander_seed);
  return true;
}

std::size_t Walkers::step(std::uint64_t frames, rt::Duration since_tracking, rt::Duration duration,
                          const View& view, std::span<const contact::BodyState> bodies,
                          std::span<WalkerNews, 2 * kWalkersMax> news) noexcept {
  std::size_t count = 0;
  for (std::size_t i = 0; i < count_; ++i) {
    Agent& agent = agents_[i];
    const bool was_placed = agent.pose().is_placed;
    if (!was_placed && !script_[i].when.is_due(frames, since_tracking)) continue;
    look_around(i, was_placed ? agent.pose().position_world_m : view.T_world_picture.translation, bodies);
    if (!searches_[i].is_done && !find_place(i, view)) continue;
    const AgentCounters before = agent.counters();
    (void)agent.step(duration);  // without ground it waits, which it counts
    if (!was_placed && agent.pose().is_placed) {
      ++counters_.placed;
      news[count++] = {i, AgentState::waiting};
    }
    if (agent.counters().arrivals > before.arrivals) {
      ++counters_.arrivals;
      news[count++] = {i, AgentState::arrived};
    } else if (agent.counters().stuck > before.stuck) {
      ++counters_.stuck;
      news[count++] = {i, AgentState::stuck};
    }
  }
  return count;
}

}  // namespace tactus::interact
