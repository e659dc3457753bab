// `tactus query`, called as the program calls it, on the map of a run.
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "firmware_host/query.hpp"
#include "firmware_host/run.hpp"
#include "tests/support/command_line.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tactus::firmware {
namespace {

using nlohmann::json;
using test::Outcome;

Outcome tactus(const std::vector<std::string>& words) {
  PipelineCommands commands;
  commands.run = run;
  commands.query = query;
  return test::call_tactus(words, commands);
}

json answer(std::vector<std::string> words) {
  words.insert(words.begin(), "query");
  words.push_back("--json");
  const Outcome o = tactus(words);
  EXPECT_EQ(o.code, 0) << o.err;
  return json::parse(o.out, nullptr, false);
}

void expect_failure(std::vector<std::string> words, int code, const std::string& part) {
  words.insert(words.begin(), "query");
  const Outcome o = tactus(words);
  EXPECT_EQ(o.code, code) << o.err;
  EXPECT_TRUE(o.err.starts_with("tactus: ")) << o.err;
  EXPECT_NE(o.err.find(part), std::string::npos) << o.err;
  EXPECT_EQ(o.err.find('\n'), o.err.size() - 1) << "one sentence, one line: " << o.err;
  EXPECT_EQ(o.out, "");
}

/// The folder of a run in front of the synthetic wall, made once.
const std::string& room() {
  static const test::TemporaryFolder folder;
  static const std::string path = [] {
    const Outcome o = tactus({"run", "synthetic:wall?mode=320x240&frames=14", "--runner", "lockstep", "--out",
                              (folder.path() / "room").string()});
    EXPECT_EQ(o.code, 0) << o.err;
    return (folder.path() / "room").string();
  }();
  return path;
}

const std::vector<std::string> kAhead = {"--ray", "0,0,0,0,0,-1"};

std::vector<std::string> ask(const std::string& map, std::vector<std::string> more, bool is_ahead = true) {
  more.insert(more.begin(), map);
  if (is_ahead) more.insert(more.end(), kAhead.begin(), kAhead.end());
  return more;
}

TEST(Query, RayAndPointOnItsSurfaceAgreeOnPlaceAndPosterior) {
  const json hit = answer(ask(room(), {}));
  const json& surface = hit["surface"];
  ASSERT_TRUE(surface.is_object());
  double sum = 0;
  for (const auto& [name, p] : surface["materials"].items()) sum += p.get<double>();
  EXPECT_NEAR(sum, 1, 1e-4);
  EXPECT_EQ(surface["materials"].size(), 23U);
  EXPECT_GT(surface["materials"][surface["material"].get<std::string>()], 0.5);
  EXPECT_GE(surface["observations"], 1);
  EXPECT_GT(surface["normal"][2], 0.9) << "towards the camera";
  EXPECT_NEAR(hit["distance_m"].get<double>(), -surface["position_m"][2].get<double>(), 1e-6);
  const auto at = std::to_string(surface["position_m"][0].get<double>()) + "," +
                  std::to_string(surface["position_m"][1].get<double>()) + "," +
                  std::to_string(surface["position_m"][2].get<double>() + 0.02);
  const json near = answer({room(), "--at", at});
  EXPECT_NEAR(near["distance_m"].get<double>(), 0.02, 0.003);
  EXPECT_EQ(near["surface"]["material"], surface["material"]);
}

TEST(Query, WholeMapIsCountedByMaterial) {
  const json whole = answer({room()});
  std::size_t cells = whole["unlabelled_cells"];
  for (const json& one : whole["materials"]) cells += one["cells"].get<std::size_t>();
  EXPECT_EQ(cells, whole["surface_cells"].get<std::size_t>());
  EXPECT_GT(cells, 1000U);
  EXPECT_EQ(whole["pinned_cells"], 0);
}

TEST(Query, SetPinsInANewFileAndUnsetGivesBack) {
  const test::TemporaryFolder folder;
  const std::string copy = (folder.path() / "corrected.tactus").string();
  const json set = answer(ask(room(), {"--set", "glass", "--within", "0.3", "--out", copy}));
  EXPECT_GT(set["changed_cells"], 300);
  EXPECT_FALSE(answer(ask(room(), {}))["surface"]["is_pinned"].get<bool>()) << "the first file stays";
  const json pinned = answer(ask(copy, {}));
  EXPECT_EQ(pinned["surface"]["material"], "glass");
  EXPECT_EQ(pinned["surface"]["materials"]["glass"], 1);
  EXPECT_TRUE(pinned["surface"]["is_pinned"].get<bool>());
  EXPECT_EQ(answer({copy})["pinned_cells"], set["changed_cells"]);
  const json unset = answer(ask(copy, {"--unset"}));
  EXPECT_EQ(unset["changed_cells"], set["changed_cells"]);
  EXPECT_EQ(unset["file"], copy);
  EXPECT_EQ(answer({copy})["pinned_cells"], 0);
  EXPECT_EQ(answer(ask(copy, {}))["surface"]["material"], answer(ask(room(), {}))["surface"]["material"]);
}

TEST(Query, NothingThereIsAnAnswerButNothingToCorrect) {
  const Outcome o = tactus({"query", room(), "--at", "0,50,0"});
  EXPECT_EQ(o.code, 0);
  EXPECT_EQ(o.out, "no surface within 4 cm of that place\n");
  EXPECT_TRUE(answer({room(), "--ray", "0,0,0,0,0,1"})["surface"].is_null());
  expect_failure({room(), "--at", "0,50,0", "--set", "glass"}, 2, "no surface within 4 cm");
  expect_failure(ask(room(), {"--unset"}), 2, "nothing is pinned");
}

TEST(Query, BadInputIsToldInOneSentence) {
  expect_failure({room(), "--at", "1,2"}, 2, "--at 1,2: it reads 3 numbers");
  expect_failure({room(), "--at", "1,2,3,4"}, 2, "3 numbers");
  expect_failure({room(), "--at", "1,2,nan"}, 2, "3 numbers");
  expect_failure({room(), "--at", ""}, 2, "3 numbers");
  expect_failure({room(), "--ray", "0,0,0,0,0,0"}, 2, "the direction");
  expect_failure({room(), "--set", "glass"}, 2, "need --at or --ray");
  expect_failure(ask(room(), {"--at", "0,0,0"}), 2, "only one of them");
  expect_failure(ask(room(), {"--set", "glass", "--unset"}), 2, "only one of them");
  expect_failure(ask(room(), {"--set", "gold"}), 2, "no such material");
  expect_failure({room() + "/absent"}, 3, "there is no such file");
  expect_failure({room() + "/mesh.ply"}, 3, "is no map of tactus");
}

}  // namespace
}  // namespace tactus::firmware
