// How the studies print what their tests say.
#pragma once

#include <algorithm>
#include <string>

#include "firmware_host/html.hpp"

namespace tactus::firmware {

/// "p = .042", or "p < .001".
inline std::string p_text(double p) {
  return p < 0.001 ? "p < .001" : "p = " + fixed(p, 3).substr(p < 0.9995 ? 1 : 0);
}

/// A column of a table in text; a longer name pushes what follows.
inline std::string padded(std::string name, std::size_t width) {
  name.resize(std::max(name.size(), width), ' ');
  return name;
}

}  // namespace tactus::firmware
