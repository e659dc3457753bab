// What a user gets wrong on the command line of a run, and the one sentence each mistake is answered with.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include "firmware_host/run.hpp"
#include "pipeline/contact/materials.hpp"
#include "tests/support/command_line.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tactus::firmware {
namespace {

constexpr const char* kSource = "synthetic:wall?mode=320x240&frames=3";

test::Outcome run_with(const std::vector<std::string>& more) {
  PipelineCommands commands;
  commands.run = run;
  std::vector<std::string> words = {"run", kSource, "--runner", "lockstep"};
  words.insert(words.end(), more.begin(), more.end());
  return test::call_tactus(words, commands);
}

/// Exit code 2, nothing on standard output, one line on standard error that holds these words.
void expect_refusal(const test::Outcome& o, const std::vector<std::string>& words) {
  EXPECT_EQ(o.code, 2) << o.err;
  EXPECT_EQ(o.out, "");
  EXPECT_TRUE(o.err.starts_with("tactus: ")) << o.err;
  EXPECT_EQ(std::count(o.err.begin(), o.err.end(), '\n'), 1) << o.err;
  for (const std::string& word : words) EXPECT_NE(o.err.find(word), std::string::npos) << "'" << word << "' in " << o.err;
}

TEST(BadScript, IsRefusedWithFileLineAndKey) {
  const struct {
    const char* text;
    std::vector<std::string> words;
  } kCases[] = {
      {"[[throw]]\nat_s = 0.1\nthng = \"plate\"\n", {"script.toml:3:", "thng"}},
      {"[[shot]]\nat_s = 0.1\nmaterial = \"wood\"\n", {"script.toml:3:", "material"}},
      {"frames = 4\n", {"script.toml:1:", "frames"}},
      {"[[throw]]\nat_s = -4\n", {"script.toml:2:", "at_s", "-4"}},
      {"[[throw]]\nat_s = nan\n", {"script.toml:2:", "at_s"}},
      {"[[throw]]\nat_s = 1e300\n", {"script.toml:2:", "at_s"}},
      {"[[throw]]\nat_frame = 2.5\n", {"script.toml:2:", "at_frame", "whole"}},
      {"[[throw]]\nat_s = 1\nradius_m = 0\n", {"script.toml:3:", "radius_m"}},
      {"[[throw]]\nat_s = 1\nradius_m = \"big\"\n", {"script.toml:3:", "radius_m"}},
      {"[[throw]]\nat_s = 1\nvelocity_m_per_s = [1, inf, 0]\n", {"script.toml:3:", "velocity_m_per_s[1]"}},
      {"[[throw]]\nat_s = 1\naim_px = [1]\n", {"script.toml:3:", "aim_px"}},
      {"[[throw]]\nat_s = 1\nthing = \"vase\"\n", {"script.toml:3:", "vase"}},
      {"[[throw]]\nat_s = 1\nmaterial = \"cheese\"\n", {"script.toml:3:", "cheese"}},
      {"[[shot]]\nat_s = 1\nenergy_j = -1\n", {"script.toml:3:", "energy_j"}},
      {"[[shot]]\n", {"script.toml:1:", "at_s", "at_frame"}},
      {"throw = 3\n", {"script.toml:1:", "[[throw]]"}},
      {"[[throw]\nat", {"script.toml:1:", "TOML"}},
      {"\xff\xfe", {"script.toml:1:", "ASCII"}},
      {"", {"script.toml:", "no [[throw]]"}},
  };
  const test::TemporaryFolder folder;
  for (const auto& [text, words] : kCases) {
    SCOPED_TRACE(text);
    expect_refusal(run_with({"--app", "plates", "--script", folder.write("script.toml", text).string()}), words);
  }
}

TEST(BadMaterials, AreRefusedWithFileLineAndKey) {
  const std::string good(contact::default_material_toml());
  const auto changed = [&](const std::string& from, const std::string& to) {
    std::string text = good;
    const std::size_t at = text.find(from, text.find("[brick]"));
    EXPECT_NE(at, std::string::npos) << from;
    return text.replace(at, from.size(), to);
  };
  const struct {
    std::string text;
    std::vector<std::string> words;
  } kCases[] = {
      {changed("restitution", "restitutio"), {"materials.toml", "restitutio"}},
      {changed("value = 0.55", "value = 5.5"), {"materials.toml:", "restitution"}},
      {changed("value = 0.55", "value = nan"), {"materials.toml:", "restitution"}},
      {changed("value = 0.55", "value = \"much\""), {"materials.toml:", "restitution"}},
      {changed("\"crumbs\"", "\"jelly\""), {"materials.toml:32:", "fracture_pattern"}},
      {changed("[brick]", "[bricks]"), {"materials.toml", "brick"}},
      {good + "\n[cheese]\n", {"materials.toml:", "cheese"}},
      {"[[brick]\n", {"materials.toml:1:", "TOML"}},
      {"", {"materials.toml:", "missing"}},
  };
  const test::TemporaryFolder folder;
  for (const auto& [text, words] : kCases) {
    SCOPED_TRACE(words.back());
    expect_refusal(run_with({"--materials", folder.write("materials.toml", text).string()}), words);
  }
}

TEST(BadFile, ThatIsMissingOrAFolderIsRefusedByName) {
  const test::TemporaryFolder folder;
  const std::string absent = (folder.path() / "absent.toml").string();
  for (const char* option : {"--script", "--materials"}) {
    expect_refusal(run_with({option, absent}), {option, "absent.toml"});
    expect_refusal(run_with({option, folder.path().string()}), {option, folder.path().string()});
  }
  expect_refusal(run_with({"--app", "chess"}), {"--app", "chess", "plates"});
  expect_refusal(run_with({"--display", "tv"}), {"--display", "tv", "window"});
}

TEST(BadOut, ThatCannotBeWrittenIsRefusedBeforeTheSession) {
  const test::TemporaryFolder folder;
  const std::string file = folder.write("file", "x").string();
  expect_refusal(run_with({"--app", "plates", "--out", file}), {"--out", file});
  expect_refusal(run_with({"--app", "plates", "--out", file + "/below"}), {"--out", file});
  expect_refusal(run_with({"--out", "/proc/tactus"}), {"--out", "/proc/tactus"});
}

TEST(BadOut, FolderWhereTheFilmShouldBeIsAFailureThatNamesIt) {
  const test::TemporaryFolder folder;
  for (const char* name : {"video.mp4", "sound.wav"}) {
    SCOPED_TRACE(name);
    const auto out = folder.path() / (std::string("out_") + name);
    std::filesystem::create_directories(out / name);
    const test::Outcome o = run_with({"--app", "plates", "--out", out.string()});
    EXPECT_EQ(o.code, 1);
    EXPECT_NE(o.err.find(name), std::string::npos) << o.err;
    EXPECT_EQ(std::count(o.err.begin(), o.err.end(), '\n'), 1) << o.err;
  }
}

}  // namespace
}  // namespace tactus::firmware
