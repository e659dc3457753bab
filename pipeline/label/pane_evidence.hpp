// What it says of a flat piece of wall or furniture that the depth camera got nothing back from it
// (register/panes.hpp): evidence beside the network's, by the same rule, eq. (1).
#pragma once

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>

#include "pipeline/label/cost_tables.hpp"
#include "pipeline/label/label_cell.hpp"

namespace tactus::label {

/// P(nothing measured | material). Mirrors throw the projector's dots elsewhere, glass lets most of them through; polished
/// and dark surfaces lose them at some angles, the rest at none below 75 degrees. Estimated: no recording here has true
/// materials and a real camera's depth of one surface in numbers.
inline constexpr auto kNothingMeasured = [] {
  std::array<double, kMaterialCount> share{};
  share.fill(0.02);
  constexpr std::array<std::pair<std::string_view, double>, 6> kHigher = {
      {{"mirror", 0.9}, {"glass", 0.7}, {"water", 0.7}, {"metal", 0.1}, {"polishedstone", 0.1}, {"plastic", 0.1}}};
  for (const auto& [name, value] : kHigher) share[material_from_name(name)] = value;
  return share;
}();

/// The network judges what a mirror reflects and what stands behind a pane: that it names something else says no more
/// against mirror and glass than this probability.
inline constexpr double kSeenAsSomethingElse = 0.1;
inline constexpr std::array<MaterialId, 2> kPaneMaterials = {material_from_name("mirror"), material_from_name("glass")};

inline constexpr auto kPaneCosts = [] {
  ObservationCosts costs;
  for (std::size_t m = 0; m < kMaterialCount; ++m)
    costs.cost[m] = static_cast<std::uint16_t>(-ln_of(kNothingMeasured[m]) * kCostsPerNat + 0.5);
  return costs;
}();
inline constexpr auto kSeenAsSomethingElseCost =
    static_cast<std::uint16_t>(-ln_of(kSeenAsSomethingElse) * kCostsPerNat + 0.5);

/// To what the network said of a pane. Any phase, any thread; integers.
inline void add_pane_evidence(ObservationCosts& observation) noexcept {
  for (const MaterialId pane : kPaneMaterials)
    observation.cost[pane] = std::min(observation.cost[pane], kSeenAsSomethingElseCost);
  for (std::size_t m = 0; m < kMaterialCount; ++m)
    observation.cost[m] = static_cast<std::uint16_t>(observation.cost[m] + kPaneCosts.cost[m]);
}

}  // namespace tactus::label
