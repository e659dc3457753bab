#include "hal/egl/offscreen.hpp"

#include <GLES3/gl3.h>

#include <utility>

namespace tactus::hal::egl {

rt::Result<OffscreenDisplay> OffscreenDisplay::create(DisplayFormat format, const ContextConfig& config) {
  auto context = Context::create(config);
  if (!context) return context.error();
  if (context->make_current() != rt::Status::ok)
    return rt::Error{rt::ExitCode::device_unavailable,
                     "no pictures can be drawn: the EGL context does not become current"};

  const std::string size = std::to_string(format.width_px) + " x " + std::to_string(format.height_px);
  GLint size_max = 0;
  glGetIntegerv(GL_MAX_RENDERBUFFER_SIZE, &size_max);
  if (format.width_px < 1 || format.height_px < 1 || format.width_px > size_max ||
      format.height_px > size_max)
    return rt::Error{rt::ExitCode::bad_usage, "a picture of " + size +
                                                  " pixels cannot be drawn; this driver draws 1 to " +
                                                  std::to_string(size_max) + " pixels each way"};

  OffscreenDisplay display(std::move(*context), format);
  glGenRenderbuffers(1, &display.color_);
  glBindRenderbuffer(GL_RENDERBUFFER, display.color_);
  glRenderbufferStorage(GL_RENDERBUFFER, GL_RGBA8, format.width_px, format.height_px);
  glGenRenderbuffers(1, &display.depth_);
  glBindRenderbuffer(GL_RENDERBUFFER, display.depth_);
  glRenderbufferStorage(GL_RENDERBUFFER, GL_DEPTH_COMPONENT24, format.width_px, format.height_px);
  glGenFramebuffers(1, &display.framebuffer_);
  glBindFramebuffer(GL_FRAMEBUFFER, display.framebuffer_);
  glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, display.color_);
  glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER, display.depth_);
  if (glCheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE)
    return rt::Error{rt::ExitCode::device_unavailable,
                     "a picture of " + size + " pixels cannot be drawn: " + display.context_.description() +
                         " has no memory for it or not the format (RGBA8, depth 24)"};
  return display;
}

OffscreenDisplay::OffscreenDisplay(OffscreenDisplay&& other) noexcept
    : context_(std::move(other.context_)),
      format_(other.format_),
      framebuffer_(std::exchange(other.framebuffer_, 0)),
      color_(std::exchange(other.color_, 0)),
      depth_(std::exchange(other.depth_, 0)),
      frames_presented_(other.frames_presented_) {}

// The framebuffer and its memory go with the context that they live in.
OffscreenDisplay::~OffscreenDisplay() = default;

rt::Status OffscreenDisplay::begin() noexcept {
  const rt::Status status = context_.make_current();
  if (status != rt::Status::ok) return status;
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_);
  glViewport(0, 0, format_.width_px, format_.height_px);
  return rt::Status::ok;
}

rt::Status OffscreenDisplay::present() noexcept {
  glFinish();
  ++frames_presented_;
  return rt::Status::ok;
}

}  // namespace tactus::hal::egl
