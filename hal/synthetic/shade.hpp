// Colour of what a camera sees.
#pragma once

#include <cstdint>
#include <span>

#include "hal/synthetic/raycast.hpp"

namespace tactus::hal::synthetic {

/// Lambert under the room's lights with distance fall-off, plus ambient light weighted by how open the space
/// in front of the surface is. Diffuse only: nothing on a surface moves with the viewer, so that photometric
/// tracking sees a still world; mirrors and panes show their own texture. `hits` with normals, of the same
/// pose. Step: no heap.
void shade(const Scene& scene, const PixelRays& rays, const T_WorldDepth& T_world_camera, const Hits& hits,
           std::span<std::uint8_t> rgb);

/// The axis (0 x, 1 y, 2 z) along which a surface with this local normal is textured.
[[nodiscard]] int dominant_axis(const Vec3f& normal_local);

/// Where a point of a solid's surface lies in its texture: shifted by the solid's place, so that equal pieces
/// do not look alike.
[[nodiscard]] Vec3f texture_point(const Primitive& solid, const Vec3f& p_local);

/// Texture at such a point, projected along `axis`; footprint_m is one pixel's width there.
[[nodiscard]] Rgb8 sample_along(const Texture& texture, const Vec3f& texture_point, int axis,
                                float footprint_m);

}  // namespace tactus::hal::synthetic
