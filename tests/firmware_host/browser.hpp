// A Chromium without a window, told what to do through its DevTools protocol: pages are tried as their
// readers have them.
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace tactus::test {

class Browser {
 public:
  /// $TACTUS_CHROMIUM, or the first of chromium, chromium-browser and google-chrome in PATH; nothing when
  /// there is none.
  static std::optional<std::filesystem::path> find_program();

  /// Profile, messages and downloads go into `folder`, which must outlive it.
  Browser(const std::filesystem::path& program, const std::filesystem::path& folder);
  ~Browser();
  Browser(const Browser&) = delete;
  Browser& operator=(const Browser&) = delete;

  struct Page {
    std::string session;
  };
  /// In a window of its own, so that several are visible at once; returns when it has loaded. Failures here
  /// and below fail the test.
  Page open(const std::filesystem::path& file);
  /// The expression's value; a promise is waited for, up to a minute. Null when it throws, which fails the
  /// test.
  nlohmann::json evaluate(const Page& page, const std::string& expression);
  /// Until the expression is true, also over a reload; false after half a minute.
  bool wait_until(const Page& page, const std::string& expression);
  /// Presses a key as a keyboard does: "Tab", "Enter", " ", "ArrowRight".
  void press(const Page& page, std::string_view key);
  void type(const Page& page, const std::string& text);
  void emulate(const Page& page, bool is_dark, int width_px, int height_px);
  void screenshot(const Page& page, const std::filesystem::path& png);

  [[nodiscard]] std::filesystem::path downloads() const { return folder_ / "downloads"; }
  /// URLs that pages asked for, the pages' own included.
  [[nodiscard]] const std::vector<std::string>& requests() const { return requests_; }

 private:
  nlohmann::json call(const std::string& method, nlohmann::json params, const std::string& session = "",
                      bool is_quiet = false);
  /// The next message; null when the browser is silent for a minute or gone.
  nlohmann::json receive();

  std::filesystem::path folder_;
  pid_t process_ = -1;
  int socket_ = -1;
  int id_ = 0;
  std::string received_;
  std::vector<std::string> requests_;
};

}  // namespace tactus::test
