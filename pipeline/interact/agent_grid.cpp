#include "pipeline/interact/agent_grid.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace tactus::interact {
namespace {

constexpr double kAboveStepM = 0.01;  // a ray down begins this far above a full step
constexpr double kClearanceM = 0.03;  // room beside the body from a cell's centre: it may stand 2.8 cm off
constexpr double kClearanceKeptM = 0.02;  // for a cell that was free
constexpr double kAxisSpacingM = 0.03;    // of samples up the axis: less than the band known behind a surface
constexpr double kHeadroomM = 0.01;
constexpr double kUprightMin = 0.8;        // cosine of the steepest ground, 37 degrees
constexpr std::int32_t kWindowShift = 16;  // cells
constexpr std::size_t kScanMax = 512;      // cells passed over by one step of the endless round

// Eight directions 45 degrees apart, and eight between them.
constexpr double kDiagonal = 0.70710678118654752, kLong = 0.92387953251128674, kShort = 0.38268343236508977;
using Ring = std::array<std::array<double, 2>, 8>;
constexpr Ring kRing{{{1, 0},
                      {kDiagonal, kDiagonal},
                      {0, 1},
                      {-kDiagonal, kDiagonal},
                      {-1, 0},
                      {-kDiagonal, -kDiagonal},
                      {0, -1},
                      {kDiagonal, -kDiagonal}}};
constexpr Ring kRingBetween{{{kLong, kShort},
                             {kShort, kLong},
                             {-kShort, kLong},
                             {-kLong, kShort},
                             {-kLong, -kShort},
                             {-kShort, -kLong},
                             {kShort, -kLong},
                             {kLong, -kShort}}};
constexpr std::array<CellCoord, 4> kSides{{{1, 0}, {-1, 0}, {0, 1}, {0, -1}}};

std::int32_t floor_of(double v) {
  const auto truncated = static_cast<std::int32_t>(v);
  return truncated - (static_cast<double>(truncated) > v ? 1 : 0);
}

// Whether something stands within `room_m` of the body's axis over ground of this height.
bool is_obstructed(const contact::DistanceField& scene, const GroundFrame& frame, const WalkerBody& body, double u_m,
                   double v_m, double ground_m, double room_m) {
  const double top_m = ground_m + body.height_m + kHeadroomM;
  for (double z_m = ground_m + body.step_m + kAboveStepM;; z_m += kAxisSpacingM) {
    z_m = std::min(z_m, top_m);
    map::DistanceSample sample;
    const Vec3d p = frame.point(u_m, v_m, z_m);
    // Near saturation the gradient is noise, and what stands that far the rays find.
    if (scene.sample(p, sample) && sample.distance_m < 0.9F * scene.truncation_m) {
      if (sample.distance_m < 0) return true;
      const Vec3d to_surface = sample.gradient.cast<double>() * -static_cast<double>(sample.distance_m);
      const double rise_m = frame.up.dot(to_surface);
      const double level2 = to_surface.dot(to_surface) - rise_m * rise_m;
      const double at_m = z_m + rise_m - ground_m;
      if (at_m > body.step_m && at_m < body.height_m + kHeadroomM && level2 < room_m * room_m) return true;
    }
    if (z_m >= top_m) break;
  }
  // A ring above what can be stepped over and one at the head, turned against each other: a leg or a pole is
  // met by one of 16 directions, 2.7 cm apart at their end.
  const auto meets = [&](const Ring& ring, double z_m) {
    map::SurfacePoint hit;
    return std::any_of(ring.begin(), ring.end(), [&](const std::array<double, 2>& way) {
      return scene.raycast(frame.point(u_m, v_m, z_m), frame.u * way[0] + frame.v * way[1], room_m, hit);
    });
  };
  return meets(kRing, ground_m + body.step_m + 1.5 * kAboveStepM) ||
         meets(kRingBetween, ground_m + 0.9 * body.height_m);
}

}  // namespace

GroundFrame GroundFrame::from_gravity(const Vec3d& gravity_world) {
  GroundFrame frame;
  frame.up = -gravity_world.normalized();
  const Vec3d axis = std::fabs(frame.up.x) < 0.9 ? Vec3d{1, 0, 0} : Vec3d{0, 1, 0};
  frame.u = (axis - frame.up * frame.up.dot(axis)).normalized();
  frame.v = frame.u.cross(frame.up);
  return frame;
}

CellCoord cell_at(double u_m, double v_m) noexcept {
  return {floor_of(u_m / kWalkCellM), floor_of(v_m / kWalkCellM)};
}

