// Pictures of the map for the report: shade a ray-cast view, then paint it grey, by label or by colour.
#pragma once

#include <cstdint>
#include <span>

#include "hal/calibration.hpp"
#include "hal/transform.hpp"
#include "pipeline/label/material.hpp"

namespace tactus::render {

inline constexpr Rgb8 kNoSurfaceColor{24, 24, 32};

/// Shade of one pixel: 0 where there is no surface, else 64 (seen edge-on, or far) to 255 (head-on, or near).
using Shade = std::uint8_t;

// All functions: row-major images of one size, pure, O(pixels), no heap, any phase. Values that are not
// finite count as "no surface".

/// How much each surface faces the direction `toward_eye` (unit, in the frame of the normals); a zero normal
/// is no surface.
void shade_normals(std::span<const Vec3f> normals, const Vec3f& toward_eye, std::span<Shade> shades) noexcept;

/// How near each surface is: 255 up to near_m, 64 from far_m on; depth 0 is no surface.
void shade_depth(std::span<const float> depth_m, float near_m, float far_m, std::span<Shade> shades) noexcept;

/// Unit normals towards the camera (optical frame) of a depth image, by central differences; zero where a
/// neighbour has no depth or is farther away in z than 5 cm + 2 % of z (another surface), and on the border.
void normals_of_depth(std::span<const float> depth_m, const hal::Intrinsics& camera,
                      std::span<Vec3f> normals_depth) noexcept;

/// Paint a shaded view; `rgb` holds 3 bytes for each shade. Where there is no surface: kNoSurfaceColor.
void paint_grey(std::span<const Shade> shades, std::span<std::uint8_t> rgb) noexcept;
void paint_labels(std::span<const Shade> shades, std::span<const MaterialId> labels,
                  std::span<std::uint8_t> rgb) noexcept;
void paint_colors(std::span<const Shade> shades, std::span<const Rgb8> colors,
                  std::span<std::uint8_t> rgb) noexcept;

}  // namespace tactus::render
