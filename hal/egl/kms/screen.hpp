// Which screen of which card to drive, and in which mode.
#pragma once

#include <xf86drmMode.h>

#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "rt/status.hpp"

namespace tactus::hal::egl {

/// An open file of the kernel.
class Descriptor {
 public:
  explicit Descriptor(int number = -1) : number_(number) {}
  Descriptor(Descriptor&& other) noexcept : number_(other.number_) { other.number_ = -1; }
  Descriptor& operator=(Descriptor&& other) noexcept {
    std::swap(number_, other.number_);
    return *this;
  }
  ~Descriptor();
  [[nodiscard]] int number() const { return number_; }

 private:
  int number_;
};

struct Screen {
  Descriptor card;
  std::uint32_t connector = 0, crtc = 0;
  drmModeModeInfo mode{};
};

/// The mode that the screen prefers, otherwise the one with the most pixels, of these the fastest. `modes`:
/// at least one.
const drmModeModeInfo& choose_mode(std::span<const drmModeModeInfo> modes);

/// The first connected screen of `device`, or of the cards of `folder` in order of their names when `device`
/// is empty. Boot. Error: device_unavailable, with what is wrong with each card.
rt::Result<Screen> find_screen(const std::string& device, const std::string& folder = "/dev/dri");

}  // namespace tactus::hal::egl
