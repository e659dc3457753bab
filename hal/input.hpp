// What a person's hands do: keys and a pointer over the picture.
#pragma once

#include <cstdint>

namespace tactus::hal {

/// Keys by what they type. Printable ASCII stands for itself, letters always as capitals: Key{'L'}, Key{'7'},
/// Key{'+'}. Those named here have no character or are better read by name.
enum class Key : std::uint8_t {
  none = 0,
  tab = 9,
  enter = 13,
  escape = 27,
  space = 32,
  // Beyond ASCII.
  left = 128,
  right,
  up,
  down
};

/// Key of a character, also of a small letter; none for what is not printable ASCII.
constexpr Key key_of(char character) {
  if (character >= 'a' && character <= 'z') return static_cast<Key>(character - 'a' + 'A');
  return character >= ' ' && character <= '~' ? static_cast<Key>(character) : Key::none;
}

struct InputEvent {
  enum class Kind : std::uint8_t { key_down, key_up, pointer_move, button_down, button_up, resize, close };

  Kind kind = Kind::close;
  // key_down, again and again while it is held, and key_up.
  Key key = Key::none;
  // button_down, button_up: 1 left, 2 middle, 3 right, 4 and 5 the wheel up and down.
  std::uint8_t button = 0;
  // Pointer and buttons: in pixels of the picture, whose upper left one has its centre at (0, 0); beyond it
  // where the pointer is beside the picture. resize: the window's new width and height.
  float x_px = 0, y_px = 0;
};

/// Where events come from. Belongs to the same thread as the display it comes with.
class InputSource {
 public:
  virtual ~InputSource() = default;

  /// The oldest event that was not taken yet; false when there is none. Never waits. Step or boot.
  virtual bool poll(InputEvent& event) noexcept = 0;
};

}  // namespace tactus::hal
