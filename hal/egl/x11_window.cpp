#include "hal/egl/x11_window.hpp"

#include <algorithm>
#include <cstdlib>
#include <optional>

#include "hal/egl/event_queue.hpp"
#include "hal/egl/framebuffer.hpp"
#include "hal/egl/letterbox.hpp"
#include "hal/egl/sigpipe_guard.hpp"
#include "hal/egl/x11_keys.hpp"

// Last: it defines Status and other common words as macros.
#include <X11/XKBlib.h>
#include <X11/Xlib.h>
#include <X11/Xutil.h>
#undef Status

namespace tactus::hal::egl {
namespace {

struct CloseConnection {
  void operator()(::Display* connection) const { XCloseDisplay(connection); }  // its windows go with it
};

rt::Error unavailable(const std::string& what) {
  return {rt::ExitCode::device_unavailable, "no window can be opened: " + what};
}

// By default Xlib ends the program on any error. A request that came too late for its window does no harm,
// and what a lost server means is for the display to say.
void keep_program_alive() {
  XSetErrorHandler([](::Display*, XErrorEvent*) { return 0; });
  XSetIOErrorHandler([](::Display*) { return 0; });
}

}  // namespace

struct WindowDisplay::State {
  bool is_lost = false;  // set by Xlib in the middle of any of its calls
  std::unique_ptr<::Display, CloseConnection> connection;
  std::optional<Context> context;
  std::optional<Framebuffer> framebuffer;
  ::Window window = 0;
  Atom delete_window = 0;
  DisplayFormat window_size;
  X11Keys keys;
  EventQueue events;
  std::uint64_t frames_presented = 0;

  ~State() {
    const SigpipeGuard guard;
    context.reset();
    connection.reset();
  }

