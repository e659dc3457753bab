// What an .oni file holds, found by walking its records: the library reads such a file without doubting any of it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

#include "hal/openni2/oni_records.hpp"
#include "rt/status.hpp"

namespace tactus::hal::openni2 {

struct OniFrameEntry {
  std::uint64_t time_us = 0;
  std::uint32_t number = 0;  // as in the file, which counts from 1
};

struct OniStreamIndex {
  std::uint32_t node = 0, codec = 0;
  int width = 0, height = 0, frame_rate_hz = 0;
  std::uint64_t pixel_format = 0;        // OniPixelFormat
  double fov_x_rad = 0, fov_y_rad = 0;   // 0: not told
  bool is_mirrored = false;
  bool sees_from_color = false;          // depth: registered to the colour camera
  std::vector<OniFrameEntry> frames;     // in the file's order
};

struct OniIndex {
  std::optional<OniStreamIndex> depth, color;
  std::optional<std::uint64_t> cut_at;  // byte; the frames before it can be played
};

/// Walks the whole file, without reading pixels. Error bad_input, one sentence with the place in the file: not an .oni
/// file, damaged, cut so that OpenNI2 does not open it, written by a version that it does not read, of a kind that its
/// player crashes on, or without one depth frame. Boot; allocates 16 bytes a frame.
rt::Result<OniIndex> read_oni_index(const std::filesystem::path& file);

}  // namespace tactus::hal::openni2
