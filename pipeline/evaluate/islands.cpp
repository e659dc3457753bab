#include "pipeline/evaluate/islands.hpp"

#include <cstddef>
#include <vector>

#include "rt/assert.hpp"

namespace tactus::evaluate {
namespace {

/// `neighbours(i, visit)` calls visit(j) for every neighbour j of member i.
template <typename Neighbours>
IslandCount count_islands(std::span<const MaterialId> predicted, std::span<const MaterialId> truth,
                          std::size_t members_max, const Neighbours& neighbours) {
  IslandCount count;
  std::vector<bool> is_seen(predicted.size());
  std::vector<std::size_t> to_visit;
  for (std::size_t start = 0; start < predicted.size(); ++start) {
    const MaterialId label = predicted[start];
    if (is_seen[start] || label >= kMaterialCount) continue;
    std::size_t members_count = 0;
    bool has_truth = false, has_right = false;
    is_seen[start] = true;
    to_visit.push_back(start);
    while (!to_visit.empty()) {
      const std::size_t i = to_visit.back();
      to_visit.pop_back();
      ++members_count;
      has_truth |= truth[i] < kMaterialCount;
      has_right |= truth[i] == label;
      neighbours(i, [&](std::size_t j) {
        if (is_seen[j] || predicted[j] != label) return;
        is_seen[j] = true;
        to_visit.push_back(j);
      });
    }
    if (members_count < members_max && has_truth && !has_right) count.add({1, members_count});
  }
  return count;
}

}  // namespace

IslandCount wrong_islands(std::span<const MaterialId> predicted, std::span<const MaterialId> truth, int width,
                          int height, std::size_t members_max) {
  const auto columns = static_cast<std::size_t>(width), rows = static_cast<std::size_t>(height);
  TACTUS_ASSERT(predicted.size() == columns * rows && truth.size() == predicted.size());
  return count_islands(predicted, truth, members_max, [&](std::size_t i, const auto& visit) {
    if (i % columns > 0) visit(i - 1);
    if (i % columns + 1 < columns) visit(i + 1);
    if (i >= columns) visit(i - columns);
    if (i + columns < predicted.size()) visit(i + columns);
  });
}

IslandCount wrong_islands(const CellIndex& cells, std::span<const MaterialId> predicted,
                          std::span<const MaterialId> truth, std::size_t members_max) {
  TACTUS_ASSERT(predicted.size() == cells.size() && truth.size() == cells.size());
  return count_islands(predicted, truth, members_max,
                       [&](std::size_t i, const auto& visit) { cells.for_each_within(i, 3, visit); });
}

}  // namespace tactus::evaluate
