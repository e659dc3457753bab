// The overlay's colour for each of the 256 values a label image can hold.
#pragma once

#include <array>
#include <cstdint>

#include "pipeline/label/material.hpp"

namespace tactus::render {

/// r g b a; alpha 0 for values that name no material (255 = unknown among them): the video stays as it is
/// there.
using Palette = std::array<std::array<std::uint8_t, 4>, 256>;

constexpr Palette overlay_palette() {
  Palette palette{};
  for (std::size_t id = 0; id < kMaterialColors.size(); ++id)
    palette[id] = {kMaterialColors[id].r, kMaterialColors[id].g, kMaterialColors[id].b, 255};
  return palette;
}

}  // namespace tactus::render
