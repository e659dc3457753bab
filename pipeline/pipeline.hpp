// The pipeline: all stages, the edges between them, and what each thread does in one round. Read pipeline.cpp
// top to bottom to follow a frame from the sensor to the screen.
//
//   capture ─ DropOldestRing ─► spine: register, track, integrate, predict, fuse ─ DropOldestRing ─► present:
//   interact, contact, render ─ SpscRing (cues) ─► sound
//                                  │   ▲                                 │
//                   DropOldestRing ▼   │ SpscRing                        └─ Seqlock (pose) ─► anyone
//                               segment (keyframes)
//   spine ─ the map, read without a lock ─► refine (3D CRF) ─ SpscRing ─► spine
//
// Two runners drive the same rounds: realtime (one thread each, runner.hpp) and lockstep (one thread, fixed
// order, nothing dropped). In lockstep every result is a pure function of the source and the configuration.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "hal/camera.hpp"
#include "hal/display.hpp"
#include "hal/spatial_mixer.hpp"
#include "pipeline/budgets.hpp"
#include "pipeline/capture/intake.hpp"
#include "pipeline/capture/pairing.hpp"
#include "pipeline/contact/touched_room.hpp"
#include "pipeline/contact/world.hpp"
#include "pipeline/interact/game.hpp"
#include "pipeline/label_survey.hpp"
#include "pipeline/map/fuse_labels.hpp"
#include "pipeline/map/pin_surface.hpp"
#include "pipeline/map/reader.hpp"
#include "pipeline/map/refine_labels.hpp"
#include "pipeline/memory_plan.hpp"
#include "pipeline/messages.hpp"
#include "pipeline/profile.hpp"
#include "pipeline/render/light_estimate.hpp"
#include "pipeline/render/renderer.hpp"
#include "pipeline/segment/segmenter.hpp"
#include "pipeline/sound/sound_stage.hpp"
#include "pipeline/spine.hpp"
#include "pipeline/track/pose_predictor.hpp"
#include "rt/clock.hpp"
#include "rt/drop_oldest_ring.hpp"
#include "rt/runner.hpp"
#include "rt/seqlock.hpp"
#include "rt/spsc_ring.hpp"
#include "rt/trace.hpp"
#include "rt/worker_pool.hpp"

namespace tactus {

/// What boot hands over. The pointees outlive the pipeline.
struct PipelineSetup {
  Profile profile;
  hal::Sensor* sensor = nullptr;
  T_WorldDepth T_world_first;             // gravity-aligned
  const segment::Model* model = nullptr;  // null: no network
  const segment::ClassMap* class_map = nullptr;
  bool labels_from_source = false;                    // exact labels instead of a network's
  map::LabelRule label_rule = map::LabelRule::bayes;  // direct: the paper's ablation
  /// For studies: what takes tracking's place, the pose of each frame by its time (a frame without one is
  /// lost). Empty: the camera is tracked.
  std::span<const hal::TruthPose> known_poses;
  contact::MaterialTable materials;
  contact::Collision collision = contact::Collision::semantic;
  interact::Script script;
  hal::Display* display = nullptr;       // null: nothing is drawn
  hal::SpatialMixer* mixer = nullptr;    // null: nothing sounds
  std::optional<render::Light> light;    // unset: estimated from the video
  std::uint64_t frames_expected = 0;  // sizes the per-frame series; 0 unknown
};

/// What is counted while running, for the summary. Read when the threads rest.
struct PipelineCounts {
  std::uint64_t frames_in = 0, frames_tracked = 0, frames_lost = 0, frames_dropped = 0;
  std::uint64_t frames_stale = 0;     // taken from the camera, thrown away by the intake; in frames_in
  std::uint64_t frames_corrupt = 0;   // rejected by the camera; in frames_in
  std::uint64_t capture_timeouts = 0;  // rounds without a frame
  std::uint64_t relocalisations = 0, keyframes = 0, keyframes_segmented = 0, keyframes_replaced = 0;
  std::uint64_t poses_left_out = 0;  // tracked when trajectory() was full
  std::uint64_t cues_dropped = 0;  // sounds that found their ring full
};

struct TrackedPose {
  rt::SensorTime time;
  T_WorldDepth T_world_depth;
};

/// A pose for anyone: present, applications, late latching.
struct PoseSample {
  std::int64_t time_ns = 0;  // SensorTime
  std::uint32_t frame_index = 0;
  std::uint32_t is_tracked = 0;
  T_WorldDepth T_world_depth;
};

/// How a picture is to be drawn.
struct PictureOptions {
  float overlay_alpha = 0;                       // of the labels over the video; 0: none
  /// Virtual things are drawn from the newest pose, latched as drawing begins and carried on to when it will end; the video
  /// is turned along. For displays in front of eyes; a film shows each frame with its own pose.
  bool predicts_pose = false;
  std::span<const render::TextLine> text;
  std::optional<render::Crosshair> crosshair;
  bool reads_back = true;  // into picture()
  /// False: for picture() alone, as for a report. The display goes on showing what it showed, and no time is
  /// counted.
  bool shows = true;
};

class Pipeline {
 public:
  Pipeline() = default;
  Pipeline(const Pipeline&) = delete;
  Pipeline& operator=(const Pipeline&) = delete;

