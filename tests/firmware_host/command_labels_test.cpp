// `tactus eval labels` and `tactus study`, called as the program calls them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "firmware_host/cli.hpp"
#include "firmware_host/label_command.hpp"
#include "firmware_host/label_methods.hpp"
#include "firmware_host/label_text.hpp"
#include "firmware_host/open_source.hpp"
#include "hal/replay/file_bytes.hpp"
#include "hal/replay/image_codec.hpp"
#include "hal/replay/recording_writer.hpp"
#include "pipeline/label_view.hpp"
#include "tests/bench/crf_points_file.hpp"
#include "tests/support/command_line.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tactus::firmware {
namespace {

using nlohmann::json;
using test::Outcome;

constexpr const char* kRoom = "synthetic:bedroom?frames=28&mode=320x240";

Outcome tactus(const std::vector<std::string>& words) {
  PipelineCommands commands;
  commands.eval_labels = eval_labels;
  return test::call_tactus(words, commands);
}

void expect_failure(const Outcome& o, int code, const std::string& part) {
  EXPECT_EQ(o.code, code) << o.err;
  EXPECT_TRUE(o.err.starts_with("tactus: ")) << o.err;
  EXPECT_NE(o.err.find(part), std::string::npos) << o.err;
  EXPECT_EQ(o.err.find('\n'), o.err.size() - 1) << "one sentence, one line: " << o.err;
  EXPECT_EQ(o.out, "");
}

/// A short recording of the synthetic bedroom with its true labels, made once.
const std::filesystem::path& recording() {
  static const test::TemporaryFolder folder;
  static const std::filesystem::path path = [] {
    auto sensor = open_source(kRoom);
    EXPECT_TRUE(sensor);
    auto written = hal::write_recording(folder.path() / "room", *sensor, {});
    EXPECT_TRUE(written);
    return folder.path() / "room";
  }();
  return path;
}

std::vector<MaterialId> read_label(const std::filesystem::path& path) {
  std::string bytes;
  std::vector<MaterialId> ids(320 * 240);
  EXPECT_TRUE(hal::replay::read_file(path, 1 << 20, bytes)) << path;
  EXPECT_EQ(hal::replay::decode_label(bytes, 320, 240, ids), "") << path;
  return ids;
}

TEST(EvalLabels, ExactLabelsAsTheNetworkComeBackFromTheMap) {
  const test::TemporaryFolder folder;
  const std::filesystem::path truth = recording() / "label";
  const std::vector<std::string> words = {"eval",
                                          "labels",
                                          recording().string(),
                                          "--truth",
                                          truth.string(),
                                          "--set",
                                          "labels.source=truth",
                                          "--every",
                                          "12",
                                          "--save-predictions",
                                          (folder.path() / "out").string(),
                                          "--save-points",
                                          (folder.path() / "cells.crf").string(),
                                          "--json"};
  const Outcome o = tactus(words);
  ASSERT_EQ(o.code, 0) << o.err;
  const json result = json::parse(o.out);
  EXPECT_EQ(result["frames_scored"], json({"000000", "000012", "000024"}));
  EXPECT_EQ(result["frames_scored_untracked"], 0);
  for (const char* method : {"net", "net_crf2d", "direct", "fused", "fused_crf3d"}) {
    const json& scores = result["methods"][method];
    // The truth comes in on a 160 x 120 grid: what is lost lies at boundaries.
    EXPECT_GT(scores["away_from_boundary"]["pixel_accuracy"], 0.97) << method;
    EXPECT_GT(scores["common"]["pixel_accuracy"], 0.95) << method;
    EXPECT_GT(scores["pixels"]["labelled_share"], 0.85) << method;
    EXPECT_LT(scores["near_boundary"]["pixel_accuracy"], scores["away_from_boundary"]["pixel_accuracy"]);
    EXPECT_LE(scores["pixels"]["pixel_accuracy"], 1.0);
    EXPECT_EQ(scores["filled"]["labelled_share"], 1.0) << "the network says something everywhere";
    EXPECT_GE(scores["filled"]["pixel_accuracy"], scores["pixels"]["pixel_accuracy"]);
  }
  EXPECT_EQ(result["methods"]["net"]["filled"], result["methods"]["net"]["pixels"]);
  EXPECT_GT(result["methods"]["fused"]["filled"]["pixel_accuracy"],
            result["methods"]["fused"]["pixels"]["pixel_accuracy"]);
  EXPECT_EQ(result["methods"]["net"]["pixels"]["labelled_share"], 1.0);
  EXPECT_EQ(result["crf"]["solver"], "incremental");
  EXPECT_GE(result["crf"]["agreement_with_batch"], 0.99);
  EXPECT_GT(result["crf"]["cells_compared"], 5000);
  EXPECT_GE(result["crf"]["regions"], 1);

  // What was written is what was scored.
  std::size_t files_count = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder.path() / "out"))
    files_count += entry.is_regular_file() ? 1u : 0u;
  EXPECT_EQ(files_count, 3 * result["methods"].size());
  std::uint64_t right = 0, known = 0;
  for (const char* name : {"000000", "000012", "000024"}) {
    const auto ids = read_label(folder.path() / "out/fused" / (std::string(name) + ".png"));
    const auto expected = read_label(truth / (std::string(name) + ".png"));
    for (std::size_t i = 0; i < ids.size(); ++i) {
      EXPECT_TRUE(ids[i] < kMaterialCount || ids[i] == kUnknownMaterial);
      known += expected[i] < kMaterialCount ? 1u : 0u;
      right += expected[i] < kMaterialCount && ids[i] == expected[i] ? 1u : 0u;
    }
  }
  EXPECT_DOUBLE_EQ(static_cast<double>(right) / static_cast<double>(known),
                   result["methods"]["fused"]["pixels"]["pixel_accuracy"]);

  // The cells are as the CRF's fitting tool reads them, and most of those with a truth agree with it.
  const auto points = bench::read_points((folder.path() / "cells.crf").string());
  ASSERT_TRUE(points) << points.error().message;
  EXPECT_EQ(points->size(), result["cells"]);
  std::size_t agree = 0, with_truth = 0;
  for (std::size_t i = 0; i < points->size(); ++i) {
    const float* unary = &points->unary_nat[i * kMaterialCount];
    if (points->truth[i] == kUnknownMaterial || *std::max_element(unary, unary + kMaterialCount) == 0)
      continue;
    ++with_truth;
    agree += std::min_element(unary, unary + kMaterialCount) - unary == points->truth[i] ? 1u : 0u;
    EXPECT_NEAR(points->normal[i].norm(), 1, 1e-4);
  }
  EXPECT_GT(with_truth, 5000u);
  EXPECT_GT(static_cast<double>(agree) / static_cast<double>(with_truth), 0.95);

  // The same again, to the last digit.
  EXPECT_EQ(tactus(words).out, o.out);
}

