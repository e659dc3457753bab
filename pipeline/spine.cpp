#include "pipeline/spine.hpp"

#include <algorithm>
#include <cmath>

#include "pipeline/register/depth_images.hpp"
#include "pipeline/register/half_color.hpp"
#include "rt/worker_pool.hpp"

namespace tactus {
namespace {

constexpr std::size_t kBlocksPerChunk = 64;  // of integration: about 60 us of work
constexpr int kRowsPerChunk = 8;             // of prediction
constexpr float kMarchDepthM = 6.0f;
constexpr int kCoarseStride = 4, kFineStride = 2;

std::size_t pixels_count(const hal::Intrinsics& camera) {
  return static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height);
}

// Motion between two frames below which the camera stands still: without it 60 noisy frames walk 0.08 mm.
constexpr double kStillM = 3e-4, kStillTurn = 2e-4;

// Where frames are missing the motion is carried on for as long, up to a third of a second: hands turn round then.
constexpr int kFramesAheadMax = 10;

double fit_of(const track::TrackResult& result) noexcept {
  return result.status == rt::Status::ok ? result.inlier_share * result.overlap_share : 0;
}

// A proposal may lie this far from the truth; acceptance is stricter than for a frame that follows its
// predecessor, because a wrong acceptance spoils the map.
constexpr double kRelocalizeShiftM = 0.8, kRelocalizeTurn = 0.8;
constexpr double kRelocalizeInlierShare = 0.75;

}  // namespace

std::size_t Spine::bytes_needed(const hal::RigCalibration& rig, const SpineConfig& config) {
  const std::size_t n = pixels_count(rig.depth), half = n / 4;
  const bool remap = rig.depth.has_distortion();
  std::size_t bytes = rt::bytes_of<std::uint16_t>(n) + rt::bytes_of<float>(half) +
                      rt::bytes_of<std::uint32_t>(half) +
                      rt::bytes_of<float>(tile_scratch_count(rig.depth.width, rig.depth.height)) +
                      rt::bytes_of<std::uint32_t>(n) +
                      rt::bytes_of<std::uint16_t>(tiles_count(rig.depth.width, rig.depth.height) + 1);
  if (remap) bytes += rt::bytes_of<std::uint32_t>(n) + rt::bytes_of<std::uint16_t>(n);
  if (rig.has_color && !rig.registered)
    bytes += rt::bytes_of<std::uint32_t>(half) + rt::bytes_of<float>(color_bins_count(rig.color));
  if (rig.has_color)
    bytes += rt::bytes_of<track::Luma>(half + track::kLumaPadding) +
             track::BrightnessKeyframes::bytes_needed(half_resolution(rig.depth), config.brightness);
  if (config.closes_panes) bytes += PaneFiller::bytes_needed(rig.depth);
  return bytes + map::ActiveSet::bytes_needed(config.map.blocks_capacity) +
         map::ModelView::bytes_needed(rig.depth.width / 2, rig.depth.height / 2) +
         track::Relocalizer::bytes_needed(config.relocalizer);
}

