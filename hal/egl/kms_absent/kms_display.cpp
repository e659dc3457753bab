// Stands in where libdrm and libgbm were not there at configure time.
#include "hal/egl/kms_display.hpp"

namespace tactus::hal::egl {

struct KmsDisplay::State {};

KmsDisplay::KmsDisplay(std::unique_ptr<State> state) : state_(std::move(state)) {}
KmsDisplay::KmsDisplay(KmsDisplay&&) noexcept = default;
KmsDisplay::~KmsDisplay() = default;

rt::Result<KmsDisplay> KmsDisplay::create(DisplayFormat, const KmsConfig&) {
  return rt::Error{
      rt::ExitCode::device_unavailable,
      "no screen can be driven: this program was built without libdrm and libgbm; build it where they "
      "are installed, or run with a window or without a display."};
}

// There is none to call these on.
DisplayFormat KmsDisplay::format() const { return {}; }
rt::Status KmsDisplay::begin() noexcept { return rt::Status::device_lost; }
rt::Status KmsDisplay::present() noexcept { return rt::Status::device_lost; }
void KmsDisplay::release() noexcept {}
std::uint64_t KmsDisplay::frames_presented() const { return 0; }

}  // namespace tactus::hal::egl
