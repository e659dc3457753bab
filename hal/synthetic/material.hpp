// Material ids of the synthetic rooms: MINC's 23 classes, alphabetical, as label images carry them. hal may
// not look up into the pipeline, so the ids are written out here; a test holds them against the pipeline's
// names.
#pragma once

#include <cstdint>

namespace tactus::hal::synthetic {

enum class Material : std::uint8_t {
  brick,
  carpet,
  ceramic,
  fabric,
  foliage,
  food,
  glass,
  hair,
  leather,
  metal,
  mirror,
  other,
  painted,
  paper,
  plastic,
  polishedstone,
  skin,
  sky,
  stone,
  tile,
  wallpaper,
  water,
  wood
};
inline constexpr int kMaterialsCount = 23;
inline constexpr std::uint8_t kNoMaterial = 255;

struct Rgb8 {
  std::uint8_t r = 0, g = 0, b = 0;
  friend constexpr bool operator==(Rgb8, Rgb8) = default;
};

}  // namespace tactus::hal::synthetic
