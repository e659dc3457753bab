// Events between the pictures that gather them and the caller that takes them, on one thread.
#pragma once

#include <array>
#include <cstddef>

#include "hal/input.hpp"

namespace tactus::hal::egl {

/// First in, first out. Moves in a row become one, as do resizes: only the last of them matters. Full, new
/// events are dropped, but for `close`, which comes after all others.
class EventQueue {
 public:
  static constexpr std::size_t kCapacity = 64;

  void push(const InputEvent& event) noexcept {
    using Kind = InputEvent::Kind;
    if (event.kind == Kind::close) {
      is_closing_ = true;
      return;
    }
    const bool newest_matters = event.kind == Kind::pointer_move || event.kind == Kind::resize;
    if (newest_matters && count_ > 0 && at(count_ - 1).kind == event.kind) {
      at(count_ - 1) = event;
    } else if (count_ < kCapacity) {
      at(count_++) = event;
    }
  }

  bool pop(InputEvent& event) noexcept {
    if (count_ > 0) {
      event = at(0);
      first_ = (first_ + 1) % kCapacity;
      --count_;
      return true;
    }
    if (!is_closing_) return false;
    is_closing_ = false;
    event = {};
    event.kind = InputEvent::Kind::close;
    return true;
  }

 private:
  InputEvent& at(std::size_t i) noexcept { return events_[(first_ + i) % kCapacity]; }

  std::array<InputEvent, kCapacity> events_{};
  std::size_t first_ = 0, count_ = 0;
  bool is_closing_ = false;
};

}  // namespace tactus::hal::egl
