// The commands, called as the program calls them.
#include <gtest/gtest.h>

#include <cstdlib>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "firmware_host/cli.hpp"
#include "firmware_host/open_source.hpp"
#include "firmware_host/summary.hpp"
#include "tests/support/command_line.hpp"
#include "tests/support/shared_data.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tactus::firmware {
namespace {

using nlohmann::json;
using test::Outcome;

Outcome tactus(const std::vector<std::string>& words, const PipelineCommands& pipeline = {}) {
  return test::call_tactus(words, pipeline);
}

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

/// Every failure: its exit code, one line on standard error, nothing on standard output.
void expect_failure(const Outcome& o, int code, const std::string& part) {
  EXPECT_EQ(o.code, code) << o.err;
  EXPECT_TRUE(o.err.starts_with("tactus: ")) << o.err;
  EXPECT_TRUE(contains(o.err, part)) << o.err;
  EXPECT_EQ(o.out, "");
}

TEST(CommandLine, HelpNamesEveryCommandAndExitCode) {
  const Outcome o = tactus({"--help"});
  EXPECT_EQ(o.code, 0);
  EXPECT_EQ(o.err, "");
  for (const char* word : {"eval", "convert", "info", "synthetic:NAME", "Exit codes", "5 budget exceeded"})
    EXPECT_TRUE(contains(o.out, word)) << word;
}

TEST(CommandLine, EveryCommandHasHelpAndNoLineIsEmptyOfMeaning) {
  for (const auto& words : std::vector<std::vector<std::string>>{{"eval", "trajectory", "--help"},
                                                                 {"eval", "surface", "--help"},
                                                                 {"eval", "--help"},
                                                                 {"convert", "--help"},
                                                                 {"info", "--help"}}) {
    const Outcome o = tactus(words);
    EXPECT_EQ(o.code, 0) << words[0];
    EXPECT_TRUE(contains(o.out, "Usage:")) << o.out;
    std::string path = "Usage: tactus";
    for (std::size_t i = 0; i + 1 < words.size(); ++i) path += " " + words[i];
    EXPECT_TRUE(contains(o.out, path)) << o.out;
  }
}

TEST(CommandLine, NothingAndNonsenseAreBadUsage) {
  expect_failure(tactus({}), 2, "no command");
  expect_failure(tactus({"dance"}), 2, "dance");
  expect_failure(tactus({"info"}), 2, "SOURCE");
  expect_failure(tactus({"info", "synthetic:wall", "--colour"}), 2, "--colour");
  expect_failure(tactus({"eval"}), 2, "subcommand");
  expect_failure(tactus({"eval", "surface", "a.ply", "b.ply", "--align", "sideways"}), 2, "sideways");
  expect_failure(tactus({"info", "synthetic:wall", "--frames", "5:5"}), 2, "empty");
}

TEST(CommandLine, CommandsThatDoNotExistAreNotInTheHelp) {
  const Outcome o = tactus({"--help"});
  for (const char* word :
       {"\n  run", "\n  plan", "\n  wiring", "\n  bench", "\n  record", "\n  study", "\n  devices"})
    EXPECT_FALSE(contains(o.out, word)) << word;
  expect_failure(tactus({"run", "synthetic:wall"}), 2, "run");
}

TEST(CommandLine, RunPassesItsOptionsOn) {
  RunOptions seen;
  PipelineCommands pipeline;
  pipeline.run = [&](const RunOptions& options) {
    seen = options;
    return rt::Result<std::string>(rt::Error{rt::ExitCode::budget_exceeded, "too slow."});
  };
  const Outcome o =
      tactus({"run", "synthetic:wall", "--out", "dir", "--runner", "lockstep", "--profile", "headset",
              "--set", "map.blocks=5", "--set", "a=b", "--collision", "uniform", "--frames", "2:7", "--json"},
             pipeline);
  expect_failure(o, 5, "too slow.");
  EXPECT_EQ(seen.source, "synthetic:wall");
  EXPECT_EQ(seen.out, "dir");
  EXPECT_EQ(seen.runner, "lockstep");
  EXPECT_EQ(seen.profile, "headset");
  EXPECT_EQ(seen.settings, (std::vector<std::string>{"map.blocks=5", "a=b"}));
  EXPECT_EQ(seen.collision, "uniform");
  EXPECT_EQ(seen.frames, (FrameRange{2, 7}));
  EXPECT_TRUE(seen.is_json);
  EXPECT_TRUE(seen.command.starts_with("tactus run synthetic:wall --out dir"));
  EXPECT_TRUE(contains(tactus({"--help"}, pipeline).out, "\n  run"));
  expect_failure(tactus({"run", "x", "--runner", "walker"}, pipeline), 2, "walker");
  expect_failure(tactus({"run", "x", "--model", "/absent.tflite"}, pipeline), 2, "absent.tflite");
}

TEST(CommandLine, WhatALibraryThrowsIsASentence) {
  PipelineCommands pipeline;
  pipeline.plan = [](const PlanOptions&) -> rt::Result<std::string> {
    throw std::runtime_error("out of luck");
  };
  expect_failure(tactus({"plan"}, pipeline), 1, "out of luck");
}

TEST(CommandLine, VersionIsPrinted) {
  const Outcome o = tactus({"--version"});
  EXPECT_EQ(o.code, 0);
  EXPECT_TRUE(o.out.starts_with("tactus 0."));
}

TEST(FrameRange, AllForms) {
  EXPECT_EQ(*parse_frame_range("3:9"), (FrameRange{3, 9}));
  EXPECT_EQ(*parse_frame_range(":9"), (FrameRange{0, 9}));
  EXPECT_EQ(*parse_frame_range("9"), (FrameRange{0, 9}));
  EXPECT_EQ(parse_frame_range("3:")->first, 3u);
  EXPECT_EQ(parse_frame_range("3:")->last, FrameRange{}.last);
  for (const char* bad :
       {"", ":", "a", "1:b", "-1:3", "3:3", "4:3", "1:2:3", "0", " 1:2", "99999999999999999999999"})
    EXPECT_FALSE(parse_frame_range(bad).has_value()) << bad;
}

TEST(OpenSource, DevicesThatAreNotThereAreUnavailable) {
  for (const char* source : {"v4l2:/dev/absent", "openni2:no-such-device"}) {
    const auto sensor = open_source(source);
    ASSERT_FALSE(sensor.has_value()) << source;
    EXPECT_EQ(sensor.error().code, rt::ExitCode::device_unavailable) << source;
    EXPECT_TRUE(contains(sensor.error().message, std::string(source).substr(std::string(source).find(':') + 1)))
        << sensor.error().message;
  }
  EXPECT_EQ(open_source("libcamera").error().code, rt::ExitCode::bad_usage);
}

TEST(OpenSource, WrongNamesAreSentences) {
  EXPECT_EQ(open_source("synthetic:castle").error().code, rt::ExitCode::bad_usage);
  EXPECT_EQ(open_source("/absent/folder").error().code, rt::ExitCode::bad_input);
  const test::TemporaryFolder folder;
  EXPECT_EQ(open_source(folder.path().string()).error().code, rt::ExitCode::bad_input);
  EXPECT_EQ(open_source(folder.write("a.txt", "x").string()).error().code, rt::ExitCode::bad_input);
  for (const char* recording : {"/absent/x.oni", "/absent/x.tac"})
    EXPECT_FALSE(open_source(recording).has_value()) << recording;
}

TEST(OpenSource, PartOfASyntheticRoomIsThatPart) {
  const std::string name = "synthetic:wall?frames=9&mode=320x240";
  auto whole = open_source(name);
  auto part = open_source(name, {{3, 6}, 0});
  ASSERT_TRUE(whole.has_value() && part.has_value());
  EXPECT_EQ(part->frames_count, 3u);
  ASSERT_EQ(part->truth.size(), 3u);
  EXPECT_EQ(part->truth[0].time, whole->truth[3].time);
  // Gravity is the same direction in the world, told in another frame.
  const Vec3d world_whole = whole->truth[0].T_world_depth.rotation * *whole->gravity_depth;
  const Vec3d world_part = part->truth[0].T_world_depth.rotation * *part->gravity_depth;
  EXPECT_LT((world_whole - world_part).norm(), 1e-12);
  std::vector<std::uint16_t> a(320 * 240), b(320 * 240);
  hal::FrameHeader header_a, header_b;
  for (int i = 0; i < 4; ++i)
    ASSERT_EQ(whole->depth->read(a, header_a, rt::Duration{1'000'000'000}), rt::Status::ok);
  ASSERT_EQ(part->depth->read(b, header_b, rt::Duration{1'000'000'000}), rt::Status::ok);
  EXPECT_EQ(a, b);
  EXPECT_EQ(header_b.sequence, 3u);
  EXPECT_EQ(part->depth->read(b, header_b, rt::Duration{}), rt::Status::ok);
  EXPECT_EQ(part->depth->read(b, header_b, rt::Duration{}), rt::Status::ok);
  EXPECT_EQ(part->depth->read(b, header_b, rt::Duration{}), rt::Status::end_of_stream);
  EXPECT_EQ(part->depth->read(b, header_b, rt::Duration{}), rt::Status::end_of_stream);
  EXPECT_EQ(part->depth->counters().frames_delivered, 3u);
  EXPECT_EQ(open_source(name, {{9, 12}, 0}).error().code, rt::ExitCode::bad_usage);
}

class Converted : public ::testing::Test {
 protected:
  std::string convert(const std::vector<std::string>& more = {}) {
    const std::string out = (folder_.path() / ("room" + std::to_string(count_++))).string();
    std::vector<std::string> words = {"convert", "synthetic:bedroom?frames=6&mode=320x240", out};
    words.insert(words.end(), more.begin(), more.end());
    const Outcome o = tactus(words);
    EXPECT_EQ(o.code, 0) << o.err;
    EXPECT_EQ(o.err, "") << "progress must not be shown when piped";
    EXPECT_TRUE(contains(o.out, "depth and")) << o.out;
    return out;
  }
  test::TemporaryFolder folder_;
  int count_ = 0;
};

TEST_F(Converted, RoomIsARecordingWithTruth) {
  const std::string room = convert();
  EXPECT_TRUE(std::filesystem::exists(std::filesystem::path(room) / "label"));
  const Outcome o = tactus({"info", room, "--json"});
  ASSERT_EQ(o.code, 0) << o.err;
  const json j = json::parse(o.out);
  EXPECT_EQ(j["frames"], 6);
  EXPECT_EQ(j["truth_poses"], 6);
  EXPECT_EQ(j["labels"], true);
  EXPECT_EQ(j["depth"]["stream"]["frames"], 6);
  EXPECT_EQ(j["depth"]["stream"]["frames_rejected"], 0);
  EXPECT_NEAR(j["depth"]["stream"]["rate_hz"].get<double>(), 30, 0.01);
  EXPECT_EQ(j["depth"]["intrinsics"]["width"], 320);
  EXPECT_EQ(j["color"]["stream"]["frames"], 6);
  EXPECT_GT(j["depth"]["valid_share"].get<double>(), 0.5);
}

TEST_F(Converted, SevenScenesLayoutAndPartAndNoLabels) {
  const std::string room =
      convert({"--layout", "7scenes", "--frames", "2:5", "--no-labels", "--color", "png"});
  const Outcome o = tactus({"info", room, "--json"});
  ASSERT_EQ(o.code, 0) << o.err;
  const json j = json::parse(o.out);
  EXPECT_EQ(j["frames"], 3);
  EXPECT_EQ(j["labels"], false);
}

TEST_F(Converted, FolderThatIsNotEmptyIsRefused) {
  folder_.write("full/file", "x");
  expect_failure(tactus({"convert", "synthetic:wall?frames=2", (folder_.path() / "full").string()}), 2,
                 "full");
}

TEST_F(Converted, InfoAsTextCountsSpoiltFrames) {
  const std::string room = convert();
  std::filesystem::path image;
  for (const auto& entry : std::filesystem::directory_iterator(room + "/depth"))
    if (image.empty() || entry.path() < image) image = entry.path();
  std::filesystem::resize_file(image, std::filesystem::file_size(image) / 2);
  const Outcome o = tactus({"info", room});
  // The first frame is spoilt: the recording may be refused as a whole or played without it, but never
  // silently.
  if (o.code == 0) {
    EXPECT_TRUE(contains(o.out, "1 unusable")) << o.out;
    EXPECT_TRUE(contains(o.out, image.filename().string())) << o.out;
  } else {
    expect_failure(o, 3, image.filename().string());
  }
}

TEST_F(Converted, TrajectoryOfTheRoomAgainstItselfHasNoError) {
  const std::string room = convert();
  const Outcome o = tactus({"eval", "trajectory", room + "/groundtruth.txt", room, "--json"});
  ASSERT_EQ(o.code, 0) << o.err;
  const json j = json::parse(o.out);
  EXPECT_EQ(j["pairs"], 6);
  EXPECT_LT(j["ate_rigid_mm"]["max"].get<double>(), 1e-6);
  const Outcome text = tactus({"eval", "trajectory", room, room});
  EXPECT_TRUE(contains(text.out, "ATE, rigidly aligned, mm")) << text.out;
  EXPECT_TRUE(contains(text.out, "6 of 6")) << text.out;
  EXPECT_TRUE(contains(text.out, "too short")) << text.out;
}

TEST(EvalTrajectory, BadInputIsExitCodeThree) {
  const test::TemporaryFolder folder;
  const std::string good =
      folder.write("good.txt", "1 0 0 0 0 0 0 1\n2 0 0 0 0 0 0 1\n3 0 0 0 0 0 0 1\n").string();
  const std::string nan = folder.write("nan.txt", "1 0 0 nan 0 0 0 1\n").string();
  const std::string late =
      folder.write("late.txt", "71 0 0 0 0 0 0 1\n72 0 0 0 0 0 0 1\n73 0 0 0 0 0 0 1\n").string();
  expect_failure(tactus({"eval", "trajectory", nan, good}), 3, "nan.txt:1:");
  expect_failure(tactus({"eval", "trajectory", good, folder.path() / "absent.txt"}), 3, "absent.txt");
  expect_failure(tactus({"eval", "trajectory", good, late}), 3, "do not overlap");
  expect_failure(tactus({"eval", "trajectory", good, good, "--gap", "-1"}), 2, "--gap");
}

/// A floor of the wall room's kind: a square patch in the plane z = `z`, 255 labels or one material.
std::string wall_patch(double z, int label) {
  const std::string l = " " + std::to_string(label) + "\n", zs = " " + std::to_string(z);
  return "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
         "property uchar label\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
         "-0.5 1" +
         zs + l + "0.5 1" + zs + l + "0.5 1.5" + zs + l + "-0.5 1.5" + zs + l + "4 0 1 2 3\n";
}

TEST(EvalSurface, MeshAgainstMeshByHand) {
  const test::TemporaryFolder folder;
  const std::string truth = folder.write("truth.ply", wall_patch(0, 12)).string();
  const std::string mesh = folder.write("mesh.ply", wall_patch(0.003, 12)).string();
  const Outcome o = tactus({"eval", "surface", mesh, truth, "--json", "--samples", "5000"});
  ASSERT_EQ(o.code, 0) << o.err;
  const json j = json::parse(o.out);
  EXPECT_NEAR(j["distance_mm"]["mean"].get<double>(), 3, 1e-4);
  EXPECT_NEAR(j["distance_mm"]["rmse"].get<double>(), 3, 1e-4);
  EXPECT_EQ(j["share_within_5mm"], 1);
  EXPECT_EQ(j["labels"]["pixel_accuracy"], 1);
  EXPECT_EQ(j["labels"]["classes_left_out"].size(), 22u);
  EXPECT_TRUE(contains(j["alignment"].get<std::string>(), "not aligned"));
  const Outcome text = tactus({"eval", "surface", mesh, truth});
  EXPECT_TRUE(contains(text.out, "100.0 % within 5 mm")) << text.out;
  EXPECT_TRUE(contains(text.out, "left out: brick")) << text.out;
}

TEST(EvalSurface, TrajectoriesBesideTheMeshesAlignThem) {
  const test::TemporaryFolder folder;
  const std::string mesh = folder.write("a/mesh.ply", wall_patch(0.25, 12)).string();
  folder.write("b/mesh.ply", wall_patch(0, 12));
  folder.write("a/trajectory.txt", "1 0 0 1.25 0 0 0 1\n2 1 0 1.25 0 0 0 1\n3 0 1 1.25 0 0 0 1\n");
  folder.write("b/groundtruth.txt", "1 0 0 1 0 0 0 1\n2 1 0 1 0 0 0 1\n3 0 1 1 0 0 0 1\n");
  const std::string truth = (folder.path() / "b").string();
  for (const char* align : {"auto", "rigid", "first"}) {
    const Outcome o = tactus({"eval", "surface", mesh, truth, "--json", "--align", align});
    ASSERT_EQ(o.code, 0) << o.err;
    EXPECT_LT(json::parse(o.out)["distance_mm"]["max"].get<double>(), 1e-4) << align;
  }
  const Outcome none = tactus({"eval", "surface", mesh, truth, "--json", "--align", "none"});
  EXPECT_NEAR(json::parse(none.out)["distance_mm"]["mean"].get<double>(), 250, 1e-3);
  std::filesystem::remove(folder.path() / "a/trajectory.txt");
  expect_failure(tactus({"eval", "surface", mesh, truth, "--align", "rigid"}), 2, "--poses");
}

TEST(EvalSurface, SyntheticRoomMeasuresItsOwnTruePointsAsZero) {
  // Points of the exact depth image, in the room's world, lie on its surface up to the depth unit of 0.2 mm.
  auto sensor = open_source("synthetic:bedroom?frames=1&mode=320x240&noise=0");
  ASSERT_TRUE(sensor.has_value());
  const hal::Intrinsics& k = sensor->calibration.depth;
  std::vector<std::uint16_t> raw(static_cast<std::size_t>(k.width * k.height));
  hal::FrameHeader header;
  ASSERT_EQ(sensor->depth->read(raw, header, rt::Duration{}), rt::Status::ok);
  std::vector<std::uint8_t> labels(raw.size());
  ASSERT_EQ(sensor->labels->read(0, labels), rt::Status::ok);
  std::string points;
  std::size_t count = 0;
  for (int v = 4; v < k.height; v += 7) {
    for (int u = 4; u < k.width; u += 7) {
      const std::size_t i = static_cast<std::size_t>(v * k.width + u);
      if (raw[i] == 0) continue;
      const double z = raw[i] * sensor->calibration.depth_m_per_unit;
      const Vec3d p = sensor->truth[0].T_world_depth * Vec3d{(u - k.cx) / k.fx * z, (v - k.cy) / k.fy * z, z};
      points += std::to_string(p.x) + " " + std::to_string(p.y) + " " + std::to_string(p.z) + " " +
                std::to_string(labels[i]) + "\n";
      ++count;
    }
  }
  ASSERT_GT(count, 500u);
  const test::TemporaryFolder folder;
  const std::string mesh =
      folder
          .write("points.ply",
                 "ply\nformat ascii 1.0\nelement vertex " + std::to_string(count) +
                     "\nproperty float x\nproperty float y\nproperty float z\nproperty uchar label\n"
                     "end_header\n" +
                     points)
          .string();
  const Outcome o = tactus({"eval", "surface", mesh, "synthetic:bedroom", "--align", "none", "--json"});
  ASSERT_EQ(o.code, 0) << o.err;
  const json j = json::parse(o.out);
  EXPECT_LT(j["distance_mm"]["p95"].get<double>(), 0.15);
  EXPECT_LT(j["distance_mm"]["max"].get<double>(), 1.0);
  EXPECT_GT(j["labels"]["pixel_accuracy"].get<double>(), 0.97);
}

TEST(EvalSurface, GarbageIsExitCodeThree) {
  const test::TemporaryFolder folder;
  const std::string good = folder.write("good.ply", wall_patch(0, 12)).string();
  const std::string garbage = folder.write("garbage.ply", "this is no mesh").string();
  expect_failure(tactus({"eval", "surface", garbage, good}), 3, "garbage.ply");
  expect_failure(tactus({"eval", "surface", good, garbage}), 3, "garbage.ply");
  expect_failure(tactus({"eval", "surface", good, "synthetic:castle"}), 2, "castle");
  expect_failure(tactus({"eval", "surface", good, good, "--samples", "0"}), 2, "--samples");
}

TEST(Info, QuickReadsNoFramesOfARealRecording) {
  const auto folder = test::shared_data("tum_fr1_rpy");
  if (!folder) GTEST_SKIP() << "the recordings beside the project are absent";
  const Outcome o = tactus({"info", folder->string(), "--quick"});
  EXPECT_EQ(o.code, 0) << o.err;
  EXPECT_TRUE(contains(o.out, "640 x 480")) << o.out;
  EXPECT_TRUE(contains(o.out, "true poses")) << o.out;
}

}  // namespace
}  // namespace tactus::firmware