  static constexpr int kSourceScoresWidth = 160,
                       kSourceScoresHeight = 120;  // of labels taken from the source
  static constexpr int kScoresSideMax = 192;  // of a network's score image, pixels each way

  /// Boot: the table for this setup; then, with the table carved, every stage takes its memory and is warmed
  /// up.
  static rt::Result<void> plan(const PipelineSetup& setup, rt::MemoryPlan& plan);
  rt::Result<void> bind(const PipelineSetup& setup, rt::MemoryPlan& plan);

  // One round of each thread. Step. The clock times the stages; deadlines decide who gives way.
  /// Reads one sensor moment, finds its colour and passes it on. end_of_stream when the source is over; device_lost while
  /// a device is away, at once; corrupt and stale for frames that are rejected, and counted. May wait for a frame, for a
  /// second at most. Makes no heap call of its own unless the sensor says that it decodes in it.
  rt::Status capture_round(rt::Clock clock) noexcept;
  /// Takes the oldest waiting frame through the spine. skipped when none waits.
  rt::Status spine_round(rt::Clock clock, rt::HostTime deadline) noexcept;
  /// Segments the waiting keyframe. skipped when none waits.
  rt::Status segment_round(rt::Clock clock) noexcept;
  /// Refines labels by the work of the frames since the last round. skipped when nothing waits.
  rt::Status refine_round(rt::Clock clock) noexcept;
  /// A person's correction: pins the surface at a place to a material, or takes that back. Done by the spine
  /// within the next frames, a few thousand cells each; pinner() counts what became of it. full: too many
  /// wait. Step; one thread, the application's; wait-free.
  rt::Status pin_surface(const map::SurfacePin& pin) noexcept;
  /// Does the corrections that wait, fuses the keyframes that are answered and refines all that still waits.
  /// Exit: when the threads rest, before the map is written out or scored.
  void finish_labels() noexcept;
  /// Takes over the newest frame from the spine, throws and shoots what is due and advances virtual things by `duration`.
  rt::Status contact_round(rt::Clock clock, rt::Duration duration) noexcept;
  /// A hand's orders, done at once, as `interact::Game` does them; present thread.
  rt::Status throw_now(const interact::Throw& what) noexcept { return game_.throw_now(what, world_); }
  rt::Status shoot_now(const interact::Shot& shot) noexcept { return game_.shoot_now(shot, world_); }
  void set_collision(contact::Collision collision) noexcept;
  [[nodiscard]] contact::Collision collision() const noexcept { return room_.collision(); }
  /// Draws the newest frame with virtual things and reads the picture back into picture(). Calls the driver, which
  /// allocates: outside the heap guard. Present thread.
  rt::Status render_round(rt::Clock clock, const PictureOptions& options) noexcept;
  /// Mixes the next samples.size() / 2 sample frames, what was struck since the last round from their beginning on.
  /// skipped without a mixer. Calls OpenAL, which allocates: outside the heap guard. The sound thread's.
  rt::Status sound_round(rt::Clock clock, std::span<float> samples) noexcept;

