// The program played by a person at a window, on a real X server; and what ends a session early.
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "tests/firmware_host/program.hpp"
#include "tests/hal/egl/x_server.hpp"
#include "tests/hal/movie/film_reader.hpp"

namespace tactus::firmware {
namespace {

using nlohmann::json;
using test::events_of;

constexpr const char* kNothing = "[[throw]]\nat_frame = 1000000\nshape = \"sphere\"\n";

std::string room(int frames) { return "synthetic:bedroom?mode=320x240&frames=" + std::to_string(frames); }

void rest(int milliseconds) { std::this_thread::sleep_for(std::chrono::milliseconds(milliseconds)); }

/// Looks every 20 ms for up to 20 s.
bool comes(const std::function<bool()>& what) {
  for (int i = 0; i < 1000; ++i) {
    if (what()) return true;
    rest(20);
  }
  return false;
}

constexpr std::array<const char*, 6> kOutputs = {"trajectory.txt", "mesh.ply",   "map.tactus",
                                                 "summary.json",   "trace.json", "report.html"};

void expect_all_outputs(const std::filesystem::path& out) {
  for (const char* name : kOutputs) EXPECT_GT(std::filesystem::file_size(out / name), 1u) << name;
  EXPECT_TRUE(std::filesystem::exists(out / "events.jsonl"));  // empty when nothing happened
  const hal::testing::Film film = hal::testing::read_film(out / "video.mp4");
  EXPECT_GT(film.pictures.size(), 5u);
  EXPECT_NEAR(film.picture_duration_s, film.sound_duration_s, 1.0 / 30);
  EXPECT_GT(std::filesystem::file_size(out / "sound.wav"), 48000u / 4);
}

class WindowGame : public ::testing::Test {
 protected:
  void SetUp() override {
    server_ = test::XServer::start();
    if (!server_) GTEST_SKIP() << "Xvfb is not here or does not start; install xvfb";
  }

  /// Starts the game and waits until its window shows the room.
  void start(int frames, const std::vector<std::string>& more = {}) {
    const std::string script = folder_.write("nothing.toml", kNothing).string();
    std::vector<std::string> words = {"run",      room(frames), "--app", "plates",      "--display", "window",
                                      "--script", script,       "--out", out_.string()};
    words.insert(words.end(), more.begin(), more.end());
    // OpenAL's wave writer without a file: a machine without a sound card.
    program_.emplace(words, test::ProgramSetup{.environment = {{"DISPLAY", server_->name()}, {"ALSOFT_DRIVERS", "wave"}},
                                               .without = {}});
    person_.emplace(*server_);
    ASSERT_TRUE(comes([&] { return person_->has_window() && brightness(person_->color_at(160, 100)) > 60; }));
  }
  static int brightness(test::Rgb color) { return color[0] + color[1] + color[2]; }

  /// A grid of pixels away from the words in the corner.
  std::vector<test::Rgb> look() {
    std::vector<test::Rgb> colors;
    for (int y = 130; y < 230; y += 20)
      for (int x = 20; x < 320; x += 40) colors.push_back(person_->color_at(x, y));
    return colors;
  }
  static double difference(const std::vector<test::Rgb>& a, const std::vector<test::Rgb>& b) {
    int sum = 0;
    for (std::size_t i = 0; i < a.size(); ++i)
      for (std::size_t c = 0; c < 3; ++c) sum += std::abs(a[i][c] - b[i][c]);
    return static_cast<double>(sum) / static_cast<double>(3 * a.size());
  }
  void tap(const char* key) {
    person_->press_key(key);
    person_->release_key(key);
  }
  void click(int x_px, int y_px) {
    person_->move_pointer(x_px, y_px);
    person_->press_button(1);
    person_->release_button(1);
  }

