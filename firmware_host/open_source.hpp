// From the word SOURCE on the command line to an opened sensor: the only place that names backends.
#pragma once

#include <cstdint>
#include <string>

#include "firmware_host/frame_range.hpp"
#include "firmware_host/open_live.hpp"
#include "hal/camera.hpp"
#include "rt/status.hpp"

namespace tactus::firmware {

struct SourceOptions {
  FrameRange frames;
  std::size_t prefetch = 0;  // recordings: frames decoded ahead by a thread per camera
  LiveDefaults live = {};    // devices
};

/// A folder in TUM RGB-D or 7-Scenes layout, an .oni or .tac file, `synthetic:NAME[?...]`, or a live sensor as
/// live_source.hpp says. bad_usage for a name that is none of these, bad_input for a recording that cannot be used,
/// device_unavailable for a device that cannot be had. Boot.
rt::Result<hal::Sensor> open_source(const std::string& source, const SourceOptions& options = {});

/// The kinds of SOURCE this build opens, for --help.
const char* source_help();

}  // namespace tactus::firmware
