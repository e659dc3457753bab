// What the command line says of a live sensor, and how one sensor is made of the cameras that are opened for it.
//
//   v4l2:NODE[?key=value&...]        openni2[:URI][?key=value&...]
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "hal/camera.hpp"
#include "hal/live_camera.hpp"
#include "rt/status.hpp"

namespace tactus::firmware {

enum class LiveKind : std::uint8_t { v4l2, openni2 };

/// Names and values in the order in which they are set.
using Controls = std::vector<std::pair<std::string, std::string>>;

struct LiveSource {
  LiveKind kind = LiveKind::v4l2;
  std::string device;                  // node, or OpenNI2's URI; empty: the first that OpenNI2 finds
  hal::ModeRequest mode, color_mode;   // all 0: not named
  std::string format, color_format;    // the driver's names; empty: its best
  std::string buffers = "mmap";        // mmap | userptr | dmabuf
  std::string dmabuf_exporter;
  Controls controls, color_controls;
  std::string color;                   // node, or libcamera:ID; empty: OpenNI2's own, V4L2 none
  std::string calibration;             // FILE.toml
  std::string accelerometer;           // iio:deviceN, or its folder
  std::optional<bool> is_registered;   // OpenNI2 resamples depth into its colour camera
  std::optional<bool> is_synchronized; // OpenNI2 takes both at the same time
};

/// Whether the word is for parse_live_source: v4l2, openni2 or libcamera, alone or before ':' or '?'.
bool is_live_source(std::string_view source);

/// Pure. bad_usage: one sentence that names the key and what it takes.
rt::Result<LiveSource> parse_live_source(std::string_view source);

/// WIDTHxHEIGHT, WIDTHxHEIGHT@HZ or @HZ; nothing for anything else.
std::optional<hal::ModeRequest> parse_mode(std::string_view text);
std::string mode_text(const hal::ModeRequest& mode);

struct ImageSize {
  int width = 0, height = 0;  // pixels; 0: there is no such camera
};

/// The calibration brought to the sizes that were negotiated: another size of the same shape scales it. bad_usage when the
/// shape is another one, or when it speaks of a colour camera less or more than there is. `file` is for the sentence. Pure.
rt::Result<hal::RigCalibration> fit_calibration(hal::RigCalibration rig, const std::string& file, ImageSize depth,
                                                ImageSize color);

/// Of a camera that nothing is known of: 62.7 degrees across, as PrimeSense's, and colour at the same place.
hal::RigCalibration assumed_calibration(ImageSize depth, ImageSize color);

/// Reads and checks FILE.toml, and brings it to the sizes. Without a file the assumed one, with a note. Boot.
rt::Result<hal::RigCalibration> calibration_for(const std::string& file, ImageSize depth, ImageSize color,
                                                std::vector<std::string>& notes);

/// One sensor of two cameras, or of depth alone. Boot.
rt::Result<hal::Sensor> compose_sensor(hal::LiveCamera<hal::DepthCamera> depth,
                                       std::optional<hal::LiveCamera<hal::ColorCamera>> color,
                                       const std::string& calibration_file);

}  // namespace tactus::firmware
