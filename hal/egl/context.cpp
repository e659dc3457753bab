#include "hal/egl/context.hpp"

#include <EGL/egl.h>
#include <EGL/eglext.h>
#include <GLES3/gl3.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <string_view>
#include <utility>

namespace tactus::hal::egl {
namespace {

rt::Error unavailable(const char* what) {
  std::array<char, 24> code{};
  std::snprintf(code.data(), code.size(), "EGL error 0x%x", static_cast<unsigned>(eglGetError()));
  return {rt::ExitCode::device_unavailable,
          std::string("no pictures can be drawn on this machine: ") + what + " (" + code.data() +
              "); install libegl1, libgles2 and libgl1-mesa-dri, or run without them"};
}

bool has_word(const char* words, std::string_view word) {
  std::string_view rest = words == nullptr ? std::string_view() : std::string_view(words);
  while (!rest.empty()) {
    const std::size_t end = rest.find(' ');
    if (rest.substr(0, end) == word) return true;
    if (end == std::string_view::npos) break;
    rest.remove_prefix(end + 1);
  }
  return false;
}

}  // namespace

rt::Result<Context> Context::create(const ContextConfig& config) {
  // Read by Mesa once, when the display is initialised. What the user has set in the environment wins.
  setenv("LP_NUM_THREADS", std::to_string(config.software_threads_count).c_str(), 0);

  if (!has_word(eglQueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS), "EGL_MESA_platform_surfaceless"))
    return unavailable("EGL has no surfaceless platform");
  const auto get_platform_display =
      reinterpret_cast<PFNEGLGETPLATFORMDISPLAYEXTPROC>(eglGetProcAddress("eglGetPlatformDisplayEXT"));
  if (get_platform_display == nullptr) return unavailable("EGL has no eglGetPlatformDisplayEXT");
  EGLDisplay display = get_platform_display(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr);
  if (display == EGL_NO_DISPLAY || eglInitialize(display, nullptr, nullptr) != EGL_TRUE)
    return unavailable("the surfaceless display does not open");
  if (!has_word(eglQueryString(display, EGL_EXTENSIONS), "EGL_KHR_surfaceless_context"))
    return unavailable("EGL cannot draw without a surface");

  eglBindAPI(EGL_OPENGL_ES_API);
  const EGLint wanted[] = {EGL_SURFACE_TYPE,
                           EGL_PBUFFER_BIT,
                           EGL_RENDERABLE_TYPE,
                           EGL_OPENGL_ES3_BIT,
                           EGL_RED_SIZE,
                           8,
                           EGL_GREEN_SIZE,
                           8,
                           EGL_BLUE_SIZE,
                           8,
                           EGL_NONE};
  EGLConfig egl_config = nullptr;
  EGLint configs_count = 0;
  if (eglChooseConfig(display, wanted, &egl_config, 1, &configs_count) != EGL_TRUE || configs_count == 0)
    return unavailable("EGL has no configuration for GLES 3 with 8-bit colour");
  const EGLint attributes[] = {EGL_CONTEXT_MAJOR_VERSION, 3, EGL_NONE};
  EGLContext context = eglCreateContext(display, egl_config, EGL_NO_CONTEXT, attributes);
  if (context == EGL_NO_CONTEXT) return unavailable("GLES 3 is not there");
  return Context(display, context);
}

Context::Context(Context&& other) noexcept
    : display_(std::exchange(other.display_, nullptr)), context_(std::exchange(other.context_, nullptr)) {}

Context& Context::operator=(Context&& other) noexcept {
  std::swap(display_, other.display_);
  std::swap(context_, other.context_);
  return *this;
}

// The EGL display stays open: EGL hands the same one to everybody who asks, and closing it would end their
// contexts.
Context::~Context() {
  if (context_ == nullptr) return;
  release();
  eglDestroyContext(display_, context_);
}

rt::Status Context::make_current() noexcept {
  if (eglGetCurrentContext() == context_) return rt::Status::ok;
  return eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, context_) == EGL_TRUE
             ? rt::Status::ok
             : rt::Status::device_lost;
}

void Context::release() noexcept {
  if (eglGetCurrentContext() == context_)
    eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
}

std::string Context::description() const {
  TACTUS_ASSERT(eglGetCurrentContext() == context_);
  const auto text = [](GLenum name) { return reinterpret_cast<const char*>(glGetString(name)); };
  return std::string(text(GL_RENDERER)) + ", " + text(GL_VERSION);
}

}  // namespace tactus::hal::egl
