#include "pipeline/interact/agent_planner.hpp"

#include <algorithm>
#include <array>

namespace tactus::interact {
namespace {

constexpr std::array<CellCoord, 8> kWays{
    {{1, 0}, {0, 1}, {-1, 0}, {0, -1}, {1, 1}, {-1, 1}, {-1, -1}, {1, -1}}};

std::int64_t distance2(CellCoord a, CellCoord b) {
  const std::int64_t di = a.i - b.i, dj = a.j - b.j;
  return di * di + dj * dj;
}

}  // namespace

std::size_t AgentPlanner::bytes_needed() {
  return rt::bytes_of<Node>(kWalkCells) + rt::bytes_of<std::uint16_t>(kWalkCells);
}

void AgentPlanner::bind(rt::Slice& memory) {
  nodes_ = memory.take<Node>(kWalkCells);
  heap_ = memory.take<std::uint16_t>(kWalkCells);
}

std::uint32_t AgentPlanner::estimate(CellCoord c) const noexcept {
  const std::int64_t di = c.i > goal_.i ? c.i - goal_.i : goal_.i - c.i;
  const std::int64_t dj = c.j > goal_.j ? c.j - goal_.j : goal_.j - c.j;
  const std::int64_t across = std::min(di, dj), straight = std::max(di, dj) - across;
  // A goal far outside of the window would overflow and need not be estimated.
  const std::int64_t cells = std::min<std::int64_t>(straight * kStraight + across * kAcross, 20'000'000);
  return static_cast<std::uint32_t>(cells) * 2 * kCostUnit;
}

bool AgentPlanner::is_before(std::uint16_t a, std::uint16_t b) const noexcept {
  const Node &x = nodes_[a], &y = nodes_[b];
  return x.total < y.total || (x.total == y.total && a < b);
}

void AgentPlanner::place(std::size_t at, std::uint16_t index) noexcept {
  heap_[at] = index;
  nodes_[index].heap_at = static_cast<std::uint16_t>(at);
}

void AgentPlanner::sift_up(std::size_t at) noexcept {
  const std::uint16_t index = heap_[at];
  while (at > 0 && is_before(index, heap_[(at - 1) / 2])) {
    place(at, heap_[(at - 1) / 2]);
    at = (at - 1) / 2;
  }
  place(at, index);
}

void AgentPlanner::sift_down(std::size_t at) noexcept {
  const std::uint16_t index = heap_[at];
  for (std::size_t child = 2 * at + 1; child < open_count_; child = 2 * at + 1) {
    if (child + 1 < open_count_ && is_before(heap_[child + 1], heap_[child])) ++child;
    if (!is_before(heap_[child], index)) break;
    place(at, heap_[child]);
    at = child;
  }
  place(at, index);
}

void AgentPlanner::open(std::uint16_t index) noexcept {
  if (nodes_[index].heap_at == kNotOpen) {
    heap_[open_count_] = index;
    nodes_[index].heap_at = static_cast<std::uint16_t>(open_count_++);
  }
  sift_up(nodes_[index].heap_at);
}

std::uint16_t AgentPlanner::pop() noexcept {
  const std::uint16_t index = heap_[0];
  nodes_[index].heap_at = kNotOpen;
  const std::uint16_t last = heap_[--open_count_];
  if (open_count_ > 0) {
    heap_[0] = last;
    sift_down(0);
  }
  return index;
}

void AgentPlanner::note_nearest(CellCoord c, std::uint32_t cost) noexcept {
  const std::int64_t d2 = distance2(c, goal_);
  if (d2 > end_distance2_ || (d2 == end_distance2_ && cost >= end_cost_)) return;
  end_ = c;
  end_distance2_ = d2;
  end_cost_ = cost;
}

void AgentPlanner::begin(const WalkGrid& grid, CellCoord start, CellCoord goal) noexcept {
  state_ = PlanState::exhausted;
  start_ = end_ = start;
  goal_ = goal;
  end_distance2_ = distance2(start, goal);
  end_cost_ = 0;
  open_count_ = 0;
  if (++search_ == 0) {  // after 2^32 searches old nodes would pass for new ones
    std::fill(nodes_.begin(), nodes_.end(), Node{});
    search_ = 1;
  }
  if (!grid.contains(start)) return;
  const auto index = static_cast<std::uint16_t>(WalkGrid::index_of(start));
  nodes_[index] = {search_, 0, estimate(start), kNotOpen, 0, false};
  open(index);
  state_ = PlanState::searching;
}

PlanState AgentPlanner::step(const WalkGrid& grid, std::size_t expansions_max) noexcept {
  for (std::size_t n = 0; n < expansions_max && state_ == PlanState::searching; ++n) {
    if (open_count_ == 0) {
      state_ = PlanState::exhausted;
      break;
    }
    const std::uint16_t index = pop();
    Node& node = nodes_[index];
    node.is_closed = true;
    ++expansions_;
    const CellCoord c = grid.coord_of(index);
    note_nearest(c, node.cost);
    if (c == goal_) {
      state_ = PlanState::found;
      break;
    }
    const WalkCell& from = grid.at(c);
    const std::uint32_t from_cost = from.state == CellState::free ? from.cost : kCostUnit;
    for (std::size_t way = 0; way < kWays.size(); ++way) {
      const CellCoord next{c.i + kWays[way].i, c.j + kWays[way].j};
      if (!grid.is_passable(c, next)) continue;
      const auto to = static_cast<std::uint16_t>(WalkGrid::index_of(next));
      Node& there = nodes_[to];
      const std::uint32_t cost =
          node.cost + (from_cost + grid.at(next).cost) * (way < 4 ? kStraight : kAcross);
      if (there.search != search_)
        there = {search_, cost, 0, kNotOpen, 0, false};
      else if (there.is_closed || there.cost <= cost)
        continue;
      there.cost = cost;
      there.total = cost + estimate(next);
      there.came_by = static_cast<std::uint8_t>(way);
      open(to);
    }
  }
  return state_;
}

std::uint32_t AgentPlanner::cost() const noexcept { return end_cost_; }

std::size_t AgentPlanner::path(const WalkGrid& grid, std::span<CellCoord> out) const noexcept {
  const auto back = [&](CellCoord c) {
    const CellCoord way = kWays[nodes_[WalkGrid::index_of(c)].came_by];
    return CellCoord{c.i - way.i, c.j - way.j};
  };
  if (!grid.contains(end_)) return 0;
  std::size_t length = 1;
  for (CellCoord c = end_; !(c == start_) && length <= kWalkCells; c = back(c)) ++length;
  CellCoord c = end_;
  for (std::size_t at = length; at-- > 0; c = back(c))
    if (at < out.size()) out[at] = c;
  return std::min(length, out.size());
}

}  // namespace tactus::interact
