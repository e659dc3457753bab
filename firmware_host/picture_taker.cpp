#include "firmware_host/picture_taker.hpp"

#include <algorithm>

namespace tactus::firmware {
namespace {

constexpr float kHiddenMin = 0.2f, kHiddenMax = 0.8f;

}  // namespace

PictureTaker::PictureTaker(std::uint64_t frames_expected)
    : every_(frames_expected > 0 ? std::max<std::uint64_t>(1, frames_expected / 4) : 60) {}

Picture PictureTaker::grab(Pipeline& pipeline, rt::Clock clock, float overlay, const std::string& title,
                           const std::string& caption) {
  Picture picture;
  PictureOptions options;
  options.overlay_alpha = overlay;
  options.shows = false;
  if (pipeline.render_round(clock, options) != rt::Status::ok) return picture;
  picture.title = title;
  picture.caption = caption;
  picture.width = pipeline.picture_camera().width;
  picture.height = pipeline.picture_camera().height;
  picture.rgb.assign(pipeline.picture().begin(), pipeline.picture().end());
  return picture;
}

void PictureTaker::consider(Pipeline& pipeline, rt::Clock clock, std::uint64_t frame) {
  const auto hidden = pipeline.occluded_share();
  if (hidden && *hidden >= kHiddenMin && *hidden <= kHiddenMax) {
    const float good = *hidden <= 0.5f ? *hidden : 1.0f - *hidden;  // half hidden shows it best
    if (good > best_hidden_ + 0.02f) {
      Picture picture =
          grab(pipeline, clock, 0, "Virtual things behind real ones",
               "Frame " + std::to_string(frame) + ": real depth hides " +
                   std::to_string(static_cast<int>(*hidden * 100)) + " % of what was thrown into the room.");
      if (picture.width > 0) {
        hidden_ = std::move(picture);
        best_hidden_ = good;
      }
    }
  }
  if (frame % every_ == every_ - 1 && spread_.size() < 8) {
    for (const float overlay : {0.0f, 0.6f}) {
      Picture picture =
          grab(pipeline, clock, overlay, overlay > 0 ? "Materials" : "Video and virtual things",
               "Frame " + std::to_string(frame) +
                   (overlay > 0 ? ": the map's labels over the video." : ": as a headset would show it."));
      if (picture.width > 0) spread_.push_back(std::move(picture));
    }
  }
}

std::vector<Picture> PictureTaker::take() {
  std::vector<Picture> all;
  if (hidden_.width > 0) all.push_back(std::move(hidden_));
  for (auto it = spread_.rbegin(); it != spread_.rend(); ++it)
    all.push_back(std::move(*it));  // late maps are fuller
  return all;
}

}  // namespace tactus::firmware
