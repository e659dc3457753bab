// Procedural, tileable colour textures, baked once into a small mip pyramid.
#pragma once

#include <cstdint>
#include <vector>

#include "hal/synthetic/material.hpp"

namespace tactus::hal::synthetic {

enum class Pattern : std::uint8_t {
  plain,    ///< broad soft mottling
  noise,    ///< strong mottling of base and second
  checks,   ///< repeats x repeats squares
  stripes,  ///< repeats stripes along v
  planks,   ///< wooden boards, repeats across v, grain along u
  grain,    ///< wood grain along v
  bricks,   ///< running bond, repeats courses
  tiles,    ///< repeats x repeats tiles with grout of the second colour
  weave,    ///< woven cloth
  speckle,  ///< scattered grains of the second colour
  damask,   ///< diamond ornament with stripes
  print,    ///< lines of text
  picture,  ///< coloured patches, a painting
  leaves,   ///< ribs on green
  clouds    ///< soft white on blue
};

struct TextureSpec {
  Pattern pattern = Pattern::plain;
  Rgb8 base, second;
  int repeats = 4;         // of the motif in one period
  double period_m = 0.64;  // size of one period on the surface
  double contrast = 0.25;  // strength of the noise laid over the motif, 0..1
  std::uint32_t seed = 0;
};

/// A square periodic texture with its mip levels (box filter). 8-bit per channel, packed r | g << 8 | b
/// << 16.
class Texture {
 public:
  /// Boot; allocates 4/3 * 128 * 128 * 4 bytes.
  explicit Texture(const TextureSpec& spec);

  /// Colour at surface coordinates (u, v) in metres, bilinear, filtered to about `footprint_m` (one pixel's
  /// width). Any phase, any thread, wait-free.
  [[nodiscard]] Rgb8 sample(float u_m, float v_m, float footprint_m) const;

 private:
  static constexpr int kLog2Size = 7;
  float texels_per_m_ = 0;
  float texel_m_ = 0;
  std::vector<std::uint32_t> texels_;  // level 0 (128 x 128), then 64 x 64, ... 1 x 1
};

}  // namespace tactus::hal::synthetic