  /// Share of the virtual bodies' visible discs that real things hide in the newest frame, bodies out of view
  /// left out; nothing when none is in view. Cheap: 64 rays a body.
  [[nodiscard]] std::optional<float> occluded_share() noexcept;

  [[nodiscard]] std::span<const std::uint8_t> picture() const noexcept { return picture_rgb_; }
  [[nodiscard]] const hal::Intrinsics& picture_camera() const noexcept { return picture_camera_; }
  [[nodiscard]] const PipelineCounts& counts() const noexcept { return counts_; }
  [[nodiscard]] const Spine& spine() const noexcept { return spine_; }
  [[nodiscard]] const contact::World& world() const noexcept { return world_; }
  [[nodiscard]] const segment::Segmenter* segmenter() const noexcept {
    return segmenter_ ? &*segmenter_ : nullptr;
  }
  [[nodiscard]] const map::LabelRefiner* refiner() const noexcept { return refiner_ ? &*refiner_ : nullptr; }
  [[nodiscard]] const map::SurfacePinner& pinner() const noexcept { return pinner_; }
  [[nodiscard]] const map::Reader& reader() const noexcept { return reader_; }
  [[nodiscard]] std::span<const TrackedPose> trajectory() const noexcept { return trajectory_; }
  [[nodiscard]] const interact::Game& game() const noexcept { return game_; }
  [[nodiscard]] const sound::SoundStage& sound() const noexcept { return sound_; }
  /// That pictures are lit by: the given one, or what the video says so far.
  [[nodiscard]] const render::Light& light() const noexcept {
    return setup_.light ? *setup_.light : light_estimate_.light();
  }
  /// The frame that the next picture will show; nothing before the first. Present thread.
  [[nodiscard]] std::optional<hal::FrameHeader> viewed_frame() const noexcept {
    return view_ ? std::optional(view_->header) : std::nullopt;
  }
  /// What the cameras' frames were like, and which belong together. When the threads rest.
  [[nodiscard]] const IntakeCounts& depth_intake() const noexcept { return depth_intake_.counts(); }
  [[nodiscard]] const IntakeCounts& color_intake() const noexcept { return color_intake_.counts(); }
  [[nodiscard]] const Pairing& pairing() const noexcept { return pairing_; }
  /// Of live cameras: from a depth frame's arrival in this machine to its lying in the pipeline's memory. Count 0:
  /// unknown.
  [[nodiscard]] const rt::Histogram& arrival_latency() const noexcept { return arrival_latency_; }
  /// From the sensor's handing a frame over to its picture's being shown.
  [[nodiscard]] const rt::Histogram& photon_latency() const noexcept { return photon_latency_; }
  /// Where each tracked frame's pose was predicted to be, one frame before, from the poses until then.
  [[nodiscard]] std::span<const TrackedPose> predictions() const noexcept { return predictions_; }
  [[nodiscard]] const rt::StageRecord& record(Stage stage) const noexcept {
    return records_[static_cast<std::size_t>(stage)];
  }
  /// Milliseconds per frame of a stage; NaN where it did not run. Sized at boot; later frames are not
  /// recorded.
  [[nodiscard]] std::span<const float> series_ms(Stage stage) const noexcept {
    return series_ms_[static_cast<std::size_t>(stage)];
  }
  [[nodiscard]] std::span<const float> frame_series_ms() const noexcept { return frame_series_ms_; }
  [[nodiscard]] const rt::TraceRing& trace(std::size_t thread) const noexcept { return traces_[thread]; }
  [[nodiscard]] std::span<const float> label_ages_ms() const noexcept { return label_ages_ms_; }
  [[nodiscard]] rt::Seqlock<PoseSample>& pose() noexcept { return pose_; }
  [[nodiscard]] rt::WorkerPool& workers() noexcept { return workers_; }

