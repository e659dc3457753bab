#include "hal/synthetic/synthetic.hpp"

#include <algorithm>
#include <string>
#include <utility>

#include "hal/frames/convert.hpp"
#include "hal/synthetic/depth_noise.hpp"
#include "hal/synthetic/shade.hpp"
#include "hal/synthetic/trajectory.hpp"

namespace tactus::hal::synthetic {

FrameRenderer::FrameRenderer(std::shared_ptr<const Scene> scene, const SyntheticOptions& options)
    : scene_(std::move(scene)),
      options_(options),
      calibration_(calibration_of(options)),
      depth_caster_(*scene_, calibration_.depth),
      hits_(static_cast<std::size_t>(calibration_.depth.width) *
            static_cast<std::size_t>(calibration_.depth.height)) {
  if (!options_.is_registered) color_caster_ = std::make_unique<Raycaster>(*scene_, calibration_.color);
}

T_WorldDepth FrameRenderer::pose(int frame_index) const {
  return pose_at(options_, scene_->loop(), frame_index);
}

bool FrameRenderer::is_blank(int frame_index) const {
  return frame_index >= options_.blank_first && frame_index < options_.blank_first + options_.blank_count;
}

void FrameRenderer::cast_from_depth_camera(int frame_index) {
  if (frame_in_hits_ == frame_index) return;
  depth_caster_.cast(pose(frame_index), hits_);
  frame_in_hits_ = frame_index;
  has_normals_ = false;
}

void FrameRenderer::find_depth_normals(int frame_index) {
  cast_from_depth_camera(frame_index);
  if (!has_normals_) depth_caster_.find_normals(pose(frame_index), hits_);
  has_normals_ = true;
}

void FrameRenderer::depth(int frame_index, std::span<std::uint16_t> raw) {
  TACTUS_ASSERT(raw.size() == hits_.pixels_count());
  if (is_blank(frame_index)) {
    std::fill(raw.begin(), raw.end(), std::uint16_t{0});
    return;
  }
  if (!options_.has_noise) {
    cast_from_depth_camera(frame_index);
    quantize_exact(hits_.depth_m, raw);
    return;
  }
  find_depth_normals(frame_index);
  apply_depth_noise(*scene_, depth_caster_.rays(), pose(frame_index), hits_, options_.seed, frame_index, raw);
}

void FrameRenderer::exact_depth(int frame_index, std::span<float> depth_m) {
  TACTUS_ASSERT(depth_m.size() == hits_.pixels_count());
  cast_from_depth_camera(frame_index);
  std::copy(hits_.depth_m.begin(), hits_.depth_m.end(), depth_m.begin());
}

void FrameRenderer::labels(int frame_index, std::span<std::uint8_t> material_ids) {
  TACTUS_ASSERT(material_ids.size() == hits_.pixels_count());
  cast_from_depth_camera(frame_index);
  const auto primitives = scene_->primitives();
  const auto finishes = scene_->finishes();
  for (std::size_t i = 0; i < material_ids.size(); ++i) {
    const std::uint16_t index = hits_.primitive[i];
    material_ids[i] = index == kNoPrimitive
                          ? kNoMaterial
                          : static_cast<std::uint8_t>(finishes[primitives[index].finish].material);
  }
}

void FrameRenderer::color(int frame_index, std::span<std::uint8_t> rgb) {
  TACTUS_ASSERT(rgb.size() == hits_.pixels_count() * 3);
  if (is_blank(frame_index)) {
    std::fill(rgb.begin(), rgb.end(), std::uint8_t{0});
    return;
  }
  if (!color_caster_) {
    find_depth_normals(frame_index);
    shade(*scene_, depth_caster_.rays(), pose(frame_index), hits_, rgb);
    return;
  }
  const Transform<World, Color> T_world_color = pose(frame_index) * calibration_.T_color_depth.inverse();
  // The caster knows one kind of camera; here it is the colour camera.
  const T_WorldDepth T_world_camera{T_world_color.rotation, T_world_color.translation};
  frame_in_hits_ = -1;
  color_caster_->cast(T_world_camera, hits_);
  color_caster_->find_normals(T_world_camera, hits_);
  shade(*scene_, color_caster_->rays(), T_world_camera, hits_, rgb);
}

namespace {

constexpr rt::SensorTime time_of(int frame_index) {
  return {(static_cast<std::int64_t>(frame_index) * 1'000'000'000 + 15) / 30};
}

/// What both cameras do: hand out frame after frame.
struct Playhead {
  int next_frame = 0;
  CameraCounters counters;

  rt::Status look(const FrameRenderer& renderer, FrameHeader& header) const {
    if (next_frame >= renderer.options().frames_count) return rt::Status::end_of_stream;
    header = {time_of(next_frame), static_cast<std::uint64_t>(next_frame), {}};
    return rt::Status::ok;
  }
  void advance() {
    ++next_frame;
    ++counters.frames_delivered;
  }
};

class SyntheticDepthCamera final : public DepthCamera {
 public:
  explicit SyntheticDepthCamera(std::shared_ptr<FrameRenderer> renderer) : renderer_(std::move(renderer)) {}
  rt::Status read(std::span<std::uint16_t> depth, FrameHeader& header, rt::Duration /*timeout*/) override {
    const rt::Status status = playhead_.look(*renderer_, header);
    if (status != rt::Status::ok) return status;
    renderer_->depth(playhead_.next_frame, depth);
    playhead_.advance();
    const Intrinsics& k = renderer_->calibration().depth;
    if (tap_ != nullptr) tap_->take(Stream::depth, frames::raw_frame(depth, header, k.width, k.height));
    return status;
  }
  [[nodiscard]] const CameraCounters& counters() const override { return playhead_.counters; }

 private:
  std::shared_ptr<FrameRenderer> renderer_;
  Playhead playhead_;
};

class SyntheticColorCamera final : public ColorCamera {
 public:
  explicit SyntheticColorCamera(std::shared_ptr<FrameRenderer> renderer) : renderer_(std::move(renderer)) {}
  rt::Status read(std::span<std::uint8_t> rgb, FrameHeader& header, rt::Duration /*timeout*/) override {
    const rt::Status status = playhead_.look(*renderer_, header);
    if (status != rt::Status::ok) return status;
    renderer_->color(playhead_.next_frame, rgb);
    playhead_.advance();
    const Intrinsics& k = renderer_->calibration().color;
    if (tap_ != nullptr) tap_->take(Stream::color, frames::raw_frame(rgb, header, k.width, k.height));
    return status;
  }
  rt::Status peek(FrameHeader& header, rt::Duration /*timeout*/) override { return playhead_.look(*renderer_, header); }
  void skip() override {
    FrameHeader header;
    if (playhead_.look(*renderer_, header) != rt::Status::ok) return;
    if (tap_ == nullptr) return playhead_.advance();
    const Intrinsics& k = renderer_->calibration().color;
    skipped_.resize(frames::packed_bytes(PixelFormat::rgb24, k.width, k.height));
    (void)read(skipped_, header, {});
  }
  [[nodiscard]] const CameraCounters& counters() const override { return playhead_.counters; }

 private:
  std::shared_ptr<FrameRenderer> renderer_;
  Playhead playhead_;
  std::vector<std::uint8_t> skipped_;  // shown to a tap alone
};

class SyntheticLabels final : public LabelTruth {
 public:
  explicit SyntheticLabels(std::shared_ptr<FrameRenderer> renderer) : renderer_(std::move(renderer)) {}
  rt::Status read(std::uint64_t sequence, std::span<std::uint8_t> material_ids) override {
    if (sequence >= static_cast<std::uint64_t>(renderer_->options().frames_count))
      return rt::Status::end_of_stream;
    renderer_->labels(static_cast<int>(sequence), material_ids);
    return rt::Status::ok;
  }

 private:
  std::shared_ptr<FrameRenderer> renderer_;
};

}  // namespace

rt::Result<Sensor> open_synthetic(const SyntheticOptions& options) {
  if (options.frames_count < 1)
    return rt::Error{rt::ExitCode::bad_usage, "synthetic source: the number of frames must be at least 1"};
  const auto renderer =
      std::make_shared<FrameRenderer>(std::make_shared<const Scene>(make_scene(options.scene)), options);
  Sensor sensor;
  sensor.calibration = renderer->calibration();
  sensor.description =
      std::string("synthetic ") + name(options.scene) + ", " +
      std::to_string(sensor.calibration.depth.width) + "x" + std::to_string(sensor.calibration.depth.height) +
      ", " + std::to_string(options.frames_count) + " frames, " +
      (options.has_noise ? "Kinect-like noise, seed " + std::to_string(options.seed) : "no noise");
  sensor.frame_rate_hz = kFrameRate_hz;
  sensor.frames_count = static_cast<std::uint64_t>(options.frames_count);
  sensor.depth = std::make_unique<SyntheticDepthCamera>(renderer);
  sensor.color = std::make_unique<SyntheticColorCamera>(renderer);
  sensor.labels = std::make_unique<SyntheticLabels>(renderer);
  for (int i = 0; i < options.frames_count; ++i) sensor.truth.push_back({time_of(i), renderer->pose(i)});
  sensor.gravity_depth = sensor.truth.front().T_world_depth.rotation.transposed() * Vec3d{0, -1, 0};
  return sensor;
}

}  // namespace tactus::hal::synthetic
