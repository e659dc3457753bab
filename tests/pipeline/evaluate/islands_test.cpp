#include "pipeline/evaluate/islands.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <random>
#include <set>
#include <string>
#include <vector>

namespace tactus::evaluate {
namespace {

constexpr MaterialId kWood = 22, kFabric = 3, kUnknown = kUnknownMaterial;

TEST(Islands, HandCountedImage) {
  // w: wood, f: fabric, ' ': unknown. The truth is wood but for the last two columns, fabric.
  const std::vector<std::string> drawn = {"wwwwwwff",   //
                                          "wffwwfff",   // 2 x 2 island; a leak of one pixel into wood: none
                                          "wffwwwff",   //
                                          "wwwf  wf",   // one pixel; unknown is none; wood leaks: none
                                          "fwwwwwff"};  // one pixel in the corner
  std::vector<MaterialId> predicted, truth;
  for (const std::string& row : drawn)
    for (std::size_t x = 0; x < row.size(); ++x) {
      predicted.push_back(row[x] == 'w' ? kWood : row[x] == 'f' ? kFabric : kUnknown);
      truth.push_back(x < 6 ? kWood : kFabric);
    }
  const IslandCount all = wrong_islands(predicted, truth, 8, 5);
  // The wood at (6, 3) touches wood at (5, 4)? No: diagonal. Its 4-neighbours are unknown and fabric: an
  // island.
  EXPECT_EQ(all.islands_count, 4u);
  EXPECT_EQ(all.members_count, 4u + 1 + 1 + 1);
  EXPECT_EQ(wrong_islands(predicted, truth, 8, 5, 4).islands_count, 3u) << "the square is no longer small";
}

TEST(Islands, WithoutAnyTruthThereIsNoWrong) {
  const std::vector<MaterialId> predicted = {kWood, kFabric, kWood}, truth(3, kUnknown);
  EXPECT_EQ(wrong_islands(predicted, truth, 3, 1).islands_count, 0u);
}

TEST(Islands, EqualsRecursiveFloodFill) {
  const unsigned seed = std::random_device{}();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  constexpr int kWidth = 31, kHeight = 17;
  for (int round = 0; round < 20; ++round) {
    std::vector<MaterialId> predicted(kWidth * kHeight), truth(predicted.size());
    for (std::size_t i = 0; i < predicted.size(); ++i) {
      predicted[i] = random() % 10 == 0 ? kUnknown : static_cast<MaterialId>(random() % 2);
      truth[i] = random() % 5 == 0 ? kUnknown : static_cast<MaterialId>(random() % 8 == 0);
    }
    IslandCount expected;
    std::set<int> seen;
    for (int start = 0; start < kWidth * kHeight; ++start) {
      std::set<int> patch;
      const std::function<void(int, int)> fill = [&](int x, int y) {
        const int p = y * kWidth + x;
        if (x < 0 || y < 0 || x >= kWidth || y >= kHeight || patch.contains(p) || seen.contains(p) ||
            predicted[static_cast<std::size_t>(p)] != predicted[static_cast<std::size_t>(start)])
          return;
        patch.insert(p);
        fill(x - 1, y);
        fill(x + 1, y);
        fill(x, y - 1);
        fill(x, y + 1);
      };
      if (predicted[static_cast<std::size_t>(start)] == kUnknown || seen.contains(start)) continue;
      fill(start % kWidth, start / kWidth);
      bool is_wrong = false, is_right = false;
      for (const int p : patch) {
        const auto i = static_cast<std::size_t>(p);
        is_right |= truth[i] == predicted[i];
        is_wrong |= truth[i] != kUnknown && truth[i] != predicted[i];
      }
      if (patch.size() < 6 && is_wrong && !is_right) {
        ++expected.islands_count;
        expected.members_count += patch.size();
      }
      seen.insert(patch.begin(), patch.end());
    }
    const IslandCount sut = wrong_islands(predicted, truth, kWidth, kHeight, 6);
    EXPECT_EQ(sut.islands_count, expected.islands_count);
    EXPECT_EQ(sut.members_count, expected.members_count);
  }
}

TEST(Islands, CellsThatTouchAtACornerAreOnePatch) {
  const std::vector<Vec3<int>> at = {{0, 0, 0}, {1, 1, 1}, {2, 2, 2}, {5, 5, 5}, {-3, -4, -5}};
  const CellIndex cells(at);
  const std::vector<MaterialId> predicted(5, kFabric);
  const std::vector<MaterialId> truth = {kUnknown, kWood, kUnknown, kWood, kFabric};
  const IslandCount sut = wrong_islands(cells, predicted, truth);
  EXPECT_EQ(sut.islands_count, 2u) << "the diagonal of three and the one apart; the fifth is right";
  EXPECT_EQ(sut.members_count, 4u);
}

}  // namespace
}  // namespace tactus::evaluate
