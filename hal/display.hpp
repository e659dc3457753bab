// Where pictures go: a window, an offscreen picture, or nowhere. The renderer draws between begin() and
// present().
#pragma once

#include <cstdint>

#include "rt/status.hpp"

namespace tactus::hal {

struct DisplayFormat {
  int width_px = 0, height_px = 0;
};

/// A place to draw with GLES 3. At most one thread at a time uses it; release() lets another one go on (boot
/// binds and warms up, the present thread draws).
class Display {
 public:
  virtual ~Display() = default;
  [[nodiscard]] virtual DisplayFormat format() const = 0;

  /// Opens the next picture: makes the drawing context current on this thread, binds its framebuffer (colour
  /// and depth) and sets the viewport. ok | skipped (nothing can be drawn here: do not draw, do present) |
  /// device_lost. Step or boot.
  virtual rt::Status begin() noexcept = 0;

  /// Shows the picture drawn since begin(). May wait for the drawing to finish and for the display. Step or
  /// boot. ok | device_lost.
  virtual rt::Status present() noexcept = 0;

  /// Gives the drawing context up on this thread, so that another thread may begin(). Boot and stop.
  virtual void release() noexcept = 0;

  /// Pictures shown since the display was opened.
  [[nodiscard]] virtual std::uint64_t frames_presented() const = 0;
};

}  // namespace tactus::hal
