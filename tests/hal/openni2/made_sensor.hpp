// A sensor of random images in memory, for files to be made of.
#pragma once

#include <algorithm>
#include <memory>
#include <random>
#include <vector>

#include "hal/camera.hpp"

namespace tactus::hal::openni2 {

inline constexpr int kMadeWidth = 32, kMadeHeight = 24;

/// Frame `index` is the same at every call.
inline std::vector<std::uint16_t> made_depth(unsigned index) {
  std::mt19937 random(index);
  std::vector<std::uint16_t> out(std::size_t{kMadeWidth} * kMadeHeight);
  for (auto& value : out) value = static_cast<std::uint16_t>(random() % 7 == 0 ? 0 : random() % 65535);
  return out;
}
inline std::vector<std::uint8_t> made_color(unsigned index) {
  std::mt19937 random(1000 + index);
  std::vector<std::uint8_t> out(std::size_t{kMadeWidth} * kMadeHeight * 3);
  for (auto& value : out) value = static_cast<std::uint8_t>(random());
  return out;
}

template <typename CameraKind, typename Pixel>
class MadeCamera : public CameraKind {
 public:
  MadeCamera(unsigned count, std::int64_t first_ns, std::vector<Pixel> (*make)(unsigned))
      : count_(count), first_ns_(first_ns), make_(make) {}
  rt::Status read(std::span<Pixel> pixels, FrameHeader& header, rt::Duration) override {
    if (!look(header)) return rt::Status::end_of_stream;
    const auto made = make_(next_++);
    std::copy(made.begin(), made.end(), pixels.begin());
    ++counters_.frames_delivered;
    return rt::Status::ok;
  }
  [[nodiscard]] const CameraCounters& counters() const override { return counters_; }

 protected:
  bool look(FrameHeader& header) const {
    if (next_ == count_) return false;
    header = {{first_ns_ + std::int64_t{next_} * 33'333'333}, next_, {}};
    return true;
  }
  unsigned count_, next_ = 0;
  std::int64_t first_ns_;
  std::vector<Pixel> (*make_)(unsigned);
  CameraCounters counters_;
};

class MadeColor final : public MadeCamera<ColorCamera, std::uint8_t> {
 public:
  using MadeCamera::MadeCamera;
  rt::Status peek(FrameHeader& header, rt::Duration) override {
    return look(header) ? rt::Status::ok : rt::Status::end_of_stream;
  }
  void skip() override { ++next_; }
};

/// Depth in `depth_m_per_unit` from `first_ns` on, colour 3 ms later.
inline Sensor made_sensor(unsigned depth_count, unsigned color_count, double depth_m_per_unit = 0.001,
                          std::int64_t first_ns = 0) {
  Sensor sensor;
  sensor.description = "made";
  sensor.calibration.depth = {.width = kMadeWidth, .height = kMadeHeight, .fx = 30, .fy = 31, .cx = 15.5, .cy = 11.5};
  sensor.calibration.color = sensor.calibration.depth;
  sensor.calibration.depth_m_per_unit = depth_m_per_unit;
  sensor.calibration.has_color = color_count > 0;
  sensor.calibration.registered = color_count > 0;
  sensor.depth = std::make_unique<MadeCamera<DepthCamera, std::uint16_t>>(depth_count, first_ns, made_depth);
  if (color_count > 0) sensor.color = std::make_unique<MadeColor>(color_count, first_ns + 3'000'000, made_color);
  return sensor;
}

}  // namespace tactus::hal::openni2
