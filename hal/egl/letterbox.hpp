// Where a picture stands in a window of another shape: as large as possible, whole, in the middle.
#pragma once

#include <algorithm>

#include "hal/display.hpp"

namespace tactus::hal::egl {

struct Letterbox {
  DisplayFormat picture;
  int left_px = 0, top_px = 0, width_px = 1, height_px = 1;  // in the window
};

/// Both sizes at least 1 x 1. A pixel that cannot be halved goes to the right or the bottom.
constexpr Letterbox fit(DisplayFormat picture, DisplayFormat window) {
  const double scale =
      std::min(static_cast<double>(window.width_px) / static_cast<double>(picture.width_px),
               static_cast<double>(window.height_px) / static_cast<double>(picture.height_px));
  const auto scaled = [&](int picture_px, int window_px) {
    return std::clamp(static_cast<int>(picture_px * scale + 0.5), 1, window_px);
  };
  const int width_px = scaled(picture.width_px, window.width_px);
  const int height_px = scaled(picture.height_px, window.height_px);
  return {picture, (window.width_px - width_px) / 2, (window.height_px - height_px) / 2, width_px, height_px};
}

struct PicturePoint {
  float x_px = 0, y_px = 0;
};
/// From a pixel of the window to coordinates of the picture, centres of pixels at integers in both.
constexpr PicturePoint to_picture(const Letterbox& box, int x_px, int y_px) {
  const auto scaled = [](int from_edge_px, int picture_px, int box_px) {
    return static_cast<float>((from_edge_px + 0.5) * picture_px / box_px - 0.5);
  };
  return {scaled(x_px - box.left_px, box.picture.width_px, box.width_px),
          scaled(y_px - box.top_px, box.picture.height_px, box.height_px)};
}

}  // namespace tactus::hal::egl
