// The whole screen of a graphics card, where no window system has it: a headset, a console.
#pragma once

#include <memory>
#include <string>

#include "hal/display.hpp"
#include "hal/egl/context.hpp"

namespace tactus::hal::egl {

struct KmsConfig {
  std::string device;  // as "/dev/dri/card0"; empty: the first with a screen connected
  ContextConfig context = {};
};

/// Pictures of a fixed size, drawn into a framebuffer of their own, so that they can be read back after
/// present(), and shown scaled, whole, with black bars, in the screen's preferred mode, flipped at its
/// refresh (libdrm, GBM, EGL). What was on the screen before comes back at the end.
class KmsDisplay final : public Display {
 public:
  /// Takes the screen and leaves the context current on the calling thread. Boot. Errors, one sentence each:
  /// device_unavailable (not built in, no card, no screen on it, no right to it, no EGL for it), bad_usage (a
  /// size that cannot be drawn).
  static rt::Result<KmsDisplay> create(DisplayFormat format, const KmsConfig& config = {});

  KmsDisplay(KmsDisplay&&) noexcept;
  KmsDisplay& operator=(KmsDisplay&&) = delete;
  ~KmsDisplay() override;

  [[nodiscard]] DisplayFormat format() const override;
  rt::Status begin() noexcept override;
  /// Waits, 1 s at most, for the flip to the picture before this one. device_lost: the screen does not take
  /// it, as while another console has it; the next one may come through.
  rt::Status present() noexcept override;
  void release() noexcept override;
  [[nodiscard]] std::uint64_t frames_presented() const override;

 private:
  struct State;
  explicit KmsDisplay(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace tactus::hal::egl
