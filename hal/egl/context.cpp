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

// Of the configurations with 8-bit colour the one of the visual that is asked for, otherwise the driver's
// first.
EGLConfig choose_config(EGLDisplay display, EGLint surface, EGLint visual) {
  const EGLint wanted[] = {EGL_SURFACE_TYPE,
                           surface,
                           EGL_RENDERABLE_TYPE,
                           EGL_OPENGL_ES3_BIT,
                           EGL_RED_SIZE,
                           8,
                           EGL_GREEN_SIZE,
                           8,
                           EGL_BLUE_SIZE,
                           8,
                           EGL_NONE};
  std::array<EGLConfig, 256> configs{};
  EGLint configs_count = 0;
  if (eglChooseConfig(display, wanted, configs.data(), static_cast<EGLint>(configs.size()), &configs_count) !=
      EGL_TRUE)
    return nullptr;
  for (EGLint i = 0; i < configs_count; ++i) {
    EGLint id = 0;
    eglGetConfigAttrib(display, configs[static_cast<std::size_t>(i)], EGL_NATIVE_VISUAL_ID, &id);
    if (id == visual) return configs[static_cast<std::size_t>(i)];
  }
  return configs[0];
}

// Read by Mesa once, when the first display is initialised. What the user has set in the environment wins.
void set_software_threads(const ContextConfig& config) {
  setenv("LP_NUM_THREADS", std::to_string(config.software_threads_count).c_str(), 0);
}

// Null where the client has no such platform or it does not open.
EGLDisplay open_display(EGLenum platform, const char* extension, void* native) {
  if (!has_word(eglQueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS), extension)) return EGL_NO_DISPLAY;
  const auto get_platform_display =
      reinterpret_cast<PFNEGLGETPLATFORMDISPLAYEXTPROC>(eglGetProcAddress("eglGetPlatformDisplayEXT"));
  if (get_platform_display == nullptr) return EGL_NO_DISPLAY;
  EGLDisplay display = get_platform_display(platform, native, nullptr);
  if (display == EGL_NO_DISPLAY || eglInitialize(display, nullptr, nullptr) != EGL_TRUE)
    return EGL_NO_DISPLAY;
  return display;
}

}  // namespace

rt::Result<Context> Context::create(const ContextConfig& config) {
  set_software_threads(config);
  EGLDisplay display = open_display(EGL_PLATFORM_SURFACELESS_MESA, "EGL_MESA_platform_surfaceless", nullptr);
  if (display == EGL_NO_DISPLAY) return unavailable("EGL has no surfaceless platform");
  if (!has_word(eglQueryString(display, EGL_EXTENSIONS), "EGL_KHR_surfaceless_context"))
    return unavailable("EGL cannot draw without a surface");
  return open(display, EGL_PBUFFER_BIT, 0);
}

rt::Result<Context> Context::create_x11(void* connection, int visual, const ContextConfig& config) {
  set_software_threads(config);
  return open_owned(open_display(EGL_PLATFORM_X11_EXT, "EGL_EXT_platform_x11", connection),
                    "EGL does not draw into windows of this X server", visual);
}

rt::Result<Context> Context::create_gbm(void* device, int visual, const ContextConfig& config) {
  set_software_threads(config);
  return open_owned(open_display(EGL_PLATFORM_GBM_MESA, "EGL_MESA_platform_gbm", device),
                    "EGL does not draw on this card's screen", visual);
}

rt::Result<Context> Context::open_owned(void* display, const char* where, int visual) {
  if (display == EGL_NO_DISPLAY) return unavailable(where);
  auto context = open(display, EGL_WINDOW_BIT, visual);
  if (context)
    context->owns_display_ = true;
  else
    eglTerminate(display);
  return context;
}

rt::Result<Context> Context::open(void* display, int surface, int visual) {
  eglBindAPI(EGL_OPENGL_ES_API);
  EGLConfig egl_config = choose_config(display, surface, visual);
  if (egl_config == nullptr) return unavailable("EGL has no configuration for GLES 3 with 8-bit colour");
  const EGLint attributes[] = {EGL_CONTEXT_MAJOR_VERSION, 3, EGL_NONE};
  EGLContext context = eglCreateContext(display, egl_config, EGL_NO_CONTEXT, attributes);
  if (context == EGL_NO_CONTEXT) return unavailable("GLES 3 is not there");
  return Context(display, egl_config, context);
}

int Context::visual() const {
  EGLint id = 0;
  eglGetConfigAttrib(display_, config_, EGL_NATIVE_VISUAL_ID, &id);
  return id;
}

rt::Result<void> Context::attach(void* native) {
  const auto create_surface = reinterpret_cast<PFNEGLCREATEPLATFORMWINDOWSURFACEEXTPROC>(
      eglGetProcAddress("eglCreatePlatformWindowSurfaceEXT"));
  if (create_surface != nullptr) surface_ = create_surface(display_, config_, native, nullptr);
  if (surface_ == EGL_NO_SURFACE || make_current() != rt::Status::ok)
    return unavailable("EGL does not draw into its surface");
  eglSwapInterval(display_, 1);
  return {};
}

rt::Status Context::swap() noexcept {
  return eglSwapBuffers(display_, surface_) == EGL_TRUE ? rt::Status::ok : rt::Status::device_lost;
}

Context::Context(Context&& other) noexcept { *this = std::move(other); }

Context& Context::operator=(Context&& other) noexcept {
  std::swap(display_, other.display_);
  std::swap(config_, other.config_);
  std::swap(context_, other.context_);
  std::swap(surface_, other.surface_);
  std::swap(owns_display_, other.owns_display_);
  return *this;
}

// The surfaceless display stays open: EGL hands the same one to everybody who asks, and closing it would end
// their contexts. A connection's display is ours alone, and EGL must forget it before the connection is
// closed.
Context::~Context() {
  if (context_ == nullptr) return;
  release();
  if (surface_ != nullptr) eglDestroySurface(display_, surface_);
  eglDestroyContext(display_, context_);
  if (owns_display_) eglTerminate(display_);
}

rt::Status Context::make_current() noexcept {
  if (eglGetCurrentContext() == context_) return rt::Status::ok;
  return eglMakeCurrent(display_, surface_, surface_, context_) == EGL_TRUE ? rt::Status::ok
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
