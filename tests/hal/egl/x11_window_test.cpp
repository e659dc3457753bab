// The window on a real X server, looked at and worked with by a second client.
#include "hal/egl/x11_window.hpp"

#include <GLES3/gl3.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cstdlib>
#include <memory>
#include <optional>
#include <thread>
#include <vector>

#include "tests/hal/egl/x_server.hpp"

namespace tactus::hal::egl {
namespace {

using Kind = InputEvent::Kind;
using test::Rgb;
constexpr Rgb kRed{255, 0, 0}, kGreen{0, 255, 0}, kBlack{0, 0, 0};

class WindowDisplayTest : public testing::Test {
 protected:
  // Holds Mesa's driver in memory: unloaded with the last window, it leaves 240 bytes that nobody points to
  // any more.
  static void SetUpTestSuite() { driver_.emplace(Context::create({})); }

  void SetUp() override {
    server_ = test::XServer::start();
    if (!server_) GTEST_SKIP() << "Xvfb is not here or does not start; install xvfb";
    setenv("DISPLAY", server_->name().c_str(), 1);
    open({160, 120});
  }

  void open(DisplayFormat format) {
    auto created = WindowDisplay::create(format, {.title = "a title"});
    if (!created && created.error().message.find("EGL does not draw into windows") != std::string::npos)
      GTEST_SKIP() << created.error().message;
    ASSERT_TRUE(created) << created.error().message;
    sut_.emplace(std::move(*created));
    person_.emplace(*server_);
  }

  // Upper half of one colour, lower half of another.
  rt::Status draw(Rgb upper, Rgb lower) {
    const rt::Status status = sut_->begin();
    if (status != rt::Status::ok) return status;
    const DisplayFormat size = sut_->format();
    const auto fill = [](Rgb color) {
      glClearColor(static_cast<float>(color[0]) / 255, static_cast<float>(color[1]) / 255,
                   static_cast<float>(color[2]) / 255, 1);
      glClear(GL_COLOR_BUFFER_BIT);
    };
    glDisable(GL_SCISSOR_TEST);
    fill(lower);
    glEnable(GL_SCISSOR_TEST);
    glScissor(0, size.height_px / 2, size.width_px, size.height_px / 2);
    fill(upper);
    return sut_->present();  // the scissor is left on: it must not cut the window
  }

