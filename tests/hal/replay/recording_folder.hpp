// A small recording on disk with random but reproducible images, to be spoilt by the tests.
#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include "hal/replay/image_codec.hpp"
#include "hal/replay/replay.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tactus::hal::replay {

inline constexpr int kWidth = 40, kHeight = 30;
inline constexpr std::size_t kPixels = kWidth * kHeight;

inline std::vector<std::uint16_t> depth_image(unsigned seed) {
  std::mt19937 random(seed);
  std::vector<std::uint16_t> out(kPixels);
  for (auto& value : out) value = static_cast<std::uint16_t>(random() % 5 == 0 ? 0 : random() % 65535);
  return out;
}

inline std::vector<std::uint8_t> bytes_image(std::size_t count, unsigned seed, unsigned modulus = 256) {
  std::mt19937 random(seed);
  std::vector<std::uint8_t> out(count);
  for (auto& value : out) value = static_cast<std::uint8_t>(random() % modulus);
  return out;
}

/// TUM layout: `count` frames at 30 Hz, colour 3 ms later, registered, poses, labels.
class RecordingFolder {
 public:
  explicit RecordingFolder(unsigned count) {
    std::filesystem::create_directories(path() / "depth");
    std::filesystem::create_directories(path() / "rgb");
    std::filesystem::create_directories(path() / "label");
    std::string depth_list, color_list, label_list, poses;
    for (unsigned i = 0; i < count; ++i) {
      const std::string name = std::to_string(i) + ".png";
      EXPECT_TRUE(write_depth_png(path() / "depth" / name, depth_image(i), kWidth, kHeight));
      EXPECT_TRUE(
          write_color_png(path() / "rgb" / name, bytes_image(kPixels * 3, 1000 + i), kWidth, kHeight));
      EXPECT_TRUE(
          write_label_png(path() / "label" / name, bytes_image(kPixels, 2000 + i, 23), kWidth, kHeight));
      depth_list += time_text(i, 0) + " depth/" + name + "\n";
      color_list += time_text(i, 3) + " rgb/" + name + "\n";
      label_list += time_text(i, 0) + " label/" + name + "\n";
      poses += time_text(i, 0) + " " + std::to_string(i) + " 0 0 0 0 0 1\n";
    }
    write("depth.txt", depth_list);
    write("rgb.txt", color_list);
    write("label.txt", label_list);
    write("groundtruth.txt", poses);
    write("intrinsics.txt", "35 35 19.5 14.5 40 30 5000\n");
  }

  [[nodiscard]] const std::filesystem::path& path() const { return folder_.path(); }
  std::filesystem::path write(const std::filesystem::path& relative, std::string_view bytes) const {
    return folder_.write(relative, bytes);
  }
  [[nodiscard]] std::string read(const std::filesystem::path& relative) const {
    return folder_.read(relative);
  }

  /// 100.000 s + i / 30 Hz in whole milliseconds + ms.
  static std::string time_text(unsigned i, unsigned ms) {
    const unsigned total_ms = 100'000 + i * 33 + ms;
    std::string fraction = std::to_string(total_ms % 1000);
    fraction.insert(0, 3 - fraction.size(), '0');
    return std::to_string(total_ms / 1000) + "." + fraction;
  }

 private:
  test::TemporaryFolder folder_;
};

/// Everything a stream gives until its end.
struct Played {
  std::vector<rt::Status> statuses;  // without the end
  std::vector<FrameHeader> headers;  // of the good frames
  std::vector<std::vector<std::uint16_t>> depth;
  std::vector<std::vector<std::uint8_t>> color;
  CameraCounters counters;
};

inline constexpr rt::Duration kLong{10'000'000'000};

inline Played play_depth(Sensor& sensor) {
  Played out;
  const Intrinsics& k = sensor.calibration.depth;
  std::vector<std::uint16_t> pixels(static_cast<std::size_t>(k.width * k.height));
  FrameHeader header;
  for (;;) {
    const rt::Status status = sensor.depth->read(pixels, header, kLong);
    if (status == rt::Status::end_of_stream) break;
    out.statuses.push_back(status);
    if (status != rt::Status::ok) continue;
    out.headers.push_back(header);
    out.depth.push_back(pixels);
  }
  out.counters = sensor.depth->counters();
  return out;
}

inline Played play_color(Sensor& sensor) {
  Played out;
  const Intrinsics& k = sensor.calibration.color;
  std::vector<std::uint8_t> pixels(static_cast<std::size_t>(k.width * k.height) * 3);
  FrameHeader header;
  for (;;) {
    const rt::Status status = sensor.color->read(pixels, header, kLong);
    if (status == rt::Status::end_of_stream) break;
    out.statuses.push_back(status);
    if (status != rt::Status::ok) continue;
    out.headers.push_back(header);
    out.color.push_back(pixels);
  }
  out.counters = sensor.color->counters();
  return out;
}

}  // namespace tactus::hal::replay
