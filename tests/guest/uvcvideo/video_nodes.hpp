// The video nodes of a camera that was just plugged in.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "rt/time.hpp"

namespace tactus::guest {

/// Paths of the nodes that give images, in the order of their numbers, of the camera that calls itself `name`.
std::vector<std::string> video_nodes(const std::string& name);

/// Waits until it has `count` of them that can be opened; what there is when `patience` ends.
std::vector<std::string> await_video_nodes(const std::string& name, std::size_t count, rt::Duration patience);

}  // namespace tactus::guest