TEST(EvalLabels, TheSourcesOwnTruthEqualsItsFolder) {
  const std::vector<std::string> words = {
      "eval", "labels", recording().string(), "--set", "labels.source=truth", "--frames", "0:13", "--every",
      "12",   "--json"};
  std::vector<std::string> with_folder = words;
  with_folder.insert(with_folder.end(), {"--truth", (recording() / "label").string()});
  const Outcome own = tactus(words), folder = tactus(with_folder);
  ASSERT_EQ(own.code, 0) << own.err;
  EXPECT_EQ(own.out, folder.out);
}

class EvalLabelsReader : public testing::TestWithParam<LabelMethod> {};
INSTANTIATE_TEST_SUITE_P(FusedAndRefined, EvalLabelsReader,
                         testing::Values(LabelMethod::fused, LabelMethod::fused_crf3d));

TEST_P(EvalLabelsReader, ImagesOfCellsEqualTheReadersOwnAnswer) {
  LabelSessionOptions options;
  options.source = kRoom;
  options.frames = {0, 24};
  auto settings = read_settings("x86", std::vector<std::string>{"labels.source=truth"});
  ASSERT_TRUE(settings);
  LabelStudyRequest request;
  request.session = options;
  request.settings = *settings;
  auto study = study_labels(request);
  ASSERT_TRUE(study) << study.error().message;
  if (GetParam() == LabelMethod::fused_crf3d) options.crf = request.crf;  // a reader says what was refined
  auto session = LabelSession::open(options, *settings);
  ASSERT_TRUE(session);
  ASSERT_TRUE((*session)->run("", [](const ObservedFrame&) -> rt::Result<void> { return {}; }));
  const LabelView& view = study->views.back();
  const PictureCamera camera = picture_camera_at(view.T_world_depth, (*session)->sensor().calibration);
  std::size_t differ = 0, hits = 0;
  for (int v = 0; v < study->camera.height; v += 3)
    for (int u = 0; u < study->camera.width; u += 3) {
      map::SurfacePoint point;
      const bool is_hit = (*session)->pipeline().reader().raycast(
          camera.T_world_camera.translation.cast<float>(), ray_of(camera, u, v).cast<float>(), 10, point);
      const MaterialId expected = is_hit ? point.material : kUnknownMaterial;
      const auto pixel = static_cast<std::size_t>(v * study->camera.width + u);
      hits += is_hit ? 1u : 0u;
      differ += view.labels[static_cast<std::size_t>(GetParam())][pixel] != expected ? 1u : 0u;
    }
  EXPECT_GT(hits, 7000u);
  EXPECT_LE(differ, hits / 500) << "rounding at a cell's border may differ, nothing else";
}