void Spine::bind(rt::Slice map_memory, rt::Slice memory, const hal::RigCalibration& rig,
                 const SpineConfig& config, const T_WorldDepth& T_world_first, rt::WorkerPool& pool) {
  rig_ = rig;
  config_ = config;
  pool_ = &pool;
  T_world_depth_ = T_world_first;
  hal::Intrinsics ideal = rig.depth;
  ideal.k1 = ideal.k2 = ideal.p1 = ideal.p2 = ideal.k3 = 0;
  half_camera_ = half_resolution(ideal);
  const std::size_t n = pixels_count(rig.depth), half = n / 4;
  map_.bind(map_memory, config.map);
  active_.bind(memory, config.map.blocks_capacity);
  model_.bind(memory, half_camera_);
  relocalizer_.bind(memory, config.relocalizer);
  depth_ = memory.take<std::uint16_t>(n);
  half_m_ = memory.take<float>(half);
  half_color_ = memory.take<std::uint32_t>(half);
  if (rig.has_color) {
    live_luma_ = memory.take<track::Luma>(half + track::kLumaPadding);
    brightness_.bind(memory, half_camera_, config.brightness);
  }
  if (config.closes_panes) panes_.bind(memory, ideal);
  tile_scratch_ = memory.take<float>(tile_scratch_count(rig.depth.width, rig.depth.height));
  image_ = {memory.take<std::uint32_t>(n),
            memory.take<std::uint16_t>(tiles_count(rig.depth.width, rig.depth.height) + 1)};
  if (rig.has_color && !rig.registered) {
    color_pixel_ = memory.take<std::uint32_t>(half);
    nearest_z_m_ = memory.take<float>(color_bins_count(rig.color));
  }
  if (rig.depth.has_distortion()) {
    undistorted_from_ = memory.take<std::uint32_t>(n);
    undistorted_ = memory.take<std::uint16_t>(n);
    for (int v = 0; v < rig.depth.height; ++v)
      for (int u = 0; u < rig.depth.width; ++u) {
        const Normalized lens = distort(rig.depth, {static_cast<float>((u - rig.depth.cx) / rig.depth.fx),
                                                    static_cast<float>((v - rig.depth.cy) / rig.depth.fy)});
        const double su = std::nearbyint(static_cast<double>(lens.x) * rig.depth.fx + rig.depth.cx);
        const double sv = std::nearbyint(static_cast<double>(lens.y) * rig.depth.fy + rig.depth.cy);
        const bool inside = su >= 0 && sv >= 0 && su < rig.depth.width && sv < rig.depth.height;
        undistorted_from_[static_cast<std::size_t>(v) * static_cast<std::size_t>(rig.depth.width) +
                          static_cast<std::size_t>(u)] =
            inside ? static_cast<std::uint32_t>(sv) * static_cast<std::uint32_t>(rig.depth.width) +
                         static_cast<std::uint32_t>(su)
                   : kNoColorPixel;
      }
    rig_.depth = ideal;
  }
}

void Spine::undistort(std::span<const std::uint16_t> raw) noexcept {
  // Nearest, never a mean: a mean across a depth edge is a surface that does not exist.
  for (std::size_t i = 0; i < undistorted_.size(); ++i)
    undistorted_[i] = undistorted_from_[i] == kNoColorPixel ? std::uint16_t{0} : raw[undistorted_from_[i]];
}

rt::Status Spine::register_frame(std::span<const std::uint16_t> raw_depth,
                                 std::span<const std::uint8_t> rgb) noexcept {
  ++frame_index_;
  was_found_ = result_.relocalized;
  result_ = SpineResult{};
  result_.T_world_depth = T_world_depth_;
  if (!undistorted_.empty()) {
    undistort(raw_depth);
    raw_depth = undistorted_;
  }
  valid_count_ = normalize_depth(raw_depth, rig_.depth_m_per_unit, config_.depth_m_max, depth_);
  half_depth(depth_, rig_.depth.width, rig_.depth.height, half_m_);
  surface_half_m_ = half_m_;
  panes_.clear();
  double sum = 0, count = 0;
  for (std::size_t i = 0; i < half_m_.size(); i += 61) {  // a prime stride: no column is preferred
    if (half_m_[i] > 0) {
      sum += static_cast<double>(half_m_[i]);
      count += 1;
    }
  }
  if (count > 0) pivot_z_m_ = static_cast<float>(sum / count);
  has_color_now_ = rig_.has_color && !rgb.empty();
  if (has_color_now_) {
    if (rig_.registered) {
      half_color_registered(rgb, rig_.depth.width, rig_.depth.height, half_color_);
    } else {
      half_color_projected(rgb, rig_, half_m_, half_camera_, nearest_z_m_, half_color_, color_pixel_);
    }
  }
  if (has_color_now_) track::luma_of(half_color_, live_luma_);
  return is_blank() ? rt::Status::corrupt : rt::Status::ok;
}

