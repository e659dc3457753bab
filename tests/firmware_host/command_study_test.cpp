// `tactus study`, called as the program calls it, on rooms of a few small frames.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "firmware_host/cli.hpp"
#include "firmware_host/study.hpp"
#include "firmware_host/study_grid.hpp"
#include "firmware_host/study_sets.hpp"
#include "hal/replay/file_bytes.hpp"
#include "hal/replay/image_codec.hpp"
#include "hal/replay/image_header.hpp"
#include "tests/support/command_line.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tactus::firmware {
namespace {

using nlohmann::json;
using test::Outcome;

/// `words` after `tactus study`; exact labels stand in for a network, and no recording lies beside.
Outcome study(std::vector<std::string> words, const std::filesystem::path& data, int frames_count) {
  std::vector<std::string> all = {"study"};
  all.insert(all.end(), words.begin(), words.end());
  const std::vector<std::string> rest = {"--mode", "320x240",     "--length", std::to_string(frames_count),
                                         "--data", data.string(), "--set",    "labels.source=truth"};
  all.insert(all.end(), rest.begin(), rest.end());
  PipelineCommands commands;
  commands.study_accuracy = study_accuracy;
  commands.study_errors = study_errors;
  commands.study_keyframes = study_keyframes;
  return test::call_tactus(all, commands);
}

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

TEST(StudySets, ScoreAsManyFramesAsThePaperLabelled) {
  const test::TemporaryFolder folder;
  StudyOptions options;
  options.data = folder.path();
  const auto sets = study_sets(options);
  ASSERT_TRUE(sets);
  ASSERT_EQ(sets->sets.size(), 2u);
  std::uint64_t views_count = 0;
  for (const StudySet& set : sets->sets) {
    EXPECT_LT((set.request.views_max - 1) * set.request.every, 300u) << "the last of them exists";
    EXPECT_GT(set.request.views_max * set.request.every, 270u) << "they are spread over all of it";
    views_count += set.request.views_max;
  }
  EXPECT_EQ(views_count, 25u);
}

TEST(StudyAccuracy, PutsOurTableBesideThePapersAndWritesTheGrid) {
  const test::TemporaryFolder folder;
  const auto out = folder.path() / "out";
  const Outcome o = study({"accuracy", "--out", out.string(), "--views", "3"}, folder.path(), 16);
  ASSERT_EQ(o.code, 0) << o.err;
  EXPECT_TRUE(contains(o.out, "6 frames, beside the paper's 25")) << o.out;
  EXPECT_TRUE(contains(o.out, "paper, Ours_noCRF")) << o.out;
  EXPECT_TRUE(contains(o.out, "bedroom_rendered was left out")) << o.out;
  const json result = json::parse(folder.read("out/accuracy.json"));
  EXPECT_EQ(result["sets"]["synthetic_bedroom"]["frames_scored"], 3);
  EXPECT_EQ(result["sets"]["synthetic_office"]["frames_scored"], 3);
  EXPECT_EQ(result["paper"]["fused_crf3d"]["mean_iu"], 56.32 / 100);
  EXPECT_EQ(result["left_out"].size(), 3u);
  for (const char* method : {"net", "net_crf2d", "direct", "fused", "fused_crf3d"}) {
    const json& both = result["sets"]["synthetic"]["methods"][method]["pixels"];
    EXPECT_GT(result["sets"]["synthetic"]["methods"][method]["common"]["pixel_accuracy"], 0.9) << method;
    // The rooms together lie between the two of them.
    const double a = result["sets"]["synthetic_bedroom"]["methods"][method]["pixels"]["pixel_accuracy"],
                 b = result["sets"]["synthetic_office"]["methods"][method]["pixels"]["pixel_accuracy"];
    EXPECT_GE(both["pixel_accuracy"], std::min(a, b));
    EXPECT_LE(both["pixel_accuracy"], std::max(a, b));
  }

  std::string bytes;
  ASSERT_TRUE(hal::replay::read_file(out / "grid_synthetic.png", 1 << 24, bytes));
  const auto header = hal::replay::parse_image_header(bytes);
  ASSERT_TRUE(header);
  const int width = static_cast<int>(header->width), height = static_cast<int>(header->height);
  EXPECT_GE(width, static_cast<int>(StudyGrid::kColumns) * StudyGrid::kTileWidth_px);
  EXPECT_GE(height, 5 * 180);
  std::vector<std::uint8_t> rgb(static_cast<std::size_t>(width * height) * 3);
  ASSERT_EQ(hal::replay::decode_color(bytes, width, height, rgb), "");
  // With exact labels, what the network said looks like the truth in the first row, but for the coarse grid's
  // edges.
  const auto pixel = [&](int x, int y) {
    const auto i = static_cast<std::size_t>(y * width + x) * 3;
    return Rgb8{rgb[i], rgb[i + 1], rgb[i + 2]};
  };
  constexpr int kTile = StudyGrid::kTileWidth_px + 4;
  int same = 0, differs_from_image = 0;
  for (int y = 30; y < 190; ++y)
    for (int x = 10; x < 230; ++x) {
      same += pixel(x, y) == pixel(x + 4 * kTile, y) ? 1 : 0;
      differs_from_image += pixel(x, y) == pixel(x + 5 * kTile, y) ? 0 : 1;
    }
  EXPECT_GT(same, 160 * 220 * 85 / 100);
  EXPECT_GT(differs_from_image, 160 * 220 * 95 / 100);
}

TEST(StudyErrors, SwappingWhatIsExactAlreadyGainsNothing) {
  const test::TemporaryFolder folder;
  const Outcome o = study({"errors", "--json", "--views", "2"}, folder.path(), 16);
  ASSERT_EQ(o.code, 0) << o.err;
  const json result = json::parse(o.out);
  for (const char* room : {"synthetic_bedroom", "synthetic_office"}) {
    const json& one = result["sets"][room];
    EXPECT_EQ(one["segmentation"]["gain_fused"], 0.0) << "the labels are the true ones in both";
    EXPECT_EQ(one["reconstruction"]["compared_with"], "tracking");
    EXPECT_NE(one["ray_cast"]["gain_fused"], 0.0);
    EXPECT_LT(std::abs(one["fusion"]["gain_fused"].get<double>()), 0.1) << "the compact form against float64";
    EXPECT_LT(std::abs(one["tracking"]["gain_fused"].get<double>()), 0.1) << "few frames drift little";
    EXPECT_GT(one["all_true"]["mean_iu_fused"], one["as_is"]["mean_iu_fused"]);
  }
}

TEST(StudyKeyframes, LabelsFewerKeyframesTheRarerTheyAre) {
  const test::TemporaryFolder folder;
  const Outcome o = study({"keyframes", "--json", "--room", "bedroom", "--views", "1"}, folder.path(), 16);
  ASSERT_EQ(o.code, 0) << o.err;
  const json curve = json::parse(o.out)["sets"]["synthetic_bedroom"];
  ASSERT_EQ(curve.size(), 8u);
  EXPECT_EQ(curve[0]["every_frames"], 1);
  EXPECT_EQ(curve[6]["every_frames"], 30);
  // With a keyframe in each or every second frame, fusing decides how many there are: it takes several frames
  // for one.
  for (std::size_t i = 3; i < 7; ++i)
    EXPECT_LE(curve[i]["keyframes_fused"], curve[i - 1]["keyframes_fused"]) << i;
  EXPECT_GT(curve[0]["keyframes_fused"], curve[6]["keyframes_fused"]);
  EXPECT_EQ(curve[6]["keyframes_fused"], 1);
  // The rarer they are, the more of what is seen has no label yet.
  EXPECT_LE(curve[0]["live_unlabelled_share"], curve[6]["live_unlabelled_share"]);
  const json& adaptive = curve[7];
  EXPECT_EQ(adaptive["policy"], "adaptive");
  EXPECT_FALSE(adaptive.contains("every_frames"));
  EXPECT_GE(adaptive["keyframes_taken"], 1);
  EXPECT_LE(adaptive["keyframes_taken"], 2) << "16 frames and a gap of 10 between two";
  EXPECT_GT(adaptive["mean_iu_fused"], 0.5 * curve[4]["mean_iu_fused"].get<double>());
}

TEST(Study, BadUsageIsOneSentence) {
  const test::TemporaryFolder folder;
  const auto expect_failure = [](const Outcome& o, int code, const std::string& part) {
    EXPECT_EQ(o.code, code) << o.err;
    EXPECT_TRUE(contains(o.err, part)) << o.err;
    EXPECT_EQ(o.err.find('\n'), o.err.size() - 1) << o.err;
    EXPECT_EQ(o.out, "");
  };
  expect_failure(study({"accuracy"}, folder.path() / "absent", 2), 3, "absent");
  expect_failure(study({"accuracy", "--crf", (folder.path() / "absent.toml").string()}, folder.path(), 2), 2,
                 "absent.toml");
  expect_failure(study({"accuracy", "--out", folder.write("a_file", "").string()}, folder.path(), 2), 1,
                 "a_file");
  expect_failure(study({"happiness"}, folder.path(), 2), 2, "subcommand");
  expect_failure(study({"errors", "--room", "none"}, folder.path(), 2), 2, "--data");
  expect_failure(study({"accuracy", "--room", "cellar"}, folder.path(), 2), 2, "cellar");
}

}  // namespace
}  // namespace tactus::firmware
