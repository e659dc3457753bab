// SIMD kernels over one row of pixels: light and sensor noise. Single precision, + - * / sqrt and integer
// operations in a fixed order: the same bits in every lane width and on every machine.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "hal/synthetic/raycast.hpp"

namespace tactus::hal::synthetic {

inline constexpr std::size_t kRowCapacity = 1024;  // pixels; the widest mode has 960

/// One row of PixelRays.
struct alignas(64) PixelRow {
  std::array<float, kRowCapacity> x{}, y{};
};

/// Light that falls on each surface point of a row; the row starts at `first` in `hits`. Writes `width`
/// values (and up to one vector beyond).
void light_row(const Scene& scene, const T_WorldDepth& T_world_camera, const PixelRow& rays,
               std::size_t width, const Hits& hits, std::size_t first, std::span<float, kRowCapacity> light);

/// Random streams of one frame.
struct NoiseStreams {
  std::uint32_t edge = 0, pane = 0, lateral_u = 0, lateral_v = 0, axial_low = 0, axial_high = 0;
};

/// Per-pixel flags found by the scalar part of the model.
inline constexpr std::uint32_t kShadowed = 1, kPane = 2;

struct NoiseRow {
  int row = 0, width = 0, height = 0;
  float jitter_px = 0;
  NoiseStreams streams;
  std::array<float, 9> R_world_depth{};
};

/// Depth of one row after the sensor, raw units. `flags` has width elements; see depth_noise.hpp for the
/// model.
void noise_row(const NoiseRow& row, const PixelRow& rays, const Hits& hits,
               std::span<const std::uint32_t, kRowCapacity> flags, std::span<std::uint16_t> raw);

}  // namespace tactus::hal::synthetic