map::IntegrationFrame Spine::integration_frame() const noexcept {
  map::IntegrationFrame frame;
  frame.camera = rig_.depth;
  frame.image = image_;
  frame.half_depth_m = surface_half_m_;
  if (has_color_now_) frame.half_color = half_color_;
  frame.T_world_depth = T_world_depth_;
  frame.index = frame_index_;
  return frame;
}

bool Spine::try_pose(const T_WorldDepth& T_world_guess) noexcept {
  struct Stage {
    int stride;
    std::span<const track::IcpLevel> levels;
  };
  const Stage stages[] = {{kCoarseStride, track::kRelocalizeCoarse}, {kFineStride, track::kRelocalizeFine}};
  track::TrackConfig strict = config_.track;
  strict.shift_m_max = kRelocalizeShiftM;
  strict.turn_max = kRelocalizeTurn;
  T_WorldDepth pose = T_world_guess;
  for (const Stage& stage : stages) {
    model_.T_world_view = pose;
    const int chunks = (model_.camera.height + kRowsPerChunk - 1) / kRowsPerChunk;
    pool_->run(static_cast<std::uint32_t>(chunks), [&](std::uint32_t index) {
      const auto chunk = static_cast<int>(index);
      predict_marching(map_, chunk * kRowsPerChunk,
                       std::min(model_.camera.height, (chunk + 1) * kRowsPerChunk), stage.stride,
                       kMarchDepthM, model_);
    });
    if (stage.stride == kFineStride) strict.inlier_share_min = kRelocalizeInlierShare;
    result_.track = track::track_frame({&model_, half_m_, pivot_z_m_, {}, {}}, stage.levels,
                                       track::T_ViewLive{}, strict, *pool_);
    if (result_.track.status != rt::Status::ok || result_.track.held_count > 0) return false;
    const auto& T = result_.track.T_view_live;
    pose = T_WorldDepth{pose.rotation, pose.translation} * Transform<Depth, Depth>{T.rotation, T.translation};
  }
  T_world_depth_ = pose.orthonormalized();
  return true;
}

bool Spine::is_blank() const noexcept {
  return static_cast<float>(valid_count_) < config_.valid_share_min * static_cast<float>(depth_.size());
}

void Spine::observe() noexcept {
  relocalizer_.observe(
      half_m_,
      has_color_now_ ? std::span<const std::uint32_t>(half_color_) : std::span<const std::uint32_t>{},
      half_camera_);
}

rt::Status Spine::place(const T_WorldDepth& T_world_depth) noexcept {
  if (is_blank()) return result_.status = rt::Status::corrupt;
  observe();
  T_world_depth_ = T_world_depth;
  result_.T_world_depth = T_world_depth_;
  return result_.status = rt::Status::ok;
}

rt::Status Spine::miss() noexcept { return result_.status = rt::Status::lost; }

