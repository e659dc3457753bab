#include "tests/guest/v4l2/nodes.hpp"

#include <gtest/gtest.h>
#include <linux/videodev2.h>

#include <algorithm>
#include <filesystem>

#include "hal/v4l2/controls.hpp"

namespace tactus::hal::v4l2 {

std::vector<FoundNode> nodes_of(std::string_view driver) {
  std::vector<FoundNode> out;
  for (int number = 0; number < 64; ++number) {
    FoundNode node;
    node.path = "/dev/video" + std::to_string(number);
    int error = 0;
    const Descriptor fd = open_node(node.path.c_str(), error);
    if (fd.is_open() && read_info(fd.get(), node.info) == 0 && std::string_view(node.info.driver.data()) == driver)
      out.push_back(std::move(node));
  }
  return out;
}

std::vector<FoundNode> capture_nodes_of(std::string_view driver, bool is_multiplanar) {
  std::vector<FoundNode> nodes = nodes_of(driver);
  std::erase_if(nodes, [&](const FoundNode& node) {
    return !node.info.is_capture() || node.info.is_multiplanar() != is_multiplanar;
  });
  return nodes;
}

void set(const FoundNode& node, std::string_view control, std::string_view value) {
  int error = 0;
  const Descriptor fd = open_node(node.path.c_str(), error);
  ASSERT_TRUE(fd.is_open()) << node.path << ": " << error;
  const std::pair<std::string, std::string> wished{control, value};
  const auto done = set_controls(fd.get(), std::span(&wished, 1), node.path);
  EXPECT_TRUE(done) << done.error().message;
}

std::int64_t get(const FoundNode& node, std::string_view control) {
  int error = 0;
  const Descriptor fd = open_node(node.path.c_str(), error);
  const std::vector<ControlInfo> controls = read_controls(fd.get());
  const auto found = std::find_if(controls.begin(), controls.end(), [&](const ControlInfo& c) { return c.name == control; });
  if (found == controls.end()) {
    ADD_FAILURE() << node.path << " has no control " << control;
    return 0;
  }
  v4l2_control value{};
  value.id = found->id;
  EXPECT_EQ(call(fd.get(), VIDIOC_G_CTRL, &value), 0);
  return value.value;
}

}  // namespace tactus::hal::v4l2
