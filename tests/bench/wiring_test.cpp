// The wiring table against the stages it names and against the edges that the pipeline has.
#include "firmware_host/wiring.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <map>
#include <regex>
#include <set>
#include <string>

#include "pipeline/wiring.hpp"

namespace tactus {
namespace {

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

TEST(Wiring, EveryStageRunsOnAThreadOfTheTableAndIsOnAnEdge) {
  for (const StageBudget& budget : kBudgets) {
    int threads_count = 0, edges_count = 0;
    for (const WiringThread& thread : kWiringThreads)
      threads_count += std::string(thread.name) == budget.thread;
    for (const WiringEdge& edge : kWiringEdges)
      edges_count += edge.from == budget.stage || edge.to == budget.stage;
    EXPECT_EQ(threads_count, 1) << budget.name;
    EXPECT_GE(edges_count, 1) << budget.name;
  }
}

TEST(Wiring, AnEdgeBetweenThreadsIsNoCallAndACallStaysOnItsThread) {
  for (const WiringEdge& edge : kWiringEdges) {
    if (!edge.from || !edge.to) continue;
    const bool is_same_thread =
        std::string(budget_of(*edge.from).thread) == std::string(budget_of(*edge.to).thread);
    EXPECT_EQ(std::string(edge.type) == "call", is_same_thread)
        << budget_of(*edge.from).name << " -> " << budget_of(*edge.to).name;
  }
}

TEST(Wiring, RingsAreThoseOfThePipelineWithTheirDepths) {
  std::ifstream in(TACTUS_SOURCE_DIR "/pipeline/pipeline.hpp");
  const std::string source(std::istreambuf_iterator<char>(in), {});
  const std::map<std::string, std::size_t> depths = {{"1", 1},
                                                     {"kFramesWaiting", kFramesWaiting},
                                                     {"kKeyframeSlots", kKeyframeSlots},
                                                     {"kRefinedBlocksWaiting", kRefinedBlocksWaiting},
                                                     {"kPinsWaiting", kPinsWaiting},
                                                     {"kCuesWaiting", kCuesWaiting}};
  using Ring = std::pair<std::string, std::size_t>;
  std::multiset<Ring> in_pipeline, in_table;
  const std::regex ring(R"(using \w+ = rt::(DropOldestRing|SpscRing|Mailbox)<[\w:]+, (\w+)>;)");
  for (std::sregex_iterator at(source.begin(), source.end(), ring), end; at != end; ++at) {
    const auto depth = depths.find((*at)[2]);
    ASSERT_NE(depth, depths.end()) << (*at)[0] << ": a depth that this test does not know";
    in_pipeline.emplace((*at)[1], depth->second);
  }
  for (const WiringEdge& edge : kWiringEdges)
    if (edge.depth > 0) in_table.emplace(edge.type, edge.depth);
  EXPECT_FALSE(in_pipeline.empty());
  EXPECT_EQ(in_pipeline, in_table);
}

TEST(WiringText, NamesEveryThreadStageAndEdge) {
  const auto text = firmware::wiring({});
  ASSERT_TRUE(text);
  for (const WiringThread& thread : kWiringThreads) EXPECT_TRUE(contains(*text, thread.name)) << thread.name;
  for (const StageBudget& budget : kBudgets)
    EXPECT_TRUE(contains(*text, std::string("    ") + budget.name)) << budget.name;
  for (const WiringEdge& edge : kWiringEdges)
    EXPECT_TRUE(contains(*text, edge.carries) && contains(*text, edge.when_full)) << edge.carries;
}

TEST(WiringDot, HasANodePerStageAndAnArrowPerEdge) {
  firmware::WiringOptions options;
  options.is_dot = true;
  const auto text = firmware::wiring(options);
  ASSERT_TRUE(text);
  EXPECT_TRUE(text->starts_with("digraph tactus {"));
  EXPECT_EQ(std::count(text->begin(), text->end(), '{'), std::count(text->begin(), text->end(), '}'));
  EXPECT_EQ(std::count(text->begin(), text->end(), '"') % 2, 0);
  std::size_t arrows_count = 0;
  for (std::size_t at = 0; (at = text->find(" -> ", at)) != std::string::npos; ++at) ++arrows_count;
  EXPECT_EQ(arrows_count, kWiringEdges.size());
  for (const StageBudget& budget : kBudgets)
    EXPECT_TRUE(contains(*text, "    \"" + std::string(budget.name) + "\";\n")) << budget.name;
}

}  // namespace
}  // namespace tactus