  static constexpr std::size_t kSpineTrace = 0, kPresentTrace = 1, kSegmentTrace = 2, kCaptureTrace = 3,
                               kRefineTrace = 4, kSoundTrace = 5;
  static constexpr std::array<const char*, 6> kThreadNames = {"spine",   "present", "segment",
                                                              "capture", "refine",  "sound"};

 private:
  template <typename Step>
  rt::Status timed(Stage stage, std::size_t trace, rt::Clock clock, rt::HostTime deadline,
                   Step&& step) noexcept;
  rt::Status place(rt::SensorTime time) noexcept;
  int count_frames_since_last(rt::SensorTime time) noexcept;
  [[nodiscard]] LabelSurvey survey() const noexcept;
  bool is_keyframe() noexcept;
  void fill_keyframe(const SensorFrame& frame) noexcept;
  void pair_color(SensorFrame& frame) noexcept;
  bool look_at_color(rt::Duration timeout) noexcept;
  void begin_fusing(KeyframeSlot slot) noexcept;
  rt::Status fuse_answered() noexcept;
  rt::Status pin_waiting() noexcept;
  bool publish_refined() noexcept;
  void hand_over_refined() noexcept;
  void predict_pose(rt::SensorTime time, bool is_tracked) noexcept;
  std::optional<T_WorldDepth> latch_pose(rt::SensorTime time) noexcept;
  void note_unguarded(Stage stage, std::size_t trace, rt::HostTime begin, rt::HostTime end, rt::Status status) noexcept;
  void look_through_depth() noexcept;
  void make_picture_inputs(const FrameVerdict& verdict) noexcept;
  void estimate_light(const T_WorldDepth& T_world_video) noexcept;

  PipelineSetup setup_;
  rt::WorkerPool workers_;

  // Stages.
  Spine spine_;
  map::SurfacePinner pinner_;
  std::optional<segment::Segmenter> segmenter_;
  std::optional<map::LabelRefiner> refiner_;
  contact::World world_;
  interact::Game game_;
  std::optional<render::Renderer> renderer_;
  render::LightEstimate light_estimate_;
  sound::SoundStage sound_;
  map::Reader reader_{spine_.map()};
  map::Reader sound_reader_{spine_.map()};  // a reading thread has its own
  contact::TouchedRoom room_;

  // Edges.
  using FrameRing = rt::DropOldestRing<rt::FrameId, kFramesWaiting>;
  using ViewRing = rt::DropOldestRing<rt::FrameId, 1>;
  using KeyframeRing = rt::DropOldestRing<KeyframeSlot, 1>;
  using AnswerRing = rt::SpscRing<KeyframeSlot, kKeyframeSlots>;
  using PinRing = rt::SpscRing<map::SurfacePin, kPinsWaiting>;
  using RefinedRing = rt::SpscRing<map::RefinedBlock, kRefinedBlocksWaiting>;
  using CueRing = rt::SpscRing<interact::SoundCue, kCuesWaiting>;
  rt::FramePool<SensorFrame> frames_;
  FrameRing to_spine_;
  ViewRing to_present_;
  KeyframeRing to_segment_;
  AnswerRing to_fuse_;
  RefinedRing to_publish_;
  PinRing to_pin_;
  CueRing to_sound_;
  rt::Seqlock<PoseSample> pose_;
  std::optional<FrameRing::Producer> to_spine_in_;
  std::optional<FrameRing::Consumer> to_spine_out_;
  std::optional<ViewRing::Producer> to_present_in_;
  std::optional<ViewRing::Consumer> to_present_out_;
  std::optional<KeyframeRing::Producer> to_segment_in_;
  std::optional<KeyframeRing::Consumer> to_segment_out_;
  std::optional<AnswerRing::Producer> to_fuse_in_;
  std::optional<AnswerRing::Consumer> to_fuse_out_;
  std::optional<RefinedRing::Producer> to_publish_in_;
  std::optional<RefinedRing::Consumer> to_publish_out_;
  std::optional<PinRing::Producer> to_pin_in_;
  std::optional<PinRing::Consumer> to_pin_out_;
  std::optional<CueRing::Producer> to_sound_in_;
  std::optional<CueRing::Consumer> to_sound_out_;
  std::optional<rt::Seqlock<PoseSample>::Producer> pose_in_;

