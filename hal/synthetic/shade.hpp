// Colour of what a camera sees.
#pragma once

#include <cstdint>
#include <span>

#include "hal/synthetic/raycast.hpp"

namespace tactus::hal::synthetic {

/// Lambert under the room's lights with distance fall-off, plus ambient light weighted by openness. Diffuse
/// only: nothing on a surface moves with the viewer, so that photometric tracking sees a still world; mirrors
/// and panes show their own texture. `depth_m` and `primitive` come from Raycaster::cast with the same pose.
/// Step: no heap.
void shade(const Scene& scene, const PixelRays& rays, const T_WorldDepth& T_world_camera,
           std::span<const float> depth_m, std::span<const std::uint16_t> primitive,
           std::span<std::uint8_t> rgb);

}  // namespace tactus::hal::synthetic
