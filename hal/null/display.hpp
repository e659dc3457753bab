// A display without pictures: for machines without EGL and runs that need none.
#pragma once

#include "hal/display.hpp"

namespace tactus::hal::null {

/// Counts what it is given; begin() answers `skipped`, so that nothing is drawn.
class Display final : public hal::Display {
 public:
  explicit Display(DisplayFormat format) : format_(format) {}
  [[nodiscard]] DisplayFormat format() const override { return format_; }
  rt::Status begin() noexcept override { return rt::Status::skipped; }
  rt::Status present() noexcept override {
    ++frames_presented_;
    return rt::Status::ok;
  }
  void release() noexcept override {}
  [[nodiscard]] std::uint64_t frames_presented() const override { return frames_presented_; }

 private:
  DisplayFormat format_;
  std::uint64_t frames_presented_ = 0;
};

}  // namespace tactus::hal::null
