// What `tactus record` and `tactus convert` share: a sensor's frames, labels and truth into a .tac file.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>

#include "firmware_host/streams.hpp"
#include "hal/camera.hpp"
#include "hal/record/tac_writer.hpp"
#include "rt/status.hpp"

namespace tactus::firmware {

struct TacRequest {
  std::filesystem::path out;
  hal::record::TacOptions how;
  bool has_labels = true;                 // where the source knows them
  hal::record::TacInfo info;              // words about where it comes from
  std::function<bool()> is_over;          // asked between frames; empty: at the source's end
  std::optional<rt::Duration> span;       // on the depth camera's clock, from its first frame
  rt::Duration patience{10'000'000'000};  // for a device that is away or silent
};

struct TacRecorded {
  StreamsEnd ended;
  hal::record::TacWriter::Counts counts;
  std::uint64_t labels_count = 0, labels_dropped_count = 0;
  double wall_s = 0;
  rt::Result<void> written{};  // an error: not all of it, the disk is full say; what is before can be played
};

/// From the sensor's next frame on. Errors: the file exists or cannot be created. Boot.
rt::Result<TacRecorded> record_tac(hal::Sensor& sensor, const std::string& source, const TacRequest& request);

}  // namespace tactus::firmware
