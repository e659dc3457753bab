#include "firmware_host/trace.hpp"

#include <gtest/gtest.h>

#include <map>
#include <nlohmann/json.hpp>

#include "tests/support/temporary_folder.hpp"

namespace tactus::firmware {
namespace {

using nlohmann::json;
using Kind = TraceRecord::Kind;

class Trace : public ::testing::Test {
 protected:
  json written(const std::vector<TraceRecord>& records, const std::vector<std::string>& threads) {
    const auto result = write_trace(folder_.path() / "trace.json", records, threads);
    EXPECT_TRUE(result.has_value());
    return json::parse(folder_.read("trace.json"));
  }
  test::TemporaryFolder folder_;
};

TEST_F(Trace, SpansCountersAndInstantsAreAsTheFormatWants) {
  const std::int64_t start_ns = 1'763'820'000'123'456'789;  // a clock far from zero
  const json j = written({{Kind::span, "track", 1, start_ns + 2'345'678, 1'500'250, 0, 7},
                          {Kind::counter, "blocks", 0, start_ns, 0, 812, 0},
                          {Kind::instant, "lost", 1, start_ns + 4'000'000, 0, 0, 8}},
                         {"present", "spine"});
  std::map<std::string, std::vector<json>> by_phase;
  for (const json& e : j["traceEvents"]) {
    EXPECT_EQ(e["pid"], 1);
    by_phase[e["ph"]].push_back(e);
  }
  ASSERT_EQ(by_phase["X"].size(), 1u);
  const json& span = by_phase["X"][0];
  EXPECT_EQ(span["name"], "track");
  EXPECT_EQ(span["tid"], 2);
  EXPECT_DOUBLE_EQ(span["ts"], 2345.678);
  EXPECT_DOUBLE_EQ(span["dur"], 1500.250);
  EXPECT_EQ(span["args"]["frame"], 7);
  ASSERT_EQ(by_phase["C"].size(), 1u);
  EXPECT_DOUBLE_EQ(by_phase["C"][0]["ts"], 0);
  EXPECT_EQ(by_phase["C"][0]["args"]["value"], 812);
  ASSERT_EQ(by_phase["i"].size(), 1u);
  EXPECT_EQ(by_phase["i"][0]["s"], "t");
  std::map<int, std::string> names;
  for (const json& e : by_phase["M"])
    if (e["name"] == "thread_name") names[e["tid"]] = e["args"]["name"];
  EXPECT_EQ(names, (std::map<int, std::string>{{1, "present"}, {2, "spine"}}));
}

TEST_F(Trace, NamesAreQuotedAndWhatJsonCannotSayIsLeftOut) {
  const json j = written({{Kind::span, "a \"quoted\"\n\\ name", 0, 0, -5, 0, 0},
                          {Kind::counter, "nothing", 0, 0, 0, std::numeric_limits<double>::quiet_NaN(), 0}},
                         {"thread \"0\""});
  int spans = 0;
  for (const json& e : j["traceEvents"]) {
    EXPECT_NE(e["ph"], "C");
    if (e["ph"] != "X") continue;
    ++spans;
    EXPECT_EQ(e["name"], "a \"quoted\"\n\\ name");
    EXPECT_EQ(e["dur"], 0);
  }
  EXPECT_EQ(spans, 1);
}

TEST_F(Trace, EmptyTraceIsValid) { EXPECT_TRUE(written({}, {})["traceEvents"].is_array()); }

}  // namespace
}  // namespace tactus::firmware
