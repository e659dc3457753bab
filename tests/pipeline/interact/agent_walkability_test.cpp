#include "pipeline/interact/agent_walkability.hpp"

#include <gtest/gtest.h>

#include "tests/pipeline/interact/agent_room.hpp"

namespace tactus::interact {
namespace {

TEST(AgentWalkability, CertainMaterialCostsItsRowOrBlocks) {
  for (const Walkability& row : kWalkability) {
    const auto cost =
        ground_cost(test::only(std::string(row.material).c_str()), material_from_name(row.material));
    EXPECT_EQ(cost.cost == 0, row.is_avoided) << row.material;
    if (!row.is_avoided) {
      EXPECT_NEAR(cost.cost, row.cost * kCostUnit, 0.51) << row.material;
    }
    EXPECT_FALSE(row.why.empty()) << row.material;
  }
}

TEST(AgentWalkability, DoubtCostsItsExpectationUntilAvoidedIsTheLikelier) {
  EXPECT_NEAR(ground_cost(test::mixed("carpet", 0.6F, "water"), 1).cost, 4.6 * kCostUnit, 0.51);
  EXPECT_NEAR(ground_cost(test::mixed("wood", 0.75F, "fabric"), 1).cost, 1.25 * kCostUnit, 0.51);
  EXPECT_GT(ground_cost(test::mixed("wood", 0.51F, "glass"), 1).cost, 0);
  EXPECT_EQ(ground_cost(test::mixed("wood", 0.49F, "glass"), 1).cost, 0);
  EXPECT_EQ(ground_cost({}, kUnknownMaterial).cost, 24);
}

}  // namespace
}  // namespace tactus::interact
