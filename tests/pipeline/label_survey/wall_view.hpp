// A flat wall 2 m before the camera, in a map of its own and in the model view of a 320x240 camera.
#pragma once

#include <cstdlib>
#include <memory>
#include <vector>

#include "pipeline/label/label_cell.hpp"
#include "pipeline/label_survey.hpp"
#include "tests/pipeline/map/analytic_map.hpp"

namespace tactus::test {

inline constexpr double kWallZ = 2.003;  // off the voxels' lattice
inline constexpr MaterialId kWood = 22;

inline hal::Intrinsics survey_camera() {
  hal::Intrinsics camera;
  camera.width = 320;
  camera.height = 240;
  camera.fx = camera.fy = 262.5;
  camera.cx = 159.5;
  camera.cy = 119.5;
  return camera;
}

/// The camera's axes are the world's at first.
struct WallView {
  map::test::OwnedMap owned{map::MapConfig{}};
  map::Map& map = owned.map;
  std::size_t view_bytes = rt::round_up(map::ModelView::bytes_needed(320, 240), 64);
  std::unique_ptr<std::byte, decltype(&std::free)> view_memory{
      static_cast<std::byte*>(std::aligned_alloc(64, view_bytes)), &std::free};
  map::ModelView model;
  std::vector<float> half_depth_m;

  WallView() {
    map::test::fill(map, {-1.8, -1.4, 1.9}, {1.8, 1.4, 2.1}, [](const Vec3d& p) { return kWallZ - p.z; });
    rt::Slice slice({view_memory.get(), view_bytes});
    model.bind(slice, survey_camera());
    look(T_WorldDepth{});
  }

  /// Predicts from a pose that still looks along +z.
  void look(const T_WorldDepth& T_world_depth) {
    half_depth_m.assign(std::size_t{320} * 240, static_cast<float>(kWallZ - T_world_depth.translation.z));
    model.T_world_view = T_world_depth;
    map::predict_guided(map, half_depth_m, 0, 240, model);
    map::predict_normals(0, 240, model);
  }

  /// Labels every cell whose place (of its lower corner, world) satisfies `where`, by n keyframes, the last
  /// of which was fused at `frame`.
  template <typename Where>
  void label(Where where, std::uint32_t n, std::uint32_t frame) {
    MaterialDistribution certain{};
    certain[kWood] = 1;
    const label::LabelWord word = label::encode(certain, n);
    const double size_m = 2 * static_cast<double>(map.config().voxel_size_m);
    std::vector<map::BlockIndex> blocks;
    map::test::live_blocks(map, blocks);
    for (const map::BlockIndex block : blocks) {
      const map::BlockCoord at = map::coord_of(map.key(block));
      std::array<map::LabelWord, map::kBlockCells> words;
      const auto before = map.labels(block);
      std::copy(before.begin(), before.end(), words.begin());
      bool has_any = false;
      for (int cell = 0; cell < map::kBlockCells; ++cell) {
        const Vec3d corner{(at.x * 4 + (cell & 3)) * size_m, (at.y * 4 + (cell >> 2 & 3)) * size_m,
                           (at.z * 4 + (cell >> 4)) * size_m};
        if (!where(corner)) continue;
        words[static_cast<std::size_t>(cell)] = word;
        has_any = true;
      }
      if (has_any) map.publish_labels(block, words, frame);
    }
  }

  [[nodiscard]] LabelSurveyInput input(std::uint32_t frame_index) const {
    LabelSurveyInput input;
    input.map = &map;
    input.model = &model;
    input.frame_index = frame_index;
    input.weak_observations = 3;
    input.old_frames = 300;
    return input;
  }
};

}  // namespace tactus::test
