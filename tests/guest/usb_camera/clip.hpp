// Frames for a USB camera to show, rendered beforehand: an emulated machine is too slow for a room.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

#include "hal/camera.hpp"
#include "rt/status.hpp"

namespace tactus::guest {

class Clip {
 public:
  Clip(int width, int height) : width_(width), height_(height) {}

  /// All of a sensor's frames, registered colour, which becomes YUYV.
  static rt::Result<Clip> render(hal::Sensor& sensor);
  static rt::Result<Clip> read(const std::filesystem::path& file);
  [[nodiscard]] rt::Result<void> write(const std::filesystem::path& file) const;

  /// `depth` and `yuyv`: width * height * 2 bytes each.
  void append(std::span<const std::uint8_t> depth, std::span<const std::uint8_t> yuyv);

  [[nodiscard]] int width() const { return width_; }
  [[nodiscard]] int height() const { return height_; }
  [[nodiscard]] std::size_t frames_count() const { return bytes_.size() / (2 * frame_bytes()); }
  /// `format`: depth16 or yuyv.
  [[nodiscard]] std::span<const std::uint8_t> frame(hal::PixelFormat format, std::size_t index) const;

 private:
  [[nodiscard]] std::size_t frame_bytes() const {
    return static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_) * 2;
  }
  int width_, height_;
  std::vector<std::uint8_t> bytes_;  // depth and YUYV by turns
};

}  // namespace tactus::guest
