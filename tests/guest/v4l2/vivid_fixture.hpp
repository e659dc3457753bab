// Cameras of the kernel's own test driver, vivid: still colour bars without text, all faults off.
#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <vector>

#include "hal/v4l2/v4l2.hpp"
#include "rt/clock.hpp"
#include "tests/guest/v4l2/nodes.hpp"

namespace tactus::hal::v4l2 {

constexpr rt::Duration kPatience{10'000'000'000};

/// Small and slow enough for an emulated processor.
inline V4l2Request small_request(const FoundNode& node, std::string format = {}) {
  V4l2Request request;
  request.device = node.path;
  request.mode = {320, 180, 30};
  request.format = std::move(format);
  return request;
}

class Vivid : public testing::Test {
 protected:
  void SetUp() override {
    single = capture_nodes_of("vivid", false);
    multi = capture_nodes_of("vivid", true);
    if (single.empty()) GTEST_SKIP() << "this machine has no vivid capture node; modprobe vivid in a guest machine";
    for (const auto* nodes : {&single, &multi})
      for (const FoundNode& node : *nodes) {
        set(node, "osd_text_mode", "None");
        set(node, "percentage_of_dropped_buffers", "0");
        set(node, "wrap_sequence_number", "0");
        set(node, "timestamp_source", "End of Frame");
        set(node, "gain_automatic", "1");
        set(node, "brightness", "128");
      }
  }

  static LiveCamera<DepthCamera> depth(const V4l2Request& request) {
    auto camera = open_depth(request);
    if (!camera) {
      ADD_FAILURE() << camera.error().message;
      return {};
    }
    return std::move(*camera);
  }
  static LiveCamera<ColorCamera> color(const V4l2Request& request) {
    auto camera = open_color(request);
    if (!camera) {
      ADD_FAILURE() << camera.error().message;
      return {};
    }
    return std::move(*camera);
  }
  static std::string depth_refusal(const V4l2Request& request) {
    const auto camera = open_depth(request);
    return camera ? "opened: " + camera->description : camera.error().message;
  }

  std::vector<FoundNode> single, multi;
};

}  // namespace tactus::hal::v4l2
