// Eq. (1) of the paper with nothing given up: float64, all 23 materials, the finished geometry, after the
// session. What the label words lose, and what fusing while mapping loses, is measured against it.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "hal/calibration.hpp"
#include "pipeline/label/label_cell.hpp"
#include "pipeline/map/cell_list.hpp"
#include "pipeline/segment/material_scores.hpp"

namespace tactus::firmware {

/// Every cell's labels from the same observations, twice.
struct FusedTwice {
  std::vector<float> unary_nat;  // [cell][23]: -ln P relative to the best; all 0 where no keyframe saw it
  std::vector<label::LabelWord> words;  // by label::fuse(), as the map does it; 0 where no keyframe saw it
};

/// How far label words are from FusedTwice::unary_nat, over the cells that a keyframe saw.
struct FusionLoss {
  std::uint64_t cells_count = 0;
  std::uint64_t winner_equal_count = 0;      // the same most probable material
  std::uint64_t probability_near_count = 0;  // its probability within kProbabilityNear
  [[nodiscard]] double winner_share() const { return share(winner_equal_count); }
  [[nodiscard]] double probability_share() const { return share(probability_near_count); }

 private:
  [[nodiscard]] double share(std::uint64_t count) const {
    return cells_count == 0 ? 0 : static_cast<double>(count) / static_cast<double>(cells_count);
  }
};
inline constexpr double kProbabilityNear = 0.05;

/// `words`: one a cell.
[[nodiscard]] FusionLoss loss_of(std::span<const label::LabelWord> words, const FusedTwice& exact);

class ExactFusion {
 public:
  /// Keeps a keyframe: its pose, its half-resolution depth and what the network said about its colour image,
  /// which shares the depth camera's pixels. `pane_bits` as in map::LabelKeyframe; may be empty.
  void add(const T_WorldDepth& T_world_depth, std::span<const float> half_depth_m,
           std::span<const std::uint64_t> pane_bits, const segment::MaterialScores& scores);

  /// A keyframe sees a cell by the rule of map::fuse_labels().
  [[nodiscard]] FusedTwice fuse(std::span<const map::SurfaceCell> cells, const hal::RigCalibration& rig,
                                const hal::Intrinsics& half_camera, float voxel_size_m) const;

 private:
  struct Keyframe {
    T_WorldDepth T_world_depth;
    std::vector<float> half_depth_m;
    std::vector<std::uint64_t> pane_bits;
    std::vector<std::uint8_t> probability;
    segment::MaterialScores scores;
  };
  std::vector<Keyframe> keyframes_;
};

}  // namespace tactus::firmware
