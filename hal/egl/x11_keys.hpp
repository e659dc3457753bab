// X's keys as ours.
#pragma once

#include <array>

#include "hal/input.hpp"

union _XEvent;

namespace tactus::hal::egl {

/// Remembers what each key meant when it went down, so that it comes up as the same one, whatever became of
/// shift.
class X11Keys {
 public:
  /// A KeyPress or KeyRelease of the X server. Key::none: none of ours.
  Key key_of_event(_XEvent& event) noexcept;

 private:
  std::array<Key, 256> down_{};  // by X's key code, 8 to 255
};

}  // namespace tactus::hal::egl
