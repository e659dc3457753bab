#include "firmware_host/label_session.hpp"

#include <utility>
#include <vector>

#include "firmware_host/progress.hpp"
#include "firmware_host/run_session.hpp"

namespace tactus::firmware {

/// Passes frames through and remembers the last one.
class LabelSession::ColorTap final : public hal::ColorCamera {
 public:
  explicit ColorTap(std::unique_ptr<hal::ColorCamera> camera) : camera_(std::move(camera)) {}
  rt::Status read(std::span<std::uint8_t> rgb, hal::FrameHeader& header, rt::Duration timeout) override {
    const rt::Status status = camera_->read(rgb, header, timeout);
    has_frame_ = status == rt::Status::ok;
    if (has_frame_) {
      header_ = header;
      rgb_.assign(rgb.begin(), rgb.end());
    }
    return status;
  }
  rt::Status peek(hal::FrameHeader& header, rt::Duration timeout) override { return camera_->peek(header, timeout); }
  void skip() override { camera_->skip(); }
  void set_tap(hal::FrameTap* tap) override { camera_->set_tap(tap); }
  [[nodiscard]] const hal::CameraCounters& counters() const override { return camera_->counters(); }

  bool has_frame_ = false;
  hal::FrameHeader header_;
  std::vector<std::uint8_t> rgb_;

 private:
  std::unique_ptr<hal::ColorCamera> camera_;
};

class LabelSession::DepthTap final : public hal::DepthCamera {
 public:
  explicit DepthTap(std::unique_ptr<hal::DepthCamera> camera) : camera_(std::move(camera)) {}
  rt::Status read(std::span<std::uint16_t> depth, hal::FrameHeader& header, rt::Duration timeout) override {
    const rt::Status status = camera_->read(depth, header, timeout);
    header_ = header;
    depth_.assign(depth.begin(), depth.end());
    return status;
  }
  void set_tap(hal::FrameTap* tap) override { camera_->set_tap(tap); }
  [[nodiscard]] const hal::CameraCounters& counters() const override { return camera_->counters(); }

  hal::FrameHeader header_;
  std::vector<std::uint16_t> depth_;

 private:
  std::unique_ptr<hal::DepthCamera> camera_;
};

LabelSession::~LabelSession() = default;

/// Exact depth in the place of the sensor's where it is asked for, and taps that keep what was read.
rt::Result<void> LabelSession::wrap(const LabelSessionOptions& options, hal::Sensor& sensor) {
  if (options.has_true_depth) {
    auto exact = TrueDepth::of(options.source, sensor.calibration);
    if (!exact) return exact.error();
    if (!exact->is_complete() && !options.has_true_poses)
      return rt::Error{rt::ExitCode::bad_usage,
                       options.source + " knows the exact depth of some frames only, too few to track them."};
    exact_.emplace(std::move(*exact));
    sensor.depth = TrueDepth::camera(std::move(sensor.depth), *exact_, sensor.calibration);
  }
  if (sensor.color) {
    auto tap = std::make_unique<ColorTap>(std::move(sensor.color));
    color_tap_ = tap.get();
    sensor.color = std::move(tap);
  }
  auto depth_tap = std::make_unique<DepthTap>(std::move(sensor.depth));
  depth_tap_ = depth_tap.get();
  sensor.depth = std::move(depth_tap);
  return {};
}

rt::Result<std::unique_ptr<LabelSession>> LabelSession::open(const LabelSessionOptions& options,
                                                             const RunSettings& settings) {
  std::unique_ptr<LabelSession> session(new LabelSession);
  auto source = open_for_pipeline({options.source, {options.frames, 0}, options.gravity, options.model}, settings,
                                  [&](hal::Sensor& sensor) { return session->wrap(options, sensor); });
  if (!source) return source.error();
  session->source_ = std::move(*source);
  const LabelChoice& labels = session->source_.labels;
  if (!labels.model && !labels.from_source)
    return rt::Error{
        rt::ExitCode::bad_usage,
        options.source + ": there are no labels to measure. " +
            (labels.remark.empty() ? "Name a network with --model FILE.tflite." : labels.remark)};

  PipelineSetup setup = setup_for(session->source_, settings);
  setup.profile.refines_labels = settings.profile.refines_labels && options.crf.has_value();
  if (options.crf)
    setup.profile.refine = map::RefineConfig::for_cells(setup.profile.refine.crf.points_max, *options.crf);
  setup.label_rule = options.rule;
  setup.collision = contact::Collision::none;  // nothing is thrown: contact has no work
  if (options.has_true_poses) {
    if (session->sensor().truth.empty())
      return rt::Error{rt::ExitCode::bad_usage, options.source + " does not know its true poses."};
    setup.known_poses = session->sensor().truth;
  }
  auto booted = BootedPipeline::boot(setup);
  if (!booted) return booted.error();
  session->booted_.emplace(std::move(*booted));
  return session;
}

rt::Result<void> LabelSession::run(const std::string& what,
                                   const std::function<rt::Result<void>(const ObservedFrame&)>& observe) {
  catch_signals();
  Pipeline& pipeline = *booted_->pipeline;
  const rt::Clock clock = rt::Clock::monotonic();
  Progress progress(what, source_.sensor.frames_count, clock);
  std::uint64_t frames_count = 0;
  // Relaxed: the flag carries no data, and a frame more or less before it is seen does not matter.
  while (!interrupted.load(std::memory_order_relaxed)) {
    const rt::Status captured = pipeline.capture_round(clock);
    if (captured == rt::Status::end_of_stream || captured == rt::Status::device_lost) break;
    if (captured != rt::Status::ok) continue;  // rejected by the sensor and counted there
    ObservedFrame frame;
    frame.depth_sequence = depth_tap_->header_.sequence;
    frame.time = depth_tap_->header_.time;
    frame.raw_depth = depth_tap_->depth_;
    if (color_tap_ != nullptr && color_tap_->has_frame_ &&
        std::abs(color_tap_->header_.time.ns - frame.time.ns) <= Pairing::kSkewMax.ns) {
      frame.color_sequence = color_tap_->header_.sequence;
      frame.rgb = color_tap_->rgb_;
    }
    const rt::Status tracked = pipeline.spine_round(clock, rt::kNoDeadline);
    (void)pipeline.segment_round(clock);
    (void)pipeline.refine_round(clock);
    frame.is_tracked = tracked == rt::Status::ok;
    frame.T_world_depth = pipeline.spine().result().T_world_depth;
    if (auto observed = observe(frame); !observed) return observed.error();
    progress.update(++frames_count);
  }
  pipeline.finish_labels();
  if (interrupted.load(std::memory_order_relaxed))
    return rt::Error{rt::ExitCode::failed, "The measurement was interrupted before its end."};
  return {};
}

}  // namespace tactus::firmware
