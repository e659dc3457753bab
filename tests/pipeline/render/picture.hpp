// Pictures in memory, on disk, and compared.
#pragma once

#include <png.h>

#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <vector>

#include "pipeline/label/material.hpp"

namespace tactus::test {

struct Picture {
  int width_px = 0, height_px = 0;
  std::vector<std::uint8_t> rgb;

  Picture() = default;
  Picture(int width, int height)
      : width_px(width), height_px(height), rgb(static_cast<std::size_t>(width * height) * 3) {}

  [[nodiscard]] std::size_t index(int u, int v) const {
    return static_cast<std::size_t>(v * width_px + u) * 3;
  }
  [[nodiscard]] Rgb8 at(int u, int v) const {
    const std::size_t i = index(u, v);
    return {rgb[i], rgb[i + 1], rgb[i + 2]};
  }
  void set(int u, int v, Rgb8 color) {
    const std::size_t i = index(u, v);
    rgb[i] = color.r;
    rgb[i + 1] = color.g;
    rgb[i + 2] = color.b;
  }
};

inline std::optional<Picture> read_png(const std::filesystem::path& path) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  if (png_image_begin_read_from_file(&image, path.c_str()) == 0) return std::nullopt;
  image.format = PNG_FORMAT_RGB;
  Picture picture(static_cast<int>(image.width), static_cast<int>(image.height));
  if (png_image_finish_read(&image, nullptr, picture.rgb.data(), 0, nullptr) == 0) return std::nullopt;
  return picture;
}

struct Difference {
  double mean_abs = 0;      // of all channels, 0 to 255
  double part_far_off = 0;  // pixels with a channel off by more than 24, of all pixels
};

/// Both pictures have one size.
inline Difference compare(const Picture& a, const Picture& b) {
  double sum = 0;
  std::size_t far_off_count = 0;
  for (std::size_t i = 0; i < a.rgb.size(); i += 3) {
    int worst = 0;
    for (std::size_t c = 0; c < 3; ++c) {
      const int off = std::abs(int{a.rgb[i + c]} - int{b.rgb[i + c]});
      sum += off;
      worst = off > worst ? off : worst;
    }
    if (worst > 24) ++far_off_count;
  }
  const auto pixels_count = static_cast<double>(a.rgb.size() / 3);
  return {sum / (pixels_count * 3), static_cast<double>(far_off_count) / pixels_count};
}

}  // namespace tactus::test
