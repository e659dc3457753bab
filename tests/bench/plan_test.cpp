// `tactus plan`, called as the program calls it.
#include "firmware_host/plan.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace tactus::firmware {
namespace {

using nlohmann::json;

std::string plan_text(const PlanOptions& options) {
  const auto text = plan(options);
  EXPECT_TRUE(text) << (text ? "" : text.error().message);
  return text ? *text : std::string();
}

TEST(Plan, TotalsAreTheSumsOfTheRows) {
  PlanOptions options;
  options.is_json = true;
  const json sut = json::parse(plan_text(options));
  std::size_t sum = 0, network = 0;
  for (const json& row : sut["rows"]) {
    std::size_t count = 0;
    for (const json& holder : row["holders"]) count += holder["count"].get<std::size_t>();
    EXPECT_EQ(row["count"], count) << row["name"];
    EXPECT_GE(row["bytes"].get<std::size_t>(), count * row["bytes_each"].get<std::size_t>()) << row["name"];
    EXPECT_FALSE(row["why"].get<std::string>().empty()) << row["name"];
    sum += row["bytes"].get<std::size_t>();
    if (row["name"] == "network") network = row["bytes"];
  }
  EXPECT_EQ(sut["total_bytes"], sum);
  EXPECT_GT(network, 0u);
  EXPECT_EQ(sut["without_network_bytes"], sum - network);
}

TEST(Plan, TextNamesEveryRowAndBothTotals) {
  PlanOptions options;
  const std::string text = plan_text(options);
  for (const char* part :
       {"\nmap ", "\nspine ", "\nframes ", "\nkeyframes ", "\nnetwork ", "\ncontact ", "\nrender ",
        "\npicture ", "\ntrace ", "waiting for spine 2", "without the network", "Profile x86 at 640x480"})
    EXPECT_NE(text.find(part), std::string::npos) << part << "\n" << text;
  EXPECT_EQ(text.find('\0'), std::string::npos);
}

TEST(Plan, FollowsTheSourceTheProfileAndItsSettings) {
  const auto without_network = [](PlanOptions options) {
    options.is_json = true;
    return json::parse(plan_text(options))["without_network_bytes"].get<std::size_t>();
  };
  PlanOptions x86, small_source, headset, small_map;
  small_source.source = "synthetic:wall?mode=320x240";
  headset.profile = "headset";
  small_map.settings = {"map.blocks_capacity=4096"};
  EXPECT_LT(without_network(small_source), without_network(x86));
  EXPECT_LT(without_network(headset), without_network(x86));
  EXPECT_LT(without_network(small_map), without_network(x86));
}

TEST(Plan, OverTheLimitIsOneSentenceAndBudgetExceeded) {
  PlanOptions options;
  options.settings = {"memory.max_mib=20"};
  const auto sut = plan(options);
  ASSERT_FALSE(sut);
  EXPECT_EQ(sut.error().code, rt::ExitCode::budget_exceeded);
  EXPECT_NE(sut.error().message.find("20.000 MiB"), std::string::npos) << sut.error().message;
  EXPECT_EQ(sut.error().message.find('\n'), std::string::npos);
}

TEST(Plan, NonsenseIsBadUsage) {
  PlanOptions key, source;
  key.settings = {"map.cheese=1"};
  source.source = "synthetic:atlantis";
  for (const PlanOptions& options : {key, source}) {
    const auto sut = plan(options);
    ASSERT_FALSE(sut);
    EXPECT_EQ(sut.error().code, rt::ExitCode::bad_usage) << sut.error().message;
  }
}

}  // namespace
}  // namespace tactus::firmware
