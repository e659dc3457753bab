// From a finished session to the output files of the contract (DESIGN 7).
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "firmware_host/options.hpp"
#include "firmware_host/run_labels.hpp"
#include "firmware_host/run_result.hpp"
#include "firmware_host/run_settings.hpp"
#include "hal/faults/faults.hpp"
#include "pipeline/pipeline.hpp"
#include "rt/arena.hpp"

namespace tactus::firmware {

/// What the outputs tell besides the pipeline's own counts.
struct RunFacts {
  const RunOptions* options;
  const RunSettings* settings;
  const LabelChoice* labels;
  rt::MemoryPlan* plan;
  const rt::Arena* arena;
  std::string gravity_origin;
  double wall_s;
  std::vector<Picture> pictures;
  std::vector<Note> notes;
  std::uint64_t pictures_recorded = 0;  // in video.mp4
  std::string film = {}, sound = {};    // file names in the folder; empty: not written
  std::optional<RecordingResult> recording;
  const hal::faults::FaultCounts* faults = nullptr;  // null: nothing was done to the cameras
};

/// The summary's map_hash. Pure.
std::uint64_t map_hash(const map::Map::Hash& hash);

class RunOutputs {
 public:
  /// Makes the folder and tries to write in it. `folder` empty: nothing will be written. Boot.
  static rt::Result<RunOutputs> create(const std::filesystem::path& folder);

  /// Writes every file and returns the text for standard output. Exit.
  rt::Result<std::string> write(const RunFacts& facts, const Pipeline& pipeline, const hal::Sensor& sensor);

 private:
  std::filesystem::path folder_;
};

}  // namespace tactus::firmware
