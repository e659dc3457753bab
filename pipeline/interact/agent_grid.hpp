// The ground around a small walker as a grid of cells: how high, what it costs, and where the body does not
// fit.
//
// A cell is looked at from the level of the neighbour that led to it, from a step above that level: so the
// walker's own storey is found, under a table as well as on top of it, and a cell has one height. A ray
// straight down finds the ground; samples of the distance field up the body's axis and short level rays
// around it find what stands in the way. Space that the map has not seen answers nothing and stays unknown:
// it is never entered.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "hal/transform.hpp"
#include "pipeline/contact/distance_field.hpp"
#include "pipeline/interact/agent_walkability.hpp"
#include "rt/slice.hpp"

namespace tactus::interact {

/// The body as a standing cylinder, and how it climbs.
struct WalkerBody {
  double height_m = 0.12, radius_m = 0.04;
  double step_m = 0.03;  // up or down between neighbouring cells; what is lower than this is not in the way
};

inline constexpr double kWalkCellM = 0.04;
inline constexpr int kWalkGridSide = 96;  // 3.8 m
inline constexpr std::size_t kWalkCells = static_cast<std::size_t>(kWalkGridSide) * kWalkGridSide;

/// A cell of the endless grid over the ground plane; its centre lies at (i + 1/2, j + 1/2) cells.
struct CellCoord {
  std::int32_t i = 0, j = 0;
  friend constexpr bool operator==(CellCoord, CellCoord) = default;
};

/// Ground coordinates of the world: u and v level, up against gravity; with y up, u is x and v is z.
struct GroundFrame {
  Vec3d u{1, 0, 0}, v{0, 0, 1}, up{0, 1, 0};

  /// Needs a gravity that is not zero.
  static GroundFrame from_gravity(const Vec3d& gravity_world);
  [[nodiscard]] Vec3d point(double u_m, double v_m, double height_m) const {
    return u * u_m + v * v_m + up * height_m;
  }
};

CellCoord cell_at(double u_m, double v_m) noexcept;
constexpr double center_of(std::int32_t cell) { return (static_cast<double>(cell) + 0.5) * kWalkCellM; }

enum class CellState : std::uint8_t { unknown, free, blocked };

struct WalkCell {
  float height_m = 0;      // of the ground, along up; free cells only
  float from_m = 0;        // level to look from while not free: a free neighbour's
  std::uint16_t cost = 0;  // expected, in 1 / kCostUnit; free cells only
  MaterialId material = kUnknownMaterial;
  CellState state = CellState::unknown;
  bool is_queued = false;
};

/// Looks at one cell with up to 17 short rays and 5 samples, 2 us on the live map. `was_free` asks for a
/// centimetre less room, so that noise at a wall does not switch a cell to and fro. Step phase; wait-free on
/// the live map.
WalkCell probe_ground(const contact::DistanceField& scene, const GroundFrame& frame, const WalkerBody& body,
                      CellCoord cell, double from_m, bool was_free) noexcept;

/// The window of the grid around the walker. Thread-bound; no heap after bind().
class WalkGrid {
 public:
  static std::size_t bytes_needed();
  /// Boot.
  void bind(rt::Slice& memory, const contact::DistanceField& scene, const GroundFrame& frame, const WalkerBody& body);

  /// Forgets everything and starts from ground of this height under `at`. Step phase.
  void start(CellCoord at, double height_m) noexcept;
  /// Moves the window, in steps of 16 cells, when the walker is farther than that from its middle; what
  /// enters is unknown. True when it moved. Step phase.
  bool follow(CellCoord at) noexcept;
  /// Looks at up to `probes_max` cells: `first`, then the edge of what is known, then the window over and
  /// over, so that changes of the map are followed. At least a fourth goes to that last round. Step phase.
  void fill(std::span<const CellCoord> first, std::size_t probes_max) noexcept;

  [[nodiscard]] bool contains(CellCoord c) const noexcept {
    return c.i >= low_.i && c.j >= low_.j && c.i < low_.i + kWalkGridSide && c.j < low_.j + kWalkGridSide;
  }
  /// Cells outside of the window are unknown.
  [[nodiscard]] const WalkCell& at(CellCoord c) const noexcept {
    return contains(c) ? cells_[index_of(c)] : kOutside;
  }
  [[nodiscard]] bool is_free(CellCoord c) const noexcept { return at(c).state == CellState::free; }
  /// Whether the walker gets from a cell to one of its eight neighbours: ground on both, no more than a step
  /// between, and no corner cut. `from` may be any cell in the window: the walker stands where it stands.
  [[nodiscard]] bool is_passable(CellCoord from, CellCoord to) const noexcept;
  /// Cost of the straight way between two points, in kCostUnit times metres; negative when it leaves free
  /// cells or climbs more than a step. The first cell need not be free.
  [[nodiscard]] double line_cost(double u0_m, double v0_m, double u1_m, double v1_m) const noexcept;

  /// Position of a window's cell in arrays of kWalkCells; the same for as long as the cell stays in the
  /// window.
  [[nodiscard]] static std::size_t index_of(CellCoord c) noexcept {
    return wrap(c.i) + wrap(c.j) * static_cast<std::size_t>(kWalkGridSide);
  }
  [[nodiscard]] CellCoord coord_of(std::size_t index) const noexcept;
  [[nodiscard]] CellCoord low() const noexcept { return low_; }
  /// Cells at the edge of the known still wait to be looked at.
  [[nodiscard]] bool is_growing() const noexcept { return queued_ > 0; }
  /// Counts changes of state and cost.
  [[nodiscard]] std::uint64_t changes() const noexcept { return changes_; }
  [[nodiscard]] std::uint64_t probes() const noexcept { return probes_; }

 private:
  static constexpr WalkCell kOutside{};
  static std::size_t wrap(std::int32_t c) noexcept {
    const std::int32_t r = c % kWalkGridSide;
    return static_cast<std::size_t>(r < 0 ? r + kWalkGridSide : r);
  }
  [[nodiscard]] bool is_level(const WalkCell& a, const WalkCell& b) const noexcept;
  void probe(CellCoord c) noexcept;
  void push(CellCoord c, float from_m) noexcept;
  void clear(CellCoord c) noexcept { cells_[index_of(c)] = {}; }

  contact::DistanceField scene_;
  GroundFrame frame_;
  WalkerBody body_;
  CellCoord low_;
  std::span<WalkCell> cells_;
  std::span<std::uint16_t> queue_;  // a ring; a cell is in it once
  std::size_t queue_first_ = 0, queued_ = 0;
  std::size_t round_ = 0, rounds_ = 0;  // next cell of the endless round, and how often it went around
  std::uint64_t changes_ = 0, probes_ = 0;
};

}  // namespace tactus::interact
