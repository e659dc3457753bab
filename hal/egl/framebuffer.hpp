// The picture that both displays draw: a framebuffer of its own size in a context that is current.
#pragma once

#include <cstdint>

#include "hal/display.hpp"
#include "hal/egl/context.hpp"

namespace tactus::hal::egl {

/// 8-bit RGBA and 24-bit depth. Its memory belongs to the context and goes with it.
class Framebuffer {
 public:
  /// Boot; `context` is current. Errors: bad_usage (a size the driver cannot draw), device_unavailable (no
  /// memory).
  static rt::Result<Framebuffer> create(DisplayFormat format, const Context& context);

  /// Binds it for drawing and reading, with the viewport of its size. Step.
  void bind() const noexcept;
  /// Copies the picture to the context's surface of that size, scaled and whole with black bars, see
  /// letterbox.hpp. Step.
  void show(DisplayFormat surface) const noexcept;
  [[nodiscard]] DisplayFormat format() const { return format_; }

 private:
  explicit Framebuffer(DisplayFormat format) : format_(format) {}
  DisplayFormat format_;
  std::uint32_t name_ = 0;  // GL's
};

}  // namespace tactus::hal::egl