  test::TemporaryFolder folder_;
  const std::filesystem::path out_ = folder_.path() / "out";
  std::unique_ptr<test::XServer> server_;
  std::optional<test::Program> program_;
  std::optional<test::Person> person_;
};

TEST_F(WindowGame, ClickThrowsKeysSwitchTheConditionAndTheViewAndEscapeEndsWithAllOutputs) {
  start(900);
  if (HasFatalFailure()) return;
  rest(1500);  // the map grows
  click(160, 170);
  rest(1500);
  tap("2");
  rest(200);
  click(160, 170);
  rest(1500);
  tap("1");
  rest(200);
  click(160, 170);
  rest(1000);
  const auto help = [&] {  // white letters in the corner
    int white = 0;
    for (int y = 30; y < 90; y += 2)
      for (int x = 8; x < 200; x += 2) white += brightness(person_->color_at(x, y)) > 740 ? 1 : 0;
    return white;
  };
  const int with_help = help();
  tap("h");
  EXPECT_TRUE(comes([&] { return help() < with_help / 2; })) << with_help;
  const auto plain = look();
  rest(100);
  const double by_itself = difference(plain, look());
  tap("l");
  EXPECT_TRUE(comes([&] { return difference(plain, look()) > by_itself + 10; })) << "labels over the video";
  tap("Escape");
  const test::Outcome o = program_->wait();
  EXPECT_EQ(o.code, 0) << o.err;
  expect_all_outputs(out_);
  const json summary = test::summary_of(out_);
  EXPECT_EQ(summary["game"]["throws"], 3) << summary["game"];
  EXPECT_TRUE(test::is_noted(summary, "Nothing is heard")) << summary["notes"];
  const auto throws = events_of(out_, {"throw"});
  ASSERT_EQ(throws.size(), 3u);
  // What was touched by then, of what is known, of nothing known, and not at all.
  bool knows = false, does_not = false;
  for (const json& event : events_of(out_, {"contact", "break"})) {
    const auto frame = event["frame"].get<int>();
    if (frame < throws[1]["frame"].get<int>())
      knows = knows || event["material"] != "unknown";
    else if (frame < throws[2]["frame"].get<int>())
      does_not = does_not || event["material"] == "unknown";
    else
      EXPECT_TRUE(frame == throws[2]["frame"].get<int>()) << event;
  }
  EXPECT_TRUE(knows);
  EXPECT_TRUE(does_not);
}

TEST_F(WindowGame, ServerThatGoesAwayEndsTheWindowAndNothingElse) {
  start(120);
  if (HasFatalFailure()) return;
  person_.reset();
  server_->kill();
  const test::Outcome o = program_->wait();
  EXPECT_EQ(o.code, 0) << o.err;
  expect_all_outputs(out_);
  const json summary = test::summary_of(out_);
  EXPECT_TRUE(test::is_noted(summary, "The display went away")) << summary["notes"];
  EXPECT_FALSE(summary["interrupted"]);
  EXPECT_EQ(summary["frames_in"], 120);
}

TEST(WindowThatCannotBe, IsOneSentenceThatNamesBothReasons) {
  for (const auto& card : {"/dev/dri/card0", "/dev/dri/card1"})
    if (std::filesystem::exists(card)) GTEST_SKIP() << "a screen may be here, which the program would take";
  const test::Outcome unset = test::run_tactus({"run", room(3), "--display", "window"}, {.environment = {}, .without = {"DISPLAY"}});
  EXPECT_EQ(unset.code, 4);
  EXPECT_EQ(unset.out, "");
  EXPECT_NE(unset.err.find("DISPLAY is not set"), std::string::npos) << unset.err;
  EXPECT_NE(unset.err.find("no screen can be driven"), std::string::npos) << unset.err;
  EXPECT_EQ(std::count(unset.err.begin(), unset.err.end(), '\n'), 1) << unset.err;
}

TEST(WindowThatCannotBe, IsOneSentenceWhenNobodyAnswers) {
  const test::Outcome o =
      test::run_tactus({"run", room(3), "--display", "window"}, {.environment = {{"DISPLAY", ":987"}}, .without = {}});
  EXPECT_EQ(o.code, 4);
  EXPECT_EQ(o.out, "");
  EXPECT_NE(o.err.find("DISPLAY=:987"), std::string::npos) << o.err;
  EXPECT_EQ(std::count(o.err.begin(), o.err.end(), '\n'), 1) << o.err;
}

TEST(InterruptedGame, LeavesEveryOutputAndAFilmThatPlays) {
  const test::TemporaryFolder folder;
  const auto out = folder.path() / "out";
  test::Program program({"run", room(900), "--app", "plates", "--out", out.string()});
  ASSERT_TRUE(comes([&] { return std::filesystem::exists(out / "video.mp4"); }));
  rest(2000);
  program.send(SIGINT);
  const test::Outcome o = program.wait();
  EXPECT_EQ(o.code, 0) << o.err;
  expect_all_outputs(out);
  const json summary = test::summary_of(out);
  EXPECT_TRUE(summary["interrupted"]);
  EXPECT_LT(summary["frames_in"].get<int>(), 900);
  EXPECT_EQ(summary["heap_allocations_after_seal"], 0);
}

}  // namespace
}  // namespace tactus::firmware
