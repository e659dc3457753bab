// A real X server for one test, and a second client of it: a person's eyes and hands.
#pragma once

#include <sys/types.h>

#include <array>
#include <memory>
#include <string>

struct _XDisplay;

namespace tactus::test {

/// Xvfb with one screen of 800 x 600, killed with its owner.
class XServer {
 public:
  /// Null where Xvfb is not installed or does not start.
  static std::unique_ptr<XServer> start();
  XServer(const XServer&) = delete;
  XServer& operator=(const XServer&) = delete;
  ~XServer() { kill(); }

  /// For $DISPLAY.
  [[nodiscard]] const std::string& name() const { return name_; }
  /// Ends it at once and waits until it is gone.
  void kill();

 private:
  XServer(pid_t process, std::string name) : process_(process), name_(std::move(name)) {}
  pid_t process_;  // -1: none
  std::string name_;
};

using Rgb = std::array<int, 3>;

/// Works on the one window that the server shows; coordinates are the window's.
class Person {
 public:
  explicit Person(const XServer& server);
  ~Person();
  Person(const Person&) = delete;
  Person& operator=(const Person&) = delete;

  /// Whether there is a window yet; the others work on one that is there.
  [[nodiscard]] bool has_window() { return window() != 0; }
  void move_pointer(int x_px, int y_px);
  void press_button(unsigned button);
  void release_button(unsigned button);
  /// By X's names: "Left", "l", "space", "Shift_L".
  void press_key(const char* key);
  void release_key(const char* key);
  void resize_window(unsigned width_px, unsigned height_px);
  /// As a window manager does when its close button is pressed.
  void ask_to_close();
  void destroy_window();

  [[nodiscard]] Rgb color_at(int x_px, int y_px);
  /// Looks again and again, up to 5 s, until that colour (within 2 of 255) is there.
  [[nodiscard]] bool sees(int x_px, int y_px, Rgb color);
  /// The window's title, width and height.
  [[nodiscard]] std::string title();
  [[nodiscard]] std::array<unsigned, 2> size();

 private:
  [[nodiscard]] unsigned long window();
  _XDisplay* connection_;
};

}  // namespace tactus::test
