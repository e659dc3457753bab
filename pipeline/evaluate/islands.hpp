// Small wrong islands: patches of a wrong label with nothing right in them, which the paper's CRF claims to
// remove.
#pragma once

#include <cstdint>
#include <span>

#include "pipeline/evaluate/cells.hpp"
#include "pipeline/label/material.hpp"

namespace tactus::evaluate {

/// Members of a patch from which on it is no small island (NEEDS S31: 50).
inline constexpr std::size_t kIslandMembersMax = 50;

struct IslandCount {
  std::uint64_t islands_count = 0;
  std::uint64_t members_count = 0;  // pixels or cells in them
  void add(const IslandCount& other) {
    islands_count += other.islands_count;
    members_count += other.members_count;
  }
};

/// An island is a connected patch of one predicted label, of fewer than `members_max` members, in which no
/// member is right and at least one has a known truth. A rim of a larger patch that leaks over a boundary is
/// none, since the patch goes on where it is right. A prediction of unknown is no label.
///
/// Pixels, 4-connected.
IslandCount wrong_islands(std::span<const MaterialId> predicted, std::span<const MaterialId> truth, int width,
                          int height, std::size_t members_max = kIslandMembersMax);
/// Cells of a surface, 26-connected: a slanted surface is one patch.
IslandCount wrong_islands(const CellIndex& cells, std::span<const MaterialId> predicted,
                          std::span<const MaterialId> truth, std::size_t members_max = kIslandMembersMax);

}  // namespace tactus::evaluate
