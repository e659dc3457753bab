// A lockstep session of the pipeline for measuring its labels: every frame is shown to an observer, and the
// labelled map stays readable afterwards.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "firmware_host/boot.hpp"
#include "firmware_host/true_depth.hpp"
#include "pipeline/label/crf/crf.hpp"
#include "pipeline/pipeline.hpp"

namespace tactus::firmware {

/// What to run, and what of it to set aside for the truth.
struct LabelSessionOptions {
  std::string source;
  FrameRange frames;
  std::string gravity;          // as `tactus run --gravity`
  std::filesystem::path model;  // as `tactus run --model`
  map::LabelRule rule = map::LabelRule::bayes;
  /// What the pipeline refines labels with while it runs, as the product does, unless labels.crf is off;
  /// nothing: it does not.
  std::optional<label::CrfParameters> crf;
  bool has_true_poses = false;  // instead of tracking
  bool has_true_depth = false;  // instead of the sensor's; frames without are blank, so those that have some
                                // only need true poses as well
};

/// One frame after the spine took it.
struct ObservedFrame {
  std::uint64_t depth_sequence = 0;
  rt::SensorTime time;
  std::optional<std::uint64_t> color_sequence;  // of the colour frame paired with it
  std::span<const std::uint8_t> rgb;            // its pixels, until the next frame; empty without a pair
  std::span<const std::uint16_t> raw_depth;
  bool is_tracked = false;
  T_WorldDepth T_world_depth;  // when tracked
};

/// Everything a session holds; not movable, the parts point to each other. One thread.
class LabelSession {
 public:
  /// Opens the source and boots the pipeline. Errors as `tactus run`; bad_usage when nothing would be
  /// labelled, or when truth is asked for that the source does not have. Boot.
  static rt::Result<std::unique_ptr<LabelSession>> open(const LabelSessionOptions& options,
                                                        const RunSettings& settings);
  ~LabelSession();

  /// Runs to the end of the source, or until SIGINT. `what`: for the progress line. The observer may fail,
  /// which ends the session.
  rt::Result<void> run(const std::string& what,
                       const std::function<rt::Result<void>(const ObservedFrame&)>& observe);

  [[nodiscard]] hal::Sensor& sensor() { return source_.sensor; }
  [[nodiscard]] const LabelChoice& labels() const { return source_.labels; }
  [[nodiscard]] const Pipeline& pipeline() const { return *booted_->pipeline; }
  [[nodiscard]] const map::Map& map() const { return pipeline().spine().map(); }

 private:
  class ColorTap;
  class DepthTap;
  LabelSession() = default;

  rt::Result<void> wrap(const LabelSessionOptions& options, hal::Sensor& sensor);

  std::optional<TrueDepth> exact_;  // read by the sensor's depth camera
  OpenedSource source_;
  ColorTap* color_tap_ = nullptr;  // owned by the sensor
  DepthTap* depth_tap_ = nullptr;
  std::optional<BootedPipeline> booted_;
};

}  // namespace tactus::firmware
