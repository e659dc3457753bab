// Fusing what the network said about one keyframe into the map's cells (eq. (1) of the paper).
//
// Which cells: those that hold a surface (a sign change, or a voxel within one voxel size of it) and whose
// piece of surface the keyframe saw: it projects into the keyframe's depth image, the depth measured there
// agrees with it to 1.5 voxels along the normal (2 sigma of the sensor, if that is more), and the line of
// sight meets it at a cosine of 0.2 or more (flatter, a pixel of the label image covers several cells).
// Everything is taken from the moment of the keyframe: its pose, its depth; the network's answer may come
// seconds later.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "hal/calibration.hpp"
#include "pipeline/label/label_cell.hpp"
#include "pipeline/map/map.hpp"

namespace tactus::map {

/// Probabilities as the segment stage leaves them: bytes [y][x][23], 255 * p. Score coordinate = scale *
/// colour pixel + offset, integers at pixel centres. A view; nobody may write while it is read.
struct ScoreView {
  const std::uint8_t* probability = nullptr;
  int width = 0, height = 0;
  float scale_u = 1, offset_u = 0, scale_v = 1, offset_v = 0;
};

/// The 23 bytes at a colour pixel, bilinear; false where no score was ever written. Phase: any. Pure.
[[nodiscard]] bool sample_scores(const ScoreView& scores, float u, float v,
                                 std::span<std::uint8_t, kMaterialCount> out) noexcept;

/// A keyframe as it was when its images were taken.
struct LabelKeyframe {
  T_WorldDepth T_world_depth;
  hal::Intrinsics half_camera;          // of half_depth_m; no distortion
  std::span<const float> half_depth_m;  // metres, 0 where nothing was measured
  /// One bit per pixel of a mirror or pane (register/panes.hpp); may be empty. That hardly anything came back from there is
  /// evidence of its own (label/pane_evidence.hpp).
  std::span<const std::uint64_t> pane_bits;
  /// Where the network's colour image comes from: rig.color through T_color_depth, or for registered cameras
  /// rig.depth at full resolution.
  hal::RigCalibration rig;
  /// Two cameras only, may be empty: what half_color_projected() left, of which kNoColorPixel is looked at:
  /// surfaces hidden from the colour camera are left out.
  std::span<const std::uint32_t> color_pixels;
  ScoreView scores;
  std::uint32_t index = 0;  // the frame's number
};

enum class LabelRule : std::uint8_t {
  bayes,  // eq. (1)
  direct  // the newest keyframe replaces what was known: the paper's ablation
};

struct FuseLabelsResult {
  std::size_t blocks_done = 0;  // of the list, from its front
  std::size_t cells_fused = 0;
};

/// Step; the map's writer thread, or its fork-join helpers on disjoint parts of the list; no heap, no lock,
/// no waiting. Work is bounded by the list and by `cells_max`: stops after the block that reaches it, and the
/// caller goes on later with blocks.subspan(blocks_done). A block evicted since the list was made is skipped;
/// one that was reused is judged by what it holds now. Blocks with nothing new are not published.
FuseLabelsResult fuse_labels(Map& map, const LabelKeyframe& keyframe, std::span<const BlockIndex> blocks,
                             LabelRule rule = LabelRule::bayes,
                             std::size_t cells_max = static_cast<std::size_t>(-1)) noexcept;

/// Live blocks that may hold surface seen by the keyframe, in index order; those that do not fit into `out`
/// are left out. Returns the number written. Step; writer thread; looks at every block of the pool once
/// (about 0.3 ms at 14336 blocks).
std::size_t blocks_in_keyframe(const Map& map, const LabelKeyframe& keyframe,
                               std::span<BlockIndex> out) noexcept;

}  // namespace tactus::map
