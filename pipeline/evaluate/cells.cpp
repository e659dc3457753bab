#include "pipeline/evaluate/cells.hpp"

#include <algorithm>

#include "rt/assert.hpp"

namespace tactus::evaluate {
namespace {

constexpr int kBias = 1 << 20;

std::uint64_t packed(const Vec3<int>& c) {
  return static_cast<std::uint64_t>(c.x + kBias) | static_cast<std::uint64_t>(c.y + kBias) << 21 |
         static_cast<std::uint64_t>(c.z + kBias) << 42;
}

}  // namespace

CellIndex::CellIndex(std::span<const Vec3<int>> cells) : cells_(cells.begin(), cells.end()) {
  places_.reserve(cells_.size());
  for (std::size_t i = 0; i < cells_.size(); ++i) {
    const Vec3<int>& c = cells_[i];
    TACTUS_ASSERT(c.x > -kBias + 2 && c.x < kBias - 2 && c.y > -kBias + 2 && c.y < kBias - 2 &&
                  c.z > -kBias + 2 && c.z < kBias - 2);
    places_.emplace_back(packed(c), static_cast<std::uint32_t>(i));
  }
  std::sort(places_.begin(), places_.end());
}

std::optional<std::size_t> CellIndex::find(const Vec3<int>& cell) const {
  const std::uint64_t key = packed(cell);
  const auto found = std::lower_bound(places_.begin(), places_.end(), key,
                                      [](const auto& place, std::uint64_t k) { return place.first < k; });
  if (found == places_.end() || found->first != key) return std::nullopt;
  return found->second;
}

void mark_boundary_cells(const CellIndex& cells, std::span<const MaterialId> truth, int distance2_max,
                         std::span<std::uint8_t> band) {
  TACTUS_ASSERT(truth.size() == cells.size() && band.size() == cells.size() && distance2_max < 9);
  for (std::size_t i = 0; i < cells.size(); ++i) {
    bool is_near = false;
    if (truth[i] < kMaterialCount)
      cells.for_each_within(i, distance2_max, [&](std::size_t j) {
        is_near |= truth[j] < kMaterialCount && truth[j] != truth[i];
      });
    band[i] = is_near ? 1 : 0;
  }
}

}  // namespace tactus::evaluate
