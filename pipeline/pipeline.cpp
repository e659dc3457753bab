#include "pipeline/pipeline.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "pipeline/map/fuse_labels.hpp"
#include "pipeline/picture_view.hpp"
#include "pipeline/register/depth_images.hpp"
#include "pipeline/source_scores.hpp"
#include "pipeline/walker_view.hpp"

namespace tactus {
namespace {

constexpr rt::Duration kReadTimeout{1'000'000'000};
constexpr std::int64_t kKnownPoseSkewNs = 1'000'000;  // a known pose is the frame's own
constexpr std::size_t kSeriesDefault = 4096, kSeriesMax = 100'000;
constexpr std::size_t kPosesOfADevice = 108'000;  // nobody knows when it ends: an hour at 30 Hz, 104 bytes each
// A keyframe's 45 thousand cells take 20 ms: an eighth of them a frame, and they are done before the next
// keyframe's.
constexpr std::size_t kCellsPerFuse = 6000;
// Of a person's correction: 1 to 2 ms a frame, a table in a quarter of a second.
constexpr std::size_t kCellsPerPin = 1000;

std::size_t pixels_count(const hal::Intrinsics& camera) {
  return static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height);
}

hal::Intrinsics without_distortion(hal::Intrinsics camera) {
  camera.k1 = camera.k2 = camera.p1 = camera.p2 = camera.k3 = 0;
  return camera;
}

}  // namespace

rt::Result<void> Pipeline::plan(const PipelineSetup& setup, rt::MemoryPlan& plan) {
  PlanOptions options;
  options.has_render = setup.display != nullptr;
  options.has_sound = setup.mixer != nullptr;
  options.labels_from_source = setup.labels_from_source;
  if (setup.labels_from_source) {
    options.scores_width = kSourceScoresWidth;
    options.scores_height = kSourceScoresHeight;
  } else if (setup.model != nullptr) {
    const hal::Intrinsics& color = setup.sensor->calibration.color;
    const auto bytes =
        segment::Segmenter::bytes_needed({setup.model, setup.class_map, color.width, color.height});
    if (!bytes) return bytes.error();
    options.network_bytes = *bytes;
    options.scores_width = options.scores_height = kScoresSideMax;  // known exactly once the network is built
  }
  options.camera_buffers_bytes = setup.sensor->buffers_bytes;
  if (setup.frames_expected == 0) options.poses_bytes = kPosesOfADevice * sizeof(TrackedPose);
  plan_memory(setup.profile, setup.sensor->calibration, options, plan);
  const std::size_t counted = plan.arena_bytes() - options.network_bytes;
  if (counted > setup.profile.memory_bytes_max)
    return rt::Error{rt::ExitCode::budget_exceeded,
                     "The plan needs " + std::to_string(counted >> 20) + " MiB and profile " +
                         std::string(setup.profile.name) + " allows " +
                         std::to_string(setup.profile.memory_bytes_max >> 20) +
                         " MiB; lower map.blocks_capacity or raise memory.max_mib."};
  return {};
}

rt::Result<void> Pipeline::bind(const PipelineSetup& setup, rt::MemoryPlan& plan) {
  setup_ = setup;
  const hal::RigCalibration& rig = setup.sensor->calibration;

  // (1) Stages.
  if (setup.profile.threads_count > 1) {
    rt::ThreadSpec worker{.name = "spine-worker"};
    if (auto started = workers_.start(setup.profile.threads_count, worker); !started) return started.error();
  }
  spine_.bind(plan.take("map"), plan.take("spine"), rig, setup.profile.spine, setup.T_world_first, workers_);
  rt::Slice pins = plan.take("pins");
  pinner_.bind(pins, spine_.map());
  const bool has_labels = setup.labels_from_source || setup.model != nullptr;
  if (setup.model != nullptr && !setup.labels_from_source) {
    auto bound = segment::Segmenter::bind({setup.model, setup.class_map, rig.color.width, rig.color.height},
                                          plan.take("network"));
    if (!bound) return bound.error();
    segmenter_ = std::move(*bound);
    if (segmenter_->scores_width() > kScoresSideMax || segmenter_->scores_height() > kScoresSideMax)
      return rt::Error{rt::ExitCode::bad_usage,
                       "The network's scores are " + std::to_string(segmenter_->scores_width()) + "x" +
                           std::to_string(segmenter_->scores_height()) + ", more than the " +
                           std::to_string(kScoresSideMax) +
                           " pixels each way that are planned for: cut it before its resize."};
  }
  if (has_labels && setup.profile.refines_labels) {
    rt::Slice memory = plan.take("refine");
    refiner_.emplace();
    refiner_->bind(
        memory,
        refine_within(setup.profile.refine, setup.profile.spine.map.blocks_capacity, memory.bytes_left()),
        spine_.map());
  }
  room_.bind(reader_, setup.collision);
  if (auto bound = world_.bind(plan.take("contact"), world_config(setup.profile), room_.field(), setup.materials); !bound)
    return bound.error();
  if (auto bound = game_.bind(plan.take("interact"), game_config(setup.profile), setup.script, setup.materials,
                             room_.field());
      !bound)
    return bound.error();
  if (setup.mixer != nullptr) sound_.bind(plan.take("sound"), {}, setup.materials, contact::field_of(sound_reader_));

  // (2) Frames and edges.
  rt::Slice pool = plan.take("frame pool");
  frames_.bind(pool, kFramesCount);
  rt::Slice images = plan.take("frames");
  for (std::size_t i = 0; i < kFramesCount; ++i) {
    SensorFrame& frame = frames_.frame_at_boot(i);
    frame.raw_depth = images.take<std::uint16_t>(pixels_count(rig.depth));
    if (rig.has_color) frame.rgb = images.take<std::uint8_t>(pixels_count(rig.color) * 3);
    if (setup.labels_from_source) frame.labels = images.take<std::uint8_t>(pixels_count(rig.depth));
  }
  if (has_labels) {
    rt::Slice memory = plan.take("keyframes");
    const int width = segmenter_ ? segmenter_->scores_width() : kSourceScoresWidth;
    const int height = segmenter_ ? segmenter_->scores_height() : kSourceScoresHeight;
    for (std::size_t i = 0; i < kKeyframeSlots; ++i) {
      keyframes_[i].half_depth_m = memory.take<float>(pixels_count(rig.depth) / 4);
      if (setup_.profile.spine.closes_panes)
        keyframes_[i].pane_bits = memory.take<std::uint64_t>(PaneFiller::pane_words_count(rig.depth));
      if (segmenter_) {
        keyframes_[i].rgb = memory.take<std::uint8_t>(pixels_count(rig.color) * 3);
      } else {
        keyframes_[i].labels = memory.take<std::uint8_t>(pixels_count(rig.depth));
      }
      keyframes_[i].scores = segment::MaterialScores::take(memory, width, height);
      keyframe_is_free_[i] = true;
    }
  }
  to_spine_in_.emplace(to_spine_.producer());
  to_spine_out_.emplace(to_spine_.consumer());
  to_present_in_.emplace(to_present_.producer());
  to_present_out_.emplace(to_present_.consumer());
  to_segment_in_.emplace(to_segment_.producer());
  to_segment_out_.emplace(to_segment_.consumer());
  to_fuse_in_.emplace(to_fuse_.producer());
  to_fuse_out_.emplace(to_fuse_.consumer());
  to_pin_in_.emplace(to_pin_.producer());
  to_pin_out_.emplace(to_pin_.consumer());
  to_publish_in_.emplace(to_publish_.producer());
  to_publish_out_.emplace(to_publish_.consumer());
  to_sound_in_.emplace(to_sound_.producer());
  to_sound_out_.emplace(to_sound_.consumer());
  pose_in_.emplace(pose_.producer());

  // (3) Picture.
  picture_camera_ = without_distortion(rig.has_color ? rig.color : rig.depth);
  if (setup.display != nullptr) {
    rt::Slice memory = plan.take("picture");
    picture_depth_m_ = memory.take<float>(pixels_count(picture_camera_));
    picture_labels_ = memory.take<MaterialId>(pixels_count(picture_camera_));
    picture_rgb_ = memory.take<std::uint8_t>(pixels_count(picture_camera_) * 3);
    for (auto& model : model_depths_mm_) model = memory.take<std::uint16_t>(pixels_count(rig.depth) / 4);
    drawn_bodies_.reserve(setup.profile.bodies_capacity + interact::kWalkersMax * kFigureParts);
    drawn_decals_.reserve(game_config(setup.profile).marks_capacity);
    light_estimate_.bind(picture_camera_, plan.take("light"));
    render::RenderConfig config;
    config.camera = picture_camera_;
    const HullMeshes hulls(game_.catalogue());
    config.hulls = hulls.meshes;
    renderer_.emplace();
    if (auto bound = renderer_->bind(config, plan.take("render")); !bound) return bound.error();
  }

  depth_intake_.configure(setup.sensor->frame_rate_hz);
  color_intake_.configure(setup.sensor->frame_rate_hz);
  pairing_.configure(setup.sensor->frame_rate_hz, setup.sensor->has_two_clocks);

  // (4) Records.
  rt::Slice trace = plan.take("trace");
  for (auto& ring : traces_) ring.bind(trace, setup.profile.trace_records_count);
  const std::size_t series =
      setup.frames_expected == 0
          ? kSeriesDefault
          : std::min<std::size_t>(kSeriesMax, static_cast<std::size_t>(setup.frames_expected) + 1);
  for (auto& one : series_ms_) one.reserve(series);
  frame_series_ms_.reserve(series);
  // Touched now: memory that first is used frame by frame looks like a leak for as long.
  trajectory_.resize(setup.frames_expected == 0 ? kPosesOfADevice : series);
  trajectory_.clear();
  predictions_.reserve(series);
  label_ages_ms_.reserve(series);

  // (5) Every path once, before the clock counts: first inference, first picture.
  if (segmenter_)
    if (segmenter_->warm_up(keyframes_[0].scores) != rt::Status::ok)
      return rt::Error{rt::ExitCode::failed, "The network did not run on a grey image."};
  if (renderer_) {
    if (setup.display->begin() != rt::Status::ok)
      return rt::Error{rt::ExitCode::device_unavailable, "The display cannot be drawn on."};
    if (auto warm = renderer_->warm_up(); !warm) return warm.error();
    setup.display->release();
  }
  return {};
}

template <typename Step>
rt::Status Pipeline::timed(Stage stage, std::size_t trace, rt::Clock clock, rt::HostTime deadline,
                           Step&& step) noexcept {
  const auto index = static_cast<std::size_t>(stage);
  const rt::HostTime begin = clock.now();
  const rt::Status status = rt::run_stage(records_[index], clock, deadline, &traces_[trace],
                                          [&](const rt::StageContext&) noexcept { return step(); });
  auto& series = series_ms_[index];
  if (series.size() < series.capacity())
    series.push_back(status == rt::Status::late || status == rt::Status::skipped
                         ? std::numeric_limits<float>::quiet_NaN()
                         : static_cast<float>((clock.now() - begin).milliseconds()));
  return status;
}

/// Whether the next colour frame is known; what the intake rejects is passed over.
bool Pipeline::look_at_color(rt::Duration timeout) noexcept {
  while (!color_ahead_) {
    hal::FrameHeader header;
    const rt::Status status = setup_.sensor->color->peek(header, timeout);
    if (status == rt::Status::corrupt) continue;
    if (status != rt::Status::ok) return false;
    if (color_intake_.check(header) != rt::Status::ok) {
      setup_.sensor->color->skip();
      continue;
    }
    pairing_.saw_color(header);
    color_ahead_ = header;
  }
  return true;
}

/// Both cameras deliver in the order of time. An image that is too early for this depth has no partner; one that is too
/// late stays in the camera's buffer for the next.
void Pipeline::pair_color(SensorFrame& frame) noexcept {
  hal::ColorCamera& camera = *setup_.sensor->color;
  // A device's colour may be on its way still; a recording's is there or will never be.
  const rt::Duration timeout = setup_.sensor->is_live ? Pairing::kSkewMax : kReadTimeout;
  while (look_at_color(timeout)) {
    const hal::FrameHeader color = *color_ahead_;
    const Match match = pairing_.match(frame.header, color);
    if (match == Match::late) break;
    color_ahead_.reset();
    if (match == Match::early) {
      camera.skip();
      pairing_.count_color_alone();
      continue;
    }
    hal::FrameHeader taken;
    if (camera.read(frame.rgb, taken, timeout) != rt::Status::ok) continue;  // did not decode; the next may be near, too
    frame.has_rgb = true;
    pairing_.count_pair(frame.header, color);
    return;
  }
  pairing_.count_depth_alone();
}

rt::Status Pipeline::capture_round(rt::Clock clock) noexcept {
  auto lease = frames_.try_lease();
  TACTUS_ASSERT(lease.has_value());  // kFramesCount is the sum of all holders
  SensorFrame& frame = **lease;
  hal::Sensor& sensor = *setup_.sensor;
  std::optional<rt::RtScope> guarded;
  if (!sensor.allocates_in_read) guarded.emplace();
  rt::HostTime begin = clock.now();
  const rt::Status read = sensor.depth->read(frame.raw_depth, frame.header, kReadTimeout);
  if (read == rt::Status::corrupt) ++counts_.frames_corrupt;
  if (read == rt::Status::timeout) ++counts_.capture_timeouts;
  if (read == rt::Status::corrupt || read == rt::Status::ok) ++counts_.frames_in;
  if (read != rt::Status::ok) return read;
  frame.captured = clock.now();
  if (depth_intake_.check(frame.header) != rt::Status::ok) {
    ++counts_.frames_stale;
    return rt::Status::stale;
  }
  pairing_.saw_depth(frame.header);
  if (sensor.is_live && frame.header.arrived.ns != 0) {
    begin = frame.header.arrived;  // waiting for the device is not work
    arrival_latency_.record(frame.captured - begin);
    frame.captured = begin;
  }
  frame.has_rgb = false;
  if (sensor.color != nullptr) pair_color(frame);
  frame.has_labels = false;
  const segment::KeyframeRules& rules = setup_.profile.keyframes;
  // By need, any frame may be one.
  if (setup_.labels_from_source &&
      (rules.policy == segment::KeyframePolicy::adaptive || frame.header.sequence % rules.every_frames == 0)) {
    guarded.reset();  // exact labels are decoded or rendered; no headset has them
    frame.has_labels = sensor.labels->read(frame.header.sequence, frame.labels) == rt::Status::ok;
  }
  rt::StageRecord& record = records_[static_cast<std::size_t>(Stage::capture)];
  const rt::HostTime end = clock.now();
  record.latency.record(end - begin);
  record.statuses.count(rt::Status::ok);
  traces_[kCaptureTrace].span(record.name, begin, end - begin,
                              static_cast<std::int64_t>(frame.header.sequence));
  FrameRef ref = std::move(*lease).share();
  if (const auto oldest = to_spine_in_->push(std::move(ref).into_id())) {
    frames_.drop(*oldest);
    ++counts_.frames_dropped;
  }
  return rt::Status::ok;
}

/// More than 1 where frames are missing or were overtaken.
int Pipeline::count_frames_since_last(rt::SensorTime time) noexcept {
  const double interval_s = spine_saw_ ? (time - *spine_saw_).seconds() : 0;
  spine_saw_ = time;
  constexpr double kFramesMax = 1000;
  return static_cast<int>(std::clamp(interval_s * setup_.sensor->frame_rate_hz + 0.5, 1.0, kFramesMax));
}

rt::Status Pipeline::spine_round(rt::Clock clock, rt::HostTime deadline) noexcept {
  const auto id = to_spine_out_->try_pop();
  if (!id) return rt::Status::skipped;
  FrameRef frame = frames_.adopt(*id);
  const rt::HostTime begin = clock.now();
  const auto stage = [&](Stage which, auto&& step) {
    return timed(which, kSpineTrace, clock, deadline, step);
  };

  const int frames_since_last = count_frames_since_last(frame->header.time);
  const auto rgb =
      frame->has_rgb ? std::span<const std::uint8_t>(frame->rgb) : std::span<const std::uint8_t>{};
  (void)stage(Stage::register_frame, [&]() noexcept { return spine_.register_frame(frame->raw_depth, rgb); });
  const rt::Status tracked = stage(Stage::track, [&]() noexcept {
    return setup_.known_poses.empty() ? spine_.track(frames_since_last) : place(frame->header.time);
  });
  (void)stage(Stage::integrate, [&]() noexcept { return spine_.integrate(); });
  (void)stage(Stage::predict, [&]() noexcept { return spine_.predict(); });
  (void)stage(Stage::fuse, [&]() noexcept {
    const rt::Status pinned = pin_waiting();
    if (to_fuse_.was().pushed == 0) return pinned;
    const bool has_published = publish_refined();
    const rt::Status fused = fuse_answered();
    return has_published && fused == rt::Status::skipped ? rt::Status::ok : fused;
  });

  const SpineResult& result = spine_.result();
  FrameVerdict& verdict = verdicts_[frame.id().slot()];
  verdict = {tracked, spine_.frame_index(), result.T_world_depth};
  pose_in_->push({frame->header.time.ns, verdict.frame_index, tracked == rt::Status::ok ? 1u : 0u,
                  result.T_world_depth});
  if (tracked == rt::Status::ok) {
    ++counts_.frames_tracked;
    if (trajectory_.size() < trajectory_.capacity())
      trajectory_.push_back({frame->header.time, result.T_world_depth});
    else
      ++counts_.poses_left_out;
    if (result.relocalized) ++counts_.relocalisations;
    fill_keyframe(*frame);
    T_world_before_ = result.T_world_depth;
  } else {
    ++counts_.frames_lost;
    T_world_before_.reset();
  }
  predict_pose(frame->header.time, tracked == rt::Status::ok);
  if (renderer_) {
    keep_model_depth(spine_.model().z_m, model_depths_mm_[frame.id().slot()]);
  }
  if (const auto oldest = to_present_in_->push(std::move(frame).into_id())) frames_.drop(*oldest);
  if (frame_series_ms_.size() < frame_series_ms_.capacity())
    frame_series_ms_.push_back(static_cast<float>((clock.now() - begin).milliseconds()));
  return tracked;
}

/// Notes where the pose was expected, for the summary, before the true one is learned from.
void Pipeline::predict_pose(rt::SensorTime time, bool is_tracked) noexcept {
  if (!is_tracked || spine_.result().relocalized) spine_predictor_.reset();
  if (!is_tracked) return;
  const auto predicted = spine_predictor_.predict(time);
  if (predicted && predictions_.size() < predictions_.capacity()) predictions_.push_back({time, *predicted});
  spine_predictor_.push(time, spine_.result().T_world_depth);
}

rt::Status Pipeline::place(rt::SensorTime time) noexcept {
  for (const hal::TruthPose& known : setup_.known_poses)
    if (std::abs(known.time.ns - time.ns) <= kKnownPoseSkewNs) return spine_.place(known.T_world_depth);
  return spine_.miss();
}

LabelSurvey Pipeline::survey() const noexcept {
  LabelSurveyInput input;
  input.map = &spine_.map();
  input.model = &spine_.model();
  input.color_pixels = spine_.color_pixels();
  // What segment writes meanwhile into a slot that is under way is not read here.
  std::array<KeyframeUnderWay, kKeyframeSlots> under_way;
  std::size_t count = 0;
  for (std::size_t slot = 0; slot < kKeyframeSlots; ++slot)
    if (!keyframe_is_free_[slot])
      under_way[count++] = {keyframes_[slot].T_world_depth, keyframes_[slot].half_depth_m};
  input.under_way = std::span(under_way).first(count);
  // A pose that was searched for tells nothing of how fast the camera went there.
  if (!spine_.result().relocalized) input.T_world_before = T_world_before_;
  if (has_keyframe_) input.T_world_keyframe = T_world_keyframe_;
  input.frame_index = spine_.frame_index();
  input.weak_observations = setup_.profile.keyframes.weak_observations;
  input.old_frames = setup_.profile.keyframes.old_frames;
  return survey_labels(input);
}

bool Pipeline::is_keyframe() noexcept {
  const segment::KeyframeRules& rules = setup_.profile.keyframes;
  const std::uint32_t index = spine_.frame_index();
  segment::KeyframeFacts facts;
  if (has_keyframe_) facts.frames_since_last = index - last_keyframe_index_;
  if (rules.policy == segment::KeyframePolicy::every)
    return segment::judge_keyframe(rules, facts) == segment::KeyframeVerdict::take;
  if (has_keyframe_ && *facts.frames_since_last < rules.gap_min_frames) return false;  // whatever is seen
  const LabelSurvey seen = survey();
  const hal::RigCalibration& rig = setup_.sensor->calibration;
  const auto color_px = static_cast<float>((rig.registered || !rig.has_color ? rig.depth.fx : rig.color.fx) /
                                           spine_.half_camera().fx);
  facts.frames_waited = waiting_since_index_ ? index - *waiting_since_index_ : 0;
  facts.new_share = seen.share(seen.new_count);
  facts.weak_share = seen.share(seen.weak_count);
  facts.old_share = seen.share(seen.old_count);
  if (seen.moved_since_keyframe_half_px)
    facts.view_change_share =
        *seen.moved_since_keyframe_half_px / static_cast<float>(spine_.half_camera().width);
  if (seen.moved_half_px) facts.motion_px = *seen.moved_half_px * color_px;
  const segment::KeyframeVerdict verdict = segment::judge_keyframe(rules, facts);
  if (verdict == segment::KeyframeVerdict::not_needed) waiting_since_index_.reset();
  if (verdict == segment::KeyframeVerdict::wait && !waiting_since_index_) waiting_since_index_ = index;
  return verdict == segment::KeyframeVerdict::take;
}

void Pipeline::fill_keyframe(const SensorFrame& frame) noexcept {
  if (!(setup_.labels_from_source ? frame.has_labels : segmenter_.has_value() && frame.has_rgb)) return;
  // The source's labels were read for keyframes alone, unless any frame may be one.
  const bool is_chosen =
      setup_.labels_from_source && setup_.profile.keyframes.policy == segment::KeyframePolicy::every;
  if (!is_chosen && !is_keyframe()) return;
  const std::uint32_t index = spine_.frame_index();
  const auto free = std::find(keyframe_is_free_.begin(), keyframe_is_free_.end(), true);
  if (free == keyframe_is_free_.end()) return;  // every slot is under way: the next frame tries again
  const auto slot = static_cast<KeyframeSlot>(free - keyframe_is_free_.begin());
  Keyframe& keyframe = keyframes_[slot];
  keyframe.frame_index = index;
  keyframe.time = frame.header.time;
  keyframe.T_world_depth = spine_.result().T_world_depth;
  std::copy(spine_.half_depth_m().begin(), spine_.half_depth_m().end(), keyframe.half_depth_m.begin());
  const auto pane_bits = spine_.panes().pane_bits();
  std::copy(pane_bits.begin(), pane_bits.end(), keyframe.pane_bits.begin());
  if (setup_.labels_from_source) {
    std::copy(frame.labels.begin(), frame.labels.end(), keyframe.labels.begin());
  } else {
    std::copy(frame.rgb.begin(), frame.rgb.end(), keyframe.rgb.begin());
  }
  keyframe.is_segmented = false;
  keyframe_is_free_[slot] = false;
  has_keyframe_ = true;
  last_keyframe_index_ = index;
  T_world_keyframe_ = keyframe.T_world_depth;
  waiting_since_index_.reset();
  ++counts_.keyframes;
  if (const auto overtaken = to_segment_in_->push(slot)) {
    keyframe_is_free_[*overtaken] = true;
    ++counts_.keyframes_replaced;
  }
}

rt::Status Pipeline::segment_round(rt::Clock clock) noexcept {
  const auto slot = to_segment_out_->try_pop();
  if (!slot) return rt::Status::skipped;
  Keyframe& keyframe = keyframes_[*slot];
  const rt::Status status = timed(Stage::segment, kSegmentTrace, clock, rt::kNoDeadline, [&]() noexcept {
    if (segmenter_) return segmenter_->step(keyframe.rgb, keyframe.scores);
    scores_of_labels(keyframe.labels, setup_.sensor->calibration.depth, keyframe.scores);
    return rt::Status::ok;
  });
  keyframe.is_segmented = status == rt::Status::ok;
  const bool passed = to_fuse_in_->try_push(*slot);
  TACTUS_ASSERT(passed);  // the ring holds every slot there is
  return status;
}

namespace {

map::LabelKeyframe label_keyframe(const Keyframe& keyframe, const Spine& spine, bool labels_from_source) {
  map::LabelKeyframe labels;
  labels.T_world_depth = keyframe.T_world_depth;
  labels.half_camera = spine.half_camera();
  labels.half_depth_m = keyframe.half_depth_m;
  labels.pane_bits = keyframe.pane_bits;
  labels.rig = spine.rig();
  // Labels taken from the source lie in the depth camera's pixels, whatever the colour camera is.
  if (labels_from_source) labels.rig.registered = true;
  const segment::MaterialScores& scores = keyframe.scores;
  labels.scores = {scores.probability.data(), scores.width,      scores.height,     scores.columns.scale,
                   scores.columns.offset,     scores.rows.scale, scores.rows.offset};
  labels.index = spine.frame_index();
  return labels;
}

}  // namespace

void Pipeline::begin_fusing(KeyframeSlot slot) noexcept {
  const Keyframe& keyframe = keyframes_[slot];
  if (!keyframe.is_segmented) {
    keyframe_is_free_[slot] = true;
    return;
  }
  fusing_ = slot;
  fusing_done_ = 0;
  fusing_count_ = map::blocks_in_keyframe(
      spine_.map(), label_keyframe(keyframe, spine_, setup_.labels_from_source), fusing_blocks_);
}

rt::Status Pipeline::fuse_answered() noexcept {
  KeyframeSlot slot = 0;
  while (!fusing_ && to_fuse_out_->try_pop(slot))
    begin_fusing(slot);  // one that the network refused begins nothing
  if (!fusing_) return rt::Status::skipped;
  const Keyframe& keyframe = keyframes_[*fusing_];
  const auto rest = std::span(fusing_blocks_).subspan(fusing_done_, fusing_count_ - fusing_done_);
  fusing_done_ += map::fuse_labels(spine_.map(), label_keyframe(keyframe, spine_, setup_.labels_from_source),
                                   rest, setup_.label_rule, kCellsPerFuse)
                      .blocks_done;
  if (fusing_done_ < fusing_count_) return rt::Status::ok;
  ++counts_.keyframes_segmented;
  if (label_ages_ms_.size() < label_ages_ms_.capacity()) {
    const double frames = static_cast<double>(spine_.frame_index() - keyframe.frame_index);
    label_ages_ms_.push_back(static_cast<float>(frames * 1e3 / setup_.sensor->frame_rate_hz));
  }
  keyframe_is_free_[*fusing_] = true;
  fusing_.reset();
  return rt::Status::ok;
}

rt::Status Pipeline::pin_surface(const map::SurfacePin& pin) noexcept {
  return to_pin_in_->try_push(pin) ? rt::Status::ok : rt::Status::full;
}

rt::Status Pipeline::pin_waiting() noexcept {
  map::SurfacePin pin;
  while (!pinner_.is_busy() && to_pin_out_->try_pop(pin))
    (void)pinner_.begin(pin);  // a refusal is counted there
  return pinner_.step(kCellsPerPin);
}

// The map has one writer: what refine found is written here. A block that was evicted since is another by its
// key.
bool Pipeline::publish_refined() noexcept {
  map::RefinedBlock refined;
  bool has_published = false;
  while (to_publish_out_->try_pop(refined)) {
    has_published = true;
    if (spine_.map().key(refined.block) == refined.key)
      spine_.map().publish_refined(refined.block, refined.refined);
  }
  return has_published;
}

void Pipeline::hand_over_refined() noexcept {
  while (const map::RefinedBlock* refined = refiner_->front()) {
    if (!to_publish_in_->try_push(*refined)) return;  // it stays with the refiner until there is room
    refiner_->pop();
  }
}

rt::Status Pipeline::refine_round(rt::Clock clock) noexcept {
  const std::uint32_t frame = spine_.map().frame_concurrent();
  if (!refiner_ || frame == refined_frame_) return rt::Status::skipped;
  const std::uint32_t frames = frame - refined_frame_;
  refined_frame_ = frame;
  return timed(Stage::refine, kRefineTrace, clock, rt::kNoDeadline, [&]() noexcept {
    const rt::Status status = refiner_->step(frames);
    hand_over_refined();
    return status;
  });
}

void Pipeline::finish_labels() noexcept {
  while (pin_waiting() == rt::Status::ok) {
  }
  while (fuse_answered() == rt::Status::ok) {
  }
  if (!refiner_) return;
  constexpr int kFramesMax = 3000;  // a room of ten regions takes 600
  for (int frame = 0; frame < kFramesMax; ++frame) {
    (void)refiner_->step(1);
    hand_over_refined();
    (void)publish_refined();
    if (refiner_->is_idle()) return;
  }
}

void Pipeline::set_collision(contact::Collision collision) noexcept {
  room_.set_collision(collision);
  world_.wake_all();  // what rested on the room may have nothing under it now
}

/// Where the map knows nothing yet, contact asks the newest depth frame.
void Pipeline::look_through_depth() noexcept {
  const FrameVerdict& verdict = verdicts_[view_.id().slot()];
  const hal::RigCalibration& rig = setup_.sensor->calibration;
  contact::DepthView depth;
  depth.is_valid = verdict.status == rt::Status::ok;
  depth.raw_depth = view_->raw_depth;
  depth.depth_m_per_unit = rig.depth_m_per_unit;
  depth.camera = rig.depth;
  depth.T_world_depth = verdict.T_world_depth;
  room_.set_depth(depth);
}

rt::Status Pipeline::contact_round(rt::Clock clock, rt::Duration duration) noexcept {
  while (const auto id = to_present_out_->try_pop()) view_ = frames_.adopt(*id);
  if (!view_) return rt::Status::skipped;
  return timed(Stage::contact, kPresentTrace, clock, rt::kNoDeadline, [&]() noexcept {
    look_through_depth();
    const FrameVerdict& verdict = verdicts_[view_.id().slot()];
    const hal::RigCalibration& rig = setup_.sensor->calibration;
    const interact::View view{verdict.T_world_depth, picture_camera_, picture_pose(verdict.T_world_depth, rig), room_.seen()};
    const rt::Status status = game_.step(view, verdict.status == rt::Status::ok, view_->header, duration, world_);
    for (const interact::SoundCue& cue : game_.cues())
      if (!to_sound_in_->try_push(cue)) ++counts_.cues_dropped;
    return status;
  });
}

rt::Status Pipeline::sound_round(rt::Clock clock, std::span<float> samples) noexcept {
  if (setup_.mixer == nullptr) return rt::Status::skipped;
  const rt::HostTime begin = clock.now();
  interact::SoundCue cue;
  while (to_sound_out_->try_pop(cue)) {
    sound::Impact impact;
    impact.delay = cue.delay;
    impact.position_world_m = cue.position_world_m;
    impact.normal_world = cue.normal_world;
    impact.energy_j = cue.energy_j;
    impact.impulse_n_s = cue.impulse_n_s;
    impact.impact_speed_m_per_s = cue.impact_speed_m_per_s;
    impact.body_size_m = cue.body_size_m;
    impact.surface_size_m = cue.other_size_m;
    impact.body_material = cue.body_material;
    impact.surface_material = cue.surface_material;
    (void)sound_.add(impact);  // counted there
  }
  PoseSample ears;
  (void)pose_.read(ears);  // before the first pose the listener stands at the origin
  const rt::Status status = sound_.step(ears.T_world_depth, *setup_.mixer, samples);
  note_unguarded(Stage::sound, kSoundTrace, begin, clock.now(), status);
  return status;
}

void Pipeline::make_picture_inputs(const FrameVerdict& verdict) noexcept {
  const hal::RigCalibration& rig = setup_.sensor->calibration;
  const bool has_model = verdict.status == rt::Status::ok;
  picture_depth(*view_, has_model ? model_depths_mm_[view_.id().slot()] : std::span<std::uint16_t>{}, rig, picture_camera_,
                picture_depth_m_);
}

rt::Status Pipeline::render_round(rt::Clock clock, const PictureOptions& options) noexcept {
  if (!renderer_ || !view_) return rt::Status::skipped;
  const rt::HostTime begin = clock.now();
  const FrameVerdict& verdict = verdicts_[view_.id().slot()];
  const hal::RigCalibration& rig = setup_.sensor->calibration;
  make_picture_inputs(verdict);
  const T_WorldDepth T_world_video = picture_pose(verdict.T_world_depth, rig);
  render::RenderInputs inputs;
  inputs.is_tracked = verdict.status == rt::Status::ok;
  if (view_->has_rgb) inputs.video_rgb = view_->rgb;
  inputs.depth_m = picture_depth_m_;
  if (options.overlay_alpha > 0) {
    picture_labels(picture_depth_m_, picture_camera_, T_world_video, reader_, picture_labels_);
    inputs.labels = picture_labels_;
    inputs.overlay_alpha = options.overlay_alpha;
  }
  if (!setup_.light && view_->has_rgb && inputs.is_tracked) estimate_light(T_world_video);
  inputs.light = light();
  drawn_bodies_.clear();
  for (const contact::BodyState& body : world_.bodies())
    drawn_bodies_.push_back(drawn_body(body, game_.look_of(body), setup_.materials));
  const auto walkers = game_.walkers().agents();
  for (std::size_t i = 0; i < walkers.size(); ++i) {
    if (!walkers[i].pose().is_placed) continue;
    for (const render::Body& part : drawn_figure(walkers[i].pose(), i)) drawn_bodies_.push_back(part);
  }
  inputs.bodies = drawn_bodies_;
  drawn_decals_.clear();
  for (const interact::Mark& mark : game_.marks()) drawn_decals_.push_back(drawn_decal(mark));
  inputs.decals = drawn_decals_;
  inputs.text = options.text;
  inputs.crosshair = options.crosshair;

  rt::Status status = setup_.display->begin();
  // As late as it can be: the newest pose there is, carried on to when the picture will be seen.
  inputs.T_world_depth = T_world_video;
  if (options.predicts_pose && inputs.is_tracked) {
    const rt::Duration age = clock.now() - view_->captured;
    if (const auto latest = latch_pose(view_->header.time + age + drawing_)) {
      inputs.T_world_depth = picture_pose(*latest, rig);
      inputs.R_video_picture = T_world_video.rotation.transposed() * inputs.T_world_depth.rotation;
    }
  }
  if (status == rt::Status::ok) status = renderer_->step(inputs);
  if (status == rt::Status::ok && options.reads_back) status = renderer_->read_back(picture_rgb_);
  if (!options.shows) return status;
  if (setup_.display->present() == rt::Status::device_lost) status = rt::Status::device_lost;
  const rt::HostTime end = clock.now();
  drawing_ = end - begin;  // as long as the next one will take
  photon_latency_.record(end - view_->captured);
  note_unguarded(Stage::render, kPresentTrace, begin, end, status);
  return status;
}

void Pipeline::estimate_light(const T_WorldDepth& T_world_video) noexcept {
  const rt::SensorTime time = view_->header.time;
  if (light_seen_ == time) return;
  const double interval_s = light_seen_ ? (time - *light_seen_).seconds() : 1 / setup_.sensor->frame_rate_hz;
  light_seen_ = time;
  // A view that cannot tell leaves the light as it was.
  (void)light_estimate_.step({view_->rgb, picture_depth_m_, picture_camera_, T_world_video},
                             static_cast<float>(interval_s));
}

/// The newest pose, predicted to `time`; nothing while tracking is lost.
std::optional<T_WorldDepth> Pipeline::latch_pose(rt::SensorTime time) noexcept {
  PoseSample newest;
  if (!pose_.read(newest) || newest.is_tracked == 0) {
    present_predictor_.reset();
    return std::nullopt;
  }
  if (newest.time_ns != predicted_from_ns_) present_predictor_.push({newest.time_ns}, newest.T_world_depth);
  predicted_from_ns_ = newest.time_ns;
  return present_predictor_.predict(time);
}

/// What timed() does, for stages whose libraries allocate.
void Pipeline::note_unguarded(Stage stage, std::size_t trace, rt::HostTime begin, rt::HostTime end,
                              rt::Status status) noexcept {
  rt::StageRecord& record = records_[static_cast<std::size_t>(stage)];
  record.latency.record(end - begin);
  record.statuses.count(status);
  traces_[trace].span(record.name, begin, end - begin, static_cast<std::int64_t>(status));
}

std::optional<float> Pipeline::occluded_share() noexcept {
  if (!view_) return std::nullopt;
  const FrameVerdict& verdict = verdicts_[view_.id().slot()];
  if (verdict.status != rt::Status::ok) return std::nullopt;
  return hidden_share(world_.bodies(), setup_.sensor->calibration, *view_, verdict.T_world_depth);
}

}  // namespace tactus
