// What every lock-free type must show.
#pragma once

#include <gtest/gtest.h>

#include <iostream>

#include "tests/rt/interleave.hpp"

namespace tactus::test {

/// All schedules of the scenario run and none fails.
template <typename Scenario>
void expect_holds_in_every_interleaving() {
  if (!kCanExplore) GTEST_SKIP() << "explored in builds without ThreadSanitizer";
  const Explorer::Outcome outcome = Explorer().explore<Scenario>();
  EXPECT_EQ(outcome.failure, "");
  EXPECT_TRUE(outcome.is_complete) << "stopped after " << outcome.schedules_count << " schedules";
  EXPECT_GT(outcome.schedules_count, 1U);
  testing::Test::RecordProperty("schedules", static_cast<int>(outcome.schedules_count));
  std::cout << "explored all " << outcome.schedules_count << " inequivalent schedules (and cut "
            << outcome.pruned_count << " equivalent ones)\n";
}

/// With all memory orders taken away some schedule fails: the exploration would notice an order that is too
/// weak.
template <typename Scenario>
void expect_fails_without_memory_orders() {
  if (!kCanExplore) GTEST_SKIP() << "explored in builds without ThreadSanitizer";
  const Explorer::Outcome outcome = Explorer(true).explore<Scenario>();
  EXPECT_NE(outcome.failure, "") << "in " << outcome.schedules_count << " schedules";
}

}  // namespace tactus::test
