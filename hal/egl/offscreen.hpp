// A display whose pictures are only ever read back: runs without a window, tests, recordings.
#pragma once

#include <cstdint>

#include "hal/display.hpp"
#include "hal/egl/context.hpp"

namespace tactus::hal::egl {

/// A framebuffer of 8-bit RGBA and 24-bit depth in a context of its own. present() waits until the picture is
/// drawn, so that its cost falls on the thread that drew it.
class OffscreenDisplay final : public Display {
 public:
  /// Leaves the context current on the calling thread. Boot. Errors: device_unavailable (no EGL, no GLES 3),
  /// bad_usage (a size the driver cannot draw).
  static rt::Result<OffscreenDisplay> create(DisplayFormat format, const ContextConfig& config = {});

  OffscreenDisplay(OffscreenDisplay&& other) noexcept;
  OffscreenDisplay& operator=(OffscreenDisplay&&) = delete;
  ~OffscreenDisplay() override;

  [[nodiscard]] DisplayFormat format() const override { return format_; }
  rt::Status begin() noexcept override;
  rt::Status present() noexcept override;
  void release() noexcept override { context_.release(); }
  [[nodiscard]] std::uint64_t frames_presented() const override { return frames_presented_; }

  [[nodiscard]] const Context& context() const { return context_; }

 private:
  OffscreenDisplay(Context&& context, DisplayFormat format) : context_(std::move(context)), format_(format) {}

  Context context_;
  DisplayFormat format_;
  std::uint32_t framebuffer_ = 0;  // GL names; 0: none (moved from)
  std::uint32_t color_ = 0;
  std::uint32_t depth_ = 0;
  std::uint64_t frames_presented_ = 0;
};

}  // namespace tactus::hal::egl