  void open_window(DisplayFormat size, const std::string& title);
  void take_events() noexcept;
  void take(XEvent& event) noexcept;
  void push_pointer(InputEvent::Kind kind, int x_px, int y_px, unsigned button) noexcept;
};

void WindowDisplay::State::open_window(DisplayFormat size, const std::string& title) {
  ::Display* x = connection.get();
  const ::Window root = DefaultRootWindow(x);
  XVisualInfo wanted{};
  wanted.visualid = static_cast<VisualID>(context->visual());
  int found_count = 0;
  XVisualInfo* found = XGetVisualInfo(x, VisualIDMask, &wanted, &found_count);
  if (found == nullptr) return;
  XSetWindowAttributes attributes{};
  attributes.colormap = XCreateColormap(x, root, found->visual, AllocNone);
  attributes.event_mask = KeyPressMask | KeyReleaseMask | ButtonPressMask | ButtonReleaseMask |
                          PointerMotionMask | StructureNotifyMask;
  window = XCreateWindow(x, root, 0, 0, static_cast<unsigned>(size.width_px),
                         static_cast<unsigned>(size.height_px), 0, found->depth, InputOutput, found->visual,
                         CWColormap | CWEventMask | CWBackPixel | CWBorderPixel, &attributes);
  XFree(found);
  window_size = size;
  XStoreName(x, window, title.c_str());
  delete_window = XInternAtom(x, "WM_DELETE_WINDOW", False);
  XSetWMProtocols(x, window, &delete_window, 1);
  XkbSetDetectableAutoRepeat(x, True, nullptr);  // a held key goes down again and again and comes up once
  XMapWindow(x, window);
  XSync(x, False);
}

void WindowDisplay::State::push_pointer(InputEvent::Kind kind, int x_px, int y_px, unsigned button) noexcept {
  const PicturePoint point = to_picture(fit(framebuffer->format(), window_size), x_px, y_px);
  InputEvent event;
  event.kind = kind;
  event.button = static_cast<std::uint8_t>(button);
  event.x_px = point.x_px;
  event.y_px = point.y_px;
  events.push(event);
}

void WindowDisplay::State::take(XEvent& event) noexcept {
  using Kind = InputEvent::Kind;
  switch (event.type) {
    case KeyPress:
    case KeyRelease: {
      InputEvent input;
      input.kind = event.type == KeyPress ? Kind::key_down : Kind::key_up;
      input.key = keys.key_of_event(event);
      if (input.key != Key::none) events.push(input);
      break;
    }
    case MotionNotify:
      push_pointer(Kind::pointer_move, event.xmotion.x, event.xmotion.y, 0);
      break;
    case ButtonPress:
      push_pointer(Kind::button_down, event.xbutton.x, event.xbutton.y, event.xbutton.button);
      break;
    case ButtonRelease:
      push_pointer(Kind::button_up, event.xbutton.x, event.xbutton.y, event.xbutton.button);
      break;
    case ConfigureNotify: {
      const DisplayFormat size{event.xconfigure.width, event.xconfigure.height};
      if (size.width_px == window_size.width_px && size.height_px == window_size.height_px) break;
      window_size = size;
      InputEvent input;
      input.kind = Kind::resize;
      input.x_px = static_cast<float>(size.width_px);
      input.y_px = static_cast<float>(size.height_px);
      events.push(input);
      break;
    }
    case ClientMessage:
      if (static_cast<Atom>(event.xclient.data.l[0]) == delete_window) events.push({});
      break;
    case DestroyNotify:
      is_lost = true;
      break;
    case MappingNotify:
      XRefreshKeyboardMapping(&event.xmapping);
      break;
    default:
      break;
  }
}

void WindowDisplay::State::take_events() noexcept {
  while (!is_lost && XPending(connection.get()) > 0) {
    XEvent event;
    XNextEvent(connection.get(), &event);
    if (!is_lost) take(event);
  }
}

rt::Result<WindowDisplay> WindowDisplay::create(DisplayFormat format, const WindowConfig& config) {
  const char* name = std::getenv("DISPLAY");
  if (name == nullptr || *name == '\0')
    return unavailable("DISPLAY is not set; start the program within a desktop, or run without a window.");
  const SigpipeGuard guard;
  XInitThreads();  // boot opens the window, another thread draws
  keep_program_alive();
  auto state = std::make_unique<State>();
  state->connection.reset(XOpenDisplay(nullptr));
  ::Display* x = state->connection.get();
  if (x == nullptr)
    return unavailable(std::string("no X server that lets us in answers at DISPLAY=") + name +
                       "; start the program within a desktop, or run without a window.");
  // Before it comes here Xlib locks the connection for the calling thread, as the program is to end in it;
  // another one, which closes the display later, would wait for that lock for ever.
  XSetIOErrorExitHandler(
      x,
      [](::Display* lost, void* is_lost) {
        *static_cast<bool*>(is_lost) = true;
        XUnlockDisplay(lost);
      },
      &state->is_lost);
  const int screen = DefaultScreen(x);
  auto context =
      Context::create_x11(x, static_cast<int>(XVisualIDFromVisual(DefaultVisual(x, screen))), config.context);
  if (!context) return context.error();
  state->context = std::move(*context);
  const DisplayFormat screen_size{DisplayWidth(x, screen), DisplayHeight(x, screen)};
  DisplayFormat size = format;
  if (size.width_px > screen_size.width_px || size.height_px > screen_size.height_px) {
    const Letterbox box = fit(format, screen_size);
    size = {box.width_px, box.height_px};
  }
  // X knows no empty window; the framebuffer says what is wrong with such a size.
  state->open_window({std::max(size.width_px, 1), std::max(size.height_px, 1)}, config.title);
  if (state->is_lost || state->window == 0)
    return unavailable(std::string("the X server at DISPLAY=") + name +
                       " has no window for EGL to draw into.");
  const auto attached = state->context->attach(&state->window);
  if (!attached) return attached.error();
  const auto framebuffer = Framebuffer::create(format, *state->context);
  if (!framebuffer) return framebuffer.error();
  state->framebuffer = *framebuffer;
  return WindowDisplay(std::move(state));
}

WindowDisplay::WindowDisplay(std::unique_ptr<State> state) : state_(std::move(state)) {}
WindowDisplay::WindowDisplay(WindowDisplay&&) noexcept = default;
WindowDisplay::~WindowDisplay() = default;

DisplayFormat WindowDisplay::format() const { return state_->framebuffer->format(); }
std::uint64_t WindowDisplay::frames_presented() const { return state_->frames_presented; }
const Context& WindowDisplay::context() const { return *state_->context; }

rt::Status WindowDisplay::begin() noexcept {
  if (state_->is_lost) return rt::Status::device_lost;
  const SigpipeGuard guard;
  const rt::Status status = state_->context->make_current();
  if (status == rt::Status::ok) state_->framebuffer->bind();
  return status;
}

rt::Status WindowDisplay::present() noexcept {
  const SigpipeGuard guard;
  state_->take_events();
  if (state_->is_lost) return rt::Status::device_lost;
  state_->framebuffer->show(state_->window_size);
  const rt::Status status = state_->context->swap();
  state_->framebuffer->bind();
  if (state_->is_lost || status != rt::Status::ok) {
    state_->is_lost = true;
    return rt::Status::device_lost;
  }
  ++state_->frames_presented;
  return rt::Status::ok;
}

void WindowDisplay::release() noexcept {
  const SigpipeGuard guard;
  state_->context->release();
}

bool WindowDisplay::poll(InputEvent& event) noexcept {
  const SigpipeGuard guard;
  state_->take_events();
  return state_->events.pop(event);
}

}  // namespace tactus::hal::egl
