#include "hal/egl/framebuffer.hpp"

#include <GLES3/gl3.h>

#include <array>

#include "hal/egl/letterbox.hpp"

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

void Framebuffer::show(DisplayFormat surface) const noexcept {
  const Letterbox box = fit(format_, surface);
  const GLboolean has_scissor = glIsEnabled(GL_SCISSOR_TEST);
  if (has_scissor == GL_TRUE) glDisable(GL_SCISSOR_TEST);
  glBindFramebuffer(GL_DRAW_FRAMEBUFFER, 0);
  glBindFramebuffer(GL_READ_FRAMEBUFFER, name_);
  if (box.width_px < surface.width_px || box.height_px < surface.height_px) {
    constexpr std::array kBlack{0.0F, 0.0F, 0.0F, 1.0F};
    glClearBufferfv(GL_COLOR, 0, kBlack.data());
  }
  const int bottom_px = surface.height_px - box.top_px - box.height_px;  // GL counts from the bottom
  const bool is_same_size = box.width_px == format_.width_px && box.height_px == format_.height_px;
  glBlitFramebuffer(0, 0, format_.width_px, format_.height_px, box.left_px, bottom_px,
                    box.left_px + box.width_px, bottom_px + box.height_px, GL_COLOR_BUFFER_BIT,
                    is_same_size ? GL_NEAREST : GL_LINEAR);
  if (has_scissor == GL_TRUE) glEnable(GL_SCISSOR_TEST);
}

}  // namespace tactus::hal::egl
