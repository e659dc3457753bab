// What the picture needs of a frame: the real depth in the drawn camera, labels per pixel, bodies in the
// renderer's terms.
#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

#include "hal/calibration.hpp"
#include "pipeline/contact/world.hpp"
#include "pipeline/interact/game.hpp"
#include "pipeline/map/reader.hpp"
#include "pipeline/messages.hpp"
#include "pipeline/render/renderer.hpp"

namespace tactus {

/// Depth in metres of the camera that is drawn: the depth camera's own image when the rig is registered or
/// has no colour, else its points splatted into the colour camera, nearest first. Where nothing was measured, what the map
/// predicted for the frame's pose stands in: mirrors and panes, dark and slanted surfaces. `model_half_mm`: half size of
/// the depth image, 0 nothing; may be empty. 0: nothing known. Step, no heap.
void picture_depth(const SensorFrame& frame, std::span<const std::uint16_t> model_half_mm, const hal::RigCalibration& rig,
                   const hal::Intrinsics& picture_camera, std::span<float> depth_m) noexcept;

/// Depths of the model view as they lie beside a frame until it is drawn: whole millimetres, half of what floats take.
void keep_model_depth(std::span<const float> model_m, std::span<std::uint16_t> model_mm) noexcept;

/// Pose of the drawn camera.
T_WorldDepth picture_pose(const T_WorldDepth& T_world_depth, const hal::RigCalibration& rig) noexcept;

/// The map's label behind each pixel with depth, asked for every fourth pixel each way. Any thread,
/// lock-free.
void picture_labels(std::span<const float> depth_m, const hal::Intrinsics& camera,
                    const T_WorldDepth& T_world_camera, const map::Reader& reader,
                    std::span<MaterialId> labels) noexcept;

/// A body and a mark as the renderer takes them.
render::Body drawn_body(const contact::BodyState& body, const interact::BodyLook& look,
                        const contact::MaterialTable& materials) noexcept;
render::Decal drawn_decal(const interact::Mark& mark) noexcept;

/// The catalogue's hulls as triangles; the renderer copies them at bind. Boot.
struct HullMeshes {
  explicit HullMeshes(const interact::ThingCatalogue& catalogue);
  std::vector<render::HullMesh> meshes;  // views into the two below

 private:
  std::vector<Vec3f> vertices_m_;
  std::vector<std::array<std::uint16_t, 3>> triangles_;
};

/// Share of the bodies' discs in the depth image that real things hide; nothing when no body is in view.
std::optional<float> hidden_share(std::span<const contact::BodyState> bodies, const hal::RigCalibration& rig,
                                  const SensorFrame& frame, const T_WorldDepth& T_world_depth) noexcept;

}  // namespace tactus
