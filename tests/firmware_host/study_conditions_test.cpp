// `tactus study clips` and `tactus study plausibility` on a few small frames, and the form that is made of
// the clips.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "hal/egl/offscreen.hpp"
#include "hal/movie/movie_writer.hpp"
#include "tests/firmware_host/study_commands.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tactus::firmware {
namespace {

using nlohmann::json;

constexpr const char* kSmallRoom = "synthetic:bedroom?frames=30&mode=320x240";

/// A plate onto the bed, one against the wall.
constexpr const char* kScript =
    "[[throw]]\nat_frame = 8\nthing = \"plate\"\nin_front_m = 0.3\naim_px = [160, 200]\nspeed_m_per_s = 5\n"
    "[[throw]]\nat_frame = 10\nthing = \"cup\"\nin_front_m = 0.3\naim_px = [40, 60]\nspeed_m_per_s = 6\n";

bool can_film() {
  const test::TemporaryFolder folder;
  return hal::egl::OffscreenDisplay::create({64, 48}).has_value() &&
         hal::MovieWriter::create(folder.path() / "film.mp4", {.width_px = 64, .height_px = 48}).has_value();
}

TEST(StudyClips, DifferInWhatStopsThingsAlone) {
  if (!can_film()) GTEST_SKIP() << "Nothing can be drawn or encoded here.";
  const test::TemporaryFolder folder;
  const auto script = folder.write("script.toml", kScript), out = folder.path() / "clips";
  const test::Outcome o = test::call_study({"clips", kSmallRoom, "--out", out, "--script", script});
  ASSERT_EQ(o.code, 0) << o.err;
  const json sut = json::parse(folder.read("clips/clips.json"));
  ASSERT_EQ(sut["clips"].size(), 3U);
  const char* names[] = {"none", "uniform", "semantic"};
  for (std::size_t i = 0; i < 3; ++i) {
    const json& clip = sut["clips"][i];
    EXPECT_EQ(clip["condition"], names[i]);
    EXPECT_EQ(clip["frames"], 30);
    EXPECT_EQ(clip["throws"], 2);
    EXPECT_EQ(clip["map_hash"], sut["clips"][0]["map_hash"]);
    EXPECT_EQ(clip["trajectory_hash"], sut["clips"][0]["trajectory_hash"]);
    EXPECT_GT(std::filesystem::file_size(out / clip["file"].get<std::string>()), 10'000U);
    EXPECT_NE(o.out.find(clip["file"].get<std::string>()), std::string::npos) << o.out;
  }
  EXPECT_EQ(sut["clips"][0]["outcomes"]["through"], 2);
  for (std::size_t i : {1U, 2U}) EXPECT_LT(sut["clips"][i]["outcomes"]["through"], 2) << i;
  EXPECT_NE(folder.read("clips/none.mp4"), folder.read("clips/semantic.mp4"));

  // The questionnaire takes the folder as it is.
  const test::Outcome form = test::call_study({"form", "--clips", out, "--out", folder.path() / "form.html"});
  ASSERT_EQ(form.code, 0) << form.err;
  const std::string html = folder.read("form.html");
  for (const char* name : names)
    EXPECT_NE(html.find(std::string("src=\"clips/") + name + ".mp4\""), std::string::npos);
  EXPECT_NE(form.out.find("none, uniform, semantic"), std::string::npos) << form.out;
}

TEST(StudyClips, ShotsAreCounted) {
  if (!can_film()) GTEST_SKIP() << "Nothing can be drawn or encoded here.";
  const test::TemporaryFolder folder;
  const test::Outcome o =
      test::call_study({"clips", "synthetic:bedroom?mode=320x240&frames=300", "--frames", ":28", "--app",
                        "shooting", "--out", folder.path() / "clips", "--json"});
  ASSERT_EQ(o.code, 0) << o.err;
  const json sut = json::parse(o.out);
  for (const json& clip : sut["clips"]) {
    EXPECT_EQ(clip["frames"], 28);
    EXPECT_EQ(clip["shots"], 1) << "0.8 s of one second";
  }
  EXPECT_EQ(sut["clips"][0]["outcomes"]["through"], 1);
  EXPECT_EQ(sut["clips"][2]["outcomes"]["through"], 0);
}

TEST(StudyPlausibility, SemanticGoesAsExpectedMoreOftenThanNone) {
  const test::TemporaryFolder folder;
  const test::Outcome o = test::call_study({"plausibility", "--rooms", "bedroom", "--throws", "8", "--length",
                                            "95", "--labels", "truth", "--out", folder.path() / "out"});
  ASSERT_EQ(o.code, 0) << o.err;
  const json sut = json::parse(folder.read("out/plausibility.json"));
  const json& room = sut["rooms"]["bedroom"];
  EXPECT_EQ(room["thrown"], 8);
  std::size_t left_out = 0;
  for (const auto& [why, count] : room["left_out"].items()) left_out += count.get<std::size_t>();
  EXPECT_EQ(room["contacts"].size() + left_out, 8U);
  ASSERT_GE(room["contacts"].size(), 5U);
  EXPECT_EQ(sut["conditions"][0]["name"], "none");
  EXPECT_EQ(sut["conditions"][0]["as_expected"], 0) << "something real is met by all of them";
  EXPECT_GE(sut["conditions"][2]["as_expected"], sut["conditions"][1]["as_expected"]);
  EXPECT_GE(sut["conditions"][2]["share"], 0.5);
  for (const json& contact : room["contacts"]) {
    if (contact["kind"] != "impact") continue;
    EXPECT_LT(std::abs(contact["surface_distance_m"].get<double>()), 0.03);
    // Sure of the true material, there is nothing left to be wrong about.
    if (contact["label"] == contact["true_material"] && contact["probability"] > 0.99) {
      EXPECT_EQ(contact["semantic"], contact["expected"]) << contact;
    }
  }
  EXPECT_NE(o.out.find("uniform - semantic"), std::string::npos) << o.out;
}

TEST(StudyConditions, WhatIsWrongIsOneSentence) {
  const test::TemporaryFolder folder;
  const std::string out = folder.path() / "out";
  const struct {
    std::vector<std::string> words;
    int code;
    std::string part;
  } cases[] = {
      {{"clips"}, 2, "--out"},
      {{"clips", folder.path() / "nowhere", "--out", out}, 3, "there is no such folder"},
      {{"clips", "synthetic:cellar", "--out", out}, 2, "cellar"},
      {{"clips", kSmallRoom, "--out", out, "--set", "map.colour=1"}, 2, "there is no key 'map.colour'"},
      {{"clips", kSmallRoom, "--out", out, "--script", folder.path() / "absent.toml"}, 2, "absent.toml"},
      {{"clips", kSmallRoom, "--out", out, "--script",
        folder.write("bad.toml", "[[throw]]\nat_s = 1\nthing = \"pot\"\n")},
       2,
       "bad.toml"},
      {{"clips", kSmallRoom, "--out", out, "--app", "none"}, 2, "--app"},
      {{"plausibility", "--rooms", "cellar"}, 2, "cellar"},
      {{"plausibility", "--throws", "0"}, 2, "--throws"},
      {{"plausibility", "--set", "map.colour=1"}, 2, "there is no key 'map.colour'"},
      {{"plausibility", "--out", folder.write("a_file", "") / "x"}, 1, "cannot be made"},
  };
  for (const auto& [words, code, part] : cases) {
    const test::Outcome sut = test::call_study(words);
    EXPECT_EQ(sut.code, code) << part << ": " << sut.err;
    EXPECT_NE(sut.err.find(part), std::string::npos) << sut.err;
    EXPECT_EQ(std::count(sut.err.begin(), sut.err.end(), '\n'), 1) << sut.err;
    EXPECT_EQ(sut.out, "");
    EXPECT_FALSE(std::filesystem::exists(out)) << part;
  }
}

}  // namespace
}  // namespace tactus::firmware
