// What the picture needs of a frame: the real depth in the drawn camera, labels per pixel, bodies in the
// renderer's terms.
#pragma once

#include <optional>
#include <span>

#include "hal/calibration.hpp"
#include "pipeline/contact/world.hpp"
#include "pipeline/map/reader.hpp"
#include "pipeline/messages.hpp"
#include "pipeline/render/body.hpp"

namespace tactus {

/// Depth in metres of the camera that is drawn: the depth camera's own image when the rig is registered or
/// has no colour, else its points splatted into the colour camera, nearest first. 0: nothing known. Step, no
/// heap.
void picture_depth(const SensorFrame& frame, const hal::RigCalibration& rig,
                   const hal::Intrinsics& picture_camera, std::span<float> depth_m) noexcept;

/// Pose of the drawn camera.
T_WorldDepth picture_pose(const T_WorldDepth& T_world_depth, const hal::RigCalibration& rig) noexcept;

/// The map's label behind each pixel with depth, asked for every fourth pixel each way. Any thread,
/// lock-free.
void picture_labels(std::span<const float> depth_m, const hal::Intrinsics& camera,
                    const T_WorldDepth& T_world_camera, const map::Reader& reader,
                    std::span<MaterialId> labels) noexcept;

/// A body as the renderer draws it, coloured by its material.
render::Body drawn_body(const contact::BodyState& body) noexcept;

/// Share of the bodies' discs in the depth image that real things hide; nothing when no body is in view.
std::optional<float> hidden_share(std::span<const contact::BodyState> bodies, const hal::RigCalibration& rig,
                                  const SensorFrame& frame, const T_WorldDepth& T_world_depth) noexcept;

}  // namespace tactus