WalkCell probe_ground(const contact::DistanceField& scene, const GroundFrame& frame, const WalkerBody& body,
                      CellCoord cell, double from_m, bool was_free) noexcept {
  WalkCell found;
  found.from_m = static_cast<float>(from_m);
  const double u_m = center_of(cell.i), v_m = center_of(cell.j);
  const double reach_m = body.step_m + kAboveStepM;
  const Vec3d eye = frame.point(u_m, v_m, from_m + reach_m);
  map::DistanceSample sample;
  if (scene.sample(eye, sample) && sample.distance_m < 0) {
    found.state = CellState::blocked;
    return found;
  }
  map::SurfacePoint ground;
  if (!scene.raycast(eye, -frame.up, 2 * reach_m, ground)) return found;
  const double height_m = frame.up.dot(ground.position_world_m.cast<double>());
  const GroundCost cost = ground_cost(ground.materials, ground.material);
  found.material = ground.material;
  found.state = CellState::blocked;
  if (std::fabs(height_m - from_m) > body.step_m || cost.cost == 0) return found;
  if (frame.up.dot(ground.normal_world.cast<double>()) < kUprightMin) return found;
  const double room_m = body.radius_m + (was_free ? kClearanceKeptM : kClearanceM);
  if (is_obstructed(scene, frame, body, u_m, v_m, height_m, room_m)) return found;
  found.state = CellState::free;
  found.height_m = static_cast<float>(height_m);
  found.cost = cost.cost;
  return found;
}

std::size_t WalkGrid::bytes_needed() {
  return rt::bytes_of<WalkCell>(kWalkCells) + rt::bytes_of<std::uint16_t>(kWalkCells);
}

void WalkGrid::bind(rt::Slice& memory, const contact::DistanceField& scene, const GroundFrame& frame,
                    const WalkerBody& body) {
  scene_ = scene;
  frame_ = frame;
  body_ = body;
  cells_ = memory.take<WalkCell>(kWalkCells);
  queue_ = memory.take<std::uint16_t>(kWalkCells);
}

void WalkGrid::start(CellCoord at, double height_m) noexcept {
  std::fill(cells_.begin(), cells_.end(), WalkCell{});
  queue_first_ = queued_ = 0;
  low_ = {at.i - kWalkGridSide / 2, at.j - kWalkGridSide / 2};
  ++changes_;
  push(at, static_cast<float>(height_m));
  for (const CellCoord side : kSides) push({at.i + side.i, at.j + side.j}, static_cast<float>(height_m));
}

bool WalkGrid::follow(CellCoord at) noexcept {
  const auto shift_of = [](std::int32_t off) {
    return off > kWindowShift ? kWindowShift : off < -kWindowShift ? -kWindowShift : 0;
  };
  const CellCoord shift{shift_of(at.i - low_.i - kWalkGridSide / 2),
                        shift_of(at.j - low_.j - kWalkGridSide / 2)};
  if (shift == CellCoord{}) return false;
  const CellCoord before = low_;
  low_ = {low_.i + shift.i, low_.j + shift.j};
  const auto entered = [&](CellCoord c) {
    return c.i < before.i || c.j < before.j || c.i >= before.i + kWalkGridSide ||
           c.j >= before.j + kWalkGridSide;
  };
  for (std::size_t n = 0; n < kWalkCells; ++n) {
    const CellCoord c = coord_of(n);
    if (entered(c)) clear(c);
  }
  // What left the window goes from the queue as well.
  std::size_t kept = 0;
  for (std::size_t n = 0; n < queued_; ++n) {
    const std::uint16_t index = queue_[(queue_first_ + n) % kWalkCells];
    if (cells_[index].is_queued) queue_[(queue_first_ + kept++) % kWalkCells] = index;
  }
  queued_ = kept;
  for (std::size_t n = 0; n < kWalkCells; ++n) {
    const CellCoord c = coord_of(n);
    if (!entered(c)) continue;
    for (const CellCoord side : kSides) {
      const WalkCell& beside = this->at({c.i + side.i, c.j + side.j});
      if (beside.state == CellState::free) push(c, beside.height_m);
    }
  }
  ++changes_;
  return true;
}

CellCoord WalkGrid::coord_of(std::size_t index) const noexcept {
  const auto along = [](std::int32_t low, std::size_t wrapped) {
    const auto off = static_cast<std::int32_t>(wrapped) - static_cast<std::int32_t>(wrap(low));
    return low + (off < 0 ? off + kWalkGridSide : off);
  };
  return {along(low_.i, index % kWalkGridSide), along(low_.j, index / kWalkGridSide)};
}

void WalkGrid::push(CellCoord c, float from_m) noexcept {
  if (!contains(c)) return;
  const std::size_t index = index_of(c);
  if (cells_[index].is_queued) return;
  cells_[index].is_queued = true;
  cells_[index].from_m = from_m;
  queue_[(queue_first_ + queued_++) % kWalkCells] = static_cast<std::uint16_t>(index);
}

