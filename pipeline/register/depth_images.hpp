// From raw depth to what the spine works on. Kernels over spans; writer-free, reentrant, step phase, no heap.
//
// Depth travels as uint16 in eighths of a millimetre (0 = no measurement, up to 8.19 m): finer than any
// sensor here (a Kinect steps 3 mm at 1 m) and half the cache of a float. Tracking works on a half-resolution
// float image.
#pragma once

#include <cstdint>
#include <span>

#include "hal/calibration.hpp"

namespace tactus {

inline constexpr float kDepthUnitM = 1.0f / 8000.0f;

/// Axial noise of a structured-light camera (Nguyen et al. 2012): sigma(z) = 1.2 mm + 1.9 mm/m^2 (z - 0.4
/// m)^2.
constexpr float depth_sigma_m(float z_m) { return 0.0012f + 0.0019f * (z_m - 0.4f) * (z_m - 0.4f); }

/// Camera of the image whose pixel (i, j) is the mean of pixels 2i..2i+1, 2j..2j+1.
hal::Intrinsics half_resolution(const hal::Intrinsics& full);

/// raw (sensor units, 0 invalid) -> depth in kDepthUnitM; beyond depth_m_max or 8.19 m becomes 0.
/// Returns the number of valid pixels.
std::uint32_t normalize_depth(std::span<const std::uint16_t> raw, double depth_m_per_unit, float depth_m_max,
                              std::span<std::uint16_t> depth) noexcept;

/// Mean of each 2x2 group's valid pixels in metres; 0 where none is valid or where they differ by more than
/// six sigma and a centimetre: a mean across a depth edge is a surface that does not exist. width and height
/// are of `depth` and even.
void half_depth(std::span<const std::uint16_t> depth, int width, int height,
                std::span<float> half_m) noexcept;

/// How measurements enter the map. A pixel word: depth in kDepthUnitM (bits 0-15) and the slope of the
/// surface, dz/du (16-23) and dz/dv (24-31), signed, in kSlopeUnitM per pixel: between pixel centres the
/// surface is taken along its tangent plane, for rounding to the nearest pixel alone makes stairs of several
/// millimetres on slanted surfaces, and stairs bias tracking. A tile word (4x4 pixels): the factor from a
/// difference in z to distance from the tangent plane, n . (x/z, y/z, 1), in 1/200 (bits 0-7); the
/// observation's weight 1..32 (8-15), inverse variance times that factor. Slopes are differences over two
/// tiles: a sixteenth of the pixels' noise.
struct IntegrationImage {
  std::span<std::uint32_t> pixels;  // width * height
  std::span<std::uint16_t> tiles;   // tiles_count(), and one more: kernels read it in 32-bit words
};
inline constexpr float kSlopeUnitM = kDepthUnitM;
inline constexpr float kTileCosineScale = 1.0f / 200.0f;

constexpr std::size_t tiles_count(int width, int height) {
  return static_cast<std::size_t>(width / 4) * static_cast<std::size_t>(height / 4);
}

/// Mean depth in metres of each tile's valid half-resolution pixels; 0 where fewer than two are, or where they straddle an
/// edge. tiles_count() floats.
void tile_means(std::span<const float> half_m, const hal::Intrinsics& full, std::span<float> means_m) noexcept;

/// Fills `image`; `tile_scratch` is tile_scratch_count() floats. width and height of `full` are multiples
/// of 4.
void integration_image(std::span<const std::uint16_t> depth, std::span<const float> half_m,
                       const hal::Intrinsics& full, std::span<float> tile_scratch,
                       const IntegrationImage& image) noexcept;

constexpr std::size_t tile_scratch_count(int width, int height) {
  return tiles_count(width, height) + static_cast<std::size_t>(width) + 2;
}

}  // namespace tactus
