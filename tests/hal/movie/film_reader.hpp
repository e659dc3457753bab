// Reads a film back with libav: every picture as RGB with its time, the sound as two rows of samples.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace tactus::hal::testing {

struct FilmPicture {
  double time_s;
  std::vector<std::uint8_t> rgb;
};

struct Film {
  std::string picture_codec, sound_codec;  // as libavcodec names them; empty: no such stream
  int width_px = 0, height_px = 0, sample_rate_hz = 0;
  double picture_duration_s = 0, sound_duration_s = 0;  // as the container says
  double sound_start_s = 0;
  std::vector<FilmPicture> pictures;
  std::array<std::vector<float>, 2> sound;
};

/// Throws std::runtime_error where libav cannot read it.
Film read_film(const std::filesystem::path& file);

}  // namespace tactus::hal::testing
