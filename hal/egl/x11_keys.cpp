#include "hal/egl/x11_keys.hpp"

#include <X11/Xlib.h>
#include <X11/Xutil.h>
#include <X11/keysym.h>

#include <utility>

namespace tactus::hal::egl {
namespace {

Key key_of_symbol(KeySym symbol) {
  switch (symbol) {
    case XK_Left:
    case XK_KP_Left:
      return Key::left;
    case XK_Right:
    case XK_KP_Right:
      return Key::right;
    case XK_Up:
    case XK_KP_Up:
      return Key::up;
    case XK_Down:
    case XK_KP_Down:
      return Key::down;
    case XK_Escape:
      return Key::escape;
    case XK_Return:
    case XK_KP_Enter:
      return Key::enter;
    case XK_Tab:
    case XK_ISO_Left_Tab:
      return Key::tab;
    default:
      break;
  }
  // The number pad's characters stand 0xFF80 behind ASCII; ASCII's symbols are their characters.
  if (symbol >= XK_KP_Multiply && symbol <= XK_KP_9) symbol -= 0xFF80;
  return symbol < 0x80 ? key_of(static_cast<char>(symbol)) : Key::none;
}

}  // namespace

Key X11Keys::key_of_event(_XEvent& event) noexcept {
  Key& down = down_[event.xkey.keycode & 0xFF];
  if (event.type == KeyRelease) return std::exchange(down, Key::none);
  KeySym symbol = NoSymbol;
  char text = 0;
  XLookupString(&event.xkey, &text, 1, &symbol, nullptr);
  down = key_of_symbol(symbol);
  return down;
}

}  // namespace tactus::hal::egl
