#include "hal/egl/framebuffer.hpp"

#include <GLES3/gl3.h>

namespace tactus::hal::egl {

rt::Result<Framebuffer> Framebuffer::create(DisplayFormat format, const Context& context) {
  const std::string size = std::to_string(format.width_px) + " x " + std::to_string(format.height_px);
  GLint size_max = 0;
  glGetIntegerv(GL_MAX_RENDERBUFFER_SIZE, &size_max);
  if (format.width_px < 1 || format.height_px < 1 || format.width_px > size_max ||
      format.height_px > size_max)
    return rt::Error{rt::ExitCode::bad_usage, "a picture of " + size +
                                                  " pixels cannot be drawn; this driver draws 1 to " +
                                                  std::to_string(size_max) + " pixels each way"};

  Framebuffer framebuffer(format);
  GLuint color = 0, depth = 0;
  glGenRenderbuffers(1, &color);
  glBindRenderbuffer(GL_RENDERBUFFER, color);
  glRenderbufferStorage(GL_RENDERBUFFER, GL_RGBA8, format.width_px, format.height_px);
  glGenRenderbuffers(1, &depth);
  glBindRenderbuffer(GL_RENDERBUFFER, depth);
  glRenderbufferStorage(GL_RENDERBUFFER, GL_DEPTH_COMPONENT24, format.width_px, format.height_px);
  glGenFramebuffers(1, &framebuffer.name_);
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer.name_);
  glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, color);
  glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER, depth);
  if (glCheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE)
    return rt::Error{rt::ExitCode::device_unavailable,
                     "a picture of " + size + " pixels cannot be drawn: " + context.description() +
                         " has no memory for it or not the format (RGBA8, depth 24)"};
  return framebuffer;
}

void Framebuffer::bind() const noexcept {
  glBindFramebuffer(GL_FRAMEBUFFER, name_);
  glViewport(0, 0, format_.width_px, format_.height_px);
}

}  // namespace tactus::hal::egl
