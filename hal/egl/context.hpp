// A GLES 3 drawing context without a window.
#pragma once

#include <string>

#include "rt/status.hpp"

namespace tactus::hal::egl {

struct ContextConfig {
  /// Threads of Mesa's software rasteriser beside the drawing one; without effect on a GPU. 0: the drawing
  /// thread does all the work itself, so that no thread we do not schedule takes a core from tracking.
  int software_threads_count = 0;
};

/// Owns one EGL context on Mesa's surfaceless platform: no window, no X server, no rights needed.
/// Thread-bound between make_current() and release().
class Context {
 public:
  /// Opens the newest GLES 3 there is. The context is current on no thread. Boot. Error (device_unavailable)
  /// with one sentence when this machine has no surfaceless EGL or no GLES 3.
  static rt::Result<Context> create(const ContextConfig& config);

  Context(Context&& other) noexcept;
  Context& operator=(Context&& other) noexcept;
  ~Context();

  /// ok | device_lost (also when another thread holds it). Any phase; cheap when it is current already.
  rt::Status make_current() noexcept;
  void release() noexcept;

  /// Renderer and version as the driver names them, for reports. Boot; the context must be current.
  [[nodiscard]] std::string description() const;

 private:
  Context(void* display, void* context) : display_(display), context_(context) {}

  void* display_ = nullptr;  // EGLDisplay
  void* context_ = nullptr;  // EGLContext; null when moved from
};

}  // namespace tactus::hal::egl
