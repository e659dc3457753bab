// The first half of every session, whatever it is for: the source with what must be known of it, and a
// pipeline in sealed memory.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>

#include "firmware_host/first_pose.hpp"
#include "firmware_host/open_source.hpp"
#include "firmware_host/run_labels.hpp"
#include "firmware_host/run_settings.hpp"
#include "pipeline/pipeline.hpp"
#include "rt/arena.hpp"

namespace tactus::firmware {

struct SourceRequest {
  std::string source;
  SourceOptions options;
  std::string gravity;          // as `tactus run --gravity`
  std::filesystem::path model;  // as `tactus run --model`
};

struct OpenedSource {
  hal::Sensor sensor;
  Gravity gravity;
  LabelChoice labels;
};

/// Opens the source, finds out where down is and chooses what labels it. `wrap` may put other cameras in the
/// place of the sensor's as soon as it is open. Errors as `tactus run`. Boot.
rt::Result<OpenedSource> open_for_pipeline(const SourceRequest& request, const RunSettings& settings,
                                           const std::function<rt::Result<void>(hal::Sensor&)>& wrap = {});

/// What the source and the settings decide of a setup, which points into both of the former; the built-in
/// materials. Pure.
PipelineSetup setup_for(OpenedSource& source, const RunSettings& settings);

/// A pipeline with all the memory it will ever have.
struct BootedPipeline {
  rt::MemoryPlan plan;
  rt::Arena arena;
  std::unique_ptr<Pipeline> pipeline;  // gone before its memory

  /// Planned, reserved, touched, handed out, sealed. What `setup` points to outlives it. Boot.
  static rt::Result<BootedPipeline> boot(const PipelineSetup& setup);
};

}  // namespace tactus::firmware
