// A GLES 3 drawing context, without a window or for one.
#pragma once

#include <string>

#include "rt/status.hpp"

namespace tactus::hal::egl {

struct ContextConfig {
  /// Threads of Mesa's software rasteriser beside the drawing one; without effect on a GPU. 0: the drawing
  /// thread does all the work itself, so that no thread we do not schedule takes a core from tracking.
  int software_threads_count = 0;
};

/// Owns one EGL context. Thread-bound between make_current() and release().
class Context {
 public:
  /// Opens the newest GLES 3 there is on Mesa's surfaceless platform: no window, no X server, no rights
  /// needed. The context is current on no thread. Boot. Error (device_unavailable) with one sentence when
  /// this machine has no surfaceless EGL or no GLES 3.
  static rt::Result<Context> create(const ContextConfig& config);

  /// The same for windows of an X server: `connection` is Xlib's Display. It is used by nobody else for EGL
  /// and outlives the context. Of its visuals `visual` is taken where that can be drawn to, see visual().
  /// Boot.
  static rt::Result<Context> create_x11(void* connection, int visual, const ContextConfig& config);
  /// The same for a screen without a window system: `device` is libgbm's gbm_device, visuals are its formats.
  static rt::Result<Context> create_gbm(void* device, int visual, const ContextConfig& config);
  /// The visual that the window or gbm_surface must be made with.
  [[nodiscard]] int visual() const;
  /// Draws to a surface from now on, at the screen's rate where the driver can wait for it. `native` points
  /// to an X window's number or to a gbm_surface, which outlives the context. Leaves the context current on
  /// the calling thread. Boot. Error: device_unavailable.
  rt::Result<void> attach(void* native);
  /// Shows what was drawn to the surface. ok | device_lost. Step; may wait for the screen.
  rt::Status swap() noexcept;

  Context(Context&& other) noexcept;
  Context& operator=(Context&& other) noexcept;
  ~Context();

  /// ok | device_lost (also when another thread holds it). Any phase; cheap when it is current already.
  rt::Status make_current() noexcept;
  void release() noexcept;

  /// Renderer and version as the driver names them, for reports. Boot; the context must be current.
  [[nodiscard]] std::string description() const;

 private:
  Context(void* display, void* config, void* context)
      : display_(display), config_(config), context_(context) {}
  static rt::Result<Context> open_owned(void* display, const char* where, int visual);
  static rt::Result<Context> open(void* display, int surface, int visual);

  void* display_ = nullptr;  // EGLDisplay
  void* config_ = nullptr;   // EGLConfig
  void* context_ = nullptr;  // EGLContext; null when moved from
  void* surface_ = nullptr;  // EGLSurface; null without a window
  bool owns_display_ = false;
};

}  // namespace tactus::hal::egl
