#include "tests/firmware_host/browser.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <signal.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <thread>

namespace tactus::test {

namespace fs = std::filesystem;
using nlohmann::json;

std::optional<fs::path> Browser::find_program() {
  if (const char* chosen = std::getenv("TACTUS_CHROMIUM")) return fs::path(chosen);
  const char* path = std::getenv("PATH");
  for (const char* name : {"chromium", "chromium-browser", "google-chrome"}) {
    std::istringstream folders(path != nullptr ? path : "");
    for (std::string folder; std::getline(folders, folder, ':');)
      if (access((fs::path(folder) / name).c_str(), X_OK) == 0) return fs::path(folder) / name;
  }
  return std::nullopt;
}

Browser::Browser(const fs::path& program, const fs::path& folder) : folder_(folder) {
  fs::create_directories(downloads());
  int ends[2] = {-1, -1};
  if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0) return;
  const std::string profile = "--user-data-dir=" + (folder / "profile").string(),
                    messages = (folder / "messages").string();
  const char* const words[] = {program.c_str(),
                               "--headless",
                               "--no-sandbox",
                               "--disable-gpu",
                               "--disable-dev-shm-usage",
                               "--disable-quic",
                               "--no-first-run",
                               "--disable-background-networking",
                               "--disable-component-update",
                               "--disable-sync",
                               "--autoplay-policy=no-user-gesture-required",
                               "--remote-debugging-pipe",
                               profile.c_str(),
                               "about:blank",
                               nullptr};
  process_ = fork();
  if (process_ == 0) {
    setpgid(0, 0);
    // The browser reads commands from 3 and answers on 4; above them first, since the socket may be one of
    // the two.
    const int socket = fcntl(ends[1], F_DUPFD, 10),
              log = ::open(messages.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
    dup2(log, 1);
    dup2(log, 2);
    dup2(socket, 3);
    dup2(socket, 4);
    execv(program.c_str(), const_cast<char* const*>(words));
    _exit(127);
  }
  close(ends[1]);
  socket_ = ends[0];
  call("Browser.setDownloadBehavior", {{"behavior", "allow"}, {"downloadPath", downloads().string()}});
}

Browser::~Browser() {
  if (socket_ >= 0) close(socket_);  // it ends when nobody is left at the other end
  if (process_ <= 0) return;
  for (int i = 0; i < 100; ++i) {
    if (waitpid(process_, nullptr, WNOHANG) == process_) {
      kill(-process_, SIGKILL);  // helpers of the browser that are not done yet
      return;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  kill(-process_, SIGKILL);
  waitpid(process_, nullptr, 0);
}

json Browser::receive() {
  for (;;) {
    const std::size_t end = received_.find('\0');
    if (end != std::string::npos) {
      json message = json::parse(received_.substr(0, end), nullptr, false);
      received_.erase(0, end + 1);
      return message;
    }
    pollfd ready{socket_, POLLIN, 0};
    char bytes[65536];
    if (poll(&ready, 1, 60'000) <= 0) return nullptr;
    const ssize_t count = recv(socket_, bytes, sizeof bytes, 0);
    if (count <= 0) return nullptr;
    received_.append(bytes, static_cast<std::size_t>(count));
  }
}

json Browser::call(const std::string& method, json params, const std::string& session, bool is_quiet) {
  json command = {{"id", ++id_}, {"method", method}, {"params", std::move(params)}};
  if (!session.empty()) command["sessionId"] = session;
  const std::string text = command.dump() + '\0';
  for (std::size_t sent = 0; sent < text.size();) {
    const ssize_t count = send(socket_, text.data() + sent, text.size() - sent, MSG_NOSIGNAL);
    if (count <= 0) break;
    sent += static_cast<std::size_t>(count);
  }
  for (;;) {
    const json message = receive();
    if (!message.is_object()) {
      std::ifstream said(folder_ / "messages");
      ADD_FAILURE() << method << ": the browser does not answer; it said: " << said.rdbuf();
      return nullptr;
    }
    if (message.value("id", 0) == id_) {
      if (message.contains("error") && !is_quiet) ADD_FAILURE() << method << ": " << message["error"].dump();
      return message.value("result", json());
    }
    if (message.value("method", "") == "Network.requestWillBeSent")
      requests_.push_back(message["params"]["request"]["url"]);
  }
}

Browser::Page Browser::open(const fs::path& file) {
  const json target = call("Target.createTarget", {{"url", "about:blank"}, {"newWindow", true}});
  if (!target.is_object()) return {};
  const json attached = call("Target.attachToTarget", {{"targetId", target["targetId"]}, {"flatten", true}});
  Page page{attached["sessionId"]};
  call("Page.enable", json::object(), page.session);
  call("Network.enable", json::object(), page.session);
  call("Page.navigate", {{"url", "file://" + file.string()}}, page.session);
  EXPECT_TRUE(wait_until(page, "document.readyState === 'complete' && location.protocol === 'file:'"))
      << file;
  return page;
}

json Browser::evaluate(const Page& page, const std::string& expression) {
  const json answer = call(
      "Runtime.evaluate",
      {{"expression", expression}, {"awaitPromise", true}, {"returnByValue", true}, {"userGesture", true}},
      page.session);
  if (!answer.is_object()) return nullptr;
  if (answer.contains("exceptionDetails")) {
    ADD_FAILURE() << expression << "\n" << answer["exceptionDetails"].dump(1);
    return nullptr;
  }
  return answer["result"].value("value", json());
}

bool Browser::wait_until(const Page& page, const std::string& expression) {
  for (int i = 0; i < 600; ++i) {
    const json answer =
        call("Runtime.evaluate", {{"expression", expression}, {"returnByValue", true}}, page.session, true);
    if (answer.is_object() && !answer.contains("exceptionDetails") &&
        answer["result"].value("value", json()) == true)
      return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  return false;
}

void Browser::press(const Page& page, std::string_view key) {
  struct Key {
    std::string_view name;
    const char* code;
    int number;
    const char* text;
  };
  constexpr Key kKeys[] = {{"Tab", "Tab", 9, ""},
                           {"Enter", "Enter", 13, "\r"},
                           {" ", "Space", 32, " "},
                           {"ArrowRight", "ArrowRight", 39, ""}};
  const Key* found =
      std::find_if(std::begin(kKeys), std::end(kKeys), [&](const Key& k) { return k.name == key; });
  ASSERT_NE(found, std::end(kKeys)) << key;
  json event = {
      {"type", "keyDown"}, {"key", key}, {"code", found->code}, {"windowsVirtualKeyCode", found->number}};
  if (*found->text != '\0') event["text"] = found->text;
  call("Input.dispatchKeyEvent", event, page.session);
  event.erase("text");
  event["type"] = "keyUp";
  call("Input.dispatchKeyEvent", event, page.session);
}

void Browser::type(const Page& page, const std::string& text) {
  call("Input.insertText", {{"text", text}}, page.session);
}

void Browser::emulate(const Page& page, bool is_dark, int width_px, int height_px) {
  call("Emulation.setEmulatedMedia",
       {{"features", {{{"name", "prefers-color-scheme"}, {"value", is_dark ? "dark" : "light"}}}}},
       page.session);
  call("Emulation.setDeviceMetricsOverride",
       {{"width", width_px}, {"height", height_px}, {"deviceScaleFactor", 1}, {"mobile", false}},
       page.session);
}

void Browser::screenshot(const Page& page, const fs::path& png) {
  const json answer =
      call("Page.captureScreenshot", {{"format", "png"}, {"captureBeyondViewport", true}}, page.session);
  const std::string text = answer.value("data", "");
  std::string bytes;
  unsigned bits = 0, count = 0;
  for (const char c : text) {
    constexpr std::string_view kAlphabet = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    const std::size_t digit = kAlphabet.find(c);
    if (digit == std::string_view::npos) break;
    bits = bits << 6 | static_cast<unsigned>(digit);
    count += 6;
    if (count >= 8) bytes += static_cast<char>(bits >> (count -= 8) & 0xFF);
  }
  EXPECT_FALSE(bytes.empty());
  std::ofstream(png, std::ios::binary) << bytes;
}

}  // namespace tactus::test
