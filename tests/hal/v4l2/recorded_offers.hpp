// Enumerations to choose from: what vivid of Linux 6.1 answers as a webcam (of its 83 formats those that matter here, of
// its 6 sizes 4), and made-up devices of the shapes that others have: a depth camera, a webcam with JPEG, a sensor with
// ranges, a television rate.
#pragma once

#include <linux/videodev2.h>

#include <vector>

#include "hal/v4l2/modes.hpp"

namespace tactus::hal::v4l2 {

inline SizeOffer size(int width, int height, std::vector<Interval> intervals) {
  return {{width, width, 1}, {height, height, 1}, std::move(intervals), false};
}

inline std::vector<FormatOffer> vivid_offers() {
  const std::vector<Interval> all{{1, 1},  {1, 2},  {1, 4},  {1, 5},  {1, 10}, {2, 25},
                                  {1, 15}, {1, 25}, {1, 30}, {1, 40}, {1, 50}, {1, 60}};
  const auto first = [&](std::ptrdiff_t count) { return std::vector<Interval>(all.begin(), all.begin() + count); };
  const std::vector<SizeOffer> sizes{size(320, 180, all), size(640, 360, first(10)), size(640, 480, first(8)),
                                     size(1280, 720, first(6))};
  return {{V4L2_PIX_FMT_YUYV, sizes}, {V4L2_PIX_FMT_UYVY, sizes}, {V4L2_PIX_FMT_NV12, sizes}, {V4L2_PIX_FMT_GREY, sizes},
          {V4L2_PIX_FMT_Y12, sizes},  {V4L2_PIX_FMT_Y16, sizes},  {V4L2_PIX_FMT_RGB24, sizes}};
}

inline std::vector<FormatOffer> depth_camera_offers() {
  const std::vector<Interval> slow{{1, 30}, {1, 15}, {1, 6}}, fast{{1, 90}, {1, 60}, {1, 30}, {1, 15}, {1, 6}};
  return {{V4L2_PIX_FMT_Z16,
           {size(1280, 720, slow), size(848, 480, fast), size(640, 480, fast), size(640, 360, fast), size(480, 270, fast)}}};
}

inline std::vector<FormatOffer> webcam_offers() {
  return {{V4L2_PIX_FMT_YUYV, {size(640, 480, {{1, 30}, {1, 15}}), size(1280, 720, {{1, 10}, {1, 5}})}},
          {V4L2_PIX_FMT_MJPEG, {size(640, 480, {{1, 30}}), size(1280, 720, {{1, 30}}), size(1920, 1080, {{1, 30}})}}};
}

inline std::vector<FormatOffer> television_offers() {
  return {{V4L2_PIX_FMT_YUYV, {size(720, 480, {{1001, 30'000}}), size(720, 576, {{1, 25}})}}};
}

inline std::vector<FormatOffer> ranged_offers() {
  return {{V4L2_PIX_FMT_NV12, {{{32, 2592, 32}, {32, 1944, 2}, {{1, 120}, {1, 1}}, true}}}};
}

}  // namespace tactus::hal::v4l2
