// The cheapest way over the walk grid: A* that goes on from step to step, a bounded number of cells each.
//
// Costs are integers and ties go to the lower index, so that the same grid gives the same path on every
// machine. The grid may change while a search is under way; who follows the path looks where it treads
// (WalkGrid::line_cost). Source: Hart, Nilsson, Raphael 1968, with a consistent estimate: no cell is opened
// twice.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "pipeline/interact/agent_grid.hpp"
#include "rt/slice.hpp"

namespace tactus::interact {

/// One cell straight on costs 70 times the sum of both cells' costs, one across 99 times (70 times the root
/// of 2 is 98.995): a cell of carpet is 2240.
inline constexpr std::uint32_t kStraight = 70, kAcross = 99;

enum class PlanState : std::uint8_t { idle, searching, found, exhausted };

/// Thread-bound; no heap after bind().
class AgentPlanner {
 public:
  static std::size_t bytes_needed();
  void bind(rt::Slice& memory);  // boot

  /// Starts anew. `start` lies in the window and need not be free. Step phase.
  void begin(const WalkGrid& grid, CellCoord start, CellCoord goal) noexcept;
  void stop() noexcept { state_ = PlanState::idle; }
  /// Opens up to `expansions_max` cells, 0.3 us each. `exhausted`: the goal cannot be reached over what is
  /// known today; then end() is the reached cell nearest to it. The window must not have moved since begin().
  /// Step phase.
  PlanState step(const WalkGrid& grid, std::size_t expansions_max) noexcept;

  [[nodiscard]] PlanState state() const noexcept { return state_; }
  [[nodiscard]] CellCoord end() const noexcept { return end_; }
  /// Cost of the way to end(), as above.
  [[nodiscard]] std::uint32_t cost() const noexcept;
  /// The way to end(), start first; its beginning when it is longer than `out`. Returns how many cells. Step
  /// phase.
  std::size_t path(const WalkGrid& grid, std::span<CellCoord> out) const noexcept;
  [[nodiscard]] std::uint64_t expansions() const noexcept { return expansions_; }

 private:
  static constexpr std::uint16_t kNotOpen = 0xFFFF;
  struct Node {
    std::uint32_t search = 0;  // the search that the rest belongs to
    std::uint32_t cost = 0;    // from the start
    std::uint32_t total = 0;   // with the estimate of what is left
    std::uint16_t heap_at = kNotOpen;
    std::uint8_t came_by = 0;  // direction of the last step
    bool is_closed = false;
  };
  [[nodiscard]] std::uint32_t estimate(CellCoord c) const noexcept;
  [[nodiscard]] bool is_before(std::uint16_t a, std::uint16_t b) const noexcept;
  void place(std::size_t at, std::uint16_t index) noexcept;
  void sift_up(std::size_t at) noexcept;
  void sift_down(std::size_t at) noexcept;
  void open(std::uint16_t index) noexcept;
  std::uint16_t pop() noexcept;
  void note_nearest(CellCoord c, std::uint32_t cost) noexcept;

  std::span<Node> nodes_;
  std::span<std::uint16_t> heap_;
  std::size_t open_count_ = 0;
  std::uint32_t search_ = 0;
  CellCoord start_, goal_, end_;
  std::int64_t end_distance2_ = 0;
  std::uint32_t end_cost_ = 0;
  PlanState state_ = PlanState::idle;
  std::uint64_t expansions_ = 0;
};

}  // namespace tactus::interact