TEST(EvalLabels, WithoutTheIncrementalSolverTheBatchSolverStandsInAndSaysWhy) {
  const std::vector<std::string> words = {
      "eval", "labels", recording().string(), "--set", "labels.source=truth", "--frames",
      "0:13", "--set",  "labels.crf=off"};
  const Outcome text = tactus(words);
  ASSERT_EQ(text.code, 0) << text.err;
  EXPECT_NE(text.out.find("3D CRF: the batch solver over the finished map, since labels.crf is off."),
            std::string::npos)
      << text.out;
  std::vector<std::string> as_json = words;
  as_json.push_back("--json");
  const json crf = json::parse(tactus(as_json).out)["crf"];
  EXPECT_EQ(crf["solver"], "batch");
  EXPECT_EQ(crf["why_batch"], "labels.crf is off.");
  EXPECT_FALSE(crf.contains("agreement_with_batch"));
}

TEST(EvalLabels, ChosenParametersDriveBothSolvers) {
  const auto refined_with = [&](const std::string& crf) {
    const Outcome o = tactus({"eval", "labels", recording().string(), "--set", "labels.source=truth",
                              "--frames", "0:13", "--crf", crf, "--json"});
    EXPECT_EQ(o.code, 0) << o.err;
    return json::parse(o.out);
  };
  const json paper = refined_with("paper"), ours = refined_with("default");
  for (const json& one : {paper, ours}) {
    EXPECT_EQ(one["crf"]["solver"], "incremental") << one["crf"];
    EXPECT_GE(one["crf"]["agreement_with_batch"], 0.99);
  }
  EXPECT_EQ(paper["methods"]["fused"], ours["methods"]["fused"]);
  EXPECT_NE(paper["methods"]["fused_crf3d"]["cells"], ours["methods"]["fused_crf3d"]["cells"]);
}

TEST(CrfText, LessAgreementThanRequiredIsSaidPlainly) {
  CrfOutcome crf{CrfSolver::incremental, "", 10000, 9900, 3};
  EXPECT_EQ(crf_text(crf).find("required"), std::string::npos) << "99 % are what is required";
  EXPECT_NE(crf_text(crf).find("99.00 % of 10000 cells"), std::string::npos) << crf_text(crf);
  crf.equal_count = 9899;
  EXPECT_NE(crf_text(crf).find("less than the 99 % required"), std::string::npos) << crf_text(crf);
}

TEST(EvalLabels, BadInputIsOneSentence) {
  const test::TemporaryFolder folder;
  const std::string source = recording().string();
  const auto labels = [&](std::vector<std::string> more) {
    std::vector<std::string> words = {"eval",     "labels", source, "--set", "labels.source=truth",
                                      "--frames", "0:2"};
    words.insert(words.end(), more.begin(), more.end());
    return tactus(words);
  };
  expect_failure(labels({"--truth", (folder.path() / "absent").string()}), 3, "absent");
  std::filesystem::create_directories(folder.path() / "empty");
  expect_failure(labels({"--truth", (folder.path() / "empty").string()}), 3, "no PNG");

  const std::vector<MaterialId> small(32 * 24, 3), strange(320 * 240, 24);
  ASSERT_TRUE(hal::replay::write_label_png(folder.write("small/000000.png", ""), small, 32, 24));
  expect_failure(labels({"--truth", (folder.path() / "small").string()}), 3, "32x24");
  ASSERT_TRUE(hal::replay::write_label_png(folder.write("strange/000000.png", ""), strange, 320, 240));
  expect_failure(labels({"--truth", (folder.path() / "strange").string()}), 3, "24");
  folder.write("broken/000000.png", "this is no PNG");
  expect_failure(labels({"--truth", (folder.path() / "broken").string()}), 3, "000000.png");
  folder.write("others/kitchen.png", "");
  expect_failure(labels({"--truth", (folder.path() / "others").string()}), 3, "named as the colour frames");

  expect_failure(tactus({"eval", "labels"}), 2, "SOURCE");
  expect_failure(tactus({"eval", "labels", kRoom, "--every", "0"}), 2, "every");
  expect_failure(tactus({"eval", "labels", kRoom, "--model", (folder.path() / "absent.tflite").string()}), 3,
                 "absent.tflite");
  expect_failure(tactus({"eval", "labels", "synthetic:bedroom?frames=4&mode=320x240&registered=0", "--set",
                         "labels.source=truth"}),
                 2, "depth camera's pixels");
  expect_failure(labels({"--save-predictions", folder.write("a_file", "").string()}), 1, "a_file");
}

}  // namespace
}  // namespace tactus::firmware
