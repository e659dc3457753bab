// Colour brought to the depth camera's half-resolution pixels.
#pragma once

#include <cstdint>
#include <span>

#include "hal/calibration.hpp"
#include "rt/slice.hpp"

namespace tactus {

/// R, G, B and 255 where known, in the bytes of a word from the lowest; 0 where nothing is known.
using PackedColor = std::uint32_t;

/// For cameras that share pixels: the mean of each 2x2 group. `rgb` is width * height * 3 bytes. Step, no
/// heap.
void half_color_registered(std::span<const std::uint8_t> rgb, int width, int height,
                           std::span<PackedColor> half_color) noexcept;

/// For two cameras: each half-resolution depth pixel is lifted, moved into the colour camera, distorted and
/// looked up. Occlusion: the colour camera sees the nearest surface only. A z-buffer of colour pixels, an
/// eighth of the resolution each way (a depth pixel's footprint and its neighbours' fall into one bin), keeps
/// the nearest depth; a pixel that lies behind it by more than the tolerance is left without colour.
/// `nearest_z_m` is scratch of color_bins_count() floats. `color_pixel` receives, per half-resolution depth
/// pixel, the colour camera's (u, v) as rounded to pixels (v << 16 | u), 0xFFFFFFFF where none: labels take
/// the same way later.
void half_color_projected(std::span<const std::uint8_t> rgb, const hal::RigCalibration& rig,
                          std::span<const float> half_m, const hal::Intrinsics& half_camera,
                          std::span<float> nearest_z_m, std::span<PackedColor> half_color,
                          std::span<std::uint32_t> color_pixel) noexcept;
inline constexpr std::uint32_t kNoColorPixel = 0xFFFFFFFFu;
inline constexpr int kColorBinPixels = 8;

constexpr std::size_t color_bins_count(const hal::Intrinsics& color) {
  return static_cast<std::size_t>(color.width / kColorBinPixels + 1) *
         static_cast<std::size_t>(color.height / kColorBinPixels + 1);
}

/// Brown-Conrady: normalised coordinates as the ideal pinhole has them to those the lens makes of them.
struct Normalized {
  float x, y;
};
Normalized distort(const hal::Intrinsics& camera, Normalized ideal) noexcept;
/// The inverse, by fixed-point iteration (8 rounds: below 1e-4 px for the lenses here).
Normalized undistort(const hal::Intrinsics& camera, Normalized distorted) noexcept;

}  // namespace tactus
