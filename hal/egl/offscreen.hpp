// A display whose pictures are only ever read back: runs without a window, tests, recordings.
#pragma once

#include <cstdint>

#include "hal/display.hpp"
#include "hal/egl/context.hpp"
#include "hal/egl/framebuffer.hpp"

namespace tactus::hal::egl {

/// A framebuffer in a context of its own. present() waits until the picture is
/// drawn, so that its cost falls on the thread that drew it.
class OffscreenDisplay final : public Display {
 public:
  /// Leaves the context current on the calling thread. Boot. Errors: device_unavailable (no EGL, no GLES 3),
  /// bad_usage (a size the driver cannot draw).
  static rt::Result<OffscreenDisplay> create(DisplayFormat format, const ContextConfig& config = {});

  OffscreenDisplay(OffscreenDisplay&&) noexcept = default;
  OffscreenDisplay& operator=(OffscreenDisplay&&) = delete;

  [[nodiscard]] DisplayFormat format() const override { return framebuffer_.format(); }
  rt::Status begin() noexcept override;
  rt::Status present() noexcept override;
  void release() noexcept override { context_.release(); }
  [[nodiscard]] std::uint64_t frames_presented() const override { return frames_presented_; }

  [[nodiscard]] const Context& context() const { return context_; }

 private:
  OffscreenDisplay(Context&& context, Framebuffer framebuffer)
      : context_(std::move(context)), framebuffer_(framebuffer) {}

  Context context_;
  Framebuffer framebuffer_;
  std::uint64_t frames_presented_ = 0;
};

}  // namespace tactus::hal::egl
