#include "tests/hal/egl/x_server.hpp"

#include <X11/Xlib.h>
#include <X11/Xutil.h>
#include <X11/extensions/XTest.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <thread>

namespace tactus::test {

std::unique_ptr<XServer> XServer::start() {
  std::array<int, 2> ends{};
  if (pipe(ends.data()) != 0) return nullptr;
  const pid_t process = fork();
  if (process < 0) return nullptr;
  if (process == 0) {
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    dup2(ends[1], 3);
    if (ends[0] != 3) close(ends[0]);
    if (ends[1] != 3) close(ends[1]);
    if (std::freopen("/dev/null", "w", stderr) == nullptr) _exit(126);
    execlp("Xvfb", "Xvfb", "-displayfd", "3", "-screen", "0", "800x600x24", "-noreset", "-nolisten", "tcp",
           static_cast<char*>(nullptr));
    _exit(127);
  }
  close(ends[1]);
  std::string number;
  for (char c = 0; read(ends[0], &c, 1) == 1 && c != '\n';) number += c;
  close(ends[0]);
  std::unique_ptr<XServer> server(new XServer(process, ":" + number));
  if (number.empty()) return nullptr;
  return server;
}

void XServer::kill() {
  if (process_ < 0) return;
  ::kill(process_, SIGTERM);  // it removes its socket and lock
  waitpid(process_, nullptr, 0);
  process_ = -1;
}

Person::Person(const XServer& server) : connection_(XOpenDisplay(server.name().c_str())) {
  if (connection_ == nullptr) std::abort();
  // Who looks at a window before it is on the screen sees nothing; by default Xlib ends the program for that.
  XSetErrorHandler([](::Display*, XErrorEvent*) { return 0; });
}
Person::~Person() { XCloseDisplay(connection_); }

unsigned long Person::window() {
  Window root = 0, parent = 0, *children = nullptr;
  unsigned count = 0;
  XQueryTree(connection_, DefaultRootWindow(connection_), &root, &parent, &children, &count);
  const Window found = count == 1 ? children[0] : 0;
  if (children != nullptr) XFree(children);
  return found;
}

void Person::move_pointer(int x_px, int y_px) {
  XWarpPointer(connection_, 0, window(), 0, 0, 0, 0, x_px, y_px);
  XSync(connection_, False);
}
void Person::press_button(unsigned button) {
  XTestFakeButtonEvent(connection_, button, True, 0);
  XSync(connection_, False);
}
void Person::release_button(unsigned button) {
  XTestFakeButtonEvent(connection_, button, False, 0);
  XSync(connection_, False);
}
void Person::press_key(const char* key) {
  XTestFakeKeyEvent(connection_, XKeysymToKeycode(connection_, XStringToKeysym(key)), True, 0);
  XSync(connection_, False);
}
void Person::release_key(const char* key) {
  XTestFakeKeyEvent(connection_, XKeysymToKeycode(connection_, XStringToKeysym(key)), False, 0);
  XSync(connection_, False);
}
void Person::resize_window(unsigned width_px, unsigned height_px) {
  XResizeWindow(connection_, window(), width_px, height_px);
  XSync(connection_, False);
}
void Person::ask_to_close() {
  XEvent event{};
  event.xclient.type = ClientMessage;
  event.xclient.window = window();
  event.xclient.message_type = XInternAtom(connection_, "WM_PROTOCOLS", False);
  event.xclient.format = 32;
  event.xclient.data.l[0] = static_cast<long>(XInternAtom(connection_, "WM_DELETE_WINDOW", False));
  XSendEvent(connection_, event.xclient.window, False, NoEventMask, &event);
  XSync(connection_, False);
}
void Person::destroy_window() {
  XDestroyWindow(connection_, window());
  XSync(connection_, False);
}

Rgb Person::color_at(int x_px, int y_px) {
  XImage* image = XGetImage(connection_, window(), x_px, y_px, 1, 1, AllPlanes, ZPixmap);
  if (image == nullptr) return {-1, -1, -1};
  const unsigned long pixel = XGetPixel(image, 0, 0);
  XDestroyImage(image);
  return {static_cast<int>(pixel >> 16 & 0xFF), static_cast<int>(pixel >> 8 & 0xFF),
          static_cast<int>(pixel & 0xFF)};
}

bool Person::sees(int x_px, int y_px, Rgb color) {
  for (int i = 0; i < 500; ++i) {
    const Rgb seen = color_at(x_px, y_px);
    if (std::abs(seen[0] - color[0]) <= 2 && std::abs(seen[1] - color[1]) <= 2 &&
        std::abs(seen[2] - color[2]) <= 2)
      return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  return false;
}

std::string Person::title() {
  char* name = nullptr;
  std::string title;
  if (XFetchName(connection_, window(), &name) != 0) title = name;
  if (name != nullptr) XFree(name);
  return title;
}

std::array<unsigned, 2> Person::size() {
  XWindowAttributes attributes{};
  XGetWindowAttributes(connection_, window(), &attributes);
  return {static_cast<unsigned>(attributes.width), static_cast<unsigned>(attributes.height)};
}

}  // namespace tactus::test
