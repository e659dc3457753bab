// Eq. (1) of the paper with nothing given up: float64, all 23 materials, the finished geometry, after the
// session. What the compact cells and fusing while mapping lose is measured against it.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "hal/calibration.hpp"
#include "pipeline/map/cell_list.hpp"
#include "pipeline/segment/material_scores.hpp"

namespace tactus::firmware {

class ExactFusion {
 public:
  /// Keeps a keyframe: its pose, its half-resolution depth and what the network said about its colour image,
  /// which shares the depth camera's pixels.
  void add(const T_WorldDepth& T_world_depth, std::span<const float> half_depth_m,
           const segment::MaterialScores& scores);

  /// Unary costs -ln P per cell and material, nats, relative to the best; all 0 where no keyframe saw the
  /// cell. A keyframe sees it by the rule of map::fuse_labels().
  [[nodiscard]] std::vector<float> unary_nat(std::span<const map::SurfaceCell> cells,
                                             const hal::RigCalibration& rig,
                                             const hal::Intrinsics& half_camera, float voxel_size_m) const;

 private:
  struct Keyframe {
    T_WorldDepth T_world_depth;
    std::vector<float> half_depth_m;
    std::vector<std::uint8_t> probability;
    segment::MaterialScores scores;
  };
  std::vector<Keyframe> keyframes_;
};

}  // namespace tactus::firmware
