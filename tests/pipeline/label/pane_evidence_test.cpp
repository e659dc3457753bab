#include "pipeline/label/pane_evidence.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

namespace tactus::label {
namespace {

using Bytes = std::array<std::uint8_t, kMaterialCount>;

Bytes said(MaterialId most, std::uint8_t by) {
  Bytes bytes{};
  bytes.fill(static_cast<std::uint8_t>((255 - by) / (kMaterialCount - 1)));
  bytes[most] = by;
  return bytes;
}
MaterialId id(std::string_view name) { return material_from_name(name); }

LabelWord after(const Bytes& bytes, int keyframes) {
  LabelWord word = 0;
  for (int i = 0; i < keyframes; ++i) {
    ObservationCosts costs = costs_of(bytes);
    add_pane_evidence(costs);
    word = fuse(word, costs);
  }
  return word;
}

TEST(PaneEvidence, CostsAreTheNegativeLogarithmsOfTheTable) {
  for (std::size_t m = 0; m < kMaterialCount; ++m) {
    ASSERT_GT(kNothingMeasured[m], 0);
    ASSERT_LE(kNothingMeasured[m], 1);
    EXPECT_NEAR(kPaneCosts.cost[m], -32 * std::log(kNothingMeasured[m]), 0.51) << kMaterialNames[m];
  }
}

TEST(PaneEvidence, IsBayesRuleWhereTheNetworkJudgesTheSurfaceItself) {
  // Metal against painted wall, neither a pane: the odds are the network's times the table's.
  Bytes bytes{};
  bytes[id("metal")] = 100;
  bytes[id("painted")] = 155;
  ObservationCosts costs = costs_of(bytes);
  add_pane_evidence(costs);
  const double odds = std::exp((costs.cost[id("painted")] - costs.cost[id("metal")]) / 32.0);
  EXPECT_NEAR(odds, 100.0 / 155 * kNothingMeasured[id("metal")] / kNothingMeasured[id("painted")], 0.1);
}

TEST(PaneEvidence, AMirrorThatShowsAWardrobeIsAMirror) {
  EXPECT_EQ(best(after(said(id("wood"), 220), 1)), id("mirror"));
  EXPECT_EQ(best(after(said(id("wood"), 220), 10)), id("mirror"));
}

TEST(PaneEvidence, APaneThatTheNetworkKnowsIsGlass) {
  EXPECT_EQ(best(after(said(id("glass"), 200), 3)), id("glass"));
  EXPECT_EQ(best(after(said(id("mirror"), 200), 3)), id("mirror"));
}

TEST(PaneEvidence, CostsStayWithinWhatFuseTakes) {
  Bytes bytes{};
  ObservationCosts costs = costs_of(bytes);
  add_pane_evidence(costs);
  for (const std::uint16_t cost : costs.cost) EXPECT_LE(cost, kObservationCostMax);
}

}  // namespace
}  // namespace tactus::label
