// The spine: the stages that every depth frame goes through, in order, on one thread.
//
//   raw depth, rgb ─► register ─► track ─► integrate ─► predict ─► (pose, model view)
//                                   ▲                      │
//                                   └────── model view ◄───┘
//
// Each stage is one call, so that the runner can time it and give way between two. The spine owns no thread
// and reads no clock; helpers of `pool` work on its behalf inside a call.
#pragma once

#include <cstdint>
#include <span>

#include "hal/calibration.hpp"
#include "pipeline/map/evict.hpp"
#include "pipeline/map/integrate.hpp"
#include "pipeline/map/map.hpp"
#include "pipeline/map/predict.hpp"
#include "pipeline/register/panes.hpp"
#include "pipeline/track/brightness.hpp"
#include "pipeline/track/relocalizer.hpp"
#include "pipeline/track/tracker.hpp"
#include "rt/slice.hpp"
#include "rt/status.hpp"

namespace tactus::rt {
class WorkerPool;
}

namespace tactus {

struct SpineConfig {
  map::MapConfig map;
  track::TrackConfig track;
  track::BrightnessConfig brightness;
  track::RelocalizerConfig relocalizer;
  float depth_m_max = 5.0f;            // farther measurements are noise of 40 mm and more
  bool closes_panes = true;            // mirrors and glass, register/panes.hpp
  float valid_share_min = 0.05f;       // of pixels: below, the frame shows nothing
  std::uint32_t evict_free_min = 512;  // blocks kept free ahead of need
};

/// What a frame came to.
struct SpineResult {
  rt::Status status =
      rt::Status::lost;        // ok: tracked and integrated; lost: pose unknown; corrupt: nothing to see
  T_WorldDepth T_world_depth;  // last good pose when not ok
  track::TrackResult track;
  bool relocalized = false;
  std::uint32_t active_blocks_count = 0;
};

class Spine {
 public:
  /// Without the map, which has a row of its own: map::Map::bytes_needed().
  static std::size_t bytes_needed(const hal::RigCalibration& rig, const SpineConfig& config);

  /// Boot. `T_world_first` is the pose of the first frame (gravity-aligned by the caller).
  void bind(rt::Slice map_memory, rt::Slice memory, const hal::RigCalibration& rig, const SpineConfig& config,
            const T_WorldDepth& T_world_first, rt::WorkerPool& pool);
  /// Before the first frame: where it will be.
  void set_first_pose(const T_WorldDepth& T_world_first) noexcept { T_world_depth_ = T_world_first; }

  // Step, in this order, once a frame.
  /// Depth to the pipeline's units and half resolution; colour to the depth camera. `rgb` may be empty.
  rt::Status register_frame(std::span<const std::uint16_t> raw_depth,
                            std::span<const std::uint8_t> rgb) noexcept;
  /// Pose by ICP; when that fails, by relocalisation. Holds integrate() and predict() back when lost. `frames_since_last`:
  /// from 1, how many frames ago the one before was taken.
  rt::Status track(int frames_since_last = 1) noexcept;
  /// Instead of track(): the pose is known from outside, or known to be missing. For studies that set tracking
  /// aside. corrupt when the frame shows nothing.
  rt::Status place(const T_WorldDepth& T_world_depth) noexcept;
  rt::Status miss() noexcept;
  rt::Status integrate() noexcept;
  rt::Status predict() noexcept;

  [[nodiscard]] const SpineResult& result() const noexcept { return result_; }
  [[nodiscard]] std::uint32_t frame_index() const noexcept { return frame_index_; }
  [[nodiscard]] map::Map& map() noexcept { return map_; }
  [[nodiscard]] const map::Map& map() const noexcept { return map_; }
  [[nodiscard]] const map::ModelView& model() const noexcept { return model_; }
  [[nodiscard]] const map::ActiveSet& active() const noexcept { return active_; }
  /// What is there as far as the map is concerned: measured depth, and after integrate() the panes in it.
  [[nodiscard]] std::span<const float> half_depth_m() const noexcept { return surface_half_m_; }
  [[nodiscard]] const PaneFiller& panes() const noexcept { return panes_; }
  [[nodiscard]] std::span<const std::uint32_t> half_color() const noexcept { return half_color_; }
  [[nodiscard]] const IntegrationImage& integration_image() const noexcept { return image_; }
  /// Colour camera pixel per half-resolution depth pixel; empty when the cameras share pixels.
  [[nodiscard]] std::span<const std::uint32_t> color_pixels() const noexcept { return color_pixel_; }
  [[nodiscard]] const hal::Intrinsics& half_camera() const noexcept { return half_camera_; }
  [[nodiscard]] const hal::RigCalibration& rig() const noexcept { return rig_; }
  [[nodiscard]] const track::Relocalizer& relocalizer() const noexcept { return relocalizer_; }

 private:
  void undistort(std::span<const std::uint16_t> raw) noexcept;
  [[nodiscard]] bool is_blank() const noexcept;
  void observe() noexcept;
  bool try_pose(const T_WorldDepth& T_world_guess) noexcept;
  [[nodiscard]] map::IntegrationFrame integration_frame() const noexcept;

  hal::RigCalibration rig_;
  SpineConfig config_;
  hal::Intrinsics half_camera_;
  rt::WorkerPool* pool_ = nullptr;
  map::Map map_;
  map::ActiveSet active_;
  map::Evictor evictor_;
  map::ModelView model_;
  track::Relocalizer relocalizer_;
  std::span<std::uint16_t> depth_;             // full resolution, kDepthUnitM
  std::span<std::uint32_t> undistorted_from_;  // source pixel per pixel; empty when the depth camera is ideal
  std::span<std::uint16_t> undistorted_;
  std::span<float> half_m_;
  std::span<const float> surface_half_m_;  // half_m_, or that with panes
  PaneFiller panes_;
  std::span<std::uint32_t> half_color_, color_pixel_;
  std::span<track::Luma> live_luma_;
  track::BrightnessKeyframes brightness_;
  std::span<float> nearest_z_m_;
  std::span<float> tile_scratch_;
  IntegrationImage image_;
  bool has_color_now_ = false;
  bool has_model_ = false;
  bool was_found_ = false;  // the last frame's pose, by relocalisation
  std::uint32_t frame_index_ = 0;
  std::uint32_t valid_count_ = 0;
  float pivot_z_m_ = 2.0f;
  T_WorldDepth T_world_depth_;
  track::T_ViewLive velocity_;  // from one frame to the next, where none is missing
  SpineResult result_;
};

}  // namespace tactus