void WalkGrid::probe(CellCoord c) noexcept {
  if (!contains(c)) return;
  WalkCell& cell = cells_[index_of(c)];
  const bool was_free = cell.state == CellState::free;
  const double from_m = static_cast<double>(was_free ? cell.height_m : cell.from_m);
  WalkCell found = probe_ground(scene_, frame_, body_, c, from_m, was_free);
  ++probes_;
  if (found.state != cell.state || found.cost != cell.cost) ++changes_;
  found.is_queued = cell.is_queued;
  cell = found;
  if (was_free || found.state != CellState::free) return;
  for (const CellCoord side : kSides) {
    const CellCoord next{c.i + side.i, c.j + side.j};
    // A neighbour that did not fit another level may fit this one.
    const WalkCell& beside = at(next);
    const bool is_other_level = std::fabs(beside.from_m - found.height_m) > 0.01F;
    if (beside.state == CellState::unknown || (beside.state == CellState::blocked && is_other_level))
      push(next, found.height_m);
  }
}

void WalkGrid::fill(std::span<const CellCoord> first, std::size_t probes_max) noexcept {
  std::size_t left = probes_max;
  for (const CellCoord c : first) {
    if (left == 0) return;
    probe(c);
    --left;
  }
  const std::size_t round_min = std::min(left, probes_max / 4);
  while (queued_ > 0 && left > round_min) {
    const std::size_t index = queue_[queue_first_];
    queue_first_ = (queue_first_ + 1) % kWalkCells;
    --queued_;
    cells_[index].is_queued = false;
    probe(coord_of(index));
    --left;
  }
  for (std::size_t scanned = 0; scanned < kScanMax && left > 0; ++scanned) {
    const CellCoord c = coord_of(round_);
    WalkCell& cell = cells_[round_];
    if (++round_ == kWalkCells) {
      round_ = 0;
      ++rounds_;
    }
    if (cell.state != CellState::free) {
      // The level to look from is a neighbour's of today, another one's each round; a cell without one is
      // left alone.
      bool has_neighbour = false;
      for (std::size_t k = 0; k < kSides.size(); ++k) {
        const CellCoord side = kSides[(k + rounds_) % kSides.size()];
        const WalkCell& beside = at({c.i + side.i, c.j + side.j});
        if (beside.state != CellState::free) continue;
        if (!cell.is_queued) cell.from_m = beside.height_m;
        has_neighbour = true;
        break;
      }
      if (!has_neighbour) continue;
    }
    probe(c);
    --left;
  }
}

bool WalkGrid::is_level(const WalkCell& a, const WalkCell& b) const noexcept {
  const double rise_m = static_cast<double>(a.height_m) - static_cast<double>(b.height_m);
  return rise_m <= body_.step_m && rise_m >= -body_.step_m;
}

bool WalkGrid::is_passable(CellCoord from, CellCoord to) const noexcept {
  const WalkCell &a = at(from), &b = at(to);
  if (b.state != CellState::free) return false;
  if (a.state == CellState::free && !is_level(a, b)) return false;
  if (from.i == to.i || from.j == to.j) return true;
  for (const CellCoord corner : {CellCoord{from.i, to.j}, CellCoord{to.i, from.j}}) {
    const WalkCell& c = at(corner);
    if (c.state != CellState::free || !is_level(c, b)) return false;
    if (a.state == CellState::free && !is_level(c, a)) return false;
  }
  return true;
}

double WalkGrid::line_cost(double u0_m, double v0_m, double u1_m, double v1_m) const noexcept {
  // Cell by cell along the line (Amanatides & Woo 1987); through a corner as a diagonal step.
  constexpr double kNever = 1e9, kTie = 1e-9;
  const double du = u1_m - u0_m, dv = v1_m - v0_m;
  const double length_m = std::sqrt(du * du + dv * dv);
  CellCoord c = cell_at(u0_m, v0_m);
  const CellCoord last = cell_at(u1_m, v1_m);
  // In its last column or row the line leaves it no more, also when it ends on the border itself.
  const auto cross = [](double from, double way, std::int32_t cell, std::int32_t last_cell) {
    if (cell == last_cell) return kNever;
    return (static_cast<double>(way > 0 ? cell + 1 : cell) * kWalkCellM - from) / way;
  };
  double cost = 0, at = 0;
  for (int steps = 0; steps < 4 * kWalkGridSide; ++steps) {
    const double to_u = cross(u0_m, du, c.i, last.i), to_v = cross(v0_m, dv, c.j, last.j);
    const bool is_last = c == last;
    const double leave = is_last ? 1 : std::min({to_u, to_v, 1.0});
    const WalkCell& cell = this->at(c);
    const double per_length = cell.state == CellState::free ? cell.cost : kCostUnit;
    cost += (leave - at) * length_m * per_length;
    if (is_last) return cost;
    CellCoord next = c;
    if (to_u <= to_v + kTie) next.i += du > 0 ? 1 : -1;
    if (to_v <= to_u + kTie) next.j += dv > 0 ? 1 : -1;
    if (!is_passable(c, next)) return -1;
    c = next;
    at = leave;
  }
  return -1;
}

}  // namespace tactus::interact
