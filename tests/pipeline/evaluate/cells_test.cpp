#include "pipeline/evaluate/cells.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <random>
#include <set>
#include <string>
#include <vector>

namespace tactus::evaluate {
namespace {

TEST(CellIndex, FindsEveryCellAndNoOther) {
  const std::vector<Vec3<int>> at = {{0, 0, 0}, {-1, 0, 0}, {0, -1, 5}, {1000, -2000, 3000}};
  const CellIndex sut(at);
  for (std::size_t i = 0; i < at.size(); ++i) EXPECT_EQ(sut.find(at[i]), i);
  EXPECT_FALSE(sut.find({1, 0, 0}).has_value());
  EXPECT_FALSE(sut.find({0, -1, 4}).has_value());
}

TEST(CellIndex, NeighboursAndBoundariesEqualLookingAtEveryPair) {
  const unsigned seed = std::random_device{}();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  std::set<std::array<int, 3>> drawn;
  while (drawn.size() < 250)
    drawn.insert({static_cast<int>(random() % 9) - 4, static_cast<int>(random() % 9) - 4,
                  static_cast<int>(random() % 9) - 4});
  std::vector<Vec3<int>> at;
  for (const auto& c : drawn) at.push_back({c[0], c[1], c[2]});
  std::shuffle(at.begin(), at.end(), random);
  std::vector<MaterialId> truth;
  for (std::size_t i = 0; i < at.size(); ++i)
    truth.push_back(random() % 4 == 0 ? kUnknownMaterial : static_cast<MaterialId>(at[i].x > 0));
  const CellIndex sut(at);
  std::vector<std::uint8_t> band(at.size());
  mark_boundary_cells(sut, truth, 2, band);
  for (std::size_t i = 0; i < at.size(); ++i) {
    std::set<std::size_t> near, expected;
    bool is_boundary = false;
    sut.for_each_within(i, 2, [&](std::size_t j) { near.insert(j); });
    for (std::size_t j = 0; j < at.size(); ++j) {
      const Vec3<int> d{at[i].x - at[j].x, at[i].y - at[j].y, at[i].z - at[j].z};
      if (i == j || d.x * d.x + d.y * d.y + d.z * d.z > 2) continue;
      expected.insert(j);
      is_boundary |= truth[i] != kUnknownMaterial && truth[j] != kUnknownMaterial && truth[i] != truth[j];
    }
    EXPECT_EQ(near, expected) << i;
    EXPECT_EQ(band[i], is_boundary ? 1 : 0) << i;
  }
}

}  // namespace
}  // namespace tactus::evaluate
