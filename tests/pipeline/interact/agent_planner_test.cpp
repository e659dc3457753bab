// A* against Dijkstra without a heap, over random terrain.
#include "pipeline/interact/agent_planner.hpp"

#include <gtest/gtest.h>

#include <array>
#include <limits>
#include <memory>
#include <random>
#include <vector>

#include "pipeline/interact/agent_grid.hpp"
#include "tests/pipeline/interact/agent_room.hpp"

namespace tactus::interact {
namespace {

constexpr int kSide = kWalkGridSide;

/// A height and a material for each cell of one window; nothing above ground.
struct Terrain {
  struct Ground {
    bool is_there = false;
    double height_m = 0;
    MaterialDistribution materials{};
  };
  std::vector<Ground> cells = std::vector<Ground>(kWalkCells);

  static bool contains(CellCoord c) { return c.i >= 0 && c.j >= 0 && c.i < kSide && c.j < kSide; }
  Ground& at(CellCoord c) { return cells[static_cast<std::size_t>(c.i + kSide * c.j)]; }
  [[nodiscard]] const Ground& at(CellCoord c) const {
    return cells[static_cast<std::size_t>(c.i + kSide * c.j)];
  }

  [[nodiscard]] contact::DistanceField scene() const {
    contact::DistanceField scene;
    scene.context = this;
    scene.raycast_fn = [](const void* self, const Vec3f& origin, const Vec3f& direction, float range_m,
                          map::SurfacePoint& out) noexcept {
      if (direction.y > -0.5F) return false;
      const CellCoord c = cell_at(static_cast<double>(origin.x), static_cast<double>(origin.z));
      if (!contains(c)) return false;
      const Ground& ground = static_cast<const Terrain*>(self)->at(c);
      const double down_m = static_cast<double>(origin.y) - ground.height_m;
      if (!ground.is_there || down_m < 0 || down_m > static_cast<double>(range_m)) return false;
      out.position_world_m = {origin.x, static_cast<float>(ground.height_m), origin.z};
      out.normal_world = {0, 1, 0};
      out.materials = ground.materials;
      out.material = 0;  // labelled
      return true;
    };
    scene.sample_fn = [](const void*, const Vec3f&, map::DistanceSample&) noexcept { return false; };
    return scene;
  }
};

/// Ground of three levels a step of 2 cm apart, holes, and puddles of doubt.
Terrain random_terrain(unsigned seed) {
  std::mt19937 random(seed);
  const auto below = [&random](unsigned n) { return static_cast<int>(random() % n); };
  Terrain terrain;
  for (auto& ground : terrain.cells) {
    ground.is_there = below(100) >= 8;
    ground.materials = test::only(below(3) == 0 ? "tile" : "carpet");
  }
  for (int rectangle = 0; rectangle < 30; ++rectangle) {
    const CellCoord low{below(kSide), below(kSide)};
    const int width = 2 + below(20), depth = 2 + below(20), kind = below(4);
    const float share = static_cast<float>(below(10)) / 10;
    for (int j = low.j; j < std::min(low.j + depth, kSide); ++j)
      for (int i = low.i; i < std::min(low.i + width, kSide); ++i) {
        Terrain::Ground& ground = terrain.at({i, j});
        if (kind == 0) ground.is_there = false;
        if (kind == 1) ground.height_m = 0.02;
        if (kind == 2) ground.height_m = ground.height_m > 0 ? 0.04 : 0;
        if (kind == 3) ground.materials = test::mixed("wood", share, "water");
      }
  }
  for (int j = -3; j <= 3; ++j)
    for (int i = -3; i <= 3; ++i)
      terrain.at({kSide / 2 + i, kSide / 2 + j}) = {true, 0, test::only("carpet")};
  return terrain;
}

/// Costs from `start` to all cells, by the definition alone. Infinite where there is no way.
std::vector<std::uint32_t> dijkstra(const Terrain& terrain, CellCoord start) {
  const auto cost_at = [&](CellCoord c) -> std::uint32_t {
    if (!Terrain::contains(c) || !terrain.at(c).is_there) return 0;
    return ground_cost(terrain.at(c).materials, 0).cost;
  };
  const auto connects = [&](CellCoord a, CellCoord b) {
    const double rise_m = static_cast<double>(static_cast<float>(terrain.at(a).height_m)) -
                          static_cast<double>(static_cast<float>(terrain.at(b).height_m));
    return cost_at(b) > 0 && std::abs(rise_m) <= 0.03;
  };
  constexpr auto kNever = std::numeric_limits<std::uint32_t>::max();
  std::vector<std::uint32_t> cost(kWalkCells, kNever);
  std::vector<bool> is_done(kWalkCells, false);
  const auto index = [](CellCoord c) { return static_cast<std::size_t>(c.i + kSide * c.j); };
  std::vector<CellCoord> reached{start};
  cost[index(start)] = 0;
  while (!reached.empty()) {
    std::size_t best = 0;
    for (std::size_t n = 1; n < reached.size(); ++n)
      if (cost[index(reached[n])] < cost[index(reached[best])]) best = n;
    const CellCoord c = reached[best];
    reached[best] = reached.back();
    reached.pop_back();
    is_done[index(c)] = true;
    for (int dj = -1; dj <= 1; ++dj)
      for (int di = -1; di <= 1; ++di) {
        const CellCoord to{c.i + di, c.j + dj};
        if ((di == 0 && dj == 0) || !Terrain::contains(to) || is_done[index(to)] || !connects(c, to))
          continue;
        if (di != 0 && dj != 0) {
          const CellCoord a{c.i + di, c.j}, b{c.i, c.j + dj};
          if (!connects(c, a) || !connects(c, b) || !connects(a, to) || !connects(b, to)) continue;
        }
        const std::uint32_t length = di != 0 && dj != 0 ? kAcross : kStraight;
        const std::uint32_t way = cost[index(c)] + length * (cost_at(c) + cost_at(to));
        if (cost[index(to)] == kNever) reached.push_back(to);
        cost[index(to)] = std::min(cost[index(to)], way);
      }
  }
  return cost;
}

struct Bound {
  explicit Bound(const contact::DistanceField& scene)
      : bytes(WalkGrid::bytes_needed() + AgentPlanner::bytes_needed()),
        memory(static_cast<std::byte*>(::operator new (bytes, std::align_val_t{64}))) {
    rt::Slice slice(std::span(memory.get(), bytes));
    grid.bind(slice, scene, {}, {});
    planner.bind(slice);
  }
  struct Free {
    void operator()(std::byte* p) const { ::operator delete (p, std::align_val_t{64}); }
  };
  std::size_t bytes;
  std::unique_ptr<std::byte, Free> memory;
  WalkGrid grid;
  AgentPlanner planner;
};

TEST(AgentPlanner, CostsOnRandomTerrainAreDijkstras) {
  constexpr CellCoord kStart{kSide / 2, kSide / 2};
  constexpr auto kNever = std::numeric_limits<std::uint32_t>::max();
  int found_in_all = 0;
  for (unsigned seed = 1; seed <= 12; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    const Terrain terrain = random_terrain(seed);
    Bound sut(terrain.scene());
    sut.grid.start(kStart, 0);
    for (int i = 0; i < 400; ++i) sut.grid.fill({}, 400);
    const auto truth = dijkstra(terrain, kStart);
    for (std::size_t n = 0; n < kWalkCells; ++n) {
      const CellCoord c{static_cast<int>(n) % kSide, static_cast<int>(n) / kSide};
      ASSERT_EQ(sut.grid.is_free(c), truth[n] != kNever) << c.i << " " << c.j;
    }
    std::mt19937 random(seed + 100);
    int found = 0;
    for (int goals = 0; goals < 25; ++goals) {
      const CellCoord goal{static_cast<int>(random() % kSide), static_cast<int>(random() % kSide)};
      sut.planner.begin(sut.grid, kStart, goal);
      while (sut.planner.step(sut.grid, 37) == PlanState::searching) {
      }
      const std::uint32_t expected = truth[static_cast<std::size_t>(goal.i + kSide * goal.j)];
      if (expected == kNever) {
        EXPECT_EQ(sut.planner.state(), PlanState::exhausted);
        // It ends at the reached cell nearest to the goal.
        const auto d2 = [&](CellCoord c) {
          return (c.i - goal.i) * (c.i - goal.i) + (c.j - goal.j) * (c.j - goal.j);
        };
        int nearest = std::numeric_limits<int>::max();
        for (std::size_t n = 0; n < kWalkCells; ++n)
          if (truth[n] != kNever)
            nearest = std::min(nearest, d2({static_cast<int>(n) % kSide, static_cast<int>(n) / kSide}));
        EXPECT_EQ(d2(sut.planner.end()), nearest);
        continue;
      }
      ++found;
      ASSERT_EQ(sut.planner.state(), PlanState::found);
      EXPECT_EQ(sut.planner.cost(), expected);
      std::vector<CellCoord> path(4096);
      path.resize(sut.planner.path(sut.grid, path));
      ASSERT_FALSE(path.empty());
      EXPECT_EQ(path.front(), kStart);
      EXPECT_EQ(path.back(), goal);
      std::uint32_t along = 0;
      for (std::size_t k = 1; k < path.size(); ++k) {
        const CellCoord a = path[k - 1], b = path[k];
        ASSERT_TRUE(sut.grid.is_passable(a, b));
        ASSERT_LE(std::max(std::abs(a.i - b.i), std::abs(a.j - b.j)), 1);
        along += (a.i != b.i && a.j != b.j ? kAcross : kStraight) *
                 (std::uint32_t{sut.grid.at(a).cost} + sut.grid.at(b).cost);
      }
      EXPECT_EQ(along, expected);
    }
    found_in_all += found;
  }
  EXPECT_GT(found_in_all, 100);
}

TEST(AgentPlanner, LongPathIsCutAtItsBeginning) {
  Terrain terrain;
  for (auto& ground : terrain.cells) ground = {true, 0, test::only("wood")};
  Bound sut(terrain.scene());
  sut.grid.start({kSide / 2, kSide / 2}, 0);
  for (int i = 0; i < 60; ++i) sut.grid.fill({}, 400);
  sut.planner.begin(sut.grid, {10, 10}, {60, 10});
  while (sut.planner.step(sut.grid, 500) == PlanState::searching) {
  }
  std::array<CellCoord, 8> path;
  ASSERT_EQ(sut.planner.path(sut.grid, path), path.size());
  for (std::size_t k = 0; k < path.size(); ++k) EXPECT_EQ(path[k], (CellCoord{10 + static_cast<int>(k), 10}));
  EXPECT_EQ(sut.planner.cost(), 50U * 2 * kStraight * kCostUnit);
}

}  // namespace
}  // namespace tactus::interact
