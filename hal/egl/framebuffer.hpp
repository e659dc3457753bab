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
  [[nodiscard]] DisplayFormat format() const { return format_; }
  [[nodiscard]] std::uint32_t name() const { return name_; }  // GL's

 private:
  explicit Framebuffer(DisplayFormat format) : format_(format) {}
  DisplayFormat format_;
  std::uint32_t name_ = 0;
};

}  // namespace tactus::hal::egl