rt::Status Spine::track(int frames_since_last) noexcept {
  if (is_blank()) {
    // Nothing is known of the motion meanwhile: the next frame with content is searched for, not followed.
    has_model_ = false;
    velocity_ = {};
    result_.status = rt::Status::corrupt;
    return result_.status;
  }
  observe();
  if (map_.blocks_used() == 0) {
    result_.status = rt::Status::ok;  // the first frame defines the world
  } else if (has_model_) {
    track::IcpInput input{&model_, half_m_, pivot_z_m_, {}, {}};
    if (has_color_now_ && brightness_.agrees_with(live_luma_)) {
      input.model_brightness = brightness_.rendered();
      input.live_luma = live_luma_;
    }
    track::TrackConfig config = config_.track;
    // A pose that was searched for is centimetres off: texture would pull to its nearest repetition.
    if (was_found_) config.brightness_first_below = 0;
    const auto steps = static_cast<double>(std::min(frames_since_last, kFramesAheadMax));
    result_.track = track::track_frame(input, track::kTrackLevels, track::scaled(velocity_, steps), config, *pool_);
    if (frames_since_last > 1) {
      // The hand may have come to rest meanwhile: how well the frame fits says which guess was right.
      const track::TrackResult slow = track::track_frame(input, track::kTrackLevels, velocity_, config, *pool_);
      if (fit_of(slow) > fit_of(result_.track)) result_.track = slow;
    }
    if (result_.track.status == rt::Status::ok) {
      const track::T_ViewLive& moved = result_.track.T_view_live;
      velocity_ = track::scaled(moved, 1 / steps);
      const Transform<Depth, Depth> motion{moved.rotation, moved.translation};
      // A camera that stands still is held: the estimate's own noise would walk. The model view stays at the
      // held pose, so slow motion adds up until it shows, and the pose is never off by more than this.
      if (motion.translation.norm() > kStillM || track::small_angle(motion.rotation) > kStillTurn)
        T_world_depth_ = (T_WorldDepth{model_.T_world_view} * motion).orthonormalized();
      result_.status = rt::Status::ok;
    }
  }
  if (result_.status != rt::Status::ok) {
    velocity_ = {};
    bool found = try_pose(T_world_depth_);
    if (!found)
      for (const auto& proposal : relocalizer_.propose())
        if (try_pose(proposal.T_world_depth)) {
          found = true;
          break;
        }
    has_model_ = false;
    if (found) {
      result_.status = rt::Status::ok;
      result_.relocalized = true;
    }
  }
  result_.T_world_depth = T_world_depth_;
  return result_.status;
}

rt::Status Spine::integrate() noexcept {
  if (result_.status != rt::Status::ok) return rt::Status::skipped;
  if (config_.closes_panes) surface_half_m_ = panes_.fill(depth_, half_m_);
  tactus::integration_image(depth_, surface_half_m_, rig_.depth, tile_scratch_, image_);
  const map::IntegrationFrame frame = integration_frame();
  map_.set_frame(frame_index_);
  evictor_.step(map_, frame_index_, T_world_depth_.translation, config_.evict_free_min);
  map::select_blocks(map_, frame, active_);
  const auto blocks = active_.blocks();
  const auto chunks = static_cast<int>((blocks.size() + kBlocksPerChunk - 1) / kBlocksPerChunk);
  pool_->run(static_cast<std::uint32_t>(chunks), [&](std::uint32_t index) {
    const std::size_t first = index * kBlocksPerChunk;
    map::integrate_blocks(map_, frame,
                          blocks.subspan(first, std::min(kBlocksPerChunk, blocks.size() - first)));
  });
  result_.active_blocks_count = static_cast<std::uint32_t>(blocks.size());
  relocalizer_.remember(T_world_depth_);
  return rt::Status::ok;
}

rt::Status Spine::predict() noexcept {
  if (result_.status != rt::Status::ok) return rt::Status::skipped;
  model_.T_world_view = T_world_depth_;
  const int chunks = (model_.camera.height + kRowsPerChunk - 1) / kRowsPerChunk;
  pool_->run(static_cast<std::uint32_t>(chunks), [&](std::uint32_t index) {
    const auto chunk = static_cast<int>(index);
    predict_guided(map_, half_m_, chunk * kRowsPerChunk,
                   std::min(model_.camera.height, (chunk + 1) * kRowsPerChunk), model_);
  });
  pool_->run(static_cast<std::uint32_t>(chunks), [&](std::uint32_t index) {
    const auto chunk = static_cast<int>(index);
    map::predict_normals(chunk * kRowsPerChunk, std::min(model_.camera.height, (chunk + 1) * kRowsPerChunk),
                         model_);
  });
  if (rig_.has_color)
    brightness_.follow(model_, has_color_now_ ? live_luma_ : std::span<track::Luma>{}, half_m_, *pool_);
  has_model_ = true;
  return rt::Status::ok;
}

}  // namespace tactus
