#include "hal/egl/offscreen.hpp"

#include <GLES3/gl3.h>

namespace tactus::hal::egl {

rt::Result<OffscreenDisplay> OffscreenDisplay::create(DisplayFormat format, const ContextConfig& config) {
  auto context = Context::create(config);
  if (!context) return context.error();
  if (context->make_current() != rt::Status::ok)
    return rt::Error{rt::ExitCode::device_unavailable,
                     "no pictures can be drawn: the EGL context does not become current"};
  const auto framebuffer = Framebuffer::create(format, *context);
  if (!framebuffer) return framebuffer.error();
  return OffscreenDisplay(std::move(*context), *framebuffer);
}

rt::Status OffscreenDisplay::begin() noexcept {
  const rt::Status status = context_.make_current();
  if (status == rt::Status::ok) framebuffer_.bind();
  return status;
}

rt::Status OffscreenDisplay::present() noexcept {
  glFinish();
  ++frames_presented_;
  return rt::Status::ok;
}

}  // namespace tactus::hal::egl