  // Everything that comes until an event of that kind, within 5 s.
  std::vector<InputEvent> events_until(Kind kind) {
    std::vector<InputEvent> events;
    for (int i = 0; i < 500; ++i) {
      for (InputEvent event; sut_->poll(event);) {
        events.push_back(event);
        if (event.kind == kind) return events;
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    ADD_FAILURE() << "no event of kind " << static_cast<int>(kind);
    events.emplace_back();
    return events;
  }

  static inline std::optional<rt::Result<Context>> driver_;
  std::unique_ptr<test::XServer> server_;
  std::optional<test::Person> person_;
  std::optional<WindowDisplay> sut_;
};

TEST_F(WindowDisplayTest, PictureStandsUprightInTheWindowAndCanBeReadBack) {
  EXPECT_EQ(person_->size(), (std::array{160U, 120U}));
  EXPECT_EQ(person_->title(), "a title");
  ASSERT_EQ(draw(kRed, kGreen), rt::Status::ok);
  EXPECT_TRUE(person_->sees(80, 10, kRed));
  EXPECT_TRUE(person_->sees(80, 110, kGreen));
  EXPECT_EQ(person_->color_at(0, 0), kRed);
  EXPECT_EQ(person_->color_at(159, 119), kGreen);
  std::array<std::uint8_t, 4> rgba{};
  glReadPixels(80, 110, 1, 1, GL_RGBA, GL_UNSIGNED_BYTE, rgba.data());
  EXPECT_EQ(rgba, (std::array<std::uint8_t, 4>{255, 0, 0, 255}));
  EXPECT_EQ(sut_->frames_presented(), 1U);
  EXPECT_EQ(glGetError(), static_cast<GLenum>(GL_NO_ERROR));
}

TEST_F(WindowDisplayTest, AnotherThreadDrawsOnlyAfterRelease) {
  rt::Status while_held = rt::Status::ok, when_released = rt::Status::device_lost;
  ASSERT_EQ(draw(kRed, kRed), rt::Status::ok);
  std::thread([&] { while_held = sut_->begin(); }).join();
  sut_->release();
  std::thread([&] {
    when_released = draw(kGreen, kGreen);
    sut_->release();
  }).join();
  EXPECT_EQ(while_held, rt::Status::device_lost);
  EXPECT_EQ(when_released, rt::Status::ok);
  EXPECT_TRUE(person_->sees(80, 60, kGreen));
}

TEST_F(WindowDisplayTest, ResizedWindowShowsTheWholePictureBetweenBars) {
  ASSERT_EQ(draw(kRed, kGreen), rt::Status::ok);
  person_->resize_window(480, 240);  // twice as large: 320 x 240 in the middle
  const auto events = events_until(Kind::resize);
  EXPECT_EQ(events.back().x_px, 480);
  EXPECT_EQ(events.back().y_px, 240);
  for (int i = 0; i < 3; ++i) ASSERT_EQ(draw(kRed, kGreen), rt::Status::ok);
  EXPECT_TRUE(person_->sees(240, 20, kRed));
  EXPECT_TRUE(person_->sees(240, 220, kGreen));
  EXPECT_TRUE(person_->sees(82, 2, kRed));
  EXPECT_TRUE(person_->sees(397, 237, kGreen));
  EXPECT_TRUE(person_->sees(78, 120, kBlack));
  EXPECT_TRUE(person_->sees(402, 120, kBlack));
  EXPECT_EQ(sut_->format().width_px, 160);
}

TEST_F(WindowDisplayTest, PointerAndButtonsComeInPixelsOfThePicture) {
  person_->move_pointer(31, 47);
  auto events = events_until(Kind::pointer_move);
  EXPECT_EQ(events.back().x_px, 31);
  EXPECT_EQ(events.back().y_px, 47);

  person_->resize_window(480, 240);
  events_until(Kind::resize);
  person_->move_pointer(80 + 2 * 50, 2 * 30);
  person_->press_button(3);
  person_->release_button(3);
  events = events_until(Kind::button_up);
  ASSERT_GE(events.size(), 3U);
  const InputEvent& move = events[events.size() - 3];
  const InputEvent& down = events[events.size() - 2];
  EXPECT_EQ(move.kind, Kind::pointer_move);
  EXPECT_EQ(down.kind, Kind::button_down);
  for (const InputEvent& event : {move, down, events.back()}) {
    EXPECT_FLOAT_EQ(event.x_px, 49.75F);
    EXPECT_FLOAT_EQ(event.y_px, 29.75F);
  }
  EXPECT_EQ(down.button, 3);
  EXPECT_EQ(events.back().button, 3);

  person_->move_pointer(10, 10);  // on the left bar
  EXPECT_LT(events_until(Kind::pointer_move).back().x_px, -0.5F);
}

TEST_F(WindowDisplayTest, KeysGoDownAndUpByWhatTheyType) {
  person_->move_pointer(80, 60);
  const std::vector<std::pair<const char*, Key>> keys{
      {"Left", Key::left},   {"Right", Key::right},   {"Up", Key::up},    {"Down", Key::down},
      {"space", Key::space}, {"Escape", Key::escape}, {"Tab", Key::tab},  {"Return", Key::enter},
      {"l", Key{'L'}},       {"h", Key{'H'}},         {"p", Key{'P'}},    {"m", Key{'M'}},
      {"0", Key{'0'}},       {"9", Key{'9'}},         {"minus", Key{'-'}}};
  for (const auto& [name, key] : keys) {
    person_->press_key(name);
    EXPECT_EQ(events_until(Kind::key_down).back().key, key) << name;
    person_->release_key(name);
    EXPECT_EQ(events_until(Kind::key_up).back().key, key) << name;
  }
}

TEST_F(WindowDisplayTest, KeyComesUpAsWhatItWentDownThoughShiftWasLetGoFirst) {
  person_->move_pointer(80, 60);
  person_->press_key("Shift_L");
  person_->press_key("1");
  const Key down = events_until(Kind::key_down).back().key;
  person_->release_key("Shift_L");
  person_->release_key("1");
  EXPECT_EQ(down, Key{'!'});
  EXPECT_EQ(events_until(Kind::key_up).back().key, Key{'!'});
}

TEST_F(WindowDisplayTest, CloseButtonIsAnEventAndTheWindowStays) {
  person_->ask_to_close();
  events_until(Kind::close);
  EXPECT_EQ(draw(kRed, kRed), rt::Status::ok);
  EXPECT_TRUE(person_->sees(80, 60, kRed));
}

TEST_F(WindowDisplayTest, LostServerIsDeviceLostAndTheNextServerWorks) {
  ASSERT_EQ(draw(kRed, kGreen), rt::Status::ok);
  person_.reset();
  server_->kill();
  ASSERT_EQ(sut_->begin(), rt::Status::ok);  // not noticed yet
  EXPECT_EQ(sut_->present(), rt::Status::device_lost);
  EXPECT_EQ(sut_->begin(), rt::Status::device_lost);
  EXPECT_EQ(sut_->present(), rt::Status::device_lost);
  InputEvent event;
  EXPECT_FALSE(sut_->poll(event));
  EXPECT_EQ(sut_->frames_presented(), 1U);
  sut_->release();
  sut_.reset();

  server_.reset();
  server_ = test::XServer::start();
  ASSERT_TRUE(server_);
  setenv("DISPLAY", server_->name().c_str(), 1);
  open({160, 120});
  ASSERT_EQ(draw(kGreen, kGreen), rt::Status::ok);
  EXPECT_TRUE(person_->sees(80, 60, kGreen));
}

TEST_F(WindowDisplayTest, ServerThatGoesAwayAtAnyTimeEndsTheDisplayAlone) {
  for (int round = 0; round < 5; ++round) {
    SCOPED_TRACE(round);
    person_.reset();
    std::thread killer([&] {
      std::this_thread::sleep_for(std::chrono::microseconds(3000 + 700 * round));
      server_->kill();
    });
    rt::Status status = rt::Status::ok;
    while (status == rt::Status::ok) status = draw(kRed, kGreen);
    killer.join();
    EXPECT_EQ(status, rt::Status::device_lost);
    sut_.reset();
    server_ = test::XServer::start();
    ASSERT_TRUE(server_);
    setenv("DISPLAY", server_->name().c_str(), 1);
    open({160, 120});
  }
}

TEST_F(WindowDisplayTest, ServerLostToTheDrawingThreadLetsAnotherThreadCloseTheDisplay) {
  for (const bool polls : {false, true}) {
    SCOPED_TRACE(polls);
    sut_->release();
    std::thread drawing([&] {
      EXPECT_EQ(draw(kRed, kGreen), rt::Status::ok);
      person_.reset();
      server_->kill();
      InputEvent event;
      if (polls) {
        EXPECT_FALSE(sut_->poll(event));
      }
      while (draw(kRed, kGreen) == rt::Status::ok) {
      }
      sut_->release();
    });
    drawing.join();
    sut_.reset();
    server_ = test::XServer::start();
    ASSERT_TRUE(server_);
    setenv("DISPLAY", server_->name().c_str(), 1);
    open({160, 120});
  }
}

TEST_F(WindowDisplayTest, WindowDestroyedByAnotherIsDeviceLost) {
  ASSERT_EQ(draw(kRed, kGreen), rt::Status::ok);
  person_->destroy_window();
  rt::Status status = rt::Status::ok;
  for (int i = 0; i < 100 && status == rt::Status::ok; ++i) status = draw(kRed, kGreen);
  EXPECT_EQ(status, rt::Status::device_lost);
}

TEST_F(WindowDisplayTest, PictureLargerThanTheScreenIsShownWhole) {
  sut_.reset();
  open({1600, 900});
  EXPECT_EQ(person_->size(), (std::array{800U, 450U}));
  ASSERT_EQ(draw(kRed, kGreen), rt::Status::ok);
  EXPECT_TRUE(person_->sees(400, 10, kRed));
  EXPECT_TRUE(person_->sees(400, 440, kGreen));
  EXPECT_EQ(sut_->format().width_px, 1600);
}

TEST_F(WindowDisplayTest, SizeThatCannotBeDrawnIsBadUsage) {
  for (const DisplayFormat format : {DisplayFormat{0, 48}, DisplayFormat{1 << 20, 48}}) {
    const auto refused = WindowDisplay::create(format);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, rt::ExitCode::bad_usage) << refused.error().message;
  }
}

TEST(WindowDisplayWithoutServer, CreateSaysWhatIsMissing) {
  unsetenv("DISPLAY");
  const auto unset = WindowDisplay::create({160, 120});
  ASSERT_FALSE(unset);
  EXPECT_EQ(unset.error().code, rt::ExitCode::device_unavailable);
  EXPECT_NE(unset.error().message.find("DISPLAY is not set"), std::string::npos);
  setenv("DISPLAY", ":9876", 1);
  const auto nobody = WindowDisplay::create({160, 120});
  ASSERT_FALSE(nobody);
  EXPECT_EQ(nobody.error().code, rt::ExitCode::device_unavailable);
  EXPECT_NE(nobody.error().message.find(":9876"), std::string::npos);
}

}  // namespace
}  // namespace tactus::hal::egl
