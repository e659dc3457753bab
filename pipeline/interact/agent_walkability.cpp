#include "pipeline/interact/agent_walkability.hpp"

namespace tactus::interact {
namespace {

constexpr bool is_in_order() {
  for (std::size_t i = 0; i < kWalkability.size(); ++i)
    if (kWalkability[i].material != kMaterialNames[i] || kWalkability[i].cost < 1) return false;
  return true;
}
// Below 1 the planner's estimate of the way left would be too long and its paths no longer the cheapest.
static_assert(is_in_order());

constexpr std::uint16_t in_units(double cost) { return static_cast<std::uint16_t>(cost * kCostUnit + 0.5); }

}  // namespace

GroundCost ground_cost(const MaterialDistribution& posterior, MaterialId best) noexcept {
  if (best == kUnknownMaterial) return {in_units(kUnlabelledCost), 0};
  double cost = 0;
  float avoided_share = 0;
  for (std::size_t m = 0; m < kWalkability.size(); ++m) {
    cost += static_cast<double>(posterior[m]) * kWalkability[m].cost;
    if (kWalkability[m].is_avoided) avoided_share += posterior[m];
  }
  if (avoided_share > kAvoidedShareMax) return {0, avoided_share};
  return {cost > 1 ? in_units(cost) : kCostUnit, avoided_share};
}

}  // namespace tactus::interact
