// Cells of a surface by their place in the grid: who lies beside whom, and which lie where two materials
// meet.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "hal/transform.hpp"
#include "pipeline/label/material.hpp"

namespace tactus::evaluate {

/// Finds cells by grid coordinates. Immutable once made; any thread.
class CellIndex {
 public:
  /// Coordinates within +-2^20 each, all different.
  explicit CellIndex(std::span<const Vec3<int>> cells);

  [[nodiscard]] std::size_t size() const { return cells_.size(); }
  [[nodiscard]] const Vec3<int>& cell(std::size_t i) const { return cells_[i]; }
  /// Place in the list given to the constructor.
  [[nodiscard]] std::optional<std::size_t> find(const Vec3<int>& cell) const;

  /// visit(j) for every other cell whose squared distance to cell i is at most distance2_max cells^2 (at most
  /// 2 cells along an axis: distance2_max < 9).
  template <typename Visit>
  void for_each_within(std::size_t i, int distance2_max, const Visit& visit) const {
    const Vec3<int> at = cells_[i];
    for (int dz = -2; dz <= 2; ++dz)
      for (int dy = -2; dy <= 2; ++dy)
        for (int dx = -2; dx <= 2; ++dx) {
          const int distance2 = dx * dx + dy * dy + dz * dz;
          if (distance2 == 0 || distance2 > distance2_max) continue;
          if (const auto j = find({at.x + dx, at.y + dy, at.z + dz})) visit(*j);
        }
  }

 private:
  std::vector<Vec3<int>> cells_;
  std::vector<std::pair<std::uint64_t, std::uint32_t>> places_;  // packed coordinates -> place, sorted
};

/// A byte per cell: 1 where a cell of another known truth lies within the distance, else 0. 3 voxels are 1.5
/// cells: squared, 2.
void mark_boundary_cells(const CellIndex& cells, std::span<const MaterialId> truth, int distance2_max,
                         std::span<std::uint8_t> band);

}  // namespace tactus::evaluate
