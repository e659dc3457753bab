// The 23 materials of MINC (Bell et al. 2015), in alphabetical order; ids are frozen (files carry them).
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <string_view>

namespace tactus {

using MaterialId = std::uint8_t;
inline constexpr int kMaterialCount = 23;
inline constexpr MaterialId kUnknownMaterial = 255;

inline constexpr std::array<std::string_view, kMaterialCount> kMaterialNames = {
    "brick", "carpet",  "ceramic", "fabric",  "foliage",       "food", "glass", "hair",  "leather", "metal",     "mirror", "other",
    "painted", "paper", "plastic", "polishedstone", "skin", "sky",  "stone", "tile",  "wallpaper", "water", "wood"};

struct Rgb8 {
  std::uint8_t r = 0, g = 0, b = 0;
  friend constexpr bool operator==(Rgb8, Rgb8) = default;
};

/// Overlay colours: glass green, painted purple, fabric blue, wood yellow and carpet red as in the paper (fig. 6);
/// the rest spread in hue and lightness so that neighbours in a room stay apart.
inline constexpr std::array<Rgb8, kMaterialCount> kMaterialColors = {{{157, 69, 48},
                                                                      {220, 30, 30},
                                                                      {235, 235, 250},
                                                                      {40, 80, 220},
                                                                      {60, 110, 30},
                                                                      {250, 160, 120},
                                                                      {40, 200, 70},
                                                                      {90, 60, 40},
                                                                      {140, 90, 20},
                                                                      {130, 140, 150},
                                                                      {180, 230, 240},
                                                                      {60, 60, 60},
                                                                      {150, 50, 190},
                                                                      {250, 245, 200},
                                                                      {250, 120, 200},
                                                                      {90, 100, 120},
                                                                      {245, 200, 170},
                                                                      {120, 190, 255},
                                                                      {150, 150, 130},
                                                                      {0, 160, 160},
                                                                      {200, 180, 230},
                                                                      {20, 60, 120},
                                                                      {240, 210, 30}}};
inline constexpr Rgb8 kUnknownColor{128, 128, 128};

constexpr Rgb8 material_color(MaterialId id) { return id < kMaterialCount ? kMaterialColors[id] : kUnknownColor; }

/// kUnknownMaterial when no material has this name.
constexpr MaterialId material_from_name(std::string_view name) {
  for (std::size_t i = 0; i < kMaterialNames.size(); ++i)
    if (kMaterialNames[i] == name) return static_cast<MaterialId>(i);
  return kUnknownMaterial;
}

/// Probability of each material; sums to 1.
using MaterialDistribution = std::array<float, kMaterialCount>;

/// Ties go to the lower id.
constexpr MaterialId most_likely(const MaterialDistribution& materials) {
  return static_cast<MaterialId>(std::max_element(materials.begin(), materials.end()) - materials.begin());
}

}  // namespace tactus
