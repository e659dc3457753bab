// What the labelled map says about each pixel of a picture: dense ray-casting, as the paper's accuracy study
// does it (sec. V-A).
#pragma once

#include <span>

#include "hal/calibration.hpp"
#include "pipeline/map/cell_list.hpp"
#include "pipeline/map/reader.hpp"
#include "pipeline/segment/material_scores.hpp"

namespace tactus {

/// The picture's camera and pose: the colour camera of the rig, lens distortion and all, or the depth camera
/// where both share pixels or there is no colour.
struct PictureCamera {
  hal::Intrinsics intrinsics;
  T_WorldDepth T_world_camera;
};
[[nodiscard]] PictureCamera picture_camera_at(const T_WorldDepth& T_world_depth,
                                              const hal::RigCalibration& rig) noexcept;

/// Direction in the world of the light that falls on a pixel; not unit: its length along the optical axis
/// is 1.
[[nodiscard]] Vec3d ray_of(const PictureCamera& camera, int u, int v) noexcept;

/// One ray per pixel, row-major: the cell of the first surface within range_m_max (key kNoKey where there is
/// none), and in `depth_m`, when it is not empty, how far that is along the optical axis (0: none). Any
/// thread; 1 to 3 us a ray.
void cast_cells(const map::Reader& reader, const PictureCamera& camera, float range_m_max,
                std::span<map::CellAddress> cells, std::span<float> depth_m) noexcept;

/// The cell nearest to the point at a depth known from elsewhere; kNoKey where depth is 0 or the map has no
/// surface within its truncation distance of that point.
void nearest_cells(const map::Reader& reader, const PictureCamera& camera, std::span<const float> depth_m,
                   std::span<map::CellAddress> cells) noexcept;

/// The most likely material of each pixel of a width x height colour image, ties to the lower id.
void labels_of_scores(const segment::MaterialScores& scores, int width, int height,
                      std::span<MaterialId> labels) noexcept;

}  // namespace tactus
