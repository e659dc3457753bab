// The whole pipeline in lockstep on a camera that goes where a test says: each frame is one of the hand-held
// path through a synthetic room, in any order and at any speed, with its true pose.
#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "hal/synthetic/synthetic.hpp"
#include "pipeline/pipeline.hpp"
#include "rt/arena.hpp"

namespace tactus::test {

/// Hands out frame after frame of the script.
class Script {
 public:
  Script(std::shared_ptr<hal::synthetic::FrameRenderer> renderer, std::vector<int> path_frames)
      : renderer_(std::move(renderer)), path_frames_(std::move(path_frames)) {}

  static rt::SensorTime time_of(std::size_t frame) { return {static_cast<std::int64_t>(frame) * 33'333'333}; }
  [[nodiscard]] std::size_t frames_count() const { return path_frames_.size(); }
  [[nodiscard]] int path_frame(std::size_t frame) const { return path_frames_[frame]; }
  [[nodiscard]] hal::synthetic::FrameRenderer& renderer() const { return *renderer_; }

 private:
  std::shared_ptr<hal::synthetic::FrameRenderer> renderer_;
  std::vector<int> path_frames_;
};

template <typename Base, typename Pixel,
          void (hal::synthetic::FrameRenderer::*kRender)(int, std::span<Pixel>)>
class ScriptedCamera : public Base {
 public:
  explicit ScriptedCamera(std::shared_ptr<Script> script) : script_(std::move(script)) {}
  rt::Status read(std::span<Pixel> image, hal::FrameHeader& header, rt::Duration /*timeout*/) override {
    const rt::Status status = look(header);
    if (status != rt::Status::ok) return status;
    (script_->renderer().*kRender)(script_->path_frame(next_), image);
    ++next_;
    return status;
  }
  [[nodiscard]] const hal::CameraCounters& counters() const override { return counters_; }

 protected:
  rt::Status look(hal::FrameHeader& header) const {
    if (next_ >= script_->frames_count()) return rt::Status::end_of_stream;
    header = {Script::time_of(next_), next_};
    return rt::Status::ok;
  }

  std::shared_ptr<Script> script_;
  std::size_t next_ = 0;
  hal::CameraCounters counters_;
};
using ScriptedDepth = ScriptedCamera<hal::DepthCamera, std::uint16_t, &hal::synthetic::FrameRenderer::depth>;

class ScriptedColor final
    : public ScriptedCamera<hal::ColorCamera, std::uint8_t, &hal::synthetic::FrameRenderer::color> {
 public:
  using ScriptedCamera::ScriptedCamera;
  rt::Status peek(hal::FrameHeader& header, rt::Duration /*timeout*/) override { return look(header); }
  void skip() override { ++next_; }
};

class ScriptedLabels final : public hal::LabelTruth {
 public:
  explicit ScriptedLabels(std::shared_ptr<Script> script) : script_(std::move(script)) {}
  rt::Status read(std::uint64_t sequence, std::span<std::uint8_t> material_ids) override {
    script_->renderer().labels(script_->path_frame(sequence), material_ids);
    return rt::Status::ok;
  }

 private:
  std::shared_ptr<Script> script_;
};

class ScriptedSession {
 public:
  /// Exact labels of the source stand in for a network, unless `setup` names one.
  explicit ScriptedSession(const std::vector<int>& path_frames, PipelineSetup setup) {
    const auto options = hal::parse_synthetic_name("synthetic:bedroom?frames=300&mode=320x240&noise=0");
    const auto script = std::make_shared<Script>(
        std::make_shared<hal::synthetic::FrameRenderer>(
            std::make_shared<const hal::synthetic::Scene>(hal::synthetic::make_scene(options->scene)),
            *options),
        path_frames);
    sensor_.calibration = script->renderer().calibration();
    sensor_.depth = std::make_unique<ScriptedDepth>(script);
    setup.labels_from_source = setup.model == nullptr;
    if (setup.labels_from_source)
      sensor_.labels = std::make_unique<ScriptedLabels>(script);
    else
      sensor_.color = std::make_unique<ScriptedColor>(script);
    for (std::size_t i = 0; i < path_frames.size(); ++i)
      sensor_.truth.push_back({Script::time_of(i), script->renderer().pose(path_frames[i])});
    setup.sensor = &sensor_;
    setup.T_world_first = sensor_.truth.front().T_world_depth;
    setup.known_poses = sensor_.truth;
    setup.collision = contact::Collision::none;
    setup.profile.refines_labels = false;
    setup.frames_expected = path_frames.size();
    auto planned = Pipeline::plan(setup, plan_);
    EXPECT_TRUE(planned) << planned.error().message;
    auto arena = rt::Arena::reserve(plan_.arena_bytes());
    EXPECT_TRUE(arena);
    arena_.emplace(std::move(*arena));
    plan_.carve(*arena_);
    auto bound = pipeline->bind(setup, plan_);
    EXPECT_TRUE(bound) << bound.error().message;
  }

  /// One frame through capture, spine and segment; false when the script is over.
  bool step() {
    if (pipeline->capture_round(clock) != rt::Status::ok) return false;
    EXPECT_EQ(pipeline->spine_round(clock, rt::kNoDeadline), rt::Status::ok);
    (void)pipeline->segment_round(clock);
    return true;
  }

  /// The rest of the script; which frames became keyframes, from 0.
  std::vector<int> keyframes() {
    std::vector<int> taken;
    std::uint64_t before = pipeline->counts().keyframes;
    for (int frame = 0; step(); ++frame) {
      if (pipeline->counts().keyframes > before) taken.push_back(frame);
      before = pipeline->counts().keyframes;
    }
    pipeline->finish_labels();
    return taken;
  }

  const rt::Clock clock = rt::Clock::monotonic();

 private:
  hal::Sensor sensor_;
  rt::MemoryPlan plan_;
  std::optional<rt::Arena> arena_;

 public:
  std::unique_ptr<Pipeline> pipeline = std::make_unique<Pipeline>();  // goes before its memory does
};

}  // namespace tactus::test
