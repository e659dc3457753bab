// A window on an X server's screen, with the keys and the pointer that a person uses over it.
#pragma once

#include <memory>
#include <string>

#include "hal/display.hpp"
#include "hal/egl/context.hpp"
#include "hal/input.hpp"

namespace tactus::hal::egl {

struct WindowConfig {
  std::string title = "tactus";
  ContextConfig context = {};
};

/// Pictures of a fixed size, drawn into a framebuffer of their own, so that they can be read back after
/// present(), and shown scaled, whole, with black bars, in a window that the person may resize. At the
/// screen's rate where the driver can wait for it.
///
/// Thread: as Display; poll() belongs to the thread that draws. The process's handlers of X errors are
/// replaced: errors are ignored, and losing the server ends the display, not the program.
class WindowDisplay final : public Display, public InputSource {
 public:
  /// Opens the window on $DISPLAY, no larger than the screen, and leaves the context current on the calling
  /// thread. Boot. Errors, one sentence each: device_unavailable ($DISPLAY is not set, nobody answers there,
  /// no EGL or GLES 3 on it), bad_usage (a size that cannot be drawn).
  static rt::Result<WindowDisplay> create(DisplayFormat format, const WindowConfig& config = {});

  WindowDisplay(WindowDisplay&&) noexcept;
  WindowDisplay& operator=(WindowDisplay&&) = delete;
  ~WindowDisplay() override;

  [[nodiscard]] DisplayFormat format() const override;
  /// device_lost for good once the server or the window is gone.
  rt::Status begin() noexcept override;
  rt::Status present() noexcept override;
  void release() noexcept override;
  [[nodiscard]] std::uint64_t frames_presented() const override;

  /// Up to 64 events wait; more are dropped, see EventQueue. After the loss of the server: those that came
  /// before.
  bool poll(InputEvent& event) noexcept override;

  [[nodiscard]] const Context& context() const;

 private:
  struct State;
  explicit WindowDisplay(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace tactus::hal::egl
