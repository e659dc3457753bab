// The V4L2 nodes of a guest machine, found by their drivers, and a second hand on their controls.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "hal/v4l2/node.hpp"

namespace tactus::hal::v4l2 {

struct FoundNode {
  std::string path;
  NodeInfo info;
};

/// Nodes of this driver, by number.
std::vector<FoundNode> nodes_of(std::string_view driver);

/// Capture nodes of this driver, with either of the two calls.
std::vector<FoundNode> capture_nodes_of(std::string_view driver, bool is_multiplanar);

/// Sets a control by a descriptor of its own, closed again; adds a failure when it cannot.
void set(const FoundNode& node, std::string_view control, std::string_view value);

/// Its present value.
std::int64_t get(const FoundNode& node, std::string_view control);

}  // namespace tactus::hal::v4l2
