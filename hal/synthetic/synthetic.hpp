// The synthetic sensor: a furnished room seen by a depth camera in a hand, with exact truth.
#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "hal/camera.hpp"
#include "hal/synthetic/options.hpp"
#include "hal/synthetic/raycast.hpp"
#include "hal/synthetic/scene.hpp"

namespace tactus::hal::synthetic {

/// Renders the frames of one session, by index and in any order: every image is a pure function of the
/// options and the index, the same bits on every machine. Scratch memory inside: one thread at a time.
class FrameRenderer {
 public:
  /// Boot; allocates 19 bytes a pixel (35 with lens distortion).
  FrameRenderer(std::shared_ptr<const Scene> scene, const SyntheticOptions& options);

  [[nodiscard]] T_WorldDepth pose(int frame_index) const;
  /// Row-major, width * height raw values; 0 = no measurement. Blank frames are all zero.
  void depth(int frame_index, std::span<std::uint16_t> raw);
  /// Exact z of the depth camera's pixels in metres, without noise or rounding; also for blank frames.
  void exact_depth(int frame_index, std::span<float> depth_m);
  /// Exact material ids of the depth camera's pixels; kNoMaterial where nothing is hit. Also for blank
  /// frames.
  void labels(int frame_index, std::span<std::uint8_t> material_ids);
  /// Row-major interleaved RGB of the colour camera. Blank frames are all zero.
  void color(int frame_index, std::span<std::uint8_t> rgb);

  [[nodiscard]] const RigCalibration& calibration() const { return calibration_; }
  [[nodiscard]] const SyntheticOptions& options() const { return options_; }
  [[nodiscard]] const Scene& scene() const { return *scene_; }

 private:
  void cast_from_depth_camera(int frame_index);
  void find_depth_normals(int frame_index);
  [[nodiscard]] bool is_blank(int frame_index) const;

  std::shared_ptr<const Scene> scene_;
  SyntheticOptions options_;
  RigCalibration calibration_;
  Raycaster depth_caster_;
  std::unique_ptr<Raycaster> color_caster_;  // null when registered: colour shares the depth camera's rays
  Hits hits_;
  int frame_in_hits_ = -1;  // the depth camera's frame that hits_ holds, -1: none
  bool has_normals_ = false;
};

/// Opens a session at its first frame: depth and colour cameras at 30 Hz with timestamps from 0, exact truth
/// poses of the depth camera in the scene's world, exact labels, gravity. read() renders at once and never
/// waits. The two cameras share one renderer: read them on one thread. Never fails for options that
/// parse_synthetic_name() made. Boot.
rt::Result<Sensor> open_synthetic(const SyntheticOptions& options);

}  // namespace tactus::hal::synthetic

namespace tactus::hal {
using synthetic::open_synthetic;
using synthetic::parse_synthetic_name;
using synthetic::SyntheticOptions;
}  // namespace tactus::hal
