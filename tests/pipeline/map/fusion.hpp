// Depth images, exact or from the synthetic rooms, and a map that they are fused into.
#pragma once

#include <hwy/targets.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <span>
#include <vector>

#include "hal/synthetic/synthetic.hpp"
#include "pipeline/map/integrate.hpp"
#include "pipeline/register/depth_images.hpp"
#include "pipeline/register/half_color.hpp"
#include "tests/pipeline/map/analytic_map.hpp"

namespace tactus::map::test {

/// Everything the register stage makes of one depth image.
class RegisteredFrame {
 public:
  explicit RegisteredFrame(const hal::Intrinsics& full)
      : camera(full),
        half_camera(half_resolution(full)),
        depth_(pixels_count()),
        half_m(pixels_count() / 4),
        half_color(pixels_count() / 4),
        pixels_(pixels_count()),
        tiles_(tiles_count(full.width, full.height) + 1),
        scratch_(tile_scratch_count(full.width, full.height)) {}

  /// z in metres of the pixel with ray (a, b, 1); 0 where nothing is met. Rounded to the pipeline's unit
  /// only.
  template <typename Function>
  void measure(Function z_m_of) {
    for (int v = 0; v < camera.height; ++v)
      for (int u = 0; u < camera.width; ++u) {
        const double z = z_m_of((u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy);
        depth_[static_cast<std::size_t>(v * camera.width + u)] =
            static_cast<std::uint16_t>(z > 0 && z < 8.19 ? std::lround(z * 8000) : 0);
      }
    derive();
  }

  void measure(hal::synthetic::FrameRenderer& renderer, int frame_index) {
    std::vector<std::uint16_t> raw(pixels_count());
    renderer.depth(frame_index, raw);
    normalize_depth(raw, renderer.calibration().depth_m_per_unit, 5.0f, depth_);
    derive();
    std::vector<std::uint8_t> rgb(pixels_count() * 3);
    renderer.color(frame_index, rgb);
    half_color_registered(rgb, camera.width, camera.height, half_color);
    has_color_ = true;
  }

  [[nodiscard]] IntegrationFrame at(const T_WorldDepth& T_world_depth, std::uint32_t index) {
    IntegrationFrame frame;
    frame.camera = camera;
    frame.image = {pixels_, tiles_};
    frame.half_depth_m = half_m;
    if (has_color_) frame.half_color = half_color;
    frame.T_world_depth = T_world_depth;
    frame.index = index;
    return frame;
  }

  const hal::Intrinsics camera, half_camera;

 private:
  [[nodiscard]] std::size_t pixels_count() const {
    return static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height);
  }
  void derive() {
    half_depth(depth_, camera.width, camera.height, half_m);
    integration_image(depth_, half_m, camera, scratch_, {pixels_, tiles_});
  }
  std::vector<std::uint16_t> depth_;

 public:
  std::vector<float> half_m;
  std::vector<std::uint32_t> half_color;

 private:
  std::vector<std::uint32_t> pixels_;
  std::vector<std::uint16_t> tiles_;
  std::vector<float> scratch_;
  bool has_color_ = false;
};

/// A map and its active set.
class FusedMap {
 public:
  explicit FusedMap(std::uint32_t blocks_capacity = 6000, float voxel_size_m = 0.01f,
                    float truncation_m = 0.04f)
      : owned_({voxel_size_m, truncation_m, blocks_capacity}),
        bytes_(rt::round_up(ActiveSet::bytes_needed(blocks_capacity), 64)),
        memory_(static_cast<std::byte*>(std::aligned_alloc(64, bytes_)), &std::free) {
    rt::Slice slice({memory_.get(), bytes_});
    active.bind(slice, blocks_capacity);
  }

  template <typename Integrate>
  void fuse(const IntegrationFrame& frame, Integrate integrate) {
    map().set_frame(frame.index);
    select_blocks(map(), frame, active);
    integrate(map(), frame, active.blocks());
  }
  void fuse(const IntegrationFrame& frame) { fuse(frame, integrate_blocks); }

  Map& map() { return owned_.map; }
  ActiveSet active;

 private:
  OwnedMap owned_;
  std::size_t bytes_;
  std::unique_ptr<std::byte, decltype(&std::free)> memory_;
};

/// Calls `check(name)` once for each instruction set that this processor has and the kernels were compiled
/// for.
template <typename Check>
void for_each_instruction_set(Check check) {
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    hwy::SetSupportedTargetsForTest(target);
    hwy::GetChosenTarget().Update(hwy::SupportedTargets());
    check(hwy::TargetName(target));
  }
  hwy::SetSupportedTargetsForTest(0);
  hwy::GetChosenTarget().Update(hwy::SupportedTargets());
}

inline hal::Intrinsics small_camera() {
  hal::Intrinsics camera;
  camera.width = 320;
  camera.height = 240;
  camera.fx = camera.fy = 262.5;
  camera.cx = 159.5;
  camera.cy = 119.5;
  return camera;
}

inline hal::synthetic::SyntheticOptions options_of(const char* source) {
  return *hal::synthetic::parse_synthetic_name(source);
}

inline hal::synthetic::FrameRenderer renderer_of(const char* source) {
  const auto options = options_of(source);
  return {std::make_shared<const hal::synthetic::Scene>(hal::synthetic::make_scene(options.scene)), options};
}

}  // namespace tactus::map::test
