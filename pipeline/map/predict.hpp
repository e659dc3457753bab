// The model as the camera would see it: what the next frame is tracked against.
#pragma once

#include <cstdint>
#include <span>

#include "hal/calibration.hpp"
#include "hal/transform.hpp"
#include "pipeline/map/map.hpp"

namespace tactus::map {

/// An image of the model's surface in the frame of the camera that looks at it: depth (0 where no surface),
/// and unit normals towards the camera where the surface is smooth (0 0 0 elsewhere), in separate planes of
/// camera.width * camera.height floats.
struct ModelView {
  hal::Intrinsics camera;  // no distortion
  T_WorldDepth T_world_view;
  std::span<float> z_m, nx, ny, nz;
  std::span<float> row_sum,
      row_slope;  // inverse depth over 2 kFitPixels + 1 columns; scratch between the two passes

  static std::size_t bytes_needed(int width, int height) {
    return 6 * rt::bytes_of<float>(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  }
  void bind(rt::Slice& memory, const hal::Intrinsics& view_camera) {
    camera = view_camera;
    const auto count = static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height);
    for (auto* plane : {&z_m, &nx, &ny, &nz, &row_sum, &row_slope}) *plane = memory.take<float>(count);
  }
};

/// Depth of rows [row_begin, row_end), from a depth image of the same camera that has just been fused at
/// view.T_world_view: the measured depth is within the truncation band of the model's surface, so that two
/// reads of the field and a secant step find it, where marching from the camera needs dozens. Pixels without
/// measurement, and those where the model disagrees (free space, unobserved, more than a voxel left after the
/// first step), become 0: tracking has no use for them. Writer thread or its fork-join helpers on disjoint
/// rows.
void predict_guided(const Map& map, std::span<const float> depth_m, int row_begin, int row_end,
                    ModelView& view) noexcept;

/// Normals of rows [row_begin, row_end), once the depth of kFitPixels rows above and below is there: the
/// plane that fits the inverse depth (linear over a plane's image) of the pixels around. Wide on purpose:
/// normals from the field's gradient are noise while few frames are fused, and noisy normals are false
/// evidence that the camera did not move sideways (errors in variables: a third of a slow turn was seen).
/// Left 0 where a pixel is missing or the surface bends: along creases and beside steps a voxel grid rounds
/// off, always to the same side, and tracking against that drifts.
void predict_normals(int row_begin, int row_end, ModelView& view) noexcept;

/// The same two, one pixel at a time: the oracles, equal bit for bit.
void predict_guided_reference(const Map& map, std::span<const float> depth_m, int row_begin, int row_end,
                              ModelView& view) noexcept;
void predict_normals_reference(int row_begin, int row_end, ModelView& view) noexcept;

/// Marches each ray from the camera to the first zero crossing from front to back: for poses that nothing was
/// measured from (relocalisation, pictures). `stride`: every n-th pixel and row, the others become 0. Normals
/// are the field's gradient. The fit's scratch is left alone.
void predict_marching(const Map& map, int row_begin, int row_end, int stride, float depth_m_max,
                      ModelView& view) noexcept;

}  // namespace tactus::map