  // Written by one thread each: verdicts and keyframes by the spine before their id goes on, frames by
  // capture.
  std::array<FrameVerdict, kFramesCount> verdicts_{};
  std::array<std::span<std::uint16_t>, kFramesCount> model_depths_mm_{};  // half size, at the frame's pose; with a display
  std::array<Keyframe, kKeyframeSlots> keyframes_{};
  std::array<bool, kKeyframeSlots> keyframe_is_free_{};
  std::uint32_t last_keyframe_index_ = 0;
  T_WorldDepth T_world_keyframe_;                     // of the last one
  std::optional<std::uint32_t> waiting_since_index_;  // the frame that was the first to be too blurred
  std::optional<T_WorldDepth> T_world_before_;        // of the frame before, when it was tracked
  std::optional<rt::SensorTime> spine_saw_;           // the frame before, tracked or not
  // The keyframe whose labels are being fused, and how far that has come; by the spine alone.
  static constexpr std::size_t kBlocksPerKeyframe = 8192;  // it sees some 4000
  std::array<map::BlockIndex, kBlocksPerKeyframe> fusing_blocks_{};
  std::size_t fusing_count_ = 0, fusing_done_ = 0;
  std::optional<KeyframeSlot> fusing_;
  bool has_keyframe_ = false;

  // capture
  Intake depth_intake_, color_intake_;
  Pairing pairing_;
  std::optional<hal::FrameHeader> color_ahead_;  // the next colour frame, still in the camera's buffer
  rt::Histogram arrival_latency_;

  // refine
  std::uint32_t refined_frame_ = 0;
  // present
  FrameRef view_;
  rt::Duration drawing_{};  // of the last picture
  rt::Histogram photon_latency_;
  track::PosePredictor present_predictor_;
  std::int64_t predicted_from_ns_ = 0;  // time of the last pose it was given
  std::optional<rt::SensorTime> light_seen_;  // time of the picture that was last estimated from
  hal::Intrinsics picture_camera_;
  std::span<float> picture_depth_m_;
  std::span<MaterialId> picture_labels_;
  std::span<std::uint8_t> picture_rgb_;
  std::vector<render::Body> drawn_bodies_;
  std::vector<render::Decal> drawn_decals_;

  // Records.
  template <std::size_t... kIndex>
  static std::array<rt::StageRecord, kStagesCount> make_records(std::index_sequence<kIndex...>) {
    return {rt::StageRecord(kBudgets[kIndex].name, kBudgets[kIndex].when_late)...};
  }
  std::array<rt::StageRecord, kStagesCount> records_ = make_records(std::make_index_sequence<kStagesCount>{});
  std::array<rt::TraceRing, 6> traces_;
  std::array<std::vector<float>, kStagesCount> series_ms_;
  std::vector<float> frame_series_ms_;
  std::vector<float> label_ages_ms_;
  std::vector<TrackedPose> trajectory_, predictions_;
  track::PosePredictor spine_predictor_;
  PipelineCounts counts_;
};

}  // namespace tactus
